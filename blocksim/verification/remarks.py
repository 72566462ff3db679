"""Why particle models miss tolerances, and schemes are left out of cases: case, model or scheme, one line.

Remarks about models are printed only where a case is outside.
"""

BUMPS = "equal spacings of the two boundaries interlock, so bodies climb over bumps as high as (1 − √3/2) spacing"
SETTLING = "particles settle in the gaps between those opposite, (1 − √3/2) spacing deeper than flat faces"
ROUNDING = "corners are rounded by half a spacing, which moves the contact point inwards"
SAMPLING = "the position of the opposite particles decides how strongly an edge acts; small differences grow"

NOT_FOR = {
    "V2": {"nonsmooth": "rigid blocks have no stiffness; their overlap follows from the step, see blocksim check"},
    "V20": {"nonsmooth": "it is about the second order of springs; rigid contacts are first order in the step"},
}

REMARKS = {
    "V2": {"particles": SETTLING},
    "V3": {"particles": SETTLING},
    "V4": {"particles": ROUNDING},
    "V5": {"particles": ROUNDING},
    "V7": {"particles": BUMPS},
    "V8": {"particles": BUMPS},
    "V9": {"particles": BUMPS},
    "V10": {"particles": BUMPS},
    "V11": {"particles": ROUNDING},
    "V12": {
        "particles": ROUNDING,
        "kernel": "several particles along the face share the impact, so it acts a little inside of the corner",
    },
    "V13": {
        "particles": ROUNDING,
        "kernel": "probably because few particles bear at an edge, which overlaps too far with these soft contacts",
    },
    "V17": {"particles": ROUNDING},
    "V18": {
        "particles": ROUNDING,
        "kernel": "several particles along the face share the impact, so it acts a little inside of the corner",
    },
    "V19": {"particles": SAMPLING, "kernel": SAMPLING},
    "V20": {
        "particles": BUMPS,
        "kernel": "distances and normals are means over a smoothing length, which is halved with the spacing",
    },
    "V21": {
        "particles": BUMPS,
        "kernel": "the plane is exact, the face of a fixed block is made of particles; bounces multiply the difference",
    },
    "V22": {
        "particles": BUMPS,
        "kernel": "edges are felt within a smoothing length of 1.3 mm, as if they were rounded",
    },
    "V23": {
        "particles": "probably because ends of ground segments have no disc, so contacts at edges end at full overlap",
        "kernel": "the stiffness of a particle changes with its angle to the face, without a corresponding torque",
    },
    "V24": {
        "particles": BUMPS,
        "kernel": "edges are felt within a smoothing length of 1.3 mm, as if they were rounded",
    },
}

"""All verification cases: one entry each, in the order of the table, with the reasons for what is not inside."""

from collections.abc import Sequence

from blocksim.errors import BlocksimError, ExitCode, InvalidInputError
from blocksim.scenario.models.timeline import IMPULSES
from blocksim.verification import collapse, impacts, pushover, statics, toppling
from blocksim.verification.case import Case, Setting
from blocksim.verification.soil import SOIL_CASES

# Why models with particles miss tolerances; printed only where a case is outside.
BUMPS = {
    "particles": "equal spacings of the two boundaries interlock, so bodies climb over bumps as high as "
    "(1 − √3/2) spacing"
}
SETTLING = {
    "particles": "particles settle in the gaps between those opposite, (1 − √3/2) spacing deeper than flat faces"
}
ROUNDING = {"particles": "corners are rounded by half a spacing, which moves the contact point inwards"}
SHARED = {"kernel": "several particles along the face share the impact, so it acts a little inside of the corner"}
SMOOTHED = {"kernel": "edges are felt within a smoothing length of 1.3 mm, as if they were rounded"}
EXACT_PLANE = {
    "kernel": "the plane is exact, the face of a fixed block is made of particles; bounces multiply the difference"
}
MEANS = {"kernel": "distances and normals are means over a smoothing length, which is halved with the spacing"}
FEW_AT_EDGES = {
    "kernel": "probably because few particles bear at an edge, which overlaps too far with these soft contacts"
}
LEDGER = {
    "particles": "probably because ends of ground segments have no disc, so contacts at edges end at full overlap",
    "kernel": "the stiffness of a particle changes with its angle to the face, without a corresponding torque",
}
SAMPLING = dict.fromkeys(
    ("particles", "kernel"),
    "the position of the opposite particles decides how strongly an edge acts; small differences grow",
)
PAIRWISE = dict.fromkeys(
    ("particles", "kernel"), "dashpots of a pair stand for the whole block, also where other pairs bear it too"
)

CASES = (
    Case("V1", "free flight and free spin", "parabola, constant spin", impacts.free_flight),
    Case(
        "V2",
        "static overlap on the ground",
        "weight = contact force",
        statics.static_overlap,
        remarks=SETTLING,
        not_for={IMPULSES: "rigid blocks have no stiffness; their overlap follows from the step, see blocksim check"},
    ),
    Case("V3", "flat drop from 0.1 m, e = 0.5", "Eq 12", impacts.bounces, remarks=SETTLING),
    Case(
        "V4",
        "restitution of flat and corner impacts",
        "Eq 11",
        impacts.restitution,
        "one particle spacing instead of four",
        ROUNDING,
    ),
    Case("V5", "corner impact without friction", "impulse and moment", impacts.frictionless_corner, remarks=ROUNDING),
    Case("V6", "corner impact that sticks", "impulse and moment", impacts.sticking_corner),
    Case("V7", "sliding to a stop on level ground", "Eq 13", statics.sliding_to_rest, remarks=BUMPS),
    Case("V8", "sliding down a slope of 30°", "g (sin a − μ cos a)", statics.slope, remarks=BUMPS),
    Case(
        "V9",
        "sticking below the friction angle, sliding above",
        "arctan μ",
        statics.friction_angle,
        "creep over 1–2 s instead of 5–10 s",
        BUMPS,
    ),
    Case("V10", "sliding and toppling on a slope", "Ashby 1971, Sagaseta 1986", toppling.chart, remarks=BUMPS),
    Case("V11", "free rocking", "quadrature of the energy", toppling.quarter_period, remarks=ROUNDING),
    Case("V12", "spin lost in a rocking impact", "Housner 1963", toppling.housner, remarks=ROUNDING | SHARED),
    Case(
        "V13",
        "overhanging stacks at their limit",
        "moments about edges",
        statics.overhanging_stacks,
        "linear law: a hundredth of the stiffness",
        ROUNDING | FEW_AT_EDGES,
    ),
    Case(
        "V14",
        "stack of ten blocks",
        "rest",
        statics.tower,
        "creep over 0.5–1 s instead of 5–10 s, a hundredth of the stiffness",
    ),
    Case("V15", "kinetic energy in 4950 impacts", "no gain", impacts.gains),
    Case("V16", "two free blocks colliding off-centre", "conservation", impacts.two_blocks),
    Case("V17", "ladder 1:100 at a smooth wall, 60°", "(cot a − t/L)/2", toppling.ladder, remarks=ROUNDING),
    Case(
        "V18",
        "24 dominoes",
        "van Leeuwen 2010",
        toppling.dominoes,
        "gaps 0.2 h and 0.3 h only, a hundredth of the stiffness",
        ROUNDING | SHARED,
    ),
    Case("V19", "mirrored, relabelled, moved collapse", "symmetry", collapse.symmetries, remarks=SAMPLING),
    Case(
        "V20",
        "convergence in step and spacing",
        "second order",
        collapse.convergence,
        remarks=BUMPS | MEANS,
        not_for={IMPULSES: "it is about the second order of springs; rigid contacts are first order in the step"},
    ),
    Case("V21", "ground as a fixed block", "same motion", collapse.fixed_block, remarks=BUMPS | EXACT_PLANE),
    Case("V22", "three blocks at rest, e = 0", "ten engines", collapse.at_rest, remarks=BUMPS | SMOOTHED),
    Case("V23", "energy ledger of every scenario", "balance", impacts.ledgers, "a hundredth of the stiffness", LEDGER),
    Case(
        "V24",
        "three blocks before their first impact",
        "pymunk, Box2D",
        collapse.before_impact,
        remarks=BUMPS | SMOOTHED,
    ),
    Case(
        "V25",
        "flat landings on one to three seats",
        "restitution, no spin",
        impacts.seats,
        remarks=PAIRWISE,
        not_for={IMPULSES: "it is about springs of several pairs below one block; V4 has rigid restitution"},
    ),
    Case(
        "V26",
        "wall and block that an actuator moves",
        "moments, virtual work",
        pushover.pushover,
        "displacements of 2 and 20 mm",
        not_for={
            "hertz-mindlin": "points of a radius of 1 mm give way below a wall of 1 m by more than its head moves",
            **dict.fromkeys(("kernel", "particles"), "a wall of 1 m has thousands of particles"),
        },
    ),
)


class SettingError(BlocksimError):
    """Incompatible options."""

    exit_code = ExitCode.USAGE


def choose_cases(ids: Sequence[str], setting: Setting, *, soil: bool = False) -> tuple[Case, ...]:
    """Return the cases of some ids (upper or lower case), in the order of the table; without ids all of the scheme.

    Raises InvalidInputError for an unknown id, and SettingError for a model, law or case that the scheme does not have.
    """
    usual, scheme = Setting(quick=setting.quick), setting.scheme
    if not setting.has_springs and (setting.model, setting.law) != (usual.model, usual.law):
        wrong = f"--law {setting.law}" if setting.model == usual.model else f"--model {setting.model}"
        raise SettingError(f"{wrong} needs springs; contacts of --scheme {scheme} are rigid")
    if soil and setting != usual:
        raise SettingError("--soil has one setting: the surface model, linear springs, the explicit scheme")
    table, wanted = SOIL_CASES if soil else CASES, {name.upper() for name in ids}
    unknown = sorted(wanted - {case.id for case in table})
    if unknown:
        known = f"{CASES[0].id} to {CASES[-1].id}"
        wrong = f"case of soil; choose {', '.join(case.id for case in table)}" if soil else f"case; choose {known}"
        raise InvalidInputError(f"{', '.join(unknown)}: no such {wrong}")
    words = {"scheme": scheme, "model": setting.model, "law": setting.law}
    for option, word in words.items():
        foreign = [reason for reason in exclusions(word) if reason.split()[0] in wanted]
        if foreign:
            raise SettingError(f"not for --{option} {word}: {'; '.join(foreign)}")
    chosen = (case for case in table if not wanted or case.id in wanted)
    return tuple(case for case in chosen if not case.not_for.keys() & words.values())


def exclusions(word: str) -> tuple[str, ...]:
    """Return the cases that do not apply to a scheme, a model or a law, each with the reason."""
    return tuple(f"{case.id} ({case.not_for[word]})" for case in CASES if word in case.not_for)

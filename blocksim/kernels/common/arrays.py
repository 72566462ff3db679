"""The arrays that the kernels read and write, with unit and sign of every field. Written once, here.

SI units; angles in radians, counter-clockwise positive. `x` runs along the ground and `y` away from it: the ground
is the half-plane y < 0, and a tilted ground is tilted gravity. Everything is an array of records (one body, pair or
contact slot lies together in memory, and a compiled function that takes a record takes one pointer).

`n` bodies plus one record for the ground, the last: it never moves and has no inverse mass. `p` candidate pairs
(capacity) with `s` contact slots each; what a slot stands for is the contact model's own affair:

    surface    slots from 0 are the corners of body `a` against body `b`, slots from 16 those of `b` against `a`.
               Corners count counter-clockwise from the lower left one of the unrotated rectangle; faces are 0: +x,
               1: +y, 2: -x, 3: -y of the body that is touched
    kernel     particles of `a` against `b`, then particles of `b` against `a`; the face of a contact is always 0
    particles  4 i + (j mod 4) for particle i of `a` against particle j of `b`; the face of a contact is j

The contact normal always points from `b` to `a` and the tangent is the normal turned by +90 degrees, whichever of the
two owns the corner or particle.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Records = np.recarray[Any, np.dtype[np.record]]
Record = Any  # one element of Records: a pointer in compiled code, numpy.record without the compiler
Corners = Records | None  # (q,) CORNER; None, a type of its own in compiled code, where all blocks are rectangles

SLOTS = 8  # that may touch, of a pair of rectangles in the surface model
CONTACTS = 2  # of a pair in the surface model, see models/surface.py
GROUP = 16  # bodies whose pairs share one record of the ledger
CACHE_LINE = 64  # bytes
NO_FACE = -1
SUPPORT, DRIVEN, REMOVED = 1, 2, 3  # moves with the support, along a path of its own; is not there any more
ALL = 15  # bits of all four faces or corners
OUTLINE = 16  # in place of the bits of faces: those of a table, as the body is a polygon and no rectangle

# status codes that `advance` returns
REACHED, AT_REST, NOT_FINITE, OVERLAP_LIMIT, PAIRS_FULL, TOO_FAST = range(6)


def record_type(
    floats: str, counters: str = "", indices: str = "", small: str = "", flags: str = ""
) -> np.dtype[np.void]:
    """Return a dtype from space-separated names: 8-byte floats and integers, 4-, 2- and 1-byte counts.

    Indices and counts are unsigned: compiled code then need not look for negative ones, which count from the end.
    """
    kinds: list[tuple[str, type]] = [
        (floats, np.float64),
        (counters, np.int64),
        (indices, np.uint32),
        (small, np.uint16),
        (flags, np.uint8),
    ]
    fields = [(name, kind) for names, kind in kinds for name in names.split()]
    return np.dtype(fields, align=True)


def joined(*types: np.dtype[np.void]) -> np.dtype[np.void]:
    """Return a dtype with the fields of several, one after the other."""
    return np.dtype([(name, one[name]) for one in types for name in one.names or ()], align=True)


def on_own_lines(one: np.dtype[np.void]) -> np.dtype[np.void]:
    """Return a dtype with the same fields whose records share no cache line: threads write to them all the time."""
    names = one.names or ()
    size = -(-one.itemsize // CACHE_LINE) * CACHE_LINE
    offsets = [one.fields[name][1] for name in names] if one.fields else []
    return np.dtype({"names": names, "formats": [one[name] for name in names], "offsets": offsets, "itemsize": size})


# Five cache lines, of which a step needs the first three.
BODY = on_own_lines(
    joined(
        record_type(
            "x y angle "  # m, m, rad: centre and total turned angle of the body axes, never wrapped
            "cos sin "  # of angle, advanced beside it and renewed at fixed steps
            "upper_x upper_y lower_x lower_y "  # m: from the centre to the upper and the lower right corner, world axes
            "vx vy spin "  # m/s, m/s, rad/s
            "ax ay spin_rate "  # m/s2, m/s2, rad/s2: of the last force evaluation
            "fx fy torque "  # N, N, N m: contact totals of the current evaluation
            "half_x half_y "  # m: half sides along the body's own axes; no corner of a polygon is farther along them
            "inverse_mass inverse_inertia",  # 1/kg, 1/(kg m2): zero for fixed bodies and the ground
            indices="contact_class",  # index into the interaction table; class 0 is the ground
            small="pairs_now pairs_before",  # pairs in contact in this evaluation and the one before
            flags="pairs_changed sums_changed "  # flags: those two differ; there are new sums, see inertia.py
            "faces corners "  # bits of those that can touch; pieces of ground have their upper face and its free ends,
            # and in bits 4 and 5 of corners whether those at the right and left are sharper than a right angle
            "is_moved "  # 0 for free bodies, else SUPPORT, DRIVEN or REMOVED: what moves it
            "counts",  # flag: forces on it matter, as it is free, driven, or moves with the support
        ),
        record_type(
            "radius "  # m: half diagonal
            "mass inertia "  # kg, kg m2 about the centre, out of the plane: zero for fixed bodies too
            "list_x list_y list_angle "  # m, m, rad: where the body was when the pair list was made
            "k_xx k_xy k_yy "  # N/m: stiffness of all contacts along their normals; see inertia.py
            "k_x k_y "  # N: the same times the lever arms of the normals
            "least_width "  # m: between two parallel lines around it; infinite for the ground and its pieces
            "inner_radius",  # m: from the centroid of a block to its nearest face
            indices="first_particle particle_count "  # its part of the particles
            "first_corner",  # its part of the corners of all shapes, which kernels have in scenes with polygons
            small="row_x row_y "  # intervals between particles on the faces along x and along y
            "seats coming "  # pairs in those sums; pairs about to touch
            "corner_count "
            "is_asked",  # flag: contacts of one of its pairs have changed, or its sums are being made
        ),
    )
)
PARTICLE = record_type(
    "x y "  # m: place in the body frame
    "nx ny "  # -: outward normal in the body frame
    "mx my "  # -: that of the other face at a corner, elsewhere the same
    "length "  # m: tributary length
    "share"  # -: tributary length over face length, summed over both faces at a corner that is one particle
)
CORNER = on_own_lines(
    record_type(
        # What the search for a face needs comes first: four doubles are read at once, from one cache line.
        "nx ny "  # -: outward normal of the face from this corner to the next, in the body frame
        "distance "  # m: of that face from the centroid
        "middle "  # m: of that face along (-ny, nx), from the foot of the centroid
        "half "  # m: half of its length
        "x y "  # m: place about the centroid, in the body frame; counter-clockwise
        "clear "  # -: other faces are at least so many times as far as its nearer end; see world/bodies.py
        "far "  # m: the distance of that face from all but itself and the two beside it
        "sharp "  # -: one where a face beside this one meets it at less than a right angle, else zero
        "cone"  # -: of the shape: sine of the angle up to which a face is parallel to one of another body
    )
)
PAIR = record_type(
    "limit "  # m: a deeper overlap ends the run
    "stiffness "  # of each of its corner contacts, in units of normal_stiffness; see bearing.py
    "slide turn",  # how that changes with the slip of a ahead of b, per m, and by turning a, per rad
    indices="a b "  # bodies, sorted
    "duplicates "  # bits of the slots whose corner is in touch, but marks the same end of a face contact as another
    "fronts",  # of the first candidates, 4 bits each: face of the other polygon that each was last seen in front of
    small="near active "  # number of candidate slots; of contacts
    "idle",  # candidates that are neither in contact nor a duplicate
    flags="bearing "  # PLANE, ENDS or APART: what its contacts are; see bearing.py
    "is_coming "  # flag: about to touch
    "is_sliver "  # flag: its overlap is about as deep as long; see slivers.py
    "axis "  # along which the two were apart when last looked at: a face of body b, from 16 on one of body a
    "is_between "  # flag: its bodies are of two shares
    "normal_left shear_left "  # steps until the dashpots along normals and tangents are made again
    "sticking "  # bits of the points that have a dashpot along the tangent
    "slides",  # which way its only contact slides: AHEAD, where a moves ahead of b along the tangent, BACK, or not: 0
)
NEAR_PAIR = np.dtype((np.record, record_type("", indices="a b")))  # bodies, sorted
CONTACT = record_type(
    "spring depth "  # m: shear spring, overlap
    "normal_force shear_force",  # N: pushing apart, resisting slip
    indices="slot face",  # which corner or particle it is, and the face that it touches
)
PARTICLE_CONTACT = record_type(
    "spring depth normal_force shear_force "  # as above
    "share "  # -: stiffness of this contact over that of a corner contact
    "x y nx ny",  # m, -: where the contact was, and its normal
    indices="slot face",
)
INTERACTION = record_type(
    "normal_stiffness "  # of one corner contact: N/m^n, n the exponent of the law
    "shear_ratio "  # -: shear stiffness over the slope of the normal force
    "normal_damping shear_damping "  # damping ratios
    "static_friction kinetic_friction transition_speed "  # -, -, m/s
    "restitution"  # -: what the damping follows from; rigid contacts take it as it is
)
POINT = record_type(
    "x y nx ny depth "  # m: contact point; normal; m: overlap
    "beside "  # m: the greater overlap, with the other face that the corner may touch; infinite where there is none
    "closing slipping "  # m: relative displacement of the last drift, against the normal and along the tangent
    "closing_rate slip_rate "  # m/s: the same as rates at the end of the drift, predicted
    "share "  # -: stiffness over that of a corner contact, in the models with particles
    "weight drawn "  # first steps of a contact: weight of the dashpot, share of the drift that draws the shear spring
    "stiffness rate before force "  # N/m, m/s, N, N: of the current pass; force of the step before; force now
    "push",  # N: spring and dashpot along the normal
    indices="slot face",
)
OPERATOR = record_type(
    "e_one e_mixed e_two "  # N s/m: dashpot force of points one and two per free rate of each
    "h_one h_mixed h_two",  # m/(s N): half a step times the inverse masses, change of rate per change of force
)
NORMAL, SHEAR = 0, 1
AHEAD, BACK = 1, 2
CONTROLS = record_type(
    "step gravity_x gravity_y "  # s, m/s2
    "skin rest_speed "  # m: bodies may move by 0.4 of it before the pair list is rebuilt; m/s
    "approach "  # m: closer bodies are always listed; see kernels/explicit/inertia.py
    "motion_x motion_y "  # -: direction of the support's motion, both zero without one
    "max_overlap "  # m, zero: a share of the smallest side of each pair
    "push loads_end "  # m/s2: no load gives any point more; s: from then on none changes with time
    "cell_width cell_radius "  # m: of the grid; half diagonal of the largest body in it
    "particle_size smoothing_length support "  # m: diameter; of the SPH kernel; radius beyond which it is zero
    "exponent",  # -: of the overlap in the normal force
    "model sph_kernel "  # codes
    "check_every rest_checks "  # steps between checks; checks in a row that must find rest (0: never)
    "driven",  # bodies with a motion of their own
)
CLOCK = record_type(
    "",
    "steps checks_at_rest pair_count rebuilds motion_piece "
    "next_update "  # step at which the bodies' travel since the last pair list is checked again
    "next_share last_share last_sums "  # steps at which sums of stiffness are, were looked at, and all were made
    "ends_at "  # step at which the run ends, as two bodies were found to overlap too far; 0: none
    "is_started",  # flag
)
LEDGER = record_type("dashpot friction broken to_support to_loads events travel_work largest_kinetic")  # J
ACTION = record_type(
    "fx fy torque_a torque_b "  # N, N m: force of a pair on body a and its torque; torque on b is against torque_b
    "dashpot friction broken",  # J: lost in the drift that led here
    indices="pair",  # its number
    flags="touches is_changed "  # whether it has contacts; whether it was not one that persistent_forces.py handles
    "asks "  # whether its number of contacts has changed
    "is_too_deep",  # whether its bodies overlap more than they may
)
SHARE = on_own_lines(
    record_type(
        "",
        "steps last_step "  # how far the thread of this share is, and how far it is to go in this call
        "until "  # step up to which steps follow upon one another, without a check between them
        "next_check "  # step
        "is_started status",  # flag; status code that it has come to
        # all of these from the first one to before the last one
        indices="first_body last_body "
        "first_pair last_pair "  # those whose body a is of the share
        "first_between last_between "  # those of them whose body b is of another share, among all such
        "next_pair next_between "  # where the evaluation of those is
        "first_task last_task",  # pairs between shares that this thread evaluates
        flags="is_too_deep "  # whether any pair that it has evaluated is
        "asks",  # whether the number of contacts of any has changed
    )
)
# words of World.team, each on a cache line of its own: how many threads take part, have arrived at the meeting under
# way, how many meetings there were, the status code that all of them go by
TEAM_SIZE, ARRIVED, MEETINGS, STATUS = 0, 8, 16, 24
TEAM_WORDS = 32
MOVED = record_type(
    "x y angle "  # m, m, rad: where a body that moves with the support, or is driven, was at the start
    "along_x along_y "  # -: direction in which a driven body is shifted; this and the following only of those
    "about_x about_y "  # m: the point about which it turns, which is shifted with it
    "rest_time "  # s: from when on it stays where it is; infinite where it never does
    "fx fy torque",  # N, N, N m: contact totals in the evaluation before
    # pieces of its shift and of its turn: the one that holds, and the one after the last; zero for the support's
    indices="body shift shift_end turn turn_end",
)
MOTION_PIECE = record_type("start c0 c1 c2 c3")  # s, m, m/s ...: c0 + c1 t + c2 t^2 + c3 t^3 with t from the start
# kinds of loads: accelerations of all free bodies first
LOAD_FIELD, LOAD_TILT, LOAD_FORCE, LOAD_WATER, LOAD_ACTUATOR = range(5)
LOAD = record_type(
    "x y "  # m: where it acts, in the body frame; of water the lower end of the face, of which the other is
    "end_x end_y "
    "fx fy torque "  # N, N, N m for a value of one; of accelerations m/s2; of a face m of depth times its inward normal
    "unit_weight "  # N/m2: of water, times the length of the face
    "up_x up_y "  # -: against gravity as it is at the start
    "base_x base_y "  # m: where its point was at time zero; of gravity m/s2: the part that does not turn
    "stiffness damping least most "  # N/m, N s/m, N, N: of an actuator, and between what its force is
    "fastest "  # m/s: greatest rate of its head
    "work "  # J: that of an actuator on its body
    "last_fx last_fy last_torque",  # N, N, N m: in the last evaluation
    counters="first_piece last_piece",  # its pieces, from the first to before the last
    indices="body",
    flags="kind turns stays",  # flags: its force turns with the body; its line of action stays in space
)
LOAD_PIECE = record_type("start value rate acceleration jerk")  # s, value, 1/s, 1/s2, 1/s3; see models/loads.Stretch


class World(NamedTuple):
    """Everything `advance` needs; everything that changes during a run is in here."""

    bodies: Records  # (n + 1,) BODY, the ground last
    pairs: Records  # (p,) PAIR
    contacts: Records  # (p, c) CONTACT or PARTICLE_CONTACT; the first `active` of a pair, in the order of their slots
    # (p, s) uint8 or uint32: slots within the skin of the other body, sorted, `near` of them; while pairs are listed
    candidates: Any  # each row is a NEAR_PAIR instead
    operators: Records  # (p, 2) OPERATOR, dashpots along the normals and the tangents
    interactions: Records  # (k, k) INTERACTION
    particles: Any  # (q,) PARTICLE, body after body; None, a type of its own, for the surface model
    corners: Any  # (q,) CORNER, shape after shape; None, a type of its own, where all blocks are rectangles
    points: Records  # (s + 1,) POINT, work space of one pair; the last one for contacts that end
    starts: Any  # (c + 3,) uint32: where cells of the grid, at most c + 1, begin in the order; neighbours.py
    order: Any  # (n,) uint32: bodies cell by cell
    large: Any  # (l,) uint32: bodies too large for the grid, sorted
    action: Records  # (1,) ACTION, work space of one pair
    before: Records  # (c,) CONTACT or PARTICLE_CONTACT, work space of one pair whose contacts change
    matrices: Floats  # (8, 3, 3) work space of one pair
    moved: Records  # (f,) MOVED, all bodies that move with the support, then those that are driven
    motion: Records  # (m,) MOTION_PIECE, shift (m) and turn (rad) of every driven body over time, then of the support
    controls: Records  # (1,) CONTROLS
    clock: Records  # (1,) CLOCK
    ledger: Records  # (g,) LEDGER, one for each group of bodies; what is not of pairs is in the first one
    shares: Records  # (t,) SHARE, one for each thread
    between: Records  # (1,) or, with threads, (p,) ACTION of the pairs whose bodies are of two shares, sorted
    team: Integers  # (32,) what threads exchange
    loads: Records  # (l,) LOAD
    load_pieces: Records  # (k,) LOAD_PIECE, load after load

    @property
    def world(self) -> "World":
        """Itself, as the scenes of all schemes have a world."""
        return self


def zeros(shape: int | tuple[int, ...], dtype: np.dtype[np.void]) -> Records:
    """Return an array of zeroed records that starts on a cache line: unaligned ones cost up to 15 % at random."""
    count = int(np.prod(shape)) * dtype.itemsize
    memory = np.zeros(count + CACHE_LINE, dtype=np.uint8)
    begin = -memory.ctypes.data % CACHE_LINE
    return memory[begin : begin + count].view(dtype).reshape(shape).view(np.recarray)

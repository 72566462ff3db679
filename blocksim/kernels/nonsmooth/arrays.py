"""The arrays of the non-smooth scheme beside those of the world; units and signs as in common/arrays.py.

A step walks through states and constraints many times, so both are as small as they can be: one cache line a body, two
a constraint.
"""

from typing import Any, NamedTuple

import numpy as np

from blocksim.kernels.common import tolerances
from blocksim.kernels.common.arrays import CACHE_LINE, Floats, Integers, Records, World, on_own_lines, record_type
from blocksim.kernels.common.simd import WIDTH

STATE = record_type(
    "vx vy spin "  # m/s, m/s, rad/s
    "inverse_mass inverse_inertia "  # 1/kg, 1/(kg m2): zero for what is fixed
    "dx dy turned"  # m, m, rad: since the step began
)
BEFORE = record_type(
    "vx vy spin "  # m/s, m/s, rad/s: when the substep began, before gravity
    "lifted"  # J/kg: work of the weight so far, less that along displacements by the velocities alone
)
CONSTRAINT = record_type(
    "nx ny "  # normal, from body b to body a; the tangent is the normal turned by +90 degrees
    "arm_a arm_b "  # m: r x n of point one about both bodies; that of point two is smaller by the width
    "width "  # m: from point one to point two along the tangent
    "shear_arm_a shear_arm_b "  # m: r x t, the same for both points, as they lie on one face
    "gap_one gap_two "  # m: when the step began; FAR where there is no such point
    "normal_one normal_two shear "  # N s: impulses of the last substep: pushing apart, on body a along the tangent
    "bend shear_bend",  # m/s: gain of the velocities at the points in half a substep, as bodies turn; slip.py
    indices="a b material",  # bodies; place in the table of interactions
    # of the manifold in the current step: AWAY, OPEN, TOUCHING, UNDECIDED; its impulses are those of impacts that are
    # over: NOT_STRUCK, STRUCK, STRUCK_AT_REST; FORGOTTEN of the last one when the next step has begun without them
    flags="reach is_struck "
    "corner_one corner_two",  # of a polygon's pair: the corners that the points are, see narrow_phase.py; else zero
)
# Four active constraints of one colour, field by field; see packs.py. Two fields share a cache line, and those that a
# sweep needs lie side by side: crowds fill the cache, and wait for memory more than for anything else.
LANE_INDICES = "a b constraint"  # bodies; number of the constraint
LANE_FLOATS = (
    "nx ny arm_a arm_b width bend normal_one normal_two "  # as in CONSTRAINT
    "gap_one start_one gap_two start_two "  # m: as in CONSTRAINT; when the substep began
    "shear_arm_a shear_arm_b shear shear_bend "  # as in CONSTRAINT
    "target_one target_two "  # m/s: least approach that the velocity pass leaves; -FAR where a point does not count
    "friction restitution"  # -: coefficients of kinetic friction and of restitution
)
LANES_AT = {name: CACHE_LINE + 8 * WIDTH * k for k, name in enumerate(LANE_FLOATS.split())}  # bytes
SINGLE_FLOATS = {  # 1/kg: A of a pack of one, of both normals and along the tangent; in lanes that it does not use
    "one": LANES_AT["restitution"] + 8,
    "mixed": LANES_AT["restitution"] + 16,
    "two": LANES_AT["restitution"] + 24,
    "along": LANES_AT["friction"] + 8,
}
PACK = np.dtype(
    {
        "names": [*LANE_INDICES.split(), "count", "are_simple", "is_coupled", *LANES_AT, *SINGLE_FLOATS],
        "formats": [(np.uint32, (WIDTH,))] * 3
        # number of constraints, the others are copies; flags: static friction is the kinetic one; see passes.py
        + [np.uint8] * 3
        + [(np.float64, (WIDTH,))] * len(LANES_AT)
        + [np.float64] * len(SINGLE_FLOATS),
        "offsets": [0, 16, 32, 48, 49, 50, *LANES_AT.values(), *SINGLE_FLOATS.values()],
        "itemsize": CACHE_LINE + 8 * WIDTH * len(LANES_AT),
    },
)
# of a body in a round of impacts; see impacts.py
IMPACT = on_own_lines(
    record_type(
        "vx vy spin "  # m/s, m/s, rad/s: when the round began
        "after_vx after_vy after_spin "  # m/s, m/s, rad/s: with all rebounds; then of the last solution that gains
        "low_vx low_vy low_spin "  # m/s, m/s, rad/s: of the last solution that does not gain energy; see impacts.py
        "share "  # -: of rebounds, that is tried; at last, of the way from the lower solution to the higher one
        "low high "  # -: shares of rebounds of both solutions; this and the following of roots
        "then now "  # J: kinetic energy of the group before the round, and after it or as last tried
        "least most "  # J: of both solutions
        "between "  # J: of their difference
        "stale",  # -: what the solution that stays counts for
        counters="root",  # the body that stands for the group
        # anything in the group rebounds in the substep; its share is being sought; what its last solution is kept as
        flags="is_hit is_open side",
    )
)
# of a pack, beside PACK, while its bodies go through impacts; see impacts.py
IMPACT_FIELDS = (
    "normal_one normal_two shear "  # N s: of groups that are not hit, and those of all rounds of others
    "target_one target_two "  # m/s: as PACK has them, of the velocity pass before; -FAR if not hit
    "rise_one rise_two "  # m/s: that a rebound gets against gravity after all rounds; -FAR before it is hit
    "all_one all_two "  # m/s: targets of a round with all rebounds
    "after_one after_two after_shear "  # N s: of the solutions of impacts.py, as in IMPACT
    "low_one low_two low_shear "
    "held"  # N s: normal impulses of the substep before; FAR of what presses though they are forgotten
)
IMPACT_LANES = on_own_lines(
    np.dtype([*((name, np.float64, (WIDTH,)) for name in IMPACT_FIELDS.split()), ("is_hit", np.uint8)], align=True)
)
KEPT = record_type(
    "nx ny normal_one normal_two shear",  # of a constraint whose pair is in the next list too
    # bodies of a listed pair, its colour; the next old one with the same body a, from 1; likewise in flush_joints.py,
    # and which constraints are undecided, from the first place on
    indices="a b colour next next_of_b undecided",
    flags="corner_one corner_two is_struck",
)
STEPPING = record_type(
    "substep "  # s
    "least_reach most_reach "  # m: of a body beyond itself, to find neighbours in
    "closed_bias "  # 1/s: b of points in contact
    "open_bias "  # 1/s: b of points with a gap
    "softness "  # -: gamma / A of points in contact
    "threshold "  # m/s: slower approaches do not rebound
    "tolerance "  # m/s: the velocity pass ends when no impulse changes a velocity by more
    "margin "  # m: points with a larger gap are left out of the current step
    "support_vx support_vy "  # m/s: of the ground and all that is fixed, in the current substep
    "support_x support_y "  # m: how far they have come
    "fall_x fall_y "  # m/s: what a substep of gravity adds to velocities
    "pull_x pull_y "  # m/s: the same of gravity and of loads that act on all bodies
    "lag "  # -: of a substep of gravity, what velocities lack when the current substep begins
    "bend_share "  # -: of the bend of a constraint, what velocities gain up to the middle of the current substep
    "bend_time next_bend_time "  # s: times the bend, by how much gaps at its start and end are off
    "rest_gap "  # m: points with no larger one touch others at an impact
    "touch_gap "  # m: points with no larger one touch: round-off is smaller, and must not decide
    "frequency damping "  # 1/s, -: w and zeta of points in contact
    "length gone "  # s: of the current interval of a step, and of the step before it; cuts.py
    "last_substep "  # s: with which bodies have moved last, in the interval before
    "residual worst_residual",  # m/s: largest change in the last sweep of a pass: the last one, any left unsolved
    "substeps "
    "velocity_sweeps "  # at most
    "colours constraint_count active_count pack_count "  # now
    "sweeps passes "  # of the velocity pass, in all so far; such passes, those of rounds of impacts too
    "unsolved "  # of these, ended by `velocity_sweeps`
    "cut_rounds cut_searches "  # substeps that ended at MOST_ROUNDS, rounds that ended at MOST_TRIES, so far
    "cuts "  # of the current step so far
    "is_guarded "  # flag: impacts go one after the other, in rounds, and steps are cut at them; impacts.py, cuts.py
    "is_driven "  # flag: bodies move differently from the supports
    "is_settled "  # flag: the run begins at rest, with impulses that hold against gravity
    "is_shaken "  # flag: supports or driven bodies move, so that impulses on them do work
    "has_forgotten "  # flag: impulses of what pressed are forgotten in the current interval, after an impact
    "has_rebounds "  # flag: anything rebounds in the current substep
    "has_held "  # flag: shear of the current pass goes a share of its way
    "has_gain",  # flag: the last round has created energy in a group
)
PUSH = record_type(
    "ax ay rate "  # m/s2, m/s2, rad/s2: of loads, in the current substep
    "last_ax last_ay last_rate "  # in the one before
    "work"  # J: that loads have done on the body
)
TALLY = record_type("impacts friction to_support")  # J: what normal and shear impulses have taken, and given, so far

FAR = tolerances.FAR  # m or m/s: of points that are not there, or do not count
# no point within the margin; a gap at all points; a point that touches or pressed; not known yet: flush_joints.py
AWAY, OPEN, TOUCHING, UNDECIDED = range(4)
NEITHER, LOW, HIGH = range(3)  # sides of the last solution of a group: too little energy, or too much; impacts.py
NOT_STRUCK, STRUCK, STRUCK_AT_REST, FORGOTTEN = range(4)  # the last two pressed before the impact too
COLOURS = 64  # the last one is for pairs that found no other; one thread goes through it
TALLY_PACKS = 4  # packs that share a tally; threads take whole ones


class Contacts(NamedTuple):
    """What a substep needs, and nothing else: compiled functions pass every array as several numbers."""

    states: Records  # (n + 1,) STATE
    before: Records  # (n + 1,) BEFORE
    constraints: Records  # (p,) CONSTRAINT, colour after colour, in the order of the pair list
    packs: Records  # (g,) PACK of the constraints with a point within the margin, colour after colour
    ends: Integers  # (COLOURS + 1,) where every colour begins among the packs, and where the last one ends
    materials: Records  # (k k,) INTERACTION of all pairs of contact classes, those of the world in one row
    tallies: Records  # (p / TALLY_PACKS + 1,) TALLY
    impacts: Any  # (n + 1,) IMPACT; None where impacts do not follow from one another
    impact_lanes: Any  # (g,) IMPACT_LANES; likewise
    # (2, 8 t) m/s: the largest change of velocity that each thread found in a sweep, twice; before, how many UNDECIDED
    residuals: Floats
    stepping: Records  # (1,) STEPPING


class Nonsmooth(NamedTuple):
    """A world and what stepping it without springs needs."""

    world: World
    contacts: Contacts
    kept: Records  # (p,) KEPT, work space of a new pair list and of flush joints
    reaches: Floats  # (n + 1,) m: how far beyond each body its neighbours were sought; of the ground zero
    firsts: Integers  # (n + 1,) work space: marks; the first old constraint of a body a, from 1; 0 where there is none
    begins: Integers  # (COLOURS + 1,) where every colour begins among the constraints
    used: Integers  # (n + 1,) work space: bits of the colours that a body's pairs have
    pushes: Records  # (n + 1,) PUSH; one of no use without loads

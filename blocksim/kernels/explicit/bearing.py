"""Stiffness by tributary length: what share of a corner contact's stiffness the corner of a face contact has.

Two blocks that stand on one another touch along an interval, and its two ends are their contact points. A face that
lies on its whole length has the stiffness of two corner contacts, 2 K. So the ends of an interval of length L have K
L/F each, F the length of the face: then neither the sum of the stiffnesses below a block nor their centre depends on
where the joints between the blocks below are, and a block that lands flat on several of them leaves without spin. F is
the face of the free body; where both are free, the longer one. (With the shorter one a whole block on a half block and
another whole one would lean towards the half block.) The ground, its pieces and walls are one plane, cut by no joints:
their contacts have K.

A block that stands on one corner has K. In between the share goes from L/F to 1 while the block tilts, by the cubic
step q^2 (3 - 2 q) of the sine of the angle between the two faces, q from 0 at FLAT to 1 at CONE_TOLERANCE, from where
on corners have one face to touch only. So no force jumps as one end leaves the ground, as a corner passes a joint, or
as a corner slides off the end of a face.

The stored energy share * U(depth) is a state function. Its force is not along the normal alone: where the share changes
by sliding and tilting there is U d(share)/d(slip) along the tangent, against a, and a couple U d(share)/d(angle). Both
are tiny, of the order of depth over length of the normal force, and without them an elastic contact that begins flat
and ends tilted would gain or lose energy.

It is measured where dashpots are due.
"""

from typing import NamedTuple

from blocksim.kernels.common import tolerances
from blocksim.kernels.common.arrays import ALL, Corners, Record, World
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.explicit import damping, sides
from blocksim.kernels.explicit.laws import LINEAR

FLAT_SHARE = tolerances.FLAT / tolerances.CONE_TOLERANCE  # the same of the cone, where that of polygons is narrower


class Bearing(NamedTuple):
    """Share of a contact in the stiffness of a corner contact, and how it changes by moving body a."""

    share: float
    slide: float  # 1/m, by slip of a ahead of b
    turn: float  # 1/rad, by turning a


class Interval(NamedTuple):
    """Where two faces lie opposite each other, along the tangent (-ny, nx) from the centre of b."""

    left: float  # m
    right: float  # m
    slide: float  # change of its length with the slip of a ahead of b
    per_length: float  # 1/m, one over the length of the face that the share refers to
    cosine: float  # of the tilt, by which the other face is seen shorter


WHOLE = Bearing(1.0, 0.0, 0.0)
PLANE, ENDS, APART = range(3)  # on the ground, a piece of it, or a wall; of faces that are parallel; neither


@kernel
def are_blocks(a: Record, b: Record) -> bool:
    """Return True if neither of two bodies is a piece of ground, so that intervals count; see also the ground."""
    return a.faces >= ALL and b.faces >= ALL


@kernel
def bearing_at(sine: float, rate: float, part: float, slide: float, flat: float, cone: float) -> Bearing:
    """Return the share of a corner whose interval is `part` of a face and changes with the slip by `slide` (1/m).

    `sine` is that of the tilt, `rate` its change with the angle of a; its effect lasts from `flat` to `cone`.
    """
    if sine <= flat:
        return Bearing(part, slide, 0.0)
    if sine >= cone:
        return WHOLE
    q = (sine - flat) / (cone - flat)
    up = q * q * (3.0 - 2.0 * q)
    steepness = 6.0 * q * (1.0 - q) / (cone - flat)
    return Bearing(part + (1.0 - part) * up, slide * (1.0 - up), (1.0 - part) * steepness * rate)


@kernel
def face_per_length(a: Record, b: Record, half_a: float, half_b: float) -> float:
    """Return one over the length (1/m) of the face that shares refer to: the free body's, of two free ones the longer.

    `half_a` and `half_b` (m) are half of the faces that touch. A body that is only held until time zero counts as free:
    it comes to rest on the springs that it has afterwards.
    """
    if a.is_moved != 0:
        return 0.5 / half_b
    if b.is_moved != 0:
        return 0.5 / half_a
    return 0.5 / max(half_a, half_b)


@kernel
def overlap_of(
    middle_a: float, reach_a: float, middle_b: float, reach_b: float, per_length: float, cosine: float
) -> Interval:
    """Return the interval of two faces with these middles, from the centre of b, and half lengths along the tangent."""
    is_right_of_a = middle_a + reach_a < middle_b + reach_b
    is_left_of_a = middle_a - reach_a > middle_b - reach_b
    slide = (1.0 if is_right_of_a else 0.0) - (1.0 if is_left_of_a else 0.0)
    right = min(middle_a + reach_a, middle_b + reach_b)
    left = max(middle_a - reach_a, middle_b - reach_b)
    return Interval(left, right, slide, per_length, cosine)


@kernel
def stiffness_between(pair: Record, x: float, y: float, nx: float, ny: float) -> float:
    """Return the stiffness of the two ends of an interval, given the vector (m) from one to the other and their normal.

    Where sliding does not change it, the interval is all of a face.
    """
    return abs(pair.slide * (y * nx - x * ny)) if pair.slide != 0.0 else pair.stiffness


@kernel
def flat_within(cone: float) -> float:
    """Return the sine up to which faces are parallel."""
    return min(tolerances.FLAT, FLAT_SHARE * cone)


class Facing(NamedTuple):
    """How the faces of two bodies look at each other along a normal."""

    interval: Interval
    sine: float  # of the angle between them
    rate: float  # its change with the angle of a
    flat: float  # sine up to which they are parallel
    cone: float  # sine from which on they are not


@kernel
def seen_along(body: Record, side: sides.Side, nx: float, ny: float) -> tuple[float, float, float, float]:
    """Return the normal of a face in world axes, its middle (m) along the tangent and its cosine to (nx, ny)."""
    mx, my = sides.into_world(body, side.nx, side.ny)
    x, y = sides.into_world(body, side.x - side.half * side.ny, side.y + side.half * side.nx)
    return mx, my, nx * y - ny * x, abs(mx * nx + my * ny)


@rare_kernel
def facing_of(a: Record, b: Record, nx: float, ny: float, table: Corners) -> Facing:
    """Return how the faces of a and b look at each other along the normal (nx, ny), b to a."""
    one = sides.corner_of(a, table, sides.side_along(a, table, -nx, -ny))
    two = sides.corner_of(b, table, sides.side_along(b, table, nx, ny))
    ax, ay, middle_a, cos_a = seen_along(a, one, nx, ny)
    bx, by, middle_b, cos_b = seen_along(b, two, nx, ny)
    middle_a += nx * (a.y - b.y) - ny * (a.x - b.x)
    per_length = face_per_length(a, b, one.half, two.half)
    interval = overlap_of(middle_a, one.half * cos_a, middle_b, two.half * cos_b, per_length, cos_a * cos_b)
    sine = ax * by - ay * bx  # of the angle from the face of b to that of a
    cosine = -ax * bx - ay * by
    rate = cosine if sine > 0.0 else -cosine
    cone = sides.cone_of(a, b, table)
    return Facing(interval, abs(sine) if cosine > 0.0 else 1.0, rate, flat_within(cone), cone)


@rare_kernel
def bearing_of_facing(facing: Facing) -> Bearing:
    """Return the share of a corner at an end of the interval of two faces, with or without a contact at the other."""
    found = facing.interval
    part = found.per_length * (found.right - found.left) / found.cosine
    if part > 1.0 or part < tolerances.LEAST_SHARE:
        return bearing_at(
            facing.sine, facing.rate, min(max(part, tolerances.LEAST_SHARE), 1.0), 0.0, facing.flat, facing.cone
        )
    slide = found.slide * found.per_length / found.cosine
    return bearing_at(facing.sine, facing.rate, part, slide, facing.flat, facing.cone)


@rare_kernel
def keep_bearing(pair: Record, bearing: Bearing, stiffness: float) -> None:
    """Note what the contacts of a pair have of the stiffness of a corner contact."""
    pair.stiffness = stiffness * bearing.share
    pair.slide = stiffness * bearing.slide
    pair.turn = stiffness * bearing.turn


@kernel
def measure_soon(pair: Record, slip: float, turned: float, exponent: float, table: Corners) -> None:
    """Have the stiffness of a pair measured in the next step where it changes fast.

    It does between polygons, as on slivers, and with laws other than the linear one, whose steps are longer.
    `slip` (m) and `turned` (rad) are how far a has moved ahead of b, and turned, in the last drift.
    """
    if sides.has_polygons(table) or exponent != LINEAR:
        change = abs(pair.slide * slip + pair.turn * turned)
        if tolerances.OPERATOR_LIFE * change > tolerances.MISSED_STIFFNESS * pair.stiffness:
            damping.renew_dashpots(pair)


@rare_kernel
def measure(world: World, p: int, count: int, stiffness: float) -> None:
    """Measure the stiffness of the contacts of a pair where dashpots are due; `stiffness` is that of a corner alone."""
    pair = world.pairs[p]
    if pair.normal_left != 0:
        return
    a = world.bodies[pair.a]
    b = world.bodies[pair.b]
    if pair.b == world.bodies.size - 1 or not are_blocks(a, b):
        pair.bearing = PLANE
        keep_bearing(pair, WHOLE, stiffness)
    elif pair.is_sliver != 0:
        pair.bearing = APART
        one = world.points[0]
        keep_bearing(pair, Bearing(one.stiffness, one.before, one.rate), 1.0)
    else:
        measure_faces(pair, a, b, world.points[0], world.points[count - 1], stiffness, world.corners)


@kernel
def bearing_along(a: Record, b: Record, nx: float, ny: float, table: Corners) -> tuple[Interval, Bearing, bool]:
    """Return the interval of two blocks along a normal, what its ends bear, and whether the faces are parallel."""
    facing = facing_of(a, b, nx, ny, table)
    return facing.interval, bearing_of_facing(facing), facing.sine <= facing.flat


@rare_kernel
def measure_faces(
    pair: Record, a: Record, b: Record, one: Record, two: Record, stiffness: float, table: Corners
) -> None:
    """Measure the stiffness of the contacts of two blocks, `one` and `two` (or both the same).

    Two on different faces, as where a corner lies in a corner, both have that of the deeper one.
    """
    deeper = one if one.depth >= two.depth else two
    found, bearing, flat = bearing_along(a, b, deeper.nx, deeper.ny, table)
    keep_bearing(pair, bearing, stiffness)
    is_two = one.slot != two.slot
    is_ends = not is_two or (
        one.nx * two.nx + one.ny * two.ny > tolerances.SAME_FACE and flat and bearing.share > tolerances.LEAST_SHARE
    )
    pair.bearing = ENDS if is_ends else APART
    if is_two and is_ends and bearing.slide != 0.0:
        pair.slide = stiffness * found.slide * found.per_length
        pair.stiffness = stiffness_between(pair, one.x - two.x, one.y - two.y, one.nx, one.ny)

"""Stiffness of the corner contacts of one pair, as tributary.py has it: measured where dashpots are due."""

from blocksim.kernels.common.arrays import Record, Records, World
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.explicit.damping import OPERATOR_LIFE, renew_dashpots
from blocksim.kernels.explicit.models.duplicate_corners import PARALLEL
from blocksim.kernels.explicit.tributary import (
    APART,
    ENDS,
    LEAST,
    PLANE,
    WHOLE,
    Bearing,
    Interval,
    are_blocks,
    bearing_of_facing,
    bearing_of_interval,
    facing_of,
    flat_of,
    interval_of,
    is_flat,
    stiffness_between,
)

MOST_CHANGE = 0.01  # of its stiffness, that a pair of polygons may miss until it is measured again


@rare_kernel
def keep_bearing(pair: Record, bearing: Bearing, stiffness: float) -> None:
    """Note what the contacts of a pair have of the stiffness of a corner contact."""
    pair.stiffness = stiffness * bearing.share
    pair.slide = stiffness * bearing.slide
    pair.turn = stiffness * bearing.turn


@kernel
def measure_soon(pair: Record, slip: float, turned: float, corners: Records | None) -> None:
    """Have the stiffness of a pair of polygons measured in the next step where it changes fast, as on slivers.

    `slip` (m) and `turned` (rad) are how far a has moved ahead of b, and turned, in the last drift.
    """
    if corners is not None:
        change = abs(pair.slide * slip + pair.turn * turned)
        if OPERATOR_LIFE * change > MOST_CHANGE * pair.stiffness:
            renew_dashpots(pair)


@rare_kernel
def are_alike(one: Record, two: Record) -> bool:
    """Return True if two contacts have nearly the same normal."""
    return one.nx * two.nx + one.ny * two.ny > PARALLEL


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
def bearing_along(
    a: Record, b: Record, nx: float, ny: float, corners: Records | None
) -> tuple[Interval, Bearing, bool]:
    """Return the interval of two blocks along a normal, what its ends bear, and whether the faces are parallel."""
    if corners is None:
        found = interval_of(a, b, nx, ny)
        return found, bearing_of_interval(found, a, b), is_flat(a, b)
    facing = facing_of(a, b, nx, ny, corners)
    return facing.interval, bearing_of_facing(facing), facing.sine <= flat_of(facing)


@rare_kernel
def measure_faces(
    pair: Record, a: Record, b: Record, one: Record, two: Record, stiffness: float, corners: Records | None
) -> None:
    """Measure the stiffness of the contacts of two blocks, `one` and `two` (or both the same).

    Two on different faces, as where a corner lies in a corner, both have that of the deeper one.
    """
    deeper = one if one.depth >= two.depth else two
    found, bearing, flat = bearing_along(a, b, deeper.nx, deeper.ny, corners)
    keep_bearing(pair, bearing, stiffness)
    is_two = one.slot != two.slot
    is_ends = not is_two or (are_alike(one, two) and flat and bearing.share > LEAST)
    pair.bearing = ENDS if is_ends else APART
    if is_two and is_ends and bearing.slide != 0.0:
        pair.slide = stiffness * found.slide * found.per_length
        pair.stiffness = stiffness_between(pair, one.x - two.x, one.y - two.y, one.nx, one.ny)

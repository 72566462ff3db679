"""Contact points of two polygons that are those of the step before, where forces are evaluated anew at every step.

With a stiffness that changes with the overlap contact.py deals with all pairs at all steps (with a constant one
persistent_pairs.py has nearly all of them). The search of models/outlines.py, and whether what it finds is a sliver,
would take longer than the forces. For two bodies that met at both ends of two parallel faces it finds the same again if
both corners are still on their faces, no other one begins or is the inner one at its end by now, the interval is far
longer than the overlap is deep, and the two points are still its ends.
"""

from typing import Any

import numpy as np

from blocksim.kernels.common.arrays import Record, Records, World
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.explicit.laws import has_constant_stiffness
from blocksim.kernels.explicit.models.outline_ends import has_passed
from blocksim.kernels.explicit.models.outlines import add_slot
from blocksim.kernels.explicit.outlines import MOST_CORNERS, cone_of, side_along, side_normal
from blocksim.kernels.explicit.persistent_outlines import begins_on_outlines, has_crossed, lie_on_sliver
from blocksim.kernels.explicit.sliver_axes import Axis, flat_within
from blocksim.kernels.explicit.slivers import has_both_ends
from blocksim.kernels.explicit.tributary import ENDS

SEARCH = -1


@kernel
def lasting_points(world: World, p: int, corners: Records | None) -> int:
    """Fill `points` with the contacts of pair p if they last; return how many there are, or SEARCH."""
    if corners is None:
        return SEARCH
    return ends_that_last(world, p, corners)


@rare_kernel
def ends_that_last(world: World, p: int, table: Records) -> int:
    """As lasting_points, for two ends of an interval in a scene with polygons."""
    pair = world.pairs[p]
    is_settled = pair.active == 2 and pair.bearing == ENDS and pair.is_sliver == 0
    if has_constant_stiffness(world.controls[0].law) or not is_settled:
        return SEARCH
    a = world.bodies[pair.a]
    b = world.bodies[pair.b]
    if pair.duplicates != 0 and has_crossed(world, p, a, b, table):
        return SEARCH
    if not are_found(world, p, a, b, table):
        return SEARCH
    if pair.idle > 0 and begins_on_outlines(world, p, a, b, table):
        return SEARCH
    if lie_on_sliver(a, b, world.points[0], world.points[1], table) or not are_both_ends(world, p, a, b, table):
        return SEARCH
    return 2


@kernel
def are_found(world: World, p: int, a: Record, b: Record, table: Records) -> bool:
    """Fill `points` with two contacts of a pair; return True if they are still on their faces, and the inner ones."""
    cone = cone_of(a, b, table)
    duplicates: Any = np.int64(world.pairs[p].duplicates)
    for i in range(2):
        contact = world.contacts[p, i]
        slot: Any = np.int64(contact.slot)
        if add_slot(a, b, slot, table, cone, world.points, i) == i or world.points[i].face != contact.face:
            return False
        if duplicates != 0 and has_passed(world.points[i], duplicates, a, b, table):
            return False
    return True


@kernel
def are_both_ends(world: World, p: int, a: Record, b: Record, table: Records) -> bool:
    """Return True if two points are both ends of the interval of two parallel faces."""
    point = world.points[1 if world.points[1].depth > world.points[0].depth else 0]
    face: Any = np.int64(point.face)
    of_b = bool(point.slot < MOST_CORNERS)
    corner: Any = np.int64(point.slot - (0 if of_b else MOST_CORNERS))
    body, other = (b, a) if of_b else (a, b)
    nx, ny = side_normal(body, table, face)
    across = side_along(other, table, -nx, -ny)
    mx, my = side_normal(other, table, across)
    if abs(nx * my - ny * mx) > flat_within(cone_of(a, b, table)):
        return False
    return has_both_ends(world, 2, Axis(of_b, face, corner, point.depth), across, world.pairs[p].limit, a, b, table)

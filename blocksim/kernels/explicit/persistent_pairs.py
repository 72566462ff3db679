"""Pairs whose contacts continue as they were: nearly all pairs at nearly all steps, so they decide the speed.

The same forces as contact.py has, for the `surface` model with the linear law and one or two contacts. Nothing is
searched, and nothing is written before it is certain that no contact begins, ends or changes. Where that is not so,
`persistent_forces` leaves the pair as it was and contact.py deals with it.
"""

from typing import Any

import numpy as np

from blocksim.kernels.common.arrays import ALL, Record, Records, World
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.explicit.contact import has_new_neighbours
from blocksim.kernels.explicit.damping import renew_dashpots
from blocksim.kernels.explicit.laws import has_constant_stiffness
from blocksim.kernels.explicit.models import SURFACE
from blocksim.kernels.explicit.models.duplicate_corners import is_oblique
from blocksim.kernels.explicit.outlines import gap_on, widest_gap
from blocksim.kernels.explicit.persistent_forces import CHANGED, NOTHING, UNTOUCHED, Effect, double, single
from blocksim.kernels.explicit.persistent_outlines import begins_on_outlines, has_crossed
from blocksim.kernels.explicit.separation import begins_contact, choose_axis, gap_along
from blocksim.kernels.explicit.tributary import are_blocks


@kernel
def persistent_forces(
    world: World, p: int, step: float, particles: Records | None, corners: Records | None
) -> tuple[int, Effect]:
    """Return what pair p does if its contacts continue (TOUCHING) or there are none (UNTOUCHED).

    Otherwise (CHANGED) nothing has been written. `step` is the length (s) of the drift that led here. Where `particles`
    is not None no pair is handled here.
    """
    if corners is not None:
        return forces_of_outlines(world, p, step, corners)
    if particles is not None:
        return CHANGED, NOTHING
    return forces_of_rectangles(world, p, step)


@kernel
def forces_of_rectangles(world: World, p: int, step: float) -> tuple[int, Effect]:
    """As persistent_forces, in a scene of rectangles without particles."""
    pair = world.pairs[p]
    a = world.bodies[pair.a]
    b = world.bodies[pair.b]
    dx = a.x - b.x
    dy = a.y - b.y
    if pair.active == 0 and gap_along(pair.axis, a, b, dx, dy) >= 0.0:
        return UNTOUCHED, NOTHING
    if is_unsettled(world, p, a, b, dx, dy):
        return CHANGED, NOTHING
    if pair.active > 0:
        return forces_of_contacts(world, p, a, b, dx, dy, step)
    gap = choose_axis(pair, a, b, dx, dy, pair.b == world.bodies.size - 1)
    return UNTOUCHED if gap >= -pair.limit else CHANGED, NOTHING


@kernel
def forces_of_outlines(world: World, p: int, step: float, table: Records) -> tuple[int, Effect]:
    """As persistent_forces, in a scene with polygons."""
    pair = world.pairs[p]
    a = world.bodies[pair.a]
    b = world.bodies[pair.b]
    dx = a.x - b.x
    dy = a.y - b.y
    if pair.active == 0:
        return apart_or_changed(world, p, a, b, table), NOTHING
    if has_changed(world, p, a, b, table):
        return CHANGED, NOTHING
    return forces_of_contacts(world, p, a, b, dx, dy, step)


@kernel
def forces_of_contacts(
    world: World, p: int, a: Record, b: Record, dx: float, dy: float, step: float
) -> tuple[int, Effect]:
    """Return what a pair with contacts does, if they continue.

    What is checked and measured once in OPERATOR_LIFE steps, where dashpots are due, is compiled apart, so that all
    other steps have neither the tests for it nor what they would keep for it.
    """
    pair = world.pairs[p]
    if pair.normal_left == 0:
        return forces_when_due(world, p, step)
    if pair.active == 1:
        return single(world, p, a, b, dx, dy, step, False)
    return double(world, p, a, b, dx, dy, step, False)


@rare_kernel
def forces_when_due(world: World, p: int, step: float) -> tuple[int, Effect]:
    """As forces_of_contacts, where the dashpots along the normals are due, and with them the stiffness."""
    pair = world.pairs[p]
    a = world.bodies[pair.a]
    b = world.bodies[pair.b]
    if pair.active == 1:
        return single(world, p, a, b, a.x - b.x, a.y - b.y, step, True)
    return double(world, p, a, b, a.x - b.x, a.y - b.y, step, True)


@kernel
def apart_or_changed(world: World, p: int, a: Record, b: Record, table: Records) -> int:
    """Return UNTOUCHED for a pair of a scene with polygons that did not touch and does not now, else CHANGED."""
    pair = world.pairs[p]
    is_ground = pair.b == world.bodies.size - 1
    axis: Any = np.int64(pair.axis)
    if gap_on(axis, a, b, is_ground, table) >= 0.0:
        return UNTOUCHED
    gap = widest_gap(pair, a, b, is_ground, table)
    if gap < 0.0 and (are_blocks(a, b) or gap < -pair.limit or begins_on_outlines(world, p, a, b, table)):
        return CHANGED
    return UNTOUCHED


@kernel
def has_changed(world: World, p: int, a: Record, b: Record, table: Records) -> bool:
    """As is_unsettled, for two bodies that touch in a scene with polygons."""
    pair = world.pairs[p]
    if pair.is_sliver != 0 or not has_constant_stiffness(world.controls[0].law):
        return True
    if pair.duplicates != 0 and has_crossed(world, p, a, b, table):
        return True
    if pair.idle > 0 and begins_on_outlines(world, p, a, b, table):
        return True
    if has_new_neighbours(a, b, SURFACE):
        renew_dashpots(pair)
    return False


@kernel
def is_unsettled(world: World, p: int, a: Record, b: Record, dx: float, dy: float) -> bool:
    """Return True if a new contact begins, or the contacts are of a kind that contact.py handles.

    Has the dashpots rebuilt where the number of pairs on a body has changed.
    """
    pair = world.pairs[p]
    if pair.duplicates != 0 and is_oblique(a, b):
        return True
    if pair.idle > 0 and begins_contact(world, p, a, b, dx, dy):
        return True
    if pair.active > 0 and has_new_neighbours(a, b, SURFACE):
        renew_dashpots(pair)
    return pair.active > 0 and (b.faces != ALL or not has_constant_stiffness(world.controls[0].law))

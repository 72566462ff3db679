"""Pairs whose contacts continue as they were: nearly all pairs at nearly all steps, so they decide the speed.

For the `surface` model with one or two contacts. Nothing is searched, and nothing is written before it is certain that
no contact begins, ends or changes: that is found as contacts are followed. Where it is not so, `persistent_forces`
leaves the pair as it was and contact.py deals with it. Forces are those of forces.py.
"""

from typing import Any

import numpy as np

from blocksim.kernels.common.arrays import ALL, NORMAL, SHEAR, Record, Records, World
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.explicit import (
    damping,
    kinematics,
    laws,
    outlines,
    persistent_contacts,
    persistent_outlines,
    separation,
)
from blocksim.kernels.explicit.bearing import APART, PLANE, are_blocks, bearing_along, keep_bearing, stiffness_between
from blocksim.kernels.explicit.contact import has_new_neighbours
from blocksim.kernels.explicit.forces import NOTHING, Effect, Touch, forces_of
from blocksim.kernels.explicit.models import SURFACE, surface

CHANGED, UNTOUCHED, TOUCHING = range(3)


@kernel
def follow_corner(
    contact: Record,
    a: Record,
    b: Record,
    dx: float,
    dy: float,
    motion: kinematics.Motion,
    step: float,
    turns: bool,
    duplicates: int,
    corners: Records | None,
) -> tuple[bool, kinematics.Point]:
    """Check that a contact continues, and where and how; see persistent_contacts.py."""
    if corners is None:
        return persistent_contacts.follow(contact, a, b, dx, dy, motion, step, turns)
    return persistent_outlines.follow_on_outlines(contact, a, b, dx, dy, motion, step, turns, duplicates, corners)


@kernel
def followed(
    touch: Touch, step: float, is_two: bool, is_due: bool, corners: Records | None
) -> tuple[bool, kinematics.Point, kinematics.Point]:
    """Check that the one or two contacts of a pair continue; return them too, the first one twice if there is one.

    Two are on the ground, or the two ends of one interval of parallel faces, and no sliver. That the faces are parallel
    changes by turning only, slowly, and is checked where dashpots are due, as `is_due` says.
    """
    pair, a, b = touch.pair, touch.a, touch.b
    dx = a.x - b.x
    dy = a.y - b.y
    motion = kinematics.relative_motion(a, b, dx, dy, 0.5 * step)
    goes_on, one = follow_corner(touch.first, a, b, dx, dy, motion, step, is_due, pair.duplicates, corners)
    if not is_two:
        goes_on = goes_on and one.depth <= pair.limit and not one_is_sliver(touch.first, a, b, one, corners)
        return goes_on, one, one
    goes_too, two = follow_corner(touch.second, a, b, dx, dy, motion, step, is_due, pair.duplicates, corners)
    goes_on = goes_on and goes_too and pair.bearing != APART and not two_are_sliver(a, b, one, two, corners)
    if is_due and pair.bearing != PLANE:
        goes_on = goes_on and bearing_along(a, b, one.nx, one.ny, corners)[2]
    return goes_on and max(one.depth, two.depth) <= pair.limit, one, two


@kernel
def one_is_sliver(contact: Record, a: Record, b: Record, found: kinematics.Point, corners: Records | None) -> bool:
    """Return True if a single contact is that of two polygons which overlap by a sliver; see slivers.py."""
    return False if corners is None else persistent_outlines.ends_in_sliver(contact, a, b, found, corners)


@kernel
def two_are_sliver(a: Record, b: Record, one: kinematics.Point, two: kinematics.Point, corners: Records | None) -> bool:
    """Return True if two contacts are those of two polygons which overlap by a sliver; see slivers.py."""
    return False if corners is None else persistent_outlines.lie_on_sliver(a, b, one, two, corners)


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
    if pair.active == 0 and separation.gap_along(pair.axis, a, b, dx, dy) >= 0.0:
        return UNTOUCHED, NOTHING
    if is_unsettled(world, p, a, b, dx, dy):
        return CHANGED, NOTHING
    if pair.active > 0:
        return forces_of_contacts(world, p, step)
    gap = separation.choose_axis(pair, a, b, dx, dy, pair.b == world.bodies.size - 1)
    return UNTOUCHED if gap >= -pair.limit else CHANGED, NOTHING


@kernel
def forces_of_outlines(world: World, p: int, step: float, table: Records) -> tuple[int, Effect]:
    """As persistent_forces, in a scene with polygons."""
    pair = world.pairs[p]
    a = world.bodies[pair.a]
    b = world.bodies[pair.b]
    if pair.active == 0:
        return apart_or_changed(world, p, a, b, table), NOTHING
    if has_changed(world, p, a, b, table):
        return CHANGED, NOTHING
    return forces_of_contacts(world, p, step)


@kernel
def forces_of_contacts(world: World, p: int, step: float) -> tuple[int, Effect]:
    """Return what a pair with contacts does, if they continue.

    What is checked and measured once in OPERATOR_LIFE steps, where dashpots are due, is compiled apart, so that all
    other steps have neither the tests for it nor what they would keep for it; so is what other laws need.
    """
    pair = world.pairs[p]
    a = world.bodies[pair.a]
    b = world.bodies[pair.b]
    first, second = world.contacts[p, 0], world.contacts[p, 1]
    values = world.interactions[a.contact_class, b.contact_class]
    touch = Touch(pair, a, b, values, first, second, world.operators[p, NORMAL], world.operators[p, SHEAR])
    exponent = world.controls[0].exponent
    if pair.normal_left == 0 or exponent != laws.LINEAR:
        return forces_of_some(touch, step, pair.active == 2, exponent, world.corners)
    if pair.active == 1:
        return forces_that_last(touch, step, False, world.corners)
    return forces_that_last(touch, step, True, world.corners)


@kernel
def forces_that_last(touch: Touch, step: float, is_two: bool, corners: Records | None) -> tuple[int, Effect]:
    """As forces_of_contacts, for linear springs whose dashpots along the normals are not due."""
    goes_on, one, two = followed(touch, step, is_two, False, corners)
    if not goes_on:
        return CHANGED, NOTHING
    return TOUCHING, forces_of(touch, one, two, is_two, 0.0, step, step, laws.LINEAR, True, corners, None)


@rare_kernel
def forces_of_some(
    touch: Touch, step: float, is_two: bool, exponent: float, corners: Records | None
) -> tuple[int, Effect]:
    """As forces_of_contacts, where dashpots along the normals are due, and with them the stiffness; for all laws."""
    pair = touch.pair
    is_due = pair.normal_left == 0
    goes_on, one, two = followed(touch, step, is_two, is_due, corners)
    if not goes_on:
        return CHANGED, NOTHING
    before = pair.stiffness
    if is_due and pair.bearing != PLANE:
        if is_two:
            pair.stiffness = stiffness_between(pair, one.x - two.x, one.y - two.y, one.nx, one.ny)
        else:
            measured = bearing_along(touch.a, touch.b, one.nx, one.ny, corners)[1]
            keep_bearing(pair, measured, touch.values.normal_stiffness)
    return TOUCHING, forces_of(touch, one, two, is_two, before, step, step, exponent, False, corners, None)


@kernel
def apart_or_changed(world: World, p: int, a: Record, b: Record, table: Records) -> int:
    """Return UNTOUCHED for a pair of a scene with polygons that did not touch and does not now, else CHANGED."""
    pair = world.pairs[p]
    is_ground = pair.b == world.bodies.size - 1
    axis: Any = np.int64(pair.axis)
    if outlines.gap_on(axis, a, b, is_ground, table) >= 0.0:
        return UNTOUCHED
    gap = outlines.widest_gap(pair, a, b, is_ground, table)
    if gap < 0.0 and (
        are_blocks(a, b) or gap < -pair.limit or persistent_outlines.begins_on_outlines(world, p, a, b, table)
    ):
        return CHANGED
    return UNTOUCHED


@kernel
def has_changed(world: World, p: int, a: Record, b: Record, table: Records) -> bool:
    """As is_unsettled, for two bodies that touch in a scene with polygons."""
    pair = world.pairs[p]
    if pair.is_sliver != 0:
        return True
    if pair.duplicates != 0 and persistent_outlines.has_crossed(world, p, a, b, table):
        return True
    if pair.idle > 0 and persistent_outlines.begins_on_outlines(world, p, a, b, table):
        return True
    if has_new_neighbours(a, b, SURFACE):
        damping.renew_dashpots(pair)
    return False


@kernel
def is_unsettled(world: World, p: int, a: Record, b: Record, dx: float, dy: float) -> bool:
    """Return True if a new contact begins, or the contacts are of a kind that contact.py handles.

    Has the dashpots rebuilt where the number of pairs on a body has changed.
    """
    pair = world.pairs[p]
    if pair.duplicates != 0 and surface.is_oblique(a, b):
        return True
    if pair.idle > 0 and separation.begins_contact(world, p, a, b, dx, dy):
        return True
    if pair.active > 0 and has_new_neighbours(a, b, SURFACE):
        damping.renew_dashpots(pair)
    return pair.active > 0 and b.faces != ALL

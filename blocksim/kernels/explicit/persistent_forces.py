"""Forces of one or two contacts that continue as they were, and which pairs these are.

A contact that may have ended or changed is found as it is followed: then nothing has been written yet.

Pairs whose contacts continue as they were: nearly all pairs at nearly all steps, so they decide the speed.

The same forces as contact.py has, for the `surface` model with the linear law and one or two contacts. Nothing is
searched, and nothing is written before it is certain that no contact begins, ends or changes. Where that is not so,
`persistent_forces` leaves the pair as it was and contact.py deals with it.
"""

from typing import Any, NamedTuple

import numpy as np

from blocksim.kernels.common.arrays import ALL, NORMAL, SHEAR, Record, Records, World
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.explicit import damping, laws, outlines, persistent_contacts, persistent_outlines, separation
from blocksim.kernels.explicit.bearing import (
    APART,
    PLANE,
    are_blocks,
    bearing_of_faces,
    is_flat,
    measure_soon,
    stiffness_between,
)
from blocksim.kernels.explicit.contact import has_new_neighbours
from blocksim.kernels.explicit.friction import clip_to_cone, draw_lasting_spring
from blocksim.kernels.explicit.models import SURFACE, surface

CHANGED, UNTOUCHED, TOUCHING = range(3)


class Effect(NamedTuple):
    """What a pair does in one step."""

    fx: float  # N, on body a
    fy: float
    torque_a: float  # N m, on body a
    torque_b: float  # against body b
    dashpot: float  # J, lost to dashpots
    friction: float  # J, lost to friction


NOTHING = Effect(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@kernel
def follow_corner(
    contact: Record,
    a: Record,
    b: Record,
    dx: float,
    dy: float,
    motion: persistent_contacts.Motion,
    step: float,
    turns: bool,
    duplicates: int,
    corners: Records | None,
) -> tuple[bool, persistent_contacts.PersistentContact]:
    """Check that a contact continues, and where and how; see persistent_contacts.py."""
    if corners is None:
        return persistent_contacts.follow(contact, a, b, dx, dy, motion, step, turns)
    return persistent_outlines.follow_on_outlines(contact, a, b, dx, dy, motion, step, turns, duplicates, corners)


@kernel
def measure_corner(
    pair: Record,
    a: Record,
    b: Record,
    found: persistent_contacts.PersistentContact,
    stiffness: float,
    corners: Records | None,
) -> None:
    """Measure the stiffness of a single contact of two blocks; `stiffness` is that of a corner alone."""
    if corners is None:
        bearing = bearing_of_faces(a, b, found.nx, found.ny)
        pair.stiffness = stiffness * bearing.share
        pair.slide = stiffness * bearing.slide
        pair.turn = stiffness * bearing.turn
    else:
        persistent_outlines.measure_on_outlines(pair, a, b, found.nx, found.ny, stiffness, corners)


@kernel
def are_flat(a: Record, b: Record, found: persistent_contacts.PersistentContact, corners: Records | None) -> bool:
    """Return True if the faces of two blocks that meet along the normal of a contact are parallel."""
    if corners is None:
        return is_flat(a, b)
    return persistent_outlines.are_parallel(a, b, found.nx, found.ny, corners)


@kernel
def are_ends(
    pair: Record,
    a: Record,
    b: Record,
    found: persistent_contacts.PersistentContact,
    other: persistent_contacts.PersistentContact,
    is_due: bool,
    corners: Records | None,
) -> bool:
    """Return True if two contacts are on the ground or the two ends of one interval of parallel faces, no sliver.

    That changes by turning only, slowly, and is checked where dashpots are due.
    """
    if pair.bearing == APART or two_are_sliver(a, b, found, other, corners):
        return False
    return not is_due or pair.bearing == PLANE or are_flat(a, b, found, corners)


@kernel
def use_operator_of_one(
    operator: Record,
    pair: Record,
    a: Record,
    b: Record,
    found: persistent_contacts.PersistentContact,
    values: Record,
    step: float,
    is_due: bool,
) -> None:
    """Rebuild the operator along the normal of a single contact where it is due, else count down."""
    if not is_due:
        damping.count_down(pair)
    elif pair.slides != 0:
        persistent_contacts.renew_sliding(operator, pair, a, b, found, values, step)
    else:
        persistent_contacts.renew_single(
            operator, pair, a, b, found, NORMAL, values.normal_damping, step, pair.stiffness
        )


@kernel
def one_is_sliver(
    contact: Record, a: Record, b: Record, found: persistent_contacts.PersistentContact, corners: Records | None
) -> bool:
    """Return True if a single contact is that of two polygons which overlap by a sliver; see slivers.py."""
    return False if corners is None else persistent_outlines.ends_in_sliver(contact, a, b, found, corners)


@kernel
def two_are_sliver(
    a: Record,
    b: Record,
    one: persistent_contacts.PersistentContact,
    two: persistent_contacts.PersistentContact,
    corners: Records | None,
) -> bool:
    """Return True if two contacts are those of two polygons which overlap by a sliver; see slivers.py."""
    return False if corners is None else persistent_outlines.lie_on_sliver(a, b, one, two, corners)


@kernel
def single(
    world: World, p: int, a: Record, b: Record, dx: float, dy: float, step: float, is_due: bool
) -> tuple[int, Effect]:
    """Return what a pair with one contact does, if it continues; see persistent_forces.

    `is_due` says whether dashpots along the normal are, where there are any.
    """
    contact = world.contacts[p, 0]
    pair = world.pairs[p]
    values = world.interactions[a.contact_class, b.contact_class]
    motion = persistent_contacts.relative_motion(a, b, dx, dy, 0.5 * step)
    goes_on, found = follow_corner(contact, a, b, dx, dy, motion, step, is_due, pair.duplicates, world.corners)
    if not goes_on or found.depth > pair.limit or one_is_sliver(contact, a, b, found, world.corners):
        return CHANGED, NOTHING
    before = pair.stiffness
    if is_due and pair.bearing != PLANE:
        measure_corner(pair, a, b, found, values.normal_stiffness, world.corners)
    spring = pair.stiffness * found.depth
    force = spring
    if not is_due or values.normal_damping > 0.0:
        operator = world.operators[p, NORMAL]
        use_operator_of_one(operator, pair, a, b, found, values, step, is_due)
        force = damping.damp_one(operator, spring, contact.normal_force, found.closing_rate)
    normal = max(force, 0.0)
    dashpot = 0.5 * (contact.normal_force - before * contact.depth + (normal - spring)) * found.closing
    drawn, shear, lost, friction = shear_of_one(world, p, a, b, values, found, normal, step, before, is_due)
    keep(contact, drawn, found.depth, normal, shear)
    measure_soon(pair, found.slip, step * (a.spin - b.spin), world.corners)
    square = 0.5 * found.depth * found.depth
    shear += square * pair.slide
    fx = found.nx * normal + found.ny * shear
    fy = found.ny * normal - found.nx * shear
    torque = found.x * fy - found.y * fx - square * pair.turn
    return TOUCHING, Effect(fx, fy, torque - (dx * fy - dy * fx), torque, dashpot + lost, friction)


@kernel
def shear_of_one(
    world: World,
    p: int,
    a: Record,
    b: Record,
    values: Record,
    found: persistent_contacts.PersistentContact,
    normal: float,
    step: float,
    before: float,
    is_due: bool,
) -> tuple[float, float, float, float]:
    """Return shear spring (m), shear force (N) and the losses (J) to dashpot and friction of a single contact.

    `before` (N/m) is the stiffness along the normal in the step before; it is another now only where `is_due` says so.
    """
    contact = world.contacts[p, 0]
    pair = world.pairs[p]
    operator = world.operators[p, SHEAR]
    k = values.shear_ratio * pair.stiffness
    old = values.shear_ratio * before
    drawn, limit, slides, friction = draw_lasting_spring(
        values, k, old, contact.spring, found.slip, normal, found.slip_rate, is_due
    )
    elastic = k * drawn
    shear = elastic
    if slides:
        pair.shear_left = 0
    elif values.shear_damping > 0.0:
        if damping.are_dashpots_due(pair, SHEAR):
            persistent_contacts.renew_single(operator, pair, a, b, found, SHEAR, values.shear_damping, step, k)
        free = damping.damp_one(operator, elastic, contact.shear_force, found.slip_rate)
        shear = clip_to_cone(values, free, limit, normal, found.slip_rate)
        slides = shear != free
    if normal > 0.0:
        damping.note_slip(pair, slides, shear)
    dashpot = 0.5 * (contact.shear_force - old * contact.spring + (shear - elastic)) * found.slip
    return drawn, shear, dashpot, friction


@kernel
def keep(contact: Record, spring: float, depth: float, normal_force: float, shear_force: float) -> None:
    """Write what a contact remembers until the next step."""
    contact.spring = spring
    contact.depth = depth
    contact.normal_force = normal_force
    contact.shear_force = shear_force


@kernel
def use_operator_of_two(
    operator: Record,
    pair: Record,
    a: Record,
    b: Record,
    one: persistent_contacts.PersistentContact,
    two: persistent_contacts.PersistentContact,
    values: Record,
    step: float,
    is_due: bool,
) -> None:
    """Rebuild the operator along the normals of two contacts where it is due, else count down."""
    if is_due:
        persistent_contacts.renew_double(
            operator, pair, a, b, one, two, NORMAL, damping.BOTH, values.normal_damping, step, pair.stiffness
        )
    else:
        damping.count_down(pair)


@kernel
def double(
    world: World, p: int, a: Record, b: Record, dx: float, dy: float, step: float, is_due: bool
) -> tuple[int, Effect]:
    """Return what a pair with two contacts does, if both continue; see single."""
    first = world.contacts[p, 0]
    second = world.contacts[p, 1]
    pair = world.pairs[p]
    operator = world.operators[p, NORMAL]
    values = world.interactions[a.contact_class, b.contact_class]
    motion = persistent_contacts.relative_motion(a, b, dx, dy, 0.5 * step)
    goes_1, one = follow_corner(first, a, b, dx, dy, motion, step, is_due, pair.duplicates, world.corners)
    goes_2, two = follow_corner(second, a, b, dx, dy, motion, step, is_due, pair.duplicates, world.corners)
    goes_on = goes_1 and goes_2 and are_ends(pair, a, b, one, two, is_due, world.corners)
    if not goes_on or max(one.depth, two.depth) > pair.limit:
        return CHANGED, NOTHING
    before = pair.stiffness
    if is_due and pair.bearing != PLANE:
        pair.stiffness = stiffness_between(pair, one.x - two.x, one.y - two.y, one.nx, one.ny)
    k = pair.stiffness
    spring_1, spring_2 = force_1, force_2 = k * one.depth, k * two.depth
    if not is_due or values.normal_damping > 0.0:
        use_operator_of_two(operator, pair, a, b, one, two, values, step, is_due)
        force_1, force_2 = damping.damp_two(
            operator, spring_1, spring_2, first.normal_force, second.normal_force, one.closing_rate, two.closing_rate
        )
    normal_1, normal_2 = max(force_1, 0.0), max(force_2, 0.0)
    lost_1 = (first.normal_force - before * first.depth + (normal_1 - spring_1)) * one.closing
    lost_2 = (second.normal_force - before * second.depth + (normal_2 - spring_2)) * two.closing
    drawn_1, drawn_2, shear_1, shear_2, lost, friction = shear_of_two(
        world, p, a, b, values, one, two, normal_1, normal_2, step, before, is_due
    )
    keep(first, drawn_1, one.depth, normal_1, shear_1)
    keep(second, drawn_2, two.depth, normal_2, shear_2)
    measure_soon(pair, one.slip, step * (a.spin - b.spin), world.corners)
    half_slide = 0.5 * pair.slide
    shear_1 += half_slide * one.depth * one.depth
    shear_2 += half_slide * two.depth * two.depth
    fx, fy, torque = sum_of_two(one, two, normal_1, normal_2, shear_1, shear_2)
    return TOUCHING, Effect(fx, fy, torque - (dx * fy - dy * fx), torque, 0.5 * (lost_1 + lost_2) + lost, friction)


@kernel
def sum_of_two(
    one: persistent_contacts.PersistentContact,
    two: persistent_contacts.PersistentContact,
    normal_1: float,
    normal_2: float,
    shear_1: float,
    shear_2: float,
) -> tuple[float, float, float]:
    """Return the force (N) of two contacts on body a and its torque (N m) about the centre of b."""
    fx_1 = one.nx * normal_1 + one.ny * shear_1
    fy_1 = one.ny * normal_1 - one.nx * shear_1
    fx_2 = two.nx * normal_2 + two.ny * shear_2
    fy_2 = two.ny * normal_2 - two.nx * shear_2
    torque = one.x * fy_1 - one.y * fx_1 + (two.x * fy_2 - two.y * fx_2)
    return fx_1 + fx_2, fy_1 + fy_2, torque


@kernel
def shear_of_two(
    world: World,
    p: int,
    a: Record,
    b: Record,
    values: Record,
    one: persistent_contacts.PersistentContact,
    two: persistent_contacts.PersistentContact,
    normal_1: float,
    normal_2: float,
    step: float,
    before: float,
    is_due: bool,
) -> tuple[float, float, float, float, float, float]:
    """Return shear springs (m) and forces (N) of two contacts, and their losses (J) to dashpots and friction.

    `before` and `is_due` as in shear_of_one.
    """
    first = world.contacts[p, 0]
    second = world.contacts[p, 1]
    pair = world.pairs[p]
    operator = world.operators[p, SHEAR]
    k = values.shear_ratio * pair.stiffness
    old = values.shear_ratio * before
    drawn_1, limit_1, slides_1, work_1 = draw_lasting_spring(
        values, k, old, first.spring, one.slip, normal_1, one.slip_rate, is_due
    )
    drawn_2, limit_2, slides_2, work_2 = draw_lasting_spring(
        values, k, old, second.spring, two.slip, normal_2, two.slip_rate, is_due
    )
    elastic_1 = k * drawn_1
    elastic_2 = k * drawn_2
    shear_1 = elastic_1
    shear_2 = elastic_2
    sticking = (0 if slides_1 else 1) + (0 if slides_2 else 2)
    if sticking == 0:
        pair.shear_left = 0
    elif values.shear_damping > 0.0:
        if pair.sticking != sticking or damping.are_dashpots_due(pair, SHEAR):
            persistent_contacts.renew_double(
                operator, pair, a, b, one, two, SHEAR, sticking, values.shear_damping, step, k
            )
        shear_1, shear_2 = damping.damp_two(
            operator, elastic_1, elastic_2, first.shear_force, second.shear_force, one.slip_rate, two.slip_rate
        )
        # a point that slides has its spring at the limit and no dashpot
        shear_1 = elastic_1 if slides_1 else clip_to_cone(values, shear_1, limit_1, normal_1, one.slip_rate)
        shear_2 = elastic_2 if slides_2 else clip_to_cone(values, shear_2, limit_2, normal_2, two.slip_rate)
    lost_1 = (first.shear_force - old * first.spring + (shear_1 - elastic_1)) * one.slip
    lost_2 = (second.shear_force - old * second.spring + (shear_2 - elastic_2)) * two.slip
    return drawn_1, drawn_2, shear_1, shear_2, 0.5 * (lost_1 + lost_2), work_1 + work_2


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
        return forces_of_contacts(world, p, a, b, dx, dy, step)
    gap = separation.choose_axis(pair, a, b, dx, dy, pair.b == world.bodies.size - 1)
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
    if pair.is_sliver != 0 or world.controls[0].exponent != laws.LINEAR:
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
    return pair.active > 0 and (b.faces != ALL or world.controls[0].exponent != laws.LINEAR)

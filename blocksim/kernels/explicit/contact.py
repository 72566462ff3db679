"""Forces at the contact points of one pair: springs, dashpots, clipping, friction with history, energy tally.

The normal pass comes first, the tangential pass uses its forces for the Coulomb limit. Losses are tallied where the
forces are applied, by the trapezoid rule over the drift between two evaluations, which is exactly the work that the
kicks do.

Here any number of points, in whatever way they were found; persistent_forces.py has the same for pairs whose one or two
contacts continue as they were, which is what nearly all pairs do at nearly all steps.

Contact points of two polygons that are those of the step before, where forces are evaluated anew at every step.

With a stiffness that changes with the overlap all pairs are dealt with here at all steps (with a constant one
persistent_forces.py has nearly all of them). The search of models/outlines.py, and whether what it finds is a sliver,
would take longer than the forces. For two bodies that met at both ends of two parallel faces it finds the same again if
both corners are still on their faces, no other one begins or is the inner one at its end by now, the interval is far
longer than the overlap is deep, and the two points are still its ends.
"""

from typing import Any

import numpy as np

from blocksim.kernels.common.arrays import NORMAL, SHEAR, Record, Records, World
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.explicit import (
    bearing,
    damping,
    depth,
    friction,
    history,
    inertia,
    kinematics,
    laws,
    outlines,
    persistent_outlines,
    sliver_axes,
    slivers,
)
from blocksim.kernels.explicit.models import SURFACE, contact_points
from blocksim.kernels.explicit.models.outlines import add_slot, has_passed

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
    is_settled = pair.active == 2 and pair.bearing == bearing.ENDS and pair.is_sliver == 0
    if world.controls[0].exponent == laws.LINEAR or not is_settled:
        return SEARCH
    a = world.bodies[pair.a]
    b = world.bodies[pair.b]
    if pair.duplicates != 0 and persistent_outlines.has_crossed(world, p, a, b, table):
        return SEARCH
    if not are_found(world, p, a, b, table):
        return SEARCH
    if pair.idle > 0 and persistent_outlines.begins_on_outlines(world, p, a, b, table):
        return SEARCH
    if persistent_outlines.lie_on_sliver(a, b, world.points[0], world.points[1], table):
        return SEARCH
    return 2 if are_both_ends(world, p, a, b, table) else SEARCH


@kernel
def are_found(world: World, p: int, a: Record, b: Record, table: Records) -> bool:
    """Fill `points` with two contacts of a pair; return True if they are still on their faces, and the inner ones."""
    cone = outlines.cone_of(a, b, table)
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
    of_b = bool(point.slot < outlines.MOST_CORNERS)
    corner: Any = np.int64(point.slot - (0 if of_b else outlines.MOST_CORNERS))
    body, other = (b, a) if of_b else (a, b)
    nx, ny = outlines.side_normal(body, table, face)
    across = outlines.side_along(other, table, -nx, -ny)
    mx, my = outlines.side_normal(other, table, across)
    if abs(nx * my - ny * mx) > sliver_axes.flat_within(outlines.cone_of(a, b, table)):
        return False
    return slivers.has_both_ends(
        world, 2, sliver_axes.Axis(of_b, face, corner, point.depth), across, world.pairs[p].limit, a, b, table
    )


@kernel
def push_spring(point: Record, contact: Record, exponent: float, stiffness: float) -> None:
    """Set the normal spring force of a point and what its dashpot needs."""
    point.before = contact.normal_force
    point.rate = point.closing_rate
    point.stiffness = laws.tangent_stiffness(exponent, stiffness * point.share, point.depth)
    point.force = laws.elastic_force(exponent, stiffness * point.share, point.depth)
    point.spring_force = point.force


@kernel
def clip_tension(point: Record, lost: float) -> float:
    """Contacts do not pull. Return the energy (J) that dashpot and clipping have taken during the last drift.

    `lost` (N) is what the force of the step before was more than the spring's.
    """
    point.normal_force = max(point.force, 0.0)
    return 0.5 * (lost + (point.normal_force - point.spring_force)) * point.closing


@rare_kernel
def spare_lost_faces(world: World, p: int, count: int) -> None:
    """Take the dashpot from corners about to pass beyond the end of the face they touch.

    Where a corner could touch either of two faces and will be off the nearer one within a few steps, that face cannot
    stop it: a block that slides over the flush joint of two others would be hit by the side face of the second, with a
    dashpot at full size, as its corner is elastically a little lower than the next top.
    """
    for i in range(count):
        point = world.points[i]
        if point.beside < kinematics.IMPACT_STEPS * abs(point.closing):
            point.weight = 0.0
            damping.renew_dashpots(world.pairs[p])


@kernel
def shared_step(a: Record, b: Record, step: float) -> float:
    """Return the step (s) for the dashpots' own-force correction, longer where other pairs act on the same body.

    The correction knows this pair's change of force only. With p pairs that act alike on one body the others' part is
    missing; counting the own part p/2 times keeps the recurrence stable (world/step.py says how far) and changes
    nothing up to p = 2.
    """
    most = 2
    if a.inverse_mass > 0.0:
        most = max(most, a.pairs_before)
    if b.inverse_mass > 0.0:
        most = max(most, b.pairs_before)
    return 0.5 * most * step


@kernel
def has_new_neighbours(a: Record, b: Record, model: int) -> bool:
    """Return True if operators of a pair are void, since others bear its bodies now.

    Where particles touch, this is after the number of pairs on a body has changed, else when there are new sums; see
    inertia.py.
    """
    if model == SURFACE:
        return (a.sums_changed | b.sums_changed) != 0
    return (a.pairs_changed | b.pairs_changed) != 0


@rare_kernel
def damp(world: World, p: int, count: int, direction: int, pattern: int, ratio: float, step: float) -> None:
    """Add the dashpots of pair p to the forces of its points; `pattern` has a bit for every point that has one."""
    if count > 2:
        damp_many(world, p, count, direction, ratio, step)
        return
    operator = world.operators[p, direction]
    if damping.are_dashpots_due(world.pairs[p], direction):
        fill_operator(world, p, count, direction, pattern, ratio, step)
    one = world.points[0]
    if count == 1:
        one.force = damping.damp_one(operator, one.force, one.before, one.rate)
    else:
        two = world.points[1]
        one.force, two.force = damping.damp_two(
            operator, one.force, two.force, one.before, two.before, one.rate, two.rate
        )


@rare_kernel
def pieces_of(world: World, p: int, count: int, direction: int) -> tuple[inertia.Piece, inertia.Piece]:
    """Return what of both bodies the dashpots of a pair with one or two points stand for."""
    pair = world.pairs[p]
    a = world.bodies[pair.a]
    b = world.bodies[pair.b]
    one = world.points[0]
    two = world.points[count - 1]
    stiffness = count * pair.stiffness
    mean_a = 0.5 * (one.normal_arm_a + two.normal_arm_a)
    mean_b = 0.5 * (one.normal_arm_b + two.normal_arm_b)
    of_a = inertia.piece_of(a, stiffness, one.nx, one.ny, mean_a, direction)
    return of_a, inertia.piece_of(b, stiffness, one.nx, one.ny, mean_b, direction)


@rare_kernel
def fill_operator(world: World, p: int, count: int, direction: int, pattern: int, ratio: float, step: float) -> None:
    """Rebuild the operator of one or two points; a weight of a first step holds for this step only."""
    pair = world.pairs[p]
    a = world.bodies[pair.a]
    b = world.bodies[pair.b]
    operator = world.operators[p, direction]
    one = world.points[0]
    two = world.points[count - 1]
    half = 0.5 * step
    of_a, of_b = pieces_of(world, p, count, direction)
    m_one = kinematics.mutual_mass(one, one, of_a, of_b, direction)
    m_mixed = kinematics.mutual_mass(one, two, of_a, of_b, direction)
    m_two = kinematics.mutual_mass(two, two, of_a, of_b, direction)
    if direction == NORMAL and pair.slides != 0:
        values = world.interactions[a.contact_class, b.contact_class]
        m_one = m_mixed = m_two = damping.sliding_mass(
            m_one, kinematics.coupling(one, of_a, of_b), values.kinetic_friction, pair.slides
        )
    damping.keep_masses(operator, half, m_one, m_mixed, m_two)
    if pattern == 1:
        damping.fill_single(operator, 0, ratio, half, m_one, one.stiffness, one.weight)
    elif pattern != damping.BOTH:
        damping.fill_single(operator, 1, ratio, half, m_two, two.stiffness, two.weight)
    elif one.weight == two.weight and one.stiffness == two.stiffness:
        g = one.weight * 2.0 * ratio * one.stiffness**0.5
        damping.fill_alike(operator, g, half, m_one, m_mixed, m_two)
    else:
        damping.fill_different(operator, ratio, half, m_one, m_mixed, m_two, one, two)
    lasts = half > 0.0 and one.weight == 1.0 and two.weight == 1.0
    damping.keep_dashpots(pair, direction, pattern, damping.OPERATOR_LIFE if lasts else 0)


@rare_kernel
def damp_many(world: World, p: int, count: int, direction: int, ratio: float, step: float) -> None:
    """Add the dashpots of more than two points."""
    pair = world.pairs[p]
    damping.fill_mobility(world.bodies[pair.a], world.bodies[pair.b], world.matrices[damping.MOBILITY])
    damping.add_coupled_dashpots(world.points, count, direction, ratio, step, world.matrices)


@rare_kernel
def resolve_points(world: World, p: int, count: int, step: float, tally: Record) -> None:
    """Kinematics of all points; history where the set of contacts has changed."""
    pair = world.pairs[p]
    a = world.bodies[pair.a]
    b = world.bodies[pair.b]
    exponent = world.controls[0].exponent
    continuing = 0
    loses_face = False
    for i in range(count):
        point = world.points[i]
        kinematics.resolve_point(point, a, b, step)
        if exponent != laws.LINEAR:
            kinematics.weigh_onset(point, exponent)
        if i < pair.active:
            contact = world.contacts[p, i]
            continuing += 1 if contact.slot == point.slot and contact.face == point.face else 0
        loses_face = loses_face or point.beside < kinematics.IMPACT_STEPS * abs(point.closing)
    if continuing != count or count != pair.active:
        history.change_contacts(world, p, count, step, tally)
    if loses_face:
        spare_lost_faces(world, p, count)


@rare_kernel
def foresee_slip(pair: Record, point: Record, values: Record) -> None:
    """Note whether the only contact of a pair, which has just begun, will slide: whether shear outgrows friction."""
    drawn = values.shear_ratio * abs(point.slipping)
    damping.note_slip(pair, drawn > values.kinetic_friction * point.closing, point.slipping)


@rare_kernel
def normal_pass(world: World, p: int, count: int, values: Record, step: float) -> None:
    """Springs and dashpots along the normals."""
    exponent = world.controls[0].exponent
    pair = world.pairs[p]
    stiffness = pair.stiffness if world.controls[0].model == SURFACE else values.normal_stiffness
    for i in range(count):
        push_spring(world.points[i], world.contacts[p, i], exponent, stiffness)
    if count > 1:
        pair.slides = 0
    elif world.points[0].drawn < 1.0:
        foresee_slip(pair, world.points[0], values)
    if values.normal_damping > 0.0:
        damp(world, p, count, NORMAL, (1 << min(count, 2)) - 1, values.normal_damping, step)


@rare_kernel
def draw_springs(world: World, p: int, count: int, values: Record, before: float, tally: Record) -> int:
    """Clip the normal forces and stretch the shear springs; return the bits of the points that stick.

    Beyond two points only zero or not zero counts. `before` is the stiffness of corners in the step before.
    """
    exponent = world.controls[0].exponent
    sticking = 0
    for i in range(count):
        point = world.points[i]
        contact = world.contacts[p, i]
        of_spring = history.stiffness_before(contact, before, values, world.particles)
        old_stiffness = history.shear_stiffness_before(contact, of_spring, values, exponent)
        tally.dashpot += clip_tension(point, history.normal_loss(contact, of_spring, exponent))
        stiffness = values.shear_ratio * point.stiffness
        slip = point.slipping
        spring, point.limit, slides, friction_work = friction.draw_spring(
            values, stiffness, old_stiffness, contact.spring, slip, point.drawn, point.normal_force, point.slip_rate
        )
        tally.friction += friction_work
        point.lost = history.shear_loss(contact, old_stiffness)
        sticking |= 0 if slides else 1 << min(i, 30)
        point.stiffness = 0.0 if slides else stiffness
        point.before = contact.shear_force
        point.rate = point.slip_rate
        point.force = point.spring_force = stiffness * spring
        contact.spring = spring
        contact.depth = point.depth
        contact.normal_force = point.normal_force
    return sticking


@rare_kernel
def shear_pass(world: World, p: int, count: int, values: Record, before: float, step: float, tally: Record) -> None:
    """Clip the normal forces; springs with history along the tangents and dashpots where a point sticks."""
    sticking = draw_springs(world, p, count, values, before, tally)
    pair = world.pairs[p]
    if pair.sticking != sticking or sticking == 0:
        pair.shear_left = 0
    if sticking > 0 and values.shear_damping > 0.0:
        damp(world, p, count, SHEAR, sticking, values.shear_damping, step)
    for i in range(count):
        point = world.points[i]
        contact = world.contacts[p, i]
        force = friction.clip_to_cone(values, point.force, point.limit, point.normal_force, point.slip_rate)
        if count == 1 and point.normal_force > 0.0:
            damping.note_slip(pair, sticking == 0 or force != point.force, force)
        tally.dashpot += 0.5 * (point.lost + (force - point.spring_force)) * point.slipping
        contact.shear_force = point.force = force


@rare_kernel
def force_pass(world: World, p: int, count: int, action: Record) -> None:
    """Sum all forces of the pair.

    `force` is the resistance to slip of a ahead of b, along the tangent (-ny, nx). To it comes what a change of the
    stiffness does; see bearing.py.
    """
    pair = world.pairs[p]
    exponent = world.controls[0].exponent
    for i in range(count):
        point = world.points[i]
        along = point.force + laws.stored_energy(exponent, pair.slide, point.depth)
        couple = laws.stored_energy(exponent, pair.turn, point.depth)
        action.fx += point.nx * point.normal_force + point.ny * along
        action.fy += point.ny * point.normal_force - point.nx * along
        action.torque_a += point.normal_arm_a * point.normal_force - point.shear_arm_a * along - couple
        action.torque_b += point.normal_arm_b * point.normal_force - point.shear_arm_b * along - couple
    action.touches = 1


@rare_kernel
def clear_action(action: Record) -> None:
    """Set all sums to zero."""
    action.fx = 0.0
    action.fy = 0.0
    action.torque_a = 0.0
    action.torque_b = 0.0
    action.dashpot = 0.0
    action.friction = 0.0
    action.broken = 0.0
    action.touches = 0
    action.is_changed = 1
    action.asks = 0
    action.is_too_deep = 0


@rare_kernel
def pair_forces(world: World, p: int, step: float) -> None:
    """Find the contact points of pair p and write what it does into world.action.

    `step` is the length (s) of the drift that led here, zero for a first evaluation before any motion.
    """
    pair = world.pairs[p]
    action = world.action[0]
    clear_action(action)
    count = lasting_points(world, p, world.corners)
    if count == SEARCH:
        count = slivers.points_of_sliver(world, p, contact_points(world, p), world.corners)
    action.is_too_deep = depth.is_too_deep(world, p, count)
    model = world.controls[0].model
    action.asks = count != pair.active and model == SURFACE
    before = pair.stiffness
    if count == 0:
        if pair.active > 0:
            history.change_contacts(world, p, 0, step, action)
        return
    a = world.bodies[pair.a]
    b = world.bodies[pair.b]
    values = world.interactions[a.contact_class, b.contact_class]
    if has_new_neighbours(a, b, model) or world.controls[0].exponent != laws.LINEAR:
        damping.renew_dashpots(pair)
    resolve_points(world, p, count, step, action)
    if model == SURFACE:
        bearing.measure(world, p, count, values.normal_stiffness)
    shared = step if model == SURFACE else shared_step(a, b, step)
    normal_pass(world, p, count, values, shared)
    shear_pass(world, p, count, values, before, shared, action)
    force_pass(world, p, count, action)
    bearing.measure_soon(pair, world.points[0].slipping, step * (a.spin - b.spin), world.corners)
    history.keep_places(world, p, count, world.particles)

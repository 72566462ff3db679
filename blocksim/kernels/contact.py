"""Forces at the contact points of one pair: springs, dashpots, clipping, friction with history, energy booking.

The normal pass comes first, the tangential pass uses its forces for the Coulomb limit. Losses are booked where the
forces are applied, by the trapezoid rule over the drift between two evaluations, which is exactly the work that the
kicks do.
"""

import math

from blocksim.kernels.arrays import NORMAL, SHEAR, Record, World
from blocksim.kernels.coupled import MOBILITY, add_coupled_dashpots, fill_mobility
from blocksim.kernels.damping import add_dashpots
from blocksim.kernels.friction import coulomb_limit
from blocksim.kernels.history import change_contacts, keep_places
from blocksim.kernels.jit import kernel, rare_kernel
from blocksim.kernels.kinematics import DELASSUS, inverse_masses, resolve_point, weigh_onset
from blocksim.kernels.laws import elastic_force, has_constant_stiffness, tangent_stiffness
from blocksim.kernels.models import SURFACE

IMPACT_STEPS = 10.0  # an impact lasts some thirty steps; a face lost in a third of that cannot stop a corner


@kernel
def push_spring(point: Record, slot: Record, law: int, stiffness: float) -> None:
    """Set the normal spring force of a point and what its dashpot needs."""
    point.before = slot.normal_force
    point.rate = point.closing_rate
    point.stiffness = tangent_stiffness(law, stiffness * point.share, point.depth)
    point.force = elastic_force(law, stiffness * point.share, point.depth)
    point.spring_force = point.force


@kernel
def clip_tension(point: Record, slot: Record) -> float:
    """Contacts do not pull. Return the energy (J) that dashpot and clipping have taken during the last drift."""
    force = max(point.force, 0.0)
    loss = force - point.spring_force
    dissipated = 0.5 * (slot.normal_loss + loss) * point.closing
    point.normal_force = force
    slot.normal_force = force
    slot.normal_loss = loss
    slot.depth = point.depth
    slot.share = point.share
    return dissipated


@kernel
def draw_spring(point: Record, slot: Record, values: Record) -> float:
    """Stretch the shear spring by the last drift; the point slides where the spring alone exceeds the Coulomb limit.

    `point.stiffness` comes as the slope of the normal force and leaves as the shear stiffness k, or as zero where the
    point slides: then it gets no dashpot. Where k grows with the overlap (Hertz-Mindlin) the force is kept and the
    spring shortened; where k falls the spring is kept and the force falls with it (C. Thornton, J. Appl. Mech. 64
    (1997) 160-164). Both lose energy and neither creates any: F^2/2 (1/k0 - 1/k1) and (k0 - k1) s (s + ds)/2.

    Return the energy (J) lost to friction: the work over the last drift less what the spring has gained, exactly.
    """
    stiffness = values.shear_ratio * point.stiffness
    old = slot.spring
    old_stiffness = slot.shear_stiffness
    kept = old * (old_stiffness / stiffness) if stiffness > old_stiffness else old
    spring = kept + point.slipping * point.drawn
    point.limit = coulomb_limit(values, point.normal_force, point.slip_rate, stiffness * abs(spring))
    point.stiffness = stiffness
    if stiffness * abs(spring) > point.limit:
        spring = math.copysign(point.limit / stiffness, spring)
        point.stiffness = 0.0
    slot.spring = spring
    slot.shear_stiffness = stiffness
    point.before = slot.shear_force
    point.rate = point.slip_rate
    point.force = stiffness * spring
    old_force = old_stiffness * old
    return 0.5 * ((old_force + point.force) * point.slipping - point.force * spring + old_force * old)


@kernel
def clip_to_cone(point: Record, slot: Record, values: Record) -> float:
    """Clip spring and dashpot together to the Coulomb cone. Return the energy (J) lost to what is not spring force."""
    force = point.force
    if abs(force) > point.limit:
        limit = coulomb_limit(values, point.normal_force, point.slip_rate, abs(force))
        force = min(max(force, -limit), limit)
    loss = force - slot.shear_stiffness * slot.spring
    dissipated = 0.5 * (slot.shear_loss + loss) * point.slipping
    point.force = force
    slot.shear_force = force
    slot.shear_loss = loss
    return dissipated


@rare_kernel
def spare_lost_faces(world: World, p: int, count: int) -> None:
    """Take the dashpot from corners about to pass beyond the end of the face they touch.

    Where a corner could touch either of two faces and will be off the nearer one within a few steps, that face cannot
    stop it: a block that slides over the flush joint of two others would be hit by the side face of the second, with a
    dashpot at full size, as its corner is elastically a little lower than the next top.
    """
    for i in range(count):
        point = world.points[i]
        if point.beside < IMPACT_STEPS * abs(point.closing):
            point.weight = 0.0
            world.operators[p, NORMAL].left = 0
            world.operators[p, SHEAR].left = 0


@kernel
def shared_step(a: Record, b: Record, step: float) -> float:
    """Return the step (s) for the dashpots' own-force correction, longer where other pairs act on the same body.

    The correction knows this pair's change of force only. With p pairs that act alike on one body the others' part is
    missing; counting the own part p/2 times keeps the recurrence stable (world/stable_step.py says how far) and changes
    nothing up to p = 2.
    """
    most = 2
    if a.inverse_mass > 0.0:
        most = max(most, a.pairs_before)
    if b.inverse_mass > 0.0:
        most = max(most, b.pairs_before)
    return 0.5 * most * step


@kernel
def has_new_neighbours(a: Record, b: Record) -> bool:
    """Tell whether the number of pairs on a free body has changed, so that operators made with the old one are void."""
    return (a.pairs_changed == 1 and a.inverse_mass > 0.0) or (b.pairs_changed == 1 and b.inverse_mass > 0.0)


@kernel
def damp(world: World, p: int, count: int, direction: int, pattern: int, ratio: float, step: float) -> None:
    """Add the dashpots of pair p to the forces of its points; `pattern` has a bit for every point that has one."""
    operator = world.operators[p, direction]
    if count > 2:
        damp_many(world, p, count, direction, ratio, step)
        return
    if operator.left == 0:
        fill_delassus(world, p, count, direction)
    add_dashpots(world.points, count, pattern, ratio, step, operator, world.matrices)


@rare_kernel
def fill_delassus(world: World, p: int, count: int, direction: int) -> None:
    """Bring the inverse masses of one or two points up to date."""
    pair = world.pairs[p]
    a = world.bodies[pair.a]
    b = world.bodies[pair.b]
    inverse_masses(world.points, count, direction, a, b, world.matrices[DELASSUS])


@rare_kernel
def damp_many(world: World, p: int, count: int, direction: int, ratio: float, step: float) -> None:
    """Add the dashpots of more than two points."""
    pair = world.pairs[p]
    fill_mobility(world.bodies[pair.a], world.bodies[pair.b], world.matrices[MOBILITY])
    add_coupled_dashpots(world.points, count, direction, ratio, step, world.matrices)


@kernel
def normal_pass(world: World, p: int, count: int, a: Record, b: Record, values: Record, step: float) -> None:
    """Kinematics, then springs and dashpots along the normals."""
    points = world.points
    law = world.controls[0].law
    continuing = 0
    loses_face = False
    for i in range(count):
        point = points[i]
        slot = world.slots[p, point.slot]
        resolve_point(point, a, b, step)
        push_spring(point, slot, law, values.normal_stiffness)
        if not has_constant_stiffness(law):
            weigh_onset(point, law)
        continuing += 1 if slot.face == point.face else 0
        loses_face = loses_face or point.beside < IMPACT_STEPS * abs(point.closing)
    if continuing != count or count != world.pairs[p].active:
        change_contacts(world, p, count, step)
    if loses_face:
        spare_lost_faces(world, p, count)
    if values.normal_damping > 0.0:
        operator = world.operators[p, NORMAL]
        if has_new_neighbours(a, b) or not has_constant_stiffness(law):
            operator.left = 0
        damp(world, p, count, NORMAL, (1 << min(count, 2)) - 1, values.normal_damping, shared_step(a, b, step))


@kernel
def shear_pass(world: World, p: int, count: int, a: Record, b: Record, values: Record, step: float) -> None:
    """Clip the normal forces; springs with history along the tangents and dashpots where a point sticks."""
    points = world.points
    ledger = world.ledger[0]
    sticking = 0
    dashpot_work = 0.0
    friction_work = 0.0
    for i in range(count):
        point = points[i]
        slot = world.slots[p, point.slot]
        dashpot_work += clip_tension(point, slot)
        friction_work += draw_spring(point, slot, values)
        sticking |= 1 << min(i, 62) if point.stiffness > 0.0 else 0  # beyond two points only zero or not zero counts
    ledger.dashpot += dashpot_work
    ledger.friction += friction_work
    operator = world.operators[p, SHEAR]
    changes = has_new_neighbours(a, b) or not has_constant_stiffness(world.controls[0].law)
    if operator.pattern != sticking or sticking == 0 or changes:
        operator.left = 0
    if sticking > 0 and values.shear_damping > 0.0:
        damp(world, p, count, SHEAR, sticking, values.shear_damping, shared_step(a, b, step))


@kernel
def force_pass(world: World, p: int, count: int, a: Record, b: Record, values: Record) -> None:
    """Clip the shear forces and add all forces of the pair to the totals of both bodies.

    `force` is the resistance to slip of a ahead of b, along the tangent (-ny, nx).
    """
    fx = 0.0
    fy = 0.0
    torque_a = 0.0
    torque_b = 0.0
    dashpot_work = 0.0
    for i in range(count):
        point = world.points[i]
        dashpot_work += clip_to_cone(point, world.slots[p, point.slot], values)
        fx += point.nx * point.normal_force + point.ny * point.force
        fy += point.ny * point.normal_force - point.nx * point.force
        torque_a += point.normal_arm_a * point.normal_force - point.shear_arm_a * point.force
        torque_b += point.normal_arm_b * point.normal_force - point.shear_arm_b * point.force
    world.ledger[0].dashpot += dashpot_work
    a.fx += fx
    a.fy += fy
    a.torque += torque_a
    b.fx -= fx
    b.fy -= fy
    b.torque -= torque_b


@kernel
def pair_forces(world: World, p: int, count: int, step: float) -> None:
    """Add the forces of the `count` contact points found for pair p to the totals of its bodies.

    `step` is the length (s) of the drift that led here, zero for a first evaluation before any motion.
    """
    pair = world.pairs[p]
    a = world.bodies[pair.a]
    b = world.bodies[pair.b]
    values = world.interactions[a.contact_class, b.contact_class]
    a.pairs_now += 1
    b.pairs_now += 1
    normal_pass(world, p, count, a, b, values, step)
    shear_pass(world, p, count, a, b, values, step)
    force_pass(world, p, count, a, b, values)
    if world.controls[0].model != SURFACE:
        keep_places(world, p, count)

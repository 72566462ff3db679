"""Pairs whose contacts change, and those of models with particles: their points are found, and what they remember.

Here any number of points, in whatever way they were found; persistent_forces.py has the pairs whose one or two contacts
continue as they were, which is what nearly all pairs do at nearly all steps.

A contact pushes a corner out through the nearest face that it can touch. Beyond the middle of a thin body, or deeper
than the particles of a boundary reach, that would be the wrong way or none at all, and a block would come out on the
other side. So a run ends at the first overlap beyond a limit, that of the thinner of the two. While a pair touches, the
overlaps of its contacts are checked; where it does not, or particles may have lost one another, the overlap of the
shapes. No step takes a block far into another (world/step.py, broad_phase.py), so none is behind before it is found.
"""

from blocksim.kernels.common import tolerances
from blocksim.kernels.common.arrays import ALL, NORMAL, SHEAR, Record, World
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.explicit import bearing, damping, history, kinematics, sides, slivers
from blocksim.kernels.explicit.forces import NOTHING, Touch, forces_of, forces_of_many
from blocksim.kernels.explicit.models import KERNEL, SURFACE, contact_points
from blocksim.kernels.explicit.partition import keep


@rare_kernel
def spare_lost_faces(world: World, p: int, count: int) -> None:
    """Take the dashpot from corners about to pass beyond the end of the face they touch.

    Where a corner could touch either of two faces and will be off the nearer one within a few steps, that face cannot
    stop it: a block that slides over the flush joint of two others would be hit by the side face of the second, with a
    dashpot at full size, as its corner is elastically a little lower than the next top.
    """
    for i in range(count):
        point = world.points[i]
        if point.beside < tolerances.IMPACT_STEPS * abs(point.closing):
            point.weight = 0.0
            damping.renew_dashpots(world.pairs[p])


@kernel
def shared_step(a: Record, b: Record, step: float) -> float:
    """Return the step (s) for the dashpots' own-force correction, longer where other pairs act on the same body.

    The correction knows this pair's change of force only. With p pairs that act alike on one body the others' part is
    missing; counting the own part p/2 times keeps the recurrence stable (blocksim/world/README.md says how far) and
    changes nothing up to p = 2.
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
def resolve_points(world: World, p: int, count: int, step: float, tally: Record) -> None:
    """Kinematics of all points; history where the set of contacts has changed."""
    pair = world.pairs[p]
    a = world.bodies[pair.a]
    b = world.bodies[pair.b]
    continuing = 0
    loses_face = False
    for i in range(count):
        point = world.points[i]
        kinematics.resolve_point(point, a, b, step)
        if i < pair.active:
            contact = world.contacts[p, i]
            continuing += 1 if contact.slot == point.slot and contact.face == point.face else 0
        loses_face = loses_face or point.beside < tolerances.IMPACT_STEPS * abs(point.closing)
    if continuing != count or count != pair.active:
        history.change_contacts(world, p, count, step, tally)
    if loses_face:
        spare_lost_faces(world, p, count)


@rare_kernel
def penetration(world: World, pair: Record) -> float:
    """Return how deep (m) the bodies of a pair overlap; what lies behind a piece of ground does not overlap it."""
    a = world.bodies[pair.a]
    b = world.bodies[pair.b]
    is_ground = pair.b == world.bodies.size - 1
    if not is_ground and b.faces < ALL and b.cos * (a.y - b.y) - b.sin * (a.x - b.x) < b.half_y:
        return 0.0
    return -sides.widest_gap(a, b, is_ground, world.corners)[1]


@rare_kernel
def reach_of_contacts(world: World, pair: Record) -> float:
    """Return at which overlap (m) of the rectangles contacts may be lost, or act the wrong way."""
    controls = world.controls[0]
    if controls.model == SURFACE:
        return pair.limit
    reach = controls.support if controls.model == KERNEL else tolerances.ROWS_APART * controls.particle_size
    side = min(world.bodies[pair.a].least_width, world.bodies[pair.b].least_width)
    return min(reach, tolerances.MIDDLE * side)


@rare_kernel
def is_too_deep(world: World, p: int, count: int) -> bool:
    """Return True if pair p, whose `count` points have been found, overlaps too far."""
    pair = world.pairs[p]
    for i in range(count):
        if world.points[i].depth > pair.limit:
            return True
    if count > 0 and world.controls[0].model == SURFACE:
        return False
    return penetration(world, pair) > reach_of_contacts(world, pair)


@rare_kernel
def foresee_slip(pair: Record, point: Record, values: Record) -> None:
    """Note whether the only contact of a pair, which has just begun, will slide: whether shear outgrows friction."""
    drawn = values.shear_ratio * abs(point.slipping)
    damping.note_slip(pair, drawn > values.kinetic_friction * point.closing, point.slipping)


@rare_kernel
def pair_forces(world: World, p: int, step: float) -> None:
    """Find the contact points of pair p and write what it does into world.action.

    `step` is the length (s) of the drift that led here, zero for a first evaluation before any motion.
    """
    pair = world.pairs[p]
    action = world.action[0]
    keep(action, NOTHING, False)
    action.broken = 0.0
    action.is_changed = 1
    count = contact_points(world, p)
    if sides.has_polygons(world.corners):
        count = slivers.points_of_sliver(world, p, count)
    action.is_too_deep = is_too_deep(world, p, count)
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
    if has_new_neighbours(a, b, model):
        damping.renew_dashpots(pair)
    resolve_points(world, p, count, step, action)
    shared = step
    if model == SURFACE:
        bearing.measure(world, p, count, values.normal_stiffness)
    else:
        shared = shared_step(a, b, step)
    if count > 1:
        pair.slides = 0
    elif world.points[0].drawn < 1.0:
        foresee_slip(pair, world.points[0], values)
    if count > 2:
        effect = forces_of_many(world, p, count, before, step, shared)
    else:
        one = kinematics.point_of(world.points[0], b)
        two = kinematics.point_of(world.points[count - 1], b)
        first, second = world.contacts[p, 0], world.contacts[p, 1]
        touch = Touch(pair, a, b, values, first, second, world.operators[p, NORMAL], world.operators[p, SHEAR])
        exponent = world.controls[0].exponent
        effect = forces_of(
            touch, one, two, count == 2, before, step, shared, exponent, False, world.corners, world.particles
        )
    action.fx = effect.fx
    action.fy = effect.fy
    action.torque_a = effect.torque_a
    action.torque_b = effect.torque_b
    action.dashpot += effect.dashpot
    action.friction += effect.friction
    action.touches = 1
    history.keep_places(world, p, count, world.particles)

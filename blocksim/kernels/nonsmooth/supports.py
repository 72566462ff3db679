"""Prescribed motion: of the supports (the ground, its pieces, walls, fixed bodies) and of driven bodies."""

from blocksim.kernels.common.arrays import Record, World
from blocksim.kernels.common.driven import follow_pieces, pose_at, put, way_over
from blocksim.kernels.common.jit import rare_kernel
from blocksim.kernels.common.supports import displacement, is_driven, piece_at
from blocksim.kernels.nonsmooth.arrays import Nonsmooth
from blocksim.kernels.nonsmooth.parts import begin_of_part, end_of_part


@rare_kernel
def displacement_at(world: World, time: float) -> float:
    """Return the displacement (m) of the supports at a time (s) that is not before the current step."""
    return displacement(world.motion[piece_at(world.motion, world.clock[0].motion_piece, time)], time)


@rare_kernel
def drive(scene: Nonsmooth, number: int) -> None:
    """Give supports and driven bodies their velocity in substep `number`: displacement over time."""
    world = scene.world
    controls = world.controls[0]
    stepping = scene.contacts.stepping[0]
    h = stepping.substep
    begin = begin_of_part(scene) + number * h
    rate = (displacement_at(world, begin + h) - displacement_at(world, begin)) / h
    stepping.support_vx = controls.motion_x * rate
    stepping.support_vy = controls.motion_y * rate
    for one in world.moved:
        if is_driven(one):
            drive_own(scene, one, begin)
            continue
        state = scene.contacts.states[one.body]
        before = scene.contacts.before[one.body]
        state.vx = before.vx = stepping.support_vx
        state.vy = before.vy = stepping.support_vy


@rare_kernel
def drive_own(scene: Nonsmooth, one: Record, begin: float) -> None:
    """Give a driven body its velocity in the substep that begins at a time (s)."""
    h = scene.contacts.stepping[0].substep
    state = scene.contacts.states[one.body]
    before = scene.contacts.before[one.body]
    way = way_over(scene.world, one, begin, h)
    state.vx = before.vx = way.x / h
    state.vy = before.vy = way.y / h
    state.spin = before.spin = way.angle / h


@rare_kernel
def place_supports(scene: Nonsmooth) -> None:
    """End a step of supports and driven bodies, which is not counted yet: where they have to be, never summed up."""
    world = scene.world
    controls = world.controls[0]
    clock = world.clock[0]
    now = end_of_part(scene)
    clock.motion_piece = piece_at(world.motion, clock.motion_piece, now)
    moved = displacement(world.motion[clock.motion_piece], now)
    stepping = scene.contacts.stepping[0]
    stepping.support_x = controls.motion_x * moved
    stepping.support_y = controls.motion_y * moved
    for one in world.moved:
        if is_driven(one):
            place_driven(scene, one, now)
            continue
        body = world.bodies[one.body]
        state = scene.contacts.states[one.body]
        body.x = one.x + stepping.support_x
        body.y = one.y + stepping.support_y
        body.vx = state.vx
        body.vy = state.vy
        state.dx = 0.0
        state.dy = 0.0


@rare_kernel
def place_driven(scene: Nonsmooth, one: Record, time: float) -> None:
    """End a step of one driven body, at a time (s)."""
    world = scene.world
    body = world.bodies[one.body]
    state = scene.contacts.states[one.body]
    follow_pieces(world, one, time)
    put(body, pose_at(world, one, time))
    body.vx = state.vx
    body.vy = state.vy
    body.spin = state.spin
    state.dx = 0.0
    state.dy = 0.0
    state.turned = 0.0

"""Prescribed motion of the supports: the ground, its pieces, walls and all fixed bodies together."""

from blocksim.kernels.arrays import World
from blocksim.kernels.jit import rare_kernel
from blocksim.kernels.nonsmooth.arrays import Nonsmooth
from blocksim.kernels.support import displacement, has_motion, piece_at


@rare_kernel
def displacement_at(world: World, time: float) -> float:
    """Return the displacement (m) of the supports at a time (s) that is not before the step under way."""
    return displacement(world.motion[piece_at(world.motion, world.clock[0].motion_piece, time)], time)


@rare_kernel
def drive(scene: Nonsmooth, number: int) -> None:
    """Give the supports their velocity in substep `number` of the step under way: displacement over time."""
    world = scene.world
    controls = world.controls[0]
    stepping = scene.contacts.stepping[0]
    if not has_motion(controls):
        return
    h = stepping.substep
    begin = world.clock[0].steps * controls.step + number * h
    rate = (displacement_at(world, begin + h) - displacement_at(world, begin)) / h
    stepping.support_vx = controls.motion_x * rate
    stepping.support_vy = controls.motion_y * rate
    for one in world.moved:
        line = scene.contacts.lines[one.body]
        before = scene.contacts.before[one.body]
        line.vx = before.vx = stepping.support_vx
        line.vy = before.vy = stepping.support_vy


@rare_kernel
def place_supports(scene: Nonsmooth) -> None:
    """End a step of the supports, which is not counted yet: exactly where they have to be, never summed up."""
    world = scene.world
    controls = world.controls[0]
    clock = world.clock[0]
    if not has_motion(controls):
        return
    now = (clock.steps + 1) * controls.step
    clock.motion_piece = piece_at(world.motion, clock.motion_piece, now)
    moved = displacement(world.motion[clock.motion_piece], now)
    stepping = scene.contacts.stepping[0]
    stepping.support_x = controls.motion_x * moved
    stepping.support_y = controls.motion_y * moved
    for one in world.moved:
        body = world.bodies[one.body]
        line = scene.contacts.lines[one.body]
        body.x = one.x + stepping.support_x
        body.y = one.y + stepping.support_y
        body.vx = line.vx
        body.vy = line.vy
        line.dx = 0.0
        line.dy = 0.0

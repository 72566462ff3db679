"""Prescribed motion: of the supports (the ground, its pieces, walls, fixed bodies) and of driven bodies."""

from blocksim.kernels.arrays import Record, World
from blocksim.kernels.driven import follow_pieces, pose_at, put, way_over
from blocksim.kernels.jit import rare_kernel
from blocksim.kernels.nonsmooth.arrays import Nonsmooth
from blocksim.kernels.nonsmooth.parts import begin_of_part, end_of_part
from blocksim.kernels.support import displacement, has_motion, is_driven, piece_at


@rare_kernel
def displacement_at(world: World, time: float) -> float:
    """Return the displacement (m) of the supports at a time (s) that is not before the step under way."""
    return displacement(world.motion[piece_at(world.motion, world.clock[0].motion_piece, time)], time)


@rare_kernel
def drive(scene: Nonsmooth, number: int) -> None:
    """Give supports and driven bodies their velocity in substep `number` of the step under way: way over time."""
    world = scene.world
    controls = world.controls[0]
    stepping = scene.contacts.stepping[0]
    stepping.is_shaken = has_motion(controls)
    if not stepping.is_shaken:
        return
    h = stepping.substep
    begin = begin_of_part(scene) + number * h
    rate = (displacement_at(world, begin + h) - displacement_at(world, begin)) / h
    stepping.support_vx = controls.motion_x * rate
    stepping.support_vy = controls.motion_y * rate
    for one in world.moved:
        if is_driven(one):
            drive_own(scene, one, begin)
            continue
        line = scene.contacts.lines[one.body]
        before = scene.contacts.before[one.body]
        line.vx = before.vx = stepping.support_vx
        line.vy = before.vy = stepping.support_vy


@rare_kernel
def drive_own(scene: Nonsmooth, one: Record, begin: float) -> None:
    """Give a driven body its velocity in the substep that begins at a time (s)."""
    h = scene.contacts.stepping[0].substep
    line = scene.contacts.lines[one.body]
    before = scene.contacts.before[one.body]
    way = way_over(scene.world, one, begin, h)
    line.vx = before.vx = way.x / h
    line.vy = before.vy = way.y / h
    line.spin = before.spin = way.angle / h


@rare_kernel
def place_supports(scene: Nonsmooth) -> None:
    """End a step of supports and driven bodies, which is not counted yet: where they have to be, never summed up."""
    world = scene.world
    controls = world.controls[0]
    clock = world.clock[0]
    if not has_motion(controls):
        return
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
        line = scene.contacts.lines[one.body]
        body.x = one.x + stepping.support_x
        body.y = one.y + stepping.support_y
        body.vx = line.vx
        body.vy = line.vy
        line.dx = 0.0
        line.dy = 0.0


@rare_kernel
def place_driven(scene: Nonsmooth, one: Record, time: float) -> None:
    """End a step of one driven body, at a time (s)."""
    world = scene.world
    body = world.bodies[one.body]
    line = scene.contacts.lines[one.body]
    follow_pieces(world, one, time)
    put(body, pose_at(world, one, time))
    body.vx = line.vx
    body.vy = line.vy
    body.spin = line.spin
    line.dx = 0.0
    line.dy = 0.0
    line.turned = 0.0

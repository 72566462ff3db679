"""Bodies with a prescribed motion of their own: shifted along a line and turned about a point, as functions of time.

With the shift s along the unit vector d, the turn q about the point p, and the centre c when the run began, the centre
is at p + R(q) (c - p) + s d, and the body is turned by q. Both functions are piecewise cubic.
"""

import math
from typing import NamedTuple

from blocksim.kernels.common.arrays import Record, Records, World
from blocksim.kernels.common.geometry import place_corners
from blocksim.kernels.common.jit import rare_kernel
from blocksim.kernels.common.supports import acceleration, displacement, is_driven, rate


class Pose(NamedTuple):
    """Place of a centre (m) and angle (rad)."""

    x: float
    y: float
    angle: float


@rare_kernel
def path_piece(motion: Records, piece: int, end: int, time: float) -> int:
    """Return the piece of one path that holds at a time (s), sought from `piece` to before `end`."""
    while piece + 1 < end and motion[piece + 1].start <= time:
        piece += 1
    return piece


@rare_kernel
def shift_at(world: World, one: Record, time: float) -> Record:
    """Return the piece of the shift of a driven body that holds at a time (s) that is not before the current step."""
    return world.motion[path_piece(world.motion, one.shift, one.shift_end, time)]


@rare_kernel
def turn_at(world: World, one: Record, time: float) -> Record:
    """Return the piece of the turn of a driven body that holds at a time (s) that is not before the current step."""
    return world.motion[path_piece(world.motion, one.turn, one.turn_end, time)]


@rare_kernel
def pose_at(world: World, one: Record, time: float) -> Pose:
    """Return where a driven body is at a time (s) that is not before the current step."""
    shift = displacement(shift_at(world, one, time), time)
    turn = displacement(turn_at(world, one, time), time)
    rx = one.x - one.about_x
    ry = one.y - one.about_y
    lost = math.cos(turn) - 1.0  # without a turn bodies come back to the last bit
    sin = math.sin(turn)
    x = one.x + (lost * rx - sin * ry) + one.along_x * shift
    y = one.y + (lost * ry + sin * rx) + one.along_y * shift
    return Pose(x, y, one.angle + turn)


@rare_kernel
def way_over(world: World, one: Record, begin: float, step: float) -> Pose:
    """Return how far a driven body comes from `begin` (s) on within `step` (s)."""
    then = pose_at(world, one, begin)
    now = pose_at(world, one, begin + step)
    return Pose(now.x - then.x, now.y - then.y, now.angle - then.angle)


@rare_kernel
def put(body: Record, pose: Pose) -> None:
    """Bring a body to a pose."""
    body.x = pose.x
    body.y = pose.y
    body.angle = pose.angle
    body.cos = math.cos(pose.angle)
    body.sin = math.sin(pose.angle)
    place_corners(body)


@rare_kernel
def follow_pieces(world: World, one: Record, time: float) -> None:
    """Have pieces of a driven body sought from those on that hold at a time (s)."""
    one.shift = path_piece(world.motion, one.shift, one.shift_end, time)
    one.turn = path_piece(world.motion, one.turn, one.turn_end, time)


@rare_kernel
def move_driven(world: World, step: float) -> None:
    """Bring all driven bodies to the end of the current drift: poses exact, velocities those of the drift."""
    before = world.clock[0].steps * world.controls[0].step
    for one in world.moved:
        if not is_driven(one):
            continue
        body = world.bodies[one.body]
        follow_pieces(world, one, before)
        if step > 0.0:
            way = way_over(world, one, before, step)
            body.vx = way.x / step
            body.vy = way.y / step
            body.spin = way.angle / step
        else:
            note_rates(world, one, body, before)
        put(body, pose_at(world, one, before + step))
        note_accelerations(world, one, body, before + step)


@rare_kernel
def note_rates(world: World, one: Record, body: Record, time: float) -> None:
    """Give a driven body the velocity that it has at a time (s)."""
    pose = pose_at(world, one, time)
    shift = shift_at(world, one, time)
    spin = rate(turn_at(world, one, time), time)
    moved = displacement(shift, time)
    speed = rate(shift, time)
    body.spin = spin
    body.vx = one.along_x * speed - spin * (pose.y - one.about_y - one.along_y * moved)
    body.vy = one.along_y * speed + spin * (pose.x - one.about_x - one.along_x * moved)


@rare_kernel
def note_accelerations(world: World, one: Record, body: Record, time: float) -> None:
    """Give a driven body the accelerations that it has at a time (s), as contacts predict velocities with them."""
    pose = pose_at(world, one, time)
    shift = shift_at(world, one, time)
    turn = turn_at(world, one, time)
    moved = displacement(shift, time)
    spin = rate(turn, time)
    rx = pose.x - one.about_x - one.along_x * moved
    ry = pose.y - one.about_y - one.along_y * moved
    change = acceleration(shift, time)
    body.spin_rate = acceleration(turn, time)
    body.ax = one.along_x * change - body.spin_rate * ry - spin * spin * rx
    body.ay = one.along_y * change + body.spin_rate * rx - spin * spin * ry


@rare_kernel
def tally_driven(world: World, step: float) -> None:
    """Tally the work that contacts have done on driven bodies over the last drift, as tally_support does.

    Clears the totals.
    """
    total = 0.0
    for before in world.moved:
        if not is_driven(before):
            continue
        body = world.bodies[before.body]
        total += (before.fx + body.fx) * body.vx + (before.fy + body.fy) * body.vy
        total += (before.torque + body.torque) * body.spin
        before.fx = body.fx
        before.fy = body.fy
        before.torque = body.torque
        body.fx = 0.0
        body.fy = 0.0
        body.torque = 0.0
        body.pairs_now = 0
    world.ledger[0].to_support += 0.5 * step * total

"""Prescribed motion of the support: the ground, its pieces, walls and all fixed bodies together; and of driven bodies.

Bodies with a prescribed motion of their own: shifted along a line and turned about a point, as functions of time.

With the shift s along the unit vector d, the turn q about the point p, and the centre c when the run began, the centre
is at p + R(q) (c - p) + s d, and the body is turned by q. Both functions are piecewise cubic.
"""

import math
from typing import NamedTuple

from blocksim.kernels.common import arrays, jit, shapes


@jit.kernel
def has_motion(controls: arrays.Record) -> bool:
    """Return True if the support moves at all, or any body is driven."""
    return controls.motion_x != 0.0 or controls.motion_y != 0.0 or controls.driven != 0


@jit.kernel
def is_driven(one: arrays.Record) -> bool:
    """Return True for the record of a body with a motion of its own, among those that move."""
    return one.shift_end > 0


@jit.rare_kernel
def piece_at(motion: arrays.Records, piece: int, end: int, time: float) -> int:
    """Return the piece of a path that holds at a time (s), sought from `piece` to before `end`."""
    while piece + 1 < end and motion[piece + 1].start <= time:
        piece += 1
    return piece


@jit.rare_kernel
def displacement(piece: arrays.Record, time: float) -> float:
    """Return the displacement (m) at a time (s)."""
    t = time - piece.start
    return piece.c0 + t * (piece.c1 + t * (piece.c2 + t * piece.c3))


@jit.rare_kernel
def rate(piece: arrays.Record, time: float) -> float:
    """Return the velocity (m/s) at a time (s)."""
    t = time - piece.start
    return piece.c1 + t * (2.0 * piece.c2 + 3.0 * t * piece.c3)


@jit.rare_kernel
def acceleration(piece: arrays.Record, time: float) -> float:
    """Return the acceleration (m/s2) at a time (s)."""
    return 2.0 * piece.c2 + 6.0 * piece.c3 * (time - piece.start)


@jit.rare_kernel
def move_support(world: arrays.World, step: float) -> None:
    """Bring everything that moves with the support to the end of the current drift.

    Positions are exact at every step, never summed up. The velocity is that of the drift, displacement over time, as
    the contacts want it: all relative displacements of the drift are exact.
    """
    controls = world.controls[0]
    clock = world.clock[0]
    before = clock.steps * controls.step
    now = before + step
    clock.motion_piece = piece_at(world.motion, clock.motion_piece, world.motion.size, before)
    last = displacement(world.motion[clock.motion_piece], before)
    piece = world.motion[piece_at(world.motion, clock.motion_piece, world.motion.size, now)]
    moved = displacement(piece, now)
    speed = (moved - last) / step if step > 0.0 else rate(piece, now)
    change = acceleration(piece, now)
    for base in world.moved:
        if is_driven(base):
            break
        body = world.bodies[base.body]
        body.x = base.x + controls.motion_x * moved
        body.y = base.y + controls.motion_y * moved
        body.vx = controls.motion_x * speed
        body.vy = controls.motion_y * speed
        body.ax = controls.motion_x * change
        body.ay = controls.motion_y * change


@jit.rare_kernel
def is_support_at_rest(world: arrays.World) -> bool:
    """Return True if the motion of the support and of all driven bodies is over, or there is none."""
    time = world.clock[0].steps * world.controls[0].step
    for one in world.moved:
        if is_driven(one) and time < one.rest_time:
            return False
    last = world.motion[world.motion.size - 1]
    is_constant = last.c1 == 0.0 and last.c2 == 0.0 and last.c3 == 0.0
    return is_constant and time >= last.start


class Pose(NamedTuple):
    """Place of a centre (m) and angle (rad)."""

    x: float
    y: float
    angle: float


@jit.rare_kernel
def pieces_at(world: arrays.World, one: arrays.Record, time: float) -> tuple[arrays.Record, arrays.Record]:
    """Return the pieces of shift and turn of a driven body that hold at a time (s) not before the current step."""
    shift = piece_at(world.motion, one.shift, one.shift_end, time)
    return world.motion[shift], world.motion[piece_at(world.motion, one.turn, one.turn_end, time)]


@jit.rare_kernel
def pose_at(world: arrays.World, one: arrays.Record, time: float) -> Pose:
    """Return where a driven body is at a time (s) that is not before the current step."""
    shift_piece, turn_piece = pieces_at(world, one, time)
    shift, turn = displacement(shift_piece, time), displacement(turn_piece, time)
    rx = one.x - one.about_x
    ry = one.y - one.about_y
    lost = math.cos(turn) - 1.0  # without a turn bodies come back to the last bit
    sin = math.sin(turn)
    x = one.x + (lost * rx - sin * ry) + one.along_x * shift
    y = one.y + (lost * ry + sin * rx) + one.along_y * shift
    return Pose(x, y, one.angle + turn)


@jit.rare_kernel
def way_over(world: arrays.World, one: arrays.Record, begin: float, step: float) -> Pose:
    """Return how far a driven body comes from `begin` (s) on within `step` (s)."""
    then = pose_at(world, one, begin)
    now = pose_at(world, one, begin + step)
    return Pose(now.x - then.x, now.y - then.y, now.angle - then.angle)


@jit.rare_kernel
def put(body: arrays.Record, pose: Pose) -> None:
    """Bring a body to a pose."""
    body.x = pose.x
    body.y = pose.y
    body.angle = pose.angle
    body.cos = math.cos(pose.angle)
    body.sin = math.sin(pose.angle)
    shapes.place_corners(body)


@jit.rare_kernel
def follow_pieces(world: arrays.World, one: arrays.Record, time: float) -> None:
    """Have pieces of a driven body sought from those on that hold at a time (s)."""
    one.shift = piece_at(world.motion, one.shift, one.shift_end, time)
    one.turn = piece_at(world.motion, one.turn, one.turn_end, time)


@jit.rare_kernel
def move_driven(world: arrays.World, step: float) -> None:
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


@jit.rare_kernel
def note_rates(world: arrays.World, one: arrays.Record, body: arrays.Record, time: float) -> None:
    """Give a driven body the velocity that it has at a time (s)."""
    pose = pose_at(world, one, time)
    shift, turn = pieces_at(world, one, time)
    spin = rate(turn, time)
    moved = displacement(shift, time)
    speed = rate(shift, time)
    body.spin = spin
    body.vx = one.along_x * speed - spin * (pose.y - one.about_y - one.along_y * moved)
    body.vy = one.along_y * speed + spin * (pose.x - one.about_x - one.along_x * moved)


@jit.rare_kernel
def note_accelerations(world: arrays.World, one: arrays.Record, body: arrays.Record, time: float) -> None:
    """Give a driven body the accelerations that it has at a time (s), as contacts predict velocities with them."""
    pose = pose_at(world, one, time)
    shift, turn = pieces_at(world, one, time)
    moved = displacement(shift, time)
    spin = rate(turn, time)
    rx = pose.x - one.about_x - one.along_x * moved
    ry = pose.y - one.about_y - one.along_y * moved
    change = acceleration(shift, time)
    body.spin_rate = acceleration(turn, time)
    body.ax = one.along_x * change - body.spin_rate * ry - spin * spin * rx
    body.ay = one.along_y * change + body.spin_rate * rx - spin * spin * ry


@jit.rare_kernel
def tally_moved(world: arrays.World, step: float, driven: bool) -> None:
    """Tally the work that contacts have done over the last drift on driven bodies, or on all others that move.

    By the trapezoid rule as all work. Clears the totals.
    """
    total = 0.0
    for before in world.moved:
        if is_driven(before) != driven:
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

"""Loads: forces on single bodies and accelerations of all free bodies, as functions of time and pose.

A load is a value over time (pieces of lines and cubics) and what it does per value. Nothing is kept from step to
step but the last force of each, for the trapezoid rule by which all work is tallied; so bits depend on time and pose
alone. A load on one body is evaluated by the thread that has the body; accelerations of all bodies by every thread for
its own.

An actuator is a spring and a dashpot between its point of a body and a head that moves along a line; its value is the
displacement of the head. Its force follows from pose and velocity, in the non-smooth scheme that before the kick: what
gravity and the last impulses add to it depends on the number of the substep, and would make the force do so too.

Potential energy is that in the gravity of the controls. What turned gravity does beyond that is work of a load.
"""

import math
from typing import NamedTuple

from blocksim.kernels.common import arrays, jit, shapes


class Pose(NamedTuple):
    """Where a body is and how it moves: centre (m), cosine and sine of its angle, velocity (m/s), spin (rad/s)."""

    x: float
    y: float
    cos: float
    sin: float
    vx: float
    vy: float
    spin: float


@jit.rare_kernel
def piece_at(world: arrays.World, load: arrays.Record, time: float) -> arrays.Record:
    """Return the piece of a load that holds at a time (s)."""
    low = load.first_piece
    high = load.last_piece
    while high - low > 1:
        middle = (low + high) // 2
        if world.load_pieces[middle].start <= time:
            low = middle
        else:
            high = middle
    return world.load_pieces[low]


@jit.rare_kernel
def value_at(world: arrays.World, load: arrays.Record, time: float) -> float:
    """Return the value of a load at a time (s): a factor, a level (m), a tilt (rad) or a displacement (m)."""
    piece = piece_at(world, load, time)
    since = time - piece.start
    return piece.value + since * (piece.rate + since * (0.5 * piece.acceleration + since * piece.jerk / 6.0))


@jit.rare_kernel
def acceleration_at(world: arrays.World, load: arrays.Record, time: float) -> tuple[float, float]:
    """Return the acceleration (m/s2) that a load gives all free bodies beyond gravity."""
    value = value_at(world, load, time)
    if load.kind == arrays.LOAD_TILT:
        controls = world.controls[0]
        x, y = load.base_x - load.fx * math.sin(value), load.base_y - load.fx * math.cos(value)
        return x - controls.gravity_x, y - controls.gravity_y
    return value * load.fx, value * load.fy


@jit.rare_kernel
def water_on(load: arrays.Record, level: float, pose: Pose) -> tuple[float, float]:
    """Return force (N) of water on a face along its inward normal, and where it acts: a fraction of the length.

    Depth goes linearly along the face, whose dry part is cut off: the exact integral over the wet one.
    """
    one_x = pose.x + pose.cos * load.x - pose.sin * load.y
    one_y = pose.y + pose.sin * load.x + pose.cos * load.y
    two_x = pose.x + pose.cos * load.end_x - pose.sin * load.end_y
    two_y = pose.y + pose.sin * load.end_x + pose.cos * load.end_y
    one = level - (load.up_x * one_x + load.up_y * one_y)
    two = level - (load.up_x * two_x + load.up_y * two_y)
    if one <= 0.0 and two <= 0.0:
        return 0.0, 0.5
    begin = one / (one - two) if one < 0.0 else 0.0
    end = one / (one - two) if two < 0.0 else 1.0
    first = max(one, 0.0)
    last = max(two, 0.0)
    mean = 0.5 * (first + last)
    centre = begin + (end - begin) * (first + 2.0 * last) / (3.0 * (first + last)) if mean > 0.0 else 0.5
    return load.unit_weight * mean * (end - begin), centre


@jit.rare_kernel
def thrust_of(load: arrays.Record, piece: arrays.Record, time: float, pose: Pose) -> float:
    """Return the force (N) of an actuator along its direction, given the piece of its displacement."""
    arm_x = pose.cos * load.x - pose.sin * load.y
    arm_y = pose.sin * load.x + pose.cos * load.y
    way = (pose.x + arm_x - load.base_x) * load.fx + (pose.y + arm_y - load.base_y) * load.fy
    speed = (pose.vx - pose.spin * arm_y) * load.fx + (pose.vy + pose.spin * arm_x) * load.fy
    since = time - piece.start
    head = piece.value + since * (piece.rate + since * (0.5 * piece.acceleration + since * piece.jerk / 6.0))
    rate = piece.rate + since * (piece.acceleration + 0.5 * since * piece.jerk)
    force = load.stiffness * (head - way) + load.damping * (rate - speed)
    return min(max(force, load.least), load.most)


@jit.rare_kernel
def speed_given(world: arrays.World, load: arrays.Record) -> float:
    """Return a bound (m/s) of the speed that an actuator gives any point of its body; zero of other loads.

    Its own point gets no faster than twice the head, which may turn back at once, and by all that the spring holds
    twice the force over the dashpot; a point elsewhere as much more as a force there accelerates it.
    """
    body = world.bodies[load.body]
    if load.kind != arrays.LOAD_ACTUATOR or load.damping == 0.0 or body.inverse_mass == 0.0:
        return 0.0
    arm = math.sqrt(load.x * load.x + load.y * load.y)
    own = body.inverse_mass + arm * arm * body.inverse_inertia
    farthest = body.inverse_mass + arm * body.radius * body.inverse_inertia
    force = math.sqrt(load.last_fx * load.last_fx + load.last_fy * load.last_fy)
    return 2.0 * (load.fastest + force / load.damping) * max(farthest / own, 1.0)


@jit.rare_kernel
def force_at(world: arrays.World, load: arrays.Record, time: float, pose: Pose) -> tuple[float, float, float]:
    """Return force (N) and torque about the centre (N m) of a load on its body."""
    value = value_at(world, load, time)
    along = 0.0
    size = value
    if load.kind == arrays.LOAD_WATER:
        size, along = water_on(load, value, pose)
    elif load.kind == arrays.LOAD_ACTUATOR:
        size = thrust_of(load, piece_at(world, load, time), time, pose)
    x = load.x + along * (load.end_x - load.x)
    y = load.y + along * (load.end_y - load.y)
    arm_x = pose.cos * x - pose.sin * y
    arm_y = pose.sin * x + pose.cos * y
    fx = size * load.fx
    fy = size * load.fy
    if load.turns:
        fx, fy = pose.cos * fx - pose.sin * fy, pose.sin * fx + pose.cos * fy
    if load.stays:
        arm_x = load.base_x - pose.x
        arm_y = load.base_y - pose.y
    return fx, fy, size * load.torque + arm_x * fy - arm_y * fx


@jit.rare_kernel
def accelerate(world: arrays.World, load: arrays.Record, first: int, last: int, time: float, step: float) -> None:
    """Add an acceleration of all to the free bodies from `first` to before `last`, and tally its work.

    `time` (s) is the end of that drift, `step` (s) its length.
    """
    ax, ay = acceleration_at(world, load, time)
    bx, by = acceleration_at(world, load, time - step)
    half = 0.5 * step
    for i in range(first, last):
        body = world.bodies[i]
        if body.inverse_mass > 0.0:
            body.fx += body.mass * ax
            body.fy += body.mass * ay
            work = half * body.mass * ((ax + bx) * body.vx + (ay + by) * body.vy)
            world.ledger[i // arrays.GROUP].to_loads -= work


@jit.rare_kernel
def push(world: arrays.World, load: arrays.Record, time: float, step: float) -> None:
    """Add a load on one body to its totals, and tally its work of the last drift as `accelerate` does."""
    body = world.bodies[load.body]
    pose = Pose(body.x, body.y, body.cos, body.sin, body.vx, body.vy, body.spin)
    fx, fy, torque = force_at(world, load, time, pose)
    work = (load.last_fx + fx) * body.vx + (load.last_fy + fy) * body.vy + (load.last_torque + torque) * body.spin
    world.ledger[load.body // arrays.GROUP].to_loads -= 0.5 * step * work
    load.work += 0.5 * step * work
    load.last_fx = fx
    load.last_fy = fy
    load.last_torque = torque
    body.fx += fx
    body.fy += fy
    body.torque += torque


@jit.rare_kernel
def push_bodies(world: arrays.World, first: int, last: int, time: float, step: float) -> None:
    """Add all loads to the totals of the bodies from `first` to before `last`, at the end of a drift of `step` (s)."""
    for load in world.loads:
        if load.kind >= arrays.LOAD_FORCE:
            if first <= load.body < last:
                push(world, load, time, step)
        else:
            accelerate(world, load, first, min(last, world.bodies.size - 1), time, step)


@jit.rare_kernel
def are_loads_steady(world: arrays.World) -> bool:
    """Return True if no load changes any more with time, or there is none."""
    return world.clock[0].steps * world.controls[0].step >= world.controls[0].loads_end


@jit.rare_kernel
def tally_actuators(
    world: arrays.World, lines: arrays.Records, before: arrays.Records, first: int, last: int, half: float
) -> None:
    """Tally the work of actuators on the bodies from `first` to before `last` in a substep of the non-smooth scheme.

    `half` (s) is one half of the kick.
    """
    for load in world.loads:
        if load.kind == arrays.LOAD_ACTUATOR and first <= load.body < last:
            line = lines[load.body]
            then = before[load.body]
            along = load.last_fx * (then.vx + line.vx) + load.last_fy * (then.vy + line.vy)
            load.work += half * (along + load.last_torque * (then.spin + line.spin))


@jit.rare_kernel
def accelerations(
    world: arrays.World,
    lines: arrays.Records,
    before: arrays.Records,
    pushes: arrays.Records,
    first: int,
    last: int,
    time: float,
) -> None:
    """Write what loads give the bodies from `first` to before `last` at a time (s).

    Their displacements are in `lines`, their velocities in `before`, those of the non-smooth scheme, as are `pushes`;
    what was there before is kept as the last.
    """
    for i in range(first, last):
        one = pushes[i]
        one.last_ax = one.ax
        one.last_ay = one.ay
        one.last_rate = one.rate
        one.ax = one.ay = one.rate = 0.0
    for load in world.loads:
        if load.kind < arrays.LOAD_FORCE:
            ax, ay = acceleration_at(world, load, time)
            for i in range(first, last):
                if lines[i].inverse_mass > 0.0:
                    pushes[i].ax += ax
                    pushes[i].ay += ay
        elif first <= load.body < last:
            add_force(world, load, lines[load.body], before[load.body], pushes[load.body], time)


@jit.rare_kernel
def add_force(
    world: arrays.World, load: arrays.Record, line: arrays.Record, then: arrays.Record, one: arrays.Record, time: float
) -> None:
    """Add what a load on one body gives it, at its place in the step so far, with its velocity before the kick."""
    body = world.bodies[load.body]
    cos, sin = shapes.turn(body.cos, body.sin, line.turned)
    pose = Pose(body.x + line.dx, body.y + line.dy, cos, sin, then.vx, then.vy, then.spin)
    fx, fy, torque = force_at(world, load, time, pose)
    load.last_fx = fx
    load.last_fy = fy
    load.last_torque = torque
    one.ax += line.inverse_mass * fx
    one.ay += line.inverse_mass * fy
    one.rate += line.inverse_inertia * torque

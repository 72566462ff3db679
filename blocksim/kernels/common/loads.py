"""Loads: forces on single bodies and accelerations of all free bodies, as functions of time and pose.

A load is a value over time (pieces of straight lines) and what it does per value. Nothing is kept from step to step but
the last force of each, for the trapezoid rule by which all work is tallied; so bits depend on time and pose alone. A
load on one body is evaluated by the thread that has the body; accelerations of all bodies by every thread for its own.

Potential energy is that in the gravity of the controls. What turned gravity does beyond that is work of a load.
"""

import math
from typing import NamedTuple

from blocksim.kernels.common import arrays, jit, shapes


class Pose(NamedTuple):
    """Where a body is: centre (m), cosine and sine of its angle."""

    x: float
    y: float
    cos: float
    sin: float


@jit.rare_kernel
def value_at(world: arrays.World, load: arrays.Record, time: float) -> float:
    """Return the value of a load at a time (s): a factor, a level (m) or a tilt (rad)."""
    low = load.first_piece
    high = load.last_piece
    while high - low > 1:
        middle = (low + high) // 2
        if world.load_pieces[middle].start <= time:
            low = middle
        else:
            high = middle
    piece = world.load_pieces[low]
    return piece.value + (time - piece.start) * piece.rate


@jit.rare_kernel
def acceleration_at(world: arrays.World, load: arrays.Record, time: float) -> tuple[float, float]:
    """Return the acceleration (m/s2) that a load gives all free bodies beyond gravity."""
    value = value_at(world, load, time)
    if load.kind == arrays.LOAD_TILT:
        controls = world.controls[0]
        return -load.fx * math.sin(value) - controls.gravity_x, -load.fx * math.cos(value) - controls.gravity_y
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
def force_at(world: arrays.World, load: arrays.Record, time: float, pose: Pose) -> tuple[float, float, float]:
    """Return force (N) and torque about the centre (N m) of a load on its body."""
    value = value_at(world, load, time)
    along = 0.0
    size = value
    if load.kind == arrays.LOAD_WATER:
        size, along = water_on(load, value, pose)
    x = load.x + along * (load.end_x - load.x)
    y = load.y + along * (load.end_y - load.y)
    arm_x = pose.cos * x - pose.sin * y
    arm_y = pose.sin * x + pose.cos * y
    fx = size * load.fx
    fy = size * load.fy
    if load.turns:
        fx, fy = pose.cos * fx - pose.sin * fy, pose.sin * fx + pose.cos * fy
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
    fx, fy, torque = force_at(world, load, time, Pose(body.x, body.y, body.cos, body.sin))
    work = (load.last_fx + fx) * body.vx + (load.last_fy + fy) * body.vy + (load.last_torque + torque) * body.spin
    world.ledger[load.body // arrays.GROUP].to_loads -= 0.5 * step * work
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
def accelerations(
    world: arrays.World, lines: arrays.Records, pushes: arrays.Records, first: int, last: int, time: float
) -> None:
    """Write what loads give the bodies from `first` to before `last` at a time (s), their displacements in `lines`.

    `lines` and `pushes` are those of the non-smooth scheme; what was there before is kept as the last.
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
            add_force(world, load, lines[load.body], pushes[load.body], time)


@jit.rare_kernel
def add_force(world: arrays.World, load: arrays.Record, line: arrays.Record, one: arrays.Record, time: float) -> None:
    """Add what a load on one body gives it, at its place in the step so far."""
    body = world.bodies[load.body]
    cos, sin = shapes.turn(body.cos, body.sin, line.turned)
    fx, fy, torque = force_at(world, load, time, Pose(body.x + line.dx, body.y + line.dy, cos, sin))
    one.ax += line.inverse_mass * fx
    one.ay += line.inverse_mass * fy
    one.rate += line.inverse_inertia * torque

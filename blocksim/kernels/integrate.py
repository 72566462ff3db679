"""Velocity Verlet: half a kick, a drift, forces, half a kick. Symplectic; position and velocity at the same times."""

import math

from blocksim.kernels.arrays import Record, Records, World
from blocksim.kernels.geometry import turn
from blocksim.kernels.jit import kernel, rare_kernel

PAIR_SHARE = 0.4  # of the skin, that a body may move before the pair list is made anew


@kernel
def kick_and_drift(bodies: Records, controls: Record, step: float, ledger: Record) -> bool:
    """Advance velocities by half a step, then positions and rotations by a full one; return whether pairs are due.

    Uses the accelerations of the last force evaluation. Books the weights' travel for the energy in play. The pair
    list is due when a corner may have moved 0.4 skins since it was made: two bodies use up 0.8 skins, the rest covers
    the drift that led here.
    """
    half = 0.5 * step
    limit = PAIR_SHARE * controls.skin
    travel_work = 0.0
    is_due = False
    for i in range(bodies.size - 1):
        body = bodies[i]
        body.vx += half * body.ax
        body.vy += half * body.ay
        body.spin += half * body.spin_rate
        dx = step * body.vx
        dy = step * body.vy
        turned = step * body.spin
        body.x += dx
        body.y += dy
        body.angle += turned
        body.cos, body.sin = turn(body.cos, body.sin, turned)
        travel_work += body.mass * abs(controls.gravity_x * dx + controls.gravity_y * dy)
        moved = abs(body.x - body.list_x) + abs(body.y - body.list_y)
        is_due = is_due or moved + body.radius * abs(body.angle - body.list_angle) > limit
    ledger.travel_work += travel_work
    return is_due


@rare_kernel
def renew_rotations(bodies: Records) -> None:
    """Recompute cosines and sines from the angles, so that round-off does not add up."""
    for i in range(bodies.size):
        body = bodies[i]
        body.cos = math.cos(body.angle)
        body.sin = math.sin(body.angle)


@kernel
def accelerate_and_kick(bodies: Records, controls: Record, step: float) -> None:
    """Turn gravity and the contact totals into accelerations and advance velocities by half a step with them.

    Fixed bodies and the ground have no acceleration. Clears the totals.
    """
    half = 0.5 * step
    for i in range(bodies.size):
        body = bodies[i]
        if body.inverse_mass > 0.0:
            body.ax = controls.gravity_x + body.inverse_mass * body.fx
            body.ay = controls.gravity_y + body.inverse_mass * body.fy
            body.spin_rate = body.inverse_inertia * body.torque
            body.vx += half * body.ax
            body.vy += half * body.ay
            body.spin += half * body.spin_rate
        body.pairs_changed = body.pairs_now != body.pairs_before
        body.pairs_before = body.pairs_now
        body.pairs_now = 0
        body.fx = 0.0
        body.fy = 0.0
        body.torque = 0.0


@rare_kernel
def kinetic_energy(world: World) -> float:
    """Return the kinetic energy (J) of all bodies."""
    total = 0.0
    for i in range(world.bodies.size - 1):
        body = world.bodies[i]
        total += body.mass * (body.vx**2 + body.vy**2) + body.inertia * body.spin**2
    return 0.5 * total

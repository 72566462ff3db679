"""Mechanics of single bodies, for every scheme: velocity Verlet, energies and speeds, and Coulomb's coefficient.

Velocity Verlet is kick, drift, forces, kick: symplectic, with position and velocity at the same times.
"""

import math

from blocksim.kernels.common import arrays, jit, shapes, tolerances


@jit.kernel
def kick(body: arrays.Record, step: float) -> None:
    """Advance the velocities of a body by half a step, with the accelerations of the last force evaluation."""
    half = 0.5 * step
    body.vx += half * body.ax
    body.vy += half * body.ay
    body.spin += half * body.spin_rate


@jit.kernel
def drift(body: arrays.Record, step: float) -> None:
    """Advance position and rotation of a body by a step."""
    turned = step * body.spin
    body.x += step * body.vx
    body.y += step * body.vy
    body.angle += turned
    body.cos, body.sin = shapes.turn(body.cos, body.sin, turned)
    shapes.place_corners(body)


@jit.kernel
def kick_and_drift(bodies: arrays.Records, first: int, last: int, step: float) -> None:
    """Start a step of the bodies from `first` to before `last`; the ground, the last of all, never moves by itself."""
    for i in range(first, min(last, bodies.size - 1)):
        kick(bodies[i], step)
        drift(bodies[i], step)


@jit.rare_kernel
def place_all_corners(bodies: arrays.Records) -> None:
    """Update the vectors to the corners of all bodies after their rotations changed; the ground has none."""
    for i in range(bodies.size - 1):
        shapes.place_corners(bodies[i])


@jit.rare_kernel
def renew_angles(bodies: arrays.Records) -> None:
    """Recompute cosines and sines from the angles, so that round-off does not add up."""
    for i in range(bodies.size):
        body = bodies[i]
        body.cos = math.cos(body.angle)
        body.sin = math.sin(body.angle)


@jit.rare_kernel
def renew_rotations(bodies: arrays.Records) -> None:
    """Do the same, and update the vectors to the corners."""
    renew_angles(bodies)
    place_all_corners(bodies)


@jit.kernel
def accelerate_and_kick(body: arrays.Record, controls: arrays.Record, step: float) -> None:
    """Turn gravity and contact totals of a body into accelerations, kick with them, and clear the totals.

    Fixed bodies and the ground have no acceleration; their totals are the support's affair.
    """
    if body.inverse_mass > 0.0:
        body.ax = controls.gravity_x + body.inverse_mass * body.fx
        body.ay = controls.gravity_y + body.inverse_mass * body.fy
        body.spin_rate = body.inverse_inertia * body.torque
        kick(body, step)
        body.pairs_changed = body.pairs_now != body.pairs_before
        body.sums_changed = 0
        body.pairs_before = body.pairs_now
        body.pairs_now = 0
        body.fx = 0.0
        body.fy = 0.0
        body.torque = 0.0


@jit.rare_kernel
def kinetic_energy(world: arrays.World) -> float:
    """Return the kinetic energy (J) of all bodies."""
    total = 0.0
    for i in range(world.bodies.size - 1):
        body = world.bodies[i]
        total += body.mass * (body.vx**2 + body.vy**2) + body.inertia * body.spin**2
    return 0.5 * total


@jit.rare_kernel
def potential_energy(world: arrays.World) -> float:
    """Return the energy (J) of all masses in the field of gravity, zero at the origin."""
    total = 0.0
    controls = world.controls[0]
    for i in range(world.bodies.size - 1):
        body = world.bodies[i]
        total -= body.mass * (controls.gravity_x * body.x + controls.gravity_y * body.y)
    return total


@jit.rare_kernel
def weights_power(world: arrays.World) -> float:
    """Return the power (W) of all weights, each counted positive: summed over time, the travel of the weights."""
    total = 0.0
    controls = world.controls[0]
    for i in range(world.bodies.size - 1):
        body = world.bodies[i]
        total += body.mass * abs(controls.gravity_x * body.vx + controls.gravity_y * body.vy)
    return total


@jit.rare_kernel
def fastest_point(bodies: arrays.Records) -> float:
    """Return an upper bound (m/s) of the speed of any point of any body; infinite when a state is not finite."""
    fastest = 0.0
    for i in range(bodies.size - 1):
        body = bodies[i]
        speed = math.sqrt(body.vx**2 + body.vy**2) + body.radius * abs(body.spin)
        if not math.isfinite(speed + body.x + body.y + body.angle):
            return math.inf
        fastest = max(fastest, speed)
    return fastest


@jit.kernel
def friction_coefficient(static: float, kinetic: float, transition_speed: float, speed: float) -> float:
    """Return mu(v) = mu_k + (mu_s - mu_k) exp(-|v|/v_s): static at rest, kinetic when sliding fast."""
    if static == kinetic or abs(speed) > tolerances.FULLY_KINETIC * transition_speed:
        return kinetic
    return kinetic + (static - kinetic) * math.exp(-abs(speed) / transition_speed)

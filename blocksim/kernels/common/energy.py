"""Energies that need no contacts and the power of the weights."""

from blocksim.kernels.common import arrays, jit


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

"""What all soils of a scene hold and have lost, and how fast they are."""

import math

from blocksim.kernels.common import arrays, jit
from blocksim.kernels.soil.arrays import Soils
from blocksim.kernels.soil.stress import invariants, strain_energy


@jit.rare_kernel
def survey(soils: Soils, world: arrays.World) -> tuple[float, float, float]:
    """Return highest speed (m/s), kinetic energy (J) and power of the weights (W), each counted positive.

    The speed is infinite where a number is not finite, or a list had no room.
    """
    fastest, kinetic, power = 0.0, 0.0, 0.0
    controls = world.controls[0]
    for i in range(soils.points.size):
        point = soils.points[i]
        mass = soils.kinds[soils.states[i].kind].mass
        squared = point.vx**2 + point.vy**2
        fastest = max(fastest, squared if math.isfinite(squared + point.x + point.y) else math.inf)
        kinetic += 0.5 * mass * squared
        power += mass * abs(controls.gravity_x * point.vx + controls.gravity_y * point.vy)
    if soils.controls[0].is_full:
        fastest = math.inf
    return math.sqrt(fastest), kinetic, power


@jit.rare_kernel
def measure_touches(soils: Soils, world: arrays.World) -> float:
    """Return the energy (J) in the springs between particles and bodies."""
    total = 0.0
    for e in range(soils.controls[0].touch_count):
        touch = soils.touches[e]
        kind = soils.states[touch.particle].kind
        values = soils.interactions[kind, world.bodies[touch.body].contact_class]
        squares = touch.depth * touch.depth + values.shear_ratio * touch.spring * touch.spring
        total += 0.5 * values.normal_stiffness * squares
    return total


@jit.rare_kernel
def measure(soils: Soils, world: arrays.World, row: arrays.Floats) -> None:
    """Write the energies (J) as in ENERGIES, then the mass (kg)."""
    row[:] = 0.0
    controls = world.controls[0]
    for i in range(soils.points.size):
        point, state = soils.points[i], soils.states[i]
        kind = soils.kinds[state.kind]
        total, deviator = invariants(state.sxx, state.syy, state.szz, state.sxy)
        row[0] += 0.5 * kind.mass * (point.vx**2 + point.vy**2)
        row[1] -= kind.mass * (controls.gravity_x * point.x + controls.gravity_y * point.y)
        row[2] += strain_energy(kind, total, deviator)
        row[10] += kind.mass
    row[3] = measure_touches(soils, world)
    for tally in soils.tallies:
        row[4] += tally.plastic
        row[5] += tally.viscosity
        row[6] += tally.dashpot
        row[7] += tally.friction
        row[8] += tally.settling
        row[9] += tally.ramp

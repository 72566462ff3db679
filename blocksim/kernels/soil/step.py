"""The stages of a step: kick and drift, lists where they are due, stress and forces, kick.

Velocity Verlet as for bodies; at the start, while gravity grows or contacts find their forces, velocities are damped.
"""

import math

from blocksim.kernels.common.arrays import Record, World
from blocksim.kernels.common.barrier import barrier
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.soil.arrays import GROUP, Soils
from blocksim.kernels.soil.contact import particles_of_thread
from blocksim.kernels.soil.gradient import correction, raw_gradient
from blocksim.kernels.soil.momentum import forces_on
from blocksim.kernels.soil.neighbours import (
    are_lists_due,
    lay_cells,
    list_neighbours,
    move_particles,
    sort_particles,
    travelled,
)
from blocksim.kernels.soil.stress import strain
from blocksim.kernels.soil.touches import make_touches, preload


@kernel
def share_of_gravity(soils: Soils, time: float) -> float:
    """Return which share of gravity acts on soil at a time (s)."""
    ramp = soils.controls[0].ramp
    return 1.0 if time >= ramp else time / ramp


@kernel
def kick(point: Record, state: Record, kind: Record, gx: float, gy: float, half: float, damped: float) -> float:
    """Advance the velocity of a particle by half a step (s); return the energy (J) lost to damping, a factor."""
    vx = point.vx + half * (gx + state.fx / kind.mass)
    vy = point.vy + half * (gy + state.fy / kind.mass)
    point.vx, point.vy = damped * vx, damped * vy
    return 0.5 * kind.mass * (1.0 - damped * damped) * (vx * vx + vy * vy)


@kernel
def damping_of(kind: Record, half: float, time: float) -> float:
    """Return by which factor damping slows particles down in half a step (s) at a time (s)."""
    return 1.0 / (1.0 + half * kind.settling) if time < kind.settled else 1.0


@rare_kernel
def start_group(soils: Soils, world: World, g: int, time: float, step: float) -> None:
    """Half a kick and the drift of the particles of a group; `time` (s) is that before the step."""
    controls = world.controls[0]
    tally = soils.tallies[g]
    half = 0.5 * step
    share = share_of_gravity(soils, time)
    missing = 1.0 - 0.5 * (share + share_of_gravity(soils, time + step))
    fastest = 0.0
    for i in range(GROUP * g, min(GROUP * (g + 1), soils.points.size)):
        point, state = soils.points[i], soils.states[i]
        kind = soils.kinds[state.kind]
        damped = damping_of(kind, half, time)
        lost = kick(point, state, kind, share * controls.gravity_x, share * controls.gravity_y, half, damped)
        tally.settling += lost
        tally.viscosity -= half * (state.drag_x * point.vx + state.drag_y * point.vy)
        if missing > 0.0:
            fall = controls.gravity_x * point.vx + controls.gravity_y * point.vy
            tally.ramp += missing * kind.mass * step * fall
        point.x += step * point.vx
        point.y += step * point.vy
        state.fx = 0.0
        state.fy = 0.0
        fastest = max(fastest, point.vx * point.vx + point.vy * point.vy)
    tally.fastest = math.sqrt(fastest)


@rare_kernel
def start(soils: Soils, world: World, k: int, step: float) -> None:
    """Half a kick, the drift, and new lists where they are due."""
    first, last = particles_of_thread(soils, world, k)
    time = world.shares[k].steps * world.controls[0].step - step
    for g in range(first // GROUP, (last + GROUP - 1) // GROUP):
        start_group(soils, world, g, time, step)
    barrier(world.team)
    travel = travelled(soils, world, step)
    is_due = are_lists_due(soils, travel)
    barrier(world.team)
    if k == 0:
        soils.controls[0].travel = 0.0 if is_due else travel
    if is_due:
        renew_lists(soils, world, k)


@rare_kernel
def renew_lists(soils: Soils, world: World, k: int) -> None:
    """Sort the particles, and make all lists anew."""
    if k == 0:
        lay_cells(soils)
        sort_particles(soils)
        move_particles(soils)
        make_touches(soils, world)
        if soils.controls[0].is_listed == 0:
            preload(soils, world)
        soils.controls[0].is_listed = 1
    barrier(world.team)
    first, last = particles_of_thread(soils, world, k)
    list_neighbours(soils, first, last)


@rare_kernel
def stress_group(soils: Soils, g: int, step: float) -> None:
    """Advance the stresses of the particles of a group; nothing that others read of them changes before."""
    tally = soils.tallies[g]
    for i in range(GROUP * g, min(GROUP * (g + 1), soils.points.size)):
        point, state = soils.points[i], soils.states[i]
        kind = soils.kinds[state.kind]
        ux, uy, wx, wy = raw_gradient(soils, i)
        bxx, bxy, byy = 1.0, 0.0, 1.0
        if kind.is_corrected:
            bxx, bxy, byy = correction(soils, i)
            ux, uy = ux * bxx + uy * bxy, ux * bxy + uy * byy
            wx, wy = wx * bxx + wy * bxy, wx * bxy + wy * byy
        tally.plastic += strain(state, kind, ux, uy, wx, wy, step)
        point.pxx = state.sxx * bxx + state.sxy * bxy
        point.pxy = state.sxx * bxy + state.sxy * byy
        point.pyx = state.sxy * bxx + state.syy * bxy
        point.pyy = state.sxy * bxy + state.syy * byy


@rare_kernel
def force_group(soils: Soils, g: int, step: float) -> None:
    """Add the forces between particles to those of a group."""
    tally = soils.tallies[g]
    half = 0.5 * step
    for i in range(GROUP * g, min(GROUP * (g + 1), soils.points.size)):
        point, state = soils.points[i], soils.states[i]
        fx, fy, drag_x, drag_y = forces_on(soils, i)
        state.fx += fx + drag_x
        state.fy += fy + drag_y
        state.drag_x = drag_x
        state.drag_y = drag_y
        tally.viscosity -= half * (drag_x * point.vx + drag_y * point.vy)


@rare_kernel
def flow(soils: Soils, _: Soils, world: World, k: int, step: float) -> None:
    """Let the particles of all soils act on one another."""
    first, last = particles_of_thread(soils, world, k)
    groups = range(first // GROUP, (last + GROUP - 1) // GROUP)
    for g in groups:
        stress_group(soils, g, step)
    barrier(world.team)
    for g in groups:
        force_group(soils, g, step)


@rare_kernel
def finish(soils: Soils, world: World, k: int, step: float) -> None:
    """Advance velocities by the other half of the kick."""
    first, last = particles_of_thread(soils, world, k)
    controls = world.controls[0]
    time = world.shares[k].steps * controls.step
    share = share_of_gravity(soils, time)
    half = 0.5 * step
    for i in range(first, last):
        point, state = soils.points[i], soils.states[i]
        kind = soils.kinds[state.kind]
        damped = damping_of(kind, half, time)
        lost = kick(point, state, kind, share * controls.gravity_x, share * controls.gravity_y, half, damped)
        soils.tallies[i // GROUP].settling += lost

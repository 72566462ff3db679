"""The stages of a step: kick and drift, lists where they are due, stress and forces, kick.

Velocity Verlet as for bodies; at the start, while gravity grows or contacts find their forces, velocities are damped.
"""

import math

from blocksim.kernels.common.arrays import Integers, Record, World
from blocksim.kernels.common.barrier import barrier
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.common.simd import fields_0, split, spread, write_fields_4
from blocksim.kernels.common.systems import part_of_thread
from blocksim.kernels.soil.arrays import CLUSTER, GROUP, Soils
from blocksim.kernels.soil.contact import particles_of_thread
from blocksim.kernels.soil.gradient import correction, raw_gradient
from blocksim.kernels.soil.momentum import forces_on
from blocksim.kernels.soil.neighbours import (
    are_lists_due,
    clusters_of_group,
    lay_cells,
    list_neighbours,
    move_particles,
    places_of,
    sort_particles,
    travelled,
)
from blocksim.kernels.soil.rows import balance_rows
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
            balance_rows(soils, world)
        soils.controls[0].is_listed = 1
    barrier(world.team)
    first, last = part_of_thread(soils.tallies.size, world, k)
    list_neighbours(soils, first, last)


@rare_kernel
def stress_particle(point: Record, state: Record, kind: Record, step: float) -> float:
    """Advance the stress of a particle by its gradient, which lies where its stress is to; return the energy (J) lost.

    That is what flow takes.
    """
    lost = strain(state, kind, point.pxx, point.pxy, point.pyx, point.pyy, step)
    point.pxx = state.sxx
    point.pxy = point.pyx = state.sxy
    point.pyy = state.syy
    return lost


@rare_kernel
def stress_corrected(
    point: Record,
    state: Record,
    kind: Record,
    halfway: tuple[float, float, float],
    now: tuple[float, float, float],
    step: float,
) -> float:
    """Do the same with corrected gradients: the gradient as half way through the step, forces as at the end of it."""
    bxx, bxy, byy = halfway
    ux, uy = point.pxx * bxx + point.pxy * bxy, point.pxx * bxy + point.pxy * byy
    wx, wy = point.pyx * bxx + point.pyy * bxy, point.pyx * bxy + point.pyy * byy
    lost = strain(state, kind, ux, uy, wx, wy, step)
    bxx, bxy, byy = now
    point.pxx = state.sxx * bxx + state.sxy * bxy
    point.pxy = state.sxx * bxy + state.sxy * byy
    point.pyx = state.sxy * bxx + state.syy * bxy
    point.pyy = state.sxy * bxy + state.syy * byy
    return lost


@kernel
def is_any_corrected(soils: Soils, c: int) -> bool:
    """Return True if the gradient of any particle of a cluster is corrected."""
    is_corrected = False
    for i in range(CLUSTER * c, min(CLUSTER * (c + 1), soils.points.size)):
        is_corrected = is_corrected or soils.kinds[soils.states[i].kind].is_corrected != 0
    return is_corrected


@rare_kernel
def correct_cluster(soils: Soils, c: int, near: Integers, step: float) -> float:
    """Advance the stresses of a cluster of which some are corrected by their gradients; return the energy (J) lost."""
    controls, points, lag = soils.controls[0], soils.points, 0.5 * step
    x, y, vx, vy = fields_0(None, points, places_of(soils, c))
    halfway = correction(controls, points, near, x, y, vx, vy, lag)
    now = correction(controls, points, near, x, y, vx, vy, 0.0)
    hxx, hxy, hyy = split(halfway[0]), split(halfway[1]), split(halfway[2])
    bxx, bxy, byy = split(now[0]), split(now[1]), split(now[2])
    lost = 0.0
    for m in range(min(CLUSTER, points.size - CLUSTER * c)):
        point, state = points[CLUSTER * c + m], soils.states[CLUSTER * c + m]
        kind = soils.kinds[state.kind]
        if kind.is_corrected:
            tensors = (hxx[m], hxy[m], hyy[m]), (bxx[m], bxy[m], byy[m])
            lost += stress_corrected(point, state, kind, tensors[0], tensors[1], step)
        else:
            lost += stress_particle(point, state, kind, step)
    return lost


@kernel
def stress_cluster(soils: Soils, c: int, near: Integers, step: float) -> float:
    """Advance the stresses of the particles of a cluster; return the energy (J) lost to flow.

    Until then their gradients lie where what neighbours feel of their stress is to: nobody reads that in this stage.
    """
    points, places = soils.points, places_of(soils, c)
    x, y, vx, vy = fields_0(None, points, places)
    gradients = raw_gradient(soils.controls[0], points, near, x, y, vx, vy, 0.5 * step)
    write_fields_4(None, points, places, spread(0.0) <= 0.0, gradients)
    if is_any_corrected(soils, c):
        return correct_cluster(soils, c, near, step)
    lost = 0.0
    for i in range(CLUSTER * c, min(CLUSTER * (c + 1), points.size)):
        state = soils.states[i]
        lost += stress_particle(points[i], state, soils.kinds[state.kind], step)
    return lost


@rare_kernel
def stress_group(soils: Soils, g: int, step: float) -> None:
    """Advance the stresses of the particles of a group; nothing that others read of them changes before."""
    begin = 0
    for c in clusters_of_group(soils, g):
        end = begin + soils.lengths[c]
        soils.tallies[g].plastic += stress_cluster(soils, c, soils.lists[g, begin:end], step)
        begin = end


@kernel
def force_cluster(soils: Soils, c: int, near: Integers) -> float:
    """Add the forces between particles to those of a cluster; return the power (W) of the viscosity."""
    lanes = forces_on(soils, near, places_of(soils, c))
    fx, fy, drag_x, drag_y = split(lanes[0]), split(lanes[1]), split(lanes[2]), split(lanes[3])
    power = 0.0
    for m in range(min(CLUSTER, soils.points.size - CLUSTER * c)):
        point, state = soils.points[CLUSTER * c + m], soils.states[CLUSTER * c + m]
        volume = soils.kinds[state.kind].volume
        state.drag_x = volume * drag_x[m]
        state.drag_y = volume * drag_y[m]
        state.fx += volume * fx[m] + state.drag_x
        state.fy += volume * fy[m] + state.drag_y
        power += state.drag_x * point.vx + state.drag_y * point.vy
    return power


@rare_kernel
def force_group(soils: Soils, g: int, step: float) -> None:
    """Add the forces between particles to those of a group."""
    begin = 0
    for c in clusters_of_group(soils, g):
        end = begin + soils.lengths[c]
        soils.tallies[g].viscosity -= 0.5 * step * force_cluster(soils, c, soils.lists[g, begin:end])
        begin = end


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

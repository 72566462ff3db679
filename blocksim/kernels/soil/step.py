"""The stages of a step: kick and drift, lists where they are due, stress and forces, kick.

Velocity Verlet as for bodies; at the start, while gravity grows or contacts find their forces, velocities are damped.

Velocity gradients from neighbours, raw or corrected.

With d = r_j - r_i, V the area of a particle of the first kind, f = -W'/r > 0 and grad_i W_ij = f d, the gradient is

    L = sum V (v_j - v_i) (x) f d B,    B = 1 (raw) or M^-1 with M = sum V f d (x) d (corrected; J. Bonet and
    T.-S. L. Lok, Comput. Methods Appl. Mech. Eng. 180 (1999) 97-115),

exact for linear fields where corrected. Forces (step.py) are the adjoint of it, with the same B.

The velocities are those of the drift, which runs from one end of a step to the other; gradients are taken half way, a
`lag` (s) before the end: the strain of a step is then that of the motion to second order, a turn makes none, and the
work of the stresses is that of the forces at both ends. At the end, a body that turns would grow by the square of the
angle of the step, and a collapse of a few metres a second would be off by half a per cent of its energy.

Each function deals with the four particles of a cluster, one a lane, and with one neighbour of the cluster after the
other; that a particle is its own neighbour adds zeros. Differences are taken the other way round, own values less those
of the neighbour, which changes no bit of the result: processors subtract a number in memory from four at once, but not
four from one, and the loops, which wait for nothing but registers, are up to 15 % faster.

Forces between particles: stress and artificial viscosity, each pair with exactly opposite forces.

With d, f and V as above, the volume W of a particle of the first kind, and P_i = (V_i / W) s B, the stress times the
correction and what share of W it is in,

    F_i = W sum V (P_i + P_j) f d,

the adjoint of the velocity gradient: sum F_i v_i = -sum V_i s_i : L_i, whatever B is. The artificial viscosity
(J. J. Monaghan, Annu. Rev. Astron. Astrophys. 30 (1992) 543-574, without the quadratic term) acts between particles
that approach one another. Both are odd in the particles bit by bit: momentum changes by round-off of the sums alone.
"""

import math

from blocksim.kernels.common import jit, systems, tolerances
from blocksim.kernels.common.arrays import Floats, Integers, Record, Records, World
from blocksim.kernels.common.barrier import barrier
from blocksim.kernels.common.simd import (
    Lanes,
    fields_0,
    fields_4,
    four,
    lesser,
    root,
    select,
    split,
    spread,
    write_fields_4,
)
from blocksim.kernels.soil import arrays, contact, neighbours, stress
from blocksim.kernels.sph.functions import wendland_fading, wendland_steepness


@jit.kernel
def raw_gradient(
    controls: Record, points: Records, near: Integers, x: Lanes, y: Lanes, vx: Lanes, vy: Lanes, lag: float
) -> tuple[Lanes, Lanes, Lanes, Lanes]:
    """Return dvx/dx, dvx/dy, dvy/dx and dvy/dy (1/s) at four places (m) with these velocities (m/s), a lag (s) ago."""
    inverse = 1.0 / controls.reach
    ux, uy, wx, wy = spread(0.0), spread(0.0), spread(0.0), spread(0.0)
    for k in range(near.size):
        other = points[near[k]]
        du, dw = vx - other.vx, vy - other.vy
        dx, dy = x - other.x - lag * du, y - other.y - lag * dw
        f = wendland_fading(root(dx * dx + dy * dy), inverse)
        fu, fw = f * du, f * dw
        ux = ux + fu * dx
        uy = uy + fu * dy
        wx = wx + fw * dx
        wy = wy + fw * dy
    scale = controls.area * wendland_steepness(controls.smoothing)
    return scale * ux, scale * uy, scale * wx, scale * wy


@jit.kernel
def correction(
    controls: Record, points: Records, near: Integers, x: Lanes, y: Lanes, vx: Lanes, vy: Lanes, lag: float
) -> tuple[Lanes, Lanes, Lanes]:
    """Return xx, xy and yy of the symmetric B (-) at the same places; one where neighbours are too few."""
    inverse, scale = 1.0 / controls.reach, controls.area * wendland_steepness(controls.smoothing)
    xx, xy, yy = spread(0.0), spread(0.0), spread(0.0)
    for k in range(near.size):
        other = points[near[k]]
        dx, dy = other.x - x - lag * (other.vx - vx), other.y - y - lag * (other.vy - vy)
        f = scale * wendland_fading(root(dx * dx + dy * dy), inverse)
        xx = xx + f * dx * dx
        xy = xy + f * dx * dy
        yy = yy + f * dy * dy
    least = 0.5 * (xx + yy) - root(0.25 * (xx - yy) * (xx - yy) + xy * xy)
    are_few = least < tolerances.LEAST_SPREAD
    determinant = select(are_few, 1.0, xx * yy - xy * xy)
    return (
        select(are_few, 1.0, yy / determinant),
        select(are_few, 0.0, -xy / determinant),
        select(are_few, 1.0, xx / determinant),
    )


@jit.kernel
def impedance_of(soils: arrays.Soils, i: int) -> float:
    """Return density times wave speed (kg/(m2 s)) of a particle."""
    impedance: float = soils.kinds[soils.states[i].kind].impedance
    return impedance


@jit.kernel
def forces_on(
    soils: arrays.Soils, near: Integers, places: tuple[int, int, int, int]
) -> tuple[Lanes, Lanes, Lanes, Lanes]:
    """Return force of the stresses (x and y) and of the viscosity (x and y) on four particles, in N/m3.

    That is, by volume; `near` are the neighbours of the four.
    """
    points, controls = soils.points, soils.controls[0]
    inverse, soft = 1.0 / controls.reach, tolerances.SOFTENING * controls.smoothing * controls.smoothing
    is_uniform = controls.is_uniform != 0
    i, j, k, m = places
    impedance = four(
        None, impedance_of(soils, i), impedance_of(soils, j), impedance_of(soils, k), impedance_of(soils, m)
    )
    x, y, vx, vy = fields_0(None, points, places)
    pxx, pxy, pyx, pyy = fields_4(None, points, places)
    fx, fy, drag_x, drag_y = spread(0.0), spread(0.0), spread(0.0), spread(0.0)
    for e in range(near.size):
        other = points[near[e]]
        dx, dy = x - other.x, y - other.y
        r2 = dx * dx + dy * dy
        f = wendland_fading(root(r2), inverse)
        gx, gy = f * dx, f * dy
        fx = fx - ((pxx + other.pxx) * gx + (pxy + other.pxy) * gy)
        fy = fy - ((pyx + other.pyx) * gx + (pyy + other.pyy) * gy)
        closing = lesser((vx - other.vx) * dx + (vy - other.vy) * dy, 0.0)
        mean = impedance if is_uniform else 0.5 * (impedance + impedance_of(soils, near[e]))
        q = mean * closing / (r2 + soft)
        drag_x = drag_x - q * gx
        drag_y = drag_y - q * gy
    both = controls.area * wendland_steepness(controls.smoothing)
    stiff = both * controls.viscosity * controls.smoothing
    return both * fx, both * fy, stiff * drag_x, stiff * drag_y


@jit.kernel
def share_of_gravity(soils: arrays.Soils, time: float) -> float:
    """Return which share of gravity acts on soil at a time (s)."""
    ramp = soils.controls[0].ramp
    return 1.0 if time >= ramp else time / ramp


@jit.kernel
def kick(point: Record, state: Record, kind: Record, gx: float, gy: float, half: float, damped: float) -> float:
    """Advance the velocity of a particle by half a step (s); return the energy (J) lost to damping, a factor."""
    vx = point.vx + half * (gx + state.fx / kind.mass)
    vy = point.vy + half * (gy + state.fy / kind.mass)
    point.vx, point.vy = damped * vx, damped * vy
    return 0.5 * kind.mass * (1.0 - damped * damped) * (vx * vx + vy * vy)


@jit.kernel
def damping_of(kind: Record, half: float, time: float) -> float:
    """Return by which factor damping slows particles down in half a step (s) at a time (s)."""
    return 1.0 / (1.0 + half * kind.settling) if time < kind.settled else 1.0


@jit.rare_kernel
def start_group(soils: arrays.Soils, world: World, g: int, time: float, step: float) -> None:
    """Half a kick and the drift of the particles of a group; `time` (s) is that before the step."""
    controls = world.controls[0]
    tally = soils.tallies[g]
    half = 0.5 * step
    share = share_of_gravity(soils, time)
    missing = 1.0 - 0.5 * (share + share_of_gravity(soils, time + step))
    fastest = 0.0
    for i in range(arrays.GROUP * g, min(arrays.GROUP * (g + 1), soils.points.size)):
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


@jit.rare_kernel
def start(soils: arrays.Soils, world: World, k: int, step: float) -> None:
    """Half a kick, the drift, and new lists where they are due."""
    first, last = contact.particles_of_thread(soils, world, k)
    time = world.shares[k].steps * world.controls[0].step - step
    for g in range(first // arrays.GROUP, (last + arrays.GROUP - 1) // arrays.GROUP):
        start_group(soils, world, g, time, step)
    barrier(world.team)
    travel = neighbours.travelled(soils, world, step)
    is_due = soils.controls[0].is_listed == 0 or not 2.0 * travel <= soils.controls[0].skin  # of two that approach
    barrier(world.team)
    if k == 0:
        soils.controls[0].travel = 0.0 if is_due else travel
    if is_due:
        renew_lists(soils, world, k)


@jit.rare_kernel
def renew_lists(soils: arrays.Soils, world: World, k: int) -> None:
    """Sort the particles, and make all lists anew."""
    if k == 0:
        neighbours.sort_particles(soils)
        contact.make_touches(soils, world)
        if soils.controls[0].is_listed == 0:
            contact.preload(soils, world)
            stress.balance_rows(soils, world)
        soils.controls[0].is_listed = 1
    barrier(world.team)
    first, last = systems.part_of_thread(soils.tallies.size, world, k)
    neighbours.list_neighbours(soils, first, last)


@jit.rare_kernel
def stress_particle(point: Record, state: Record, kind: Record, step: float) -> float:
    """Advance the stress of a particle by its gradient, which lies where its stress is to; return the energy (J) lost.

    That is what flow takes.
    """
    lost = stress.strain(state, kind, point.pxx, point.pxy, point.pyx, point.pyy, step)
    point.pxx = kind.share * state.sxx
    point.pxy = point.pyx = kind.share * state.sxy
    point.pyy = kind.share * state.syy
    return lost


@jit.rare_kernel
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
    lost = stress.strain(state, kind, ux, uy, wx, wy, step)
    bxx, bxy, byy = now
    point.pxx = kind.share * (state.sxx * bxx + state.sxy * bxy)
    point.pxy = kind.share * (state.sxx * bxy + state.sxy * byy)
    point.pyx = kind.share * (state.sxy * bxx + state.syy * bxy)
    point.pyy = kind.share * (state.sxy * bxy + state.syy * byy)
    return lost


@jit.kernel
def is_any_corrected(soils: arrays.Soils, c: int) -> bool:
    """Return True if the gradient of any particle of a cluster is corrected."""
    is_corrected = False
    for i in range(arrays.CLUSTER * c, min(arrays.CLUSTER * (c + 1), soils.points.size)):
        is_corrected = is_corrected or soils.kinds[soils.states[i].kind].is_corrected != 0
    return is_corrected


@jit.rare_kernel
def correct_cluster(soils: arrays.Soils, c: int, near: Integers, step: float) -> float:
    """Advance the stresses of a cluster of which some are corrected by their gradients; return the energy (J) lost."""
    controls, points, lag = soils.controls[0], soils.points, 0.5 * step
    x, y, vx, vy = fields_0(None, points, neighbours.places_of(soils, c))
    halfway = correction(controls, points, near, x, y, vx, vy, lag)
    now = correction(controls, points, near, x, y, vx, vy, 0.0)
    hxx, hxy, hyy = split(halfway[0]), split(halfway[1]), split(halfway[2])
    bxx, bxy, byy = split(now[0]), split(now[1]), split(now[2])
    lost = 0.0
    for m in range(min(arrays.CLUSTER, points.size - arrays.CLUSTER * c)):
        point, state = points[arrays.CLUSTER * c + m], soils.states[arrays.CLUSTER * c + m]
        kind = soils.kinds[state.kind]
        if kind.is_corrected:
            tensors = (hxx[m], hxy[m], hyy[m]), (bxx[m], bxy[m], byy[m])
            lost += stress_corrected(point, state, kind, tensors[0], tensors[1], step)
        else:
            lost += stress_particle(point, state, kind, step)
    return lost


@jit.kernel
def stress_cluster(soils: arrays.Soils, c: int, near: Integers, step: float) -> float:
    """Advance the stresses of the particles of a cluster; return the energy (J) lost to flow.

    Until then their gradients lie where what neighbours feel of their stress is to: nobody reads that in this stage.
    """
    points, places = soils.points, neighbours.places_of(soils, c)
    x, y, vx, vy = fields_0(None, points, places)
    gradients = raw_gradient(soils.controls[0], points, near, x, y, vx, vy, 0.5 * step)
    write_fields_4(None, points, places, spread(0.0) <= 0.0, gradients)
    if is_any_corrected(soils, c):
        return correct_cluster(soils, c, near, step)
    lost = 0.0
    for i in range(arrays.CLUSTER * c, min(arrays.CLUSTER * (c + 1), points.size)):
        state = soils.states[i]
        lost += stress_particle(points[i], state, soils.kinds[state.kind], step)
    return lost


@jit.rare_kernel
def stress_group(soils: arrays.Soils, g: int, step: float) -> None:
    """Advance the stresses of the particles of a group; nothing that others read of them changes before."""
    begin = 0
    for c in neighbours.clusters_of_group(soils, g):
        end = begin + soils.lengths[c]
        soils.tallies[g].plastic += stress_cluster(soils, c, soils.lists[g, begin:end], step)
        begin = end


@jit.kernel
def force_cluster(soils: arrays.Soils, c: int, near: Integers) -> float:
    """Add the forces between particles to those of a cluster; return the power (W) of the viscosity."""
    lanes = forces_on(soils, near, neighbours.places_of(soils, c))
    fx, fy, drag_x, drag_y = split(lanes[0]), split(lanes[1]), split(lanes[2]), split(lanes[3])
    power, volume = 0.0, soils.controls[0].volume
    for m in range(min(arrays.CLUSTER, soils.points.size - arrays.CLUSTER * c)):
        point, state = soils.points[arrays.CLUSTER * c + m], soils.states[arrays.CLUSTER * c + m]
        state.drag_x = volume * drag_x[m]
        state.drag_y = volume * drag_y[m]
        state.fx += volume * fx[m] + state.drag_x
        state.fy += volume * fy[m] + state.drag_y
        power += state.drag_x * point.vx + state.drag_y * point.vy
    return power


@jit.rare_kernel
def force_group(soils: arrays.Soils, g: int, step: float) -> None:
    """Add the forces between particles to those of a group."""
    begin = 0
    for c in neighbours.clusters_of_group(soils, g):
        end = begin + soils.lengths[c]
        soils.tallies[g].viscosity -= 0.5 * step * force_cluster(soils, c, soils.lists[g, begin:end])
        begin = end


@jit.rare_kernel
def flow(soils: arrays.Soils, _: arrays.Soils, world: World, k: int, step: float) -> None:
    """Let the particles of all soils act on one another."""
    first, last = contact.particles_of_thread(soils, world, k)
    groups = range(first // arrays.GROUP, (last + arrays.GROUP - 1) // arrays.GROUP)
    for g in groups:
        stress_group(soils, g, step)
    barrier(world.team)
    for g in groups:
        force_group(soils, g, step)


@jit.rare_kernel
def finish(soils: arrays.Soils, world: World, k: int, step: float) -> None:
    """Advance velocities by the other half of the kick."""
    first, last = contact.particles_of_thread(soils, world, k)
    controls = world.controls[0]
    time = world.shares[k].steps * controls.step
    share = share_of_gravity(soils, time)
    half = 0.5 * step
    for i in range(first, last):
        point, state = soils.points[i], soils.states[i]
        kind = soils.kinds[state.kind]
        damped = damping_of(kind, half, time)
        lost = kick(point, state, kind, share * controls.gravity_x, share * controls.gravity_y, half, damped)
        soils.tallies[i // arrays.GROUP].settling += lost


@jit.rare_kernel
def survey(soils: arrays.Soils, world: World) -> tuple[float, float, float]:
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
def measure_touches(soils: arrays.Soils, world: World) -> float:
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
def measure(soils: arrays.Soils, world: World, row: Floats) -> None:
    """Write the energies (J) as in ENERGIES, then the mass (kg)."""
    row[:] = 0.0
    controls = world.controls[0]
    for i in range(soils.points.size):
        point, state = soils.points[i], soils.states[i]
        kind = soils.kinds[state.kind]
        total, deviator = stress.invariants(state.sxx, state.syy, state.szz, state.sxy)
        row[0] += 0.5 * kind.mass * (point.vx**2 + point.vy**2)
        row[1] -= kind.mass * (controls.gravity_x * point.x + controls.gravity_y * point.y)
        row[2] += stress.strain_energy(kind, total, deviator)
        row[10] += kind.mass
    row[3] = measure_touches(soils, world)
    for tally in soils.tallies:
        row[4] += tally.plastic
        row[5] += tally.viscosity
        row[6] += tally.dashpot
        row[7] += tally.friction
        row[8] += tally.settling
        row[9] += tally.ramp

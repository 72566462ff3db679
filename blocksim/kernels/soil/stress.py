"""The constitutive law of a particle: hypoelastic, Jaumann's rate, Drucker and Prager's yield surface without dilation.

Stress is turned by the rotation of the step (Cayley's form, which keeps its size exactly), then isotropic elasticity
adds what the strain of the step gives, with the strain out of the plane zero, and what lies beyond

    f = (J2)^(1/2) + a I1 - k = 0

returns to it at the same pressure: the deviator is scaled by Y/(J2)^(1/2), Y = k - a I1, which is exact as the plastic
flow has no volume change. Where Y < 0 there is nothing but the apex, I1 = k/a.

Soil that is stretched beyond the apex opens: the volume strain that finds no stress is kept as that of gaps (the volume
correction of A. P. Tampubolon et al., ACM Trans. Graph. 36 (2017) 105). When it closes again, gaps take all but a
share of the compression. Without them, soil that has opened would be as stiff as ever from the first touch on: grains
that fly would bounce off one another like balls of rubber, and what has once opened would never be dense again.

In plane strain such a flow ends where s_zz is zero, as its rate is proportional to the deviator and has no component
out of the plane. So the failing stress lies midway, s_zz = (s_1 + s_2)/2, (J2)^(1/2) = |s_1 - s_2|/2 and
I1 = 3 (s_1 + s_2)/2: with a = sin(phi)/3 and k = c cos(phi) the surface is Mohr and Coulomb's.

Stresses of a geostatic start beside faces: those in which the rows of particles along a face are in equilibrium.

Next to a face the kernel is cut off, and a contact pushes the first row alone. With a_k what a particle has from a row
k spacings away (half of sum V f d (x) d across the face, a_1 + a_2 = 1/2), a row inside is in equilibrium where

    sum_k a_k/k (s_(i+k) - s_(i-k)) = 0,

which constant stresses solve and those that go as z^i, z + 1/z = -2 a_1/a_2. The first rows, which have no others on
one side, then want 1 - 2 z^i/(1 + z^2) times the stress inside, i = 1, 2, ...: 1.45, 0.89, 1.03 for this kernel. That
times all components leaves a stress on a yield surface without cohesion where it is, and balances what crosses these
rows along the face, too, as a row misses the same neighbours there. Otherwise rows would find their balance by a shock
that makes soil flow, and leaves more pressure sideways than it had (4.0 % with 20 rows, 3.0 % with 40).

Forces of corrected gradients are those of P = s B (step.py), B across the face one over the part of the kernel that
a row has: 1/2 of it, 1/2 + a_1, all. So P is what the stress is with raw gradients, and the stress across the face is
that times the part: 0.73, 0.75, 1.03 of the one inside. Along the face forces are in balance where the stress is that
inside, to 0.08 of the weight of a particle. Where the yield surface does not let the two differ so much, beside upright
faces without cohesion, the stress along the face is the largest that it allows, 0.87 and 0.90 of that inside; the rest
of the weight of these rows hangs on the others, which a soil of few columns shows as a K that is larger by this.

That is for rows that stand against an upright or level face as the lattice of a soil does.
"""

import math

from blocksim.kernels.common import arrays, jit, tolerances
from blocksim.kernels.soil.arrays import Soils
from blocksim.kernels.soil.contact import from_body, is_near

# Share of the work of closing gaps that soil gives back: as much as a contact with a body, exp(-pi/2) of the speed.
RESILIENCE = math.exp(-math.pi)


@jit.kernel
def invariants(sxx: float, syy: float, szz: float, sxy: float) -> tuple[float, float]:
    """Return I1 (Pa) and the root of J2 (Pa)."""
    total = sxx + syy + szz
    mean = total / 3.0
    dx, dy, dz = sxx - mean, syy - mean, szz - mean
    return total, math.sqrt(0.5 * (dx * dx + dy * dy + dz * dz) + sxy * sxy)


@jit.kernel
def strain_energy(kind: arrays.Record, total: float, deviator: float) -> float:
    """Return the elastic energy (J) of a particle with these invariants (Pa)."""
    return kind.volume * (total * total / (18.0 * kind.bulk) + deviator * deviator / (2.0 * kind.shear))


@jit.kernel
def turned(sxx: float, syy: float, sxy: float, angle: float) -> tuple[float, float, float]:
    """Return a stress (Pa) turned with its body by a small angle (rad), counter-clockwise positive."""
    q = 0.5 * angle
    scale = 1.0 / (1.0 + q * q)
    c, s = (1.0 - q * q) * scale, 2.0 * q * scale
    cosine, sine = c * c - s * s, 2.0 * c * s
    mean, half = 0.5 * (sxx + syy), 0.5 * (sxx - syy)
    across = half * sine + sxy * cosine
    half = half * cosine - sxy * sine
    return mean + half, mean - half, across


@jit.kernel
def strength(kind: arrays.Record, total: float) -> float:
    """Return the largest root of J2 (Pa) at I1 (Pa); negative beyond the apex."""
    return kind.cohesion - kind.slope * total


@jit.kernel
def return_to_surface(state: arrays.Record, kind: arrays.Record) -> float:
    """Bring the stress of a particle back to the yield surface; return the root of J2 (Pa) that was too much, or 0."""
    total, deviator = invariants(state.sxx, state.syy, state.szz, state.sxy)
    most = strength(kind, total)
    if deviator <= most:
        return 0.0
    factor, mean = 0.0, total / 3.0
    if most > 0.0:
        factor = most / deviator
    elif kind.slope > 0.0:
        mean = kind.cohesion / (3.0 * kind.slope)
    state.opening += (total / 3.0 - mean) / kind.bulk
    state.sxx = mean + factor * (state.sxx - total / 3.0)
    state.syy = mean + factor * (state.syy - total / 3.0)
    state.szz = mean + factor * (state.szz - total / 3.0)
    state.sxy *= factor
    return deviator * (1.0 - factor)


@jit.kernel
def close_gaps(state: arrays.Record, kind: arrays.Record, volume: float) -> float:
    """Close gaps of a particle whose stress has followed a volume strain (-) of the step; return by how much (-)."""
    if state.opening == 0.0 or volume >= 0.0:
        return 0.0
    pressed = -(state.sxx + state.syy + state.szz) / (3.0 * kind.bulk)
    closed: float = min(state.opening, (1.0 - RESILIENCE) * max(min(pressed, -volume), 0.0))
    state.opening -= closed
    state.sxx += kind.bulk * closed
    state.syy += kind.bulk * closed
    state.szz += kind.bulk * closed
    return closed


@jit.kernel
def stretch(state: arrays.Record, kind: arrays.Record, dxx: float, dyy: float, dxy: float) -> float:
    """Advance the stress of a particle by a strain (-); return the energy (J) lost to flow and gaps.

    The loss is the work of the mean stress less what elasticity has gained.
    """
    sxx, syy, szz, sxy = state.sxx, state.syy, state.szz, state.sxy
    volume = kind.lame * (dxx + dyy)
    state.sxx = sxx + volume + 2.0 * kind.shear * dxx
    state.syy = syy + volume + 2.0 * kind.shear * dyy
    state.szz = szz + volume
    state.sxy = sxy + 2.0 * kind.shear * dxy
    closed = close_gaps(state, kind, dxx + dyy)
    lost = return_to_surface(state, kind)
    if lost == 0.0 and closed == 0.0:
        total, _ = invariants(state.sxx, state.syy, state.szz, state.sxy)
        if strength(kind, total) >= 0.0:
            return 0.0
    state.plastic += lost / kind.shear
    total, deviator = invariants(sxx, syy, szz, sxy)
    held = strain_energy(kind, total, deviator)
    total, deviator = invariants(state.sxx, state.syy, state.szz, state.sxy)
    # of the mean of both stresses, over the strain
    work = 0.5 * kind.volume * ((sxx + state.sxx) * dxx + (syy + state.syy) * dyy + 2.0 * (sxy + state.sxy) * dxy)
    return work - (strain_energy(kind, total, deviator) - held)


@jit.kernel
def strain(state: arrays.Record, kind: arrays.Record, ux: float, uy: float, wx: float, wy: float, step: float) -> float:
    """Advance the stress of a particle by a step (s) of a velocity gradient (1/s); return the energy (J) lost to flow.

    dvx/dx, dvx/dy, dvy/dx, dvy/dy. Half of the rotation comes before the strain and half after it: the stress of the
    strain is then the mean of those at both ends of the step, whose forces do the work, to second order.
    """
    angle = 0.25 * step * (wx - uy)
    state.sxx, state.syy, state.sxy = turned(state.sxx, state.syy, state.sxy, angle)
    lost = stretch(state, kind, step * ux, step * wy, 0.5 * step * (uy + wx))
    state.sxx, state.syy, state.sxy = turned(state.sxx, state.syy, state.sxy, angle)
    return lost


ROWS = 5  # the next one wants 1.0003


@jit.kernel
def share_of_row(row: float) -> float:
    """Return the stress of a row beside a face, counted from 1, over that inside; 1 beyond those that differ."""
    if row > ROWS:
        return 1.0
    return 1.0 - 2.0 * (-tolerances.DECAY) ** int(row) / (1.0 + tolerances.DECAY * tolerances.DECAY)


@jit.kernel
def part_of_kernel(row: float) -> float:
    """Return which part of sum V f d (x) d across a face a row beside it has, counted from 1."""
    if row > 2.0:
        return 1.0
    decay = tolerances.DECAY
    return 0.5 if row < 2.0 else 0.5 + 0.5 * (1.0 + decay * decay) / (1.0 + decay) ** 2  # 1/2 + a_1, of a_1 + a_2 = 1/2


@jit.kernel
def share_across(row: float, is_corrected: bool) -> float:
    """Return the stress across a face in a row beside it, counted from 1, over that inside."""
    return share_of_row(row) * (part_of_kernel(row) if is_corrected else 1.0)


@jit.rare_kernel
def row_beside(
    world: arrays.World, b: int, x: float, y: float, radius: float, kind: arrays.Record
) -> tuple[float, float, float]:
    """Return the row along a face of body b in which a place (m) is, and the normal; 0 if it is in none."""
    if not is_near(world, b, x, y, ROWS * max(kind.pitch_x, kind.pitch_y)):
        return 0.0, 0.0, 1.0
    distance, nx, ny = from_body(world, b, x, y, radius)
    if math.isinf(distance) or min(abs(nx), abs(ny)) > tolerances.OUT_OF_LINE:
        return 0.0, nx, ny
    row = (distance - radius) / (kind.pitch_x if abs(nx) > 0.5 else kind.pitch_y) + 1.0
    nearest = math.floor(row + 0.5)
    return (nearest if nearest >= 1.0 and abs(row - nearest) < tolerances.OUT_OF_LINE else 0.0), nx, ny


@jit.rare_kernel
def shares_of_place(world: arrays.World, x: float, y: float, radius: float, kind: arrays.Record) -> tuple[float, float]:
    """Return the stresses across upright and level faces at a place (m) over those far from all faces.

    Of faces to the same side, such as those of blocks on one another, the nearest counts.
    """
    left = right = below = above = ROWS + 1.0
    is_corrected = kind.is_corrected != 0
    for b in range(world.bodies.size):
        row, nx, ny = row_beside(world, b, x, y, radius, kind)
        if row > 0.0:
            left = min(left, row) if nx > 0.5 else left
            right = min(right, row) if nx < -0.5 else right
            below = min(below, row) if ny > 0.5 else below
            above = min(above, row) if ny < -0.5 else above
    along_x = share_across(left, is_corrected) * share_across(right, is_corrected)
    return along_x, share_across(below, is_corrected) * share_across(above, is_corrected)


@jit.rare_kernel
def keep_within_surface(state: arrays.Record, kind: arrays.Record) -> None:
    """Bring a compressed particle without shear stress within the yield surface, by the larger of its stresses.

    With the stress out of the plane midway, as where it fails, the larger pressure T and the smaller N have
    (T - N)/2 = k + 3 a (T + N)/2.
    """
    total, deviator = invariants(state.sxx, state.syy, state.szz, state.sxy)
    if deviator <= strength(kind, total):
        return
    smaller = -max(state.sxx, state.syy)
    largest = (2.0 * kind.cohesion + smaller * (1.0 + 3.0 * kind.slope)) / (1.0 - 3.0 * kind.slope)
    state.sxx = max(state.sxx, -largest)
    state.syy = max(state.syy, -largest)
    state.szz = 0.5 * (state.sxx + state.syy)


@jit.rare_kernel
def balance(state: arrays.Record, kind: arrays.Record, along_x: float, along_y: float) -> None:
    """Bring the stress of a particle to these shares across upright and level faces."""
    if kind.is_corrected:
        state.sxx *= along_x
        state.syy *= along_y
        keep_within_surface(state, kind)
    else:
        share = along_x * along_y
        state.sxx *= share
        state.syy *= share
        state.szz *= share
        state.sxy *= share


@jit.rare_kernel
def balance_rows(soils: Soils, world: arrays.World) -> None:
    """Bring the stresses of all rows along faces into equilibrium; a particle in a corner is in a row of both."""
    radius = soils.controls[0].radius
    for i in range(soils.points.size):
        point, state = soils.points[i], soils.states[i]
        kind = soils.kinds[state.kind]
        if state.syy < 0.0:
            along_x, along_y = shares_of_place(world, point.x, point.y, radius, kind)
            balance(state, kind, along_x, along_y)

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
"""

import math

from blocksim.kernels.common.arrays import Record
from blocksim.kernels.common.jit import kernel

# Share of the work of closing gaps that soil gives back: as much as a contact with a body, exp(-pi/2) of the speed.
RESILIENCE = math.exp(-math.pi)


@kernel
def invariants(sxx: float, syy: float, szz: float, sxy: float) -> tuple[float, float]:
    """Return I1 (Pa) and the root of J2 (Pa)."""
    total = sxx + syy + szz
    mean = total / 3.0
    dx, dy, dz = sxx - mean, syy - mean, szz - mean
    return total, math.sqrt(0.5 * (dx * dx + dy * dy + dz * dz) + sxy * sxy)


@kernel
def strain_energy(kind: Record, total: float, deviator: float) -> float:
    """Return the elastic energy (J) of a particle with these invariants (Pa)."""
    return kind.volume * (total * total / (18.0 * kind.bulk) + deviator * deviator / (2.0 * kind.shear))


@kernel
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


@kernel
def strength(kind: Record, total: float) -> float:
    """Return the largest root of J2 (Pa) at I1 (Pa); negative beyond the apex."""
    return kind.cohesion - kind.slope * total


@kernel
def work_of(state: Record, sxx: float, syy: float, sxy: float, dxx: float, dyy: float, dxy: float) -> float:
    """Return the work per volume (J/m3) of the mean of the stress before, given, and now over a strain (-)."""
    return 0.5 * ((sxx + state.sxx) * dxx + (syy + state.syy) * dyy + 2.0 * (sxy + state.sxy) * dxy)


@kernel
def return_to_surface(state: Record, kind: Record) -> float:
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


@kernel
def close_gaps(state: Record, kind: Record, volume: float) -> float:
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


@kernel
def stretch(state: Record, kind: Record, dxx: float, dyy: float, dxy: float) -> float:
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
    work = kind.volume * work_of(state, sxx, syy, sxy, dxx, dyy, dxy)
    return work - (strain_energy(kind, total, deviator) - held)


@kernel
def strain(state: Record, kind: Record, ux: float, uy: float, wx: float, wy: float, step: float) -> float:
    """Advance the stress of a particle by a step (s) of a velocity gradient (1/s); return the energy (J) lost to flow.

    dvx/dx, dvx/dy, dvy/dx, dvy/dy. Half of the rotation comes before the strain and half after it: the stress of the
    strain is then the mean of those at both ends of the step, whose forces do the work, to second order.
    """
    angle = 0.25 * step * (wx - uy)
    state.sxx, state.syy, state.sxy = turned(state.sxx, state.syy, state.sxy, angle)
    lost = stretch(state, kind, step * ux, step * wy, 0.5 * step * (uy + wx))
    state.sxx, state.syy, state.sxy = turned(state.sxx, state.syy, state.sxy, angle)
    return lost

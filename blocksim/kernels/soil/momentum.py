"""Forces between particles: stress and artificial viscosity, each pair with exactly opposite forces.

With d, f and V as in gradient.py and P = s B, the stress times the correction,

    F_i = V_i sum V (P_i + P_j) f d,

the adjoint of the velocity gradient: sum F_i v_i = -sum V_i s_i : L_i, whatever B is. The artificial viscosity
(J. J. Monaghan, Annu. Rev. Astron. Astrophys. 30 (1992) 543-574, without the quadratic term) acts between particles
that approach one another. Both are odd in the particles bit by bit: momentum changes by round-off of the sums alone.
"""

import math

from blocksim.kernels.common.jit import kernel
from blocksim.kernels.soil.arrays import Soils
from blocksim.kernels.sph.wendland_c2 import fading, steepness

SOFTENING = 0.01  # h^2; keeps the viscosity finite where two particles meet


@kernel
def mean_impedance(soils: Soils, i: int, j: int) -> float:
    """Return density times wave speed (kg/(m2 s)) between two particles."""
    one, other = soils.kinds[soils.states[i].kind], soils.kinds[soils.states[j].kind]
    return 0.5 * (one.impedance + other.impedance)


@kernel
def forces_on(soils: Soils, i: int) -> tuple[float, float, float, float]:
    """Return force of the stresses (N, x and y) and of the viscosity (N, x and y) on particle i."""
    points, near = soils.points, soils.lists[i]
    one = points[i]
    controls = soils.controls[0]
    kind = soils.kinds[soils.states[i].kind]
    inverse, soft = 1.0 / controls.reach, SOFTENING * controls.smoothing * controls.smoothing
    is_uniform, impedance = controls.is_uniform != 0, kind.impedance
    x, y, vx, vy = one.x, one.y, one.vx, one.vy
    pxx, pxy, pyx, pyy = one.pxx, one.pxy, one.pyx, one.pyy
    fx, fy, drag_x, drag_y = 0.0, 0.0, 0.0, 0.0
    for k in range(soils.lengths[i]):
        j = near[k]
        other = points[j]
        dx, dy = other.x - x, other.y - y
        r2 = dx * dx + dy * dy
        f = fading(math.sqrt(r2), inverse)
        gx, gy = f * dx, f * dy
        fx += (pxx + other.pxx) * gx + (pxy + other.pxy) * gy
        fy += (pyx + other.pyx) * gx + (pyy + other.pyy) * gy
        closing = min((other.vx - vx) * dx + (other.vy - vy) * dy, 0.0)
        q = (impedance if is_uniform else mean_impedance(soils, i, j)) * closing / (r2 + soft)
        drag_x += q * gx
        drag_y += q * gy
    both = controls.area * kind.volume * steepness(controls.smoothing)
    stiff = both * controls.viscosity * controls.smoothing
    return both * fx, both * fy, stiff * drag_x, stiff * drag_y

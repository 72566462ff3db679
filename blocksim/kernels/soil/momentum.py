"""Forces between particles: stress and artificial viscosity, each pair with exactly opposite forces.

With d, f and V as in gradient.py and P = s B, the stress times the correction,

    F_i = V_i sum V (P_i + P_j) f d,

the adjoint of the velocity gradient: sum F_i v_i = -sum V_i s_i : L_i, whatever B is. The artificial viscosity
(J. J. Monaghan, Annu. Rev. Astron. Astrophys. 30 (1992) 543-574, without the quadratic term) acts between particles
that approach one another. Both are odd in the particles bit by bit: momentum changes by round-off of the sums alone.
"""

from blocksim.kernels.common.arrays import Integers
from blocksim.kernels.common.jit import kernel
from blocksim.kernels.common.simd import Lanes, fields_0, fields_4, four, lesser, root, spread
from blocksim.kernels.soil.arrays import Soils
from blocksim.kernels.sph.wendland_c2 import fading, steepness

SOFTENING = 0.01  # h^2; keeps the viscosity finite where two particles meet


@kernel
def impedance_of(soils: Soils, i: int) -> float:
    """Return density times wave speed (kg/(m2 s)) of a particle."""
    impedance: float = soils.kinds[soils.states[i].kind].impedance
    return impedance


@kernel
def forces_on(soils: Soils, near: Integers, places: tuple[int, int, int, int]) -> tuple[Lanes, Lanes, Lanes, Lanes]:
    """Return force of the stresses (x and y) and of the viscosity (x and y) on four particles, in N/m3.

    That is, by volume; `near` are the neighbours of the four.
    """
    points, controls = soils.points, soils.controls[0]
    inverse, soft = 1.0 / controls.reach, SOFTENING * controls.smoothing * controls.smoothing
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
        f = fading(root(r2), inverse)
        gx, gy = f * dx, f * dy
        fx = fx - ((pxx + other.pxx) * gx + (pxy + other.pxy) * gy)
        fy = fy - ((pyx + other.pyx) * gx + (pyy + other.pyy) * gy)
        closing = lesser((vx - other.vx) * dx + (vy - other.vy) * dy, 0.0)
        mean = impedance if is_uniform else 0.5 * (impedance + impedance_of(soils, near[e]))
        q = mean * closing / (r2 + soft)
        drag_x = drag_x - q * gx
        drag_y = drag_y - q * gy
    both = controls.area * steepness(controls.smoothing)
    stiff = both * controls.viscosity * controls.smoothing
    return both * fx, both * fy, stiff * drag_x, stiff * drag_y

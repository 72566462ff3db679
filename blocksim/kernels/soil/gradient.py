"""Velocity gradients from neighbours, raw or corrected.

With d = r_j - r_i, V the area s^2 and f = -W'/r > 0, so that grad_i W_ij = f d, the gradient is

    L = sum V (v_j - v_i) (x) f d B,    B = 1 (raw) or M^-1 with M = sum V f d (x) d (corrected; J. Bonet and
    T.-S. L. Lok, Comput. Methods Appl. Mech. Eng. 180 (1999) 97-115),

exact for linear fields where corrected. Forces (momentum.py) are the adjoint of it, with the same B.
"""

import math

from blocksim.kernels.common.jit import kernel
from blocksim.kernels.soil.arrays import Soils
from blocksim.kernels.sph.wendland_c2 import fading, steepness

# Smallest eigenvalue of M with which a particle is corrected: 1 inside, 0.5 on a flat surface, above 0.1 in a corner.
# What lies beyond is no surface but a few particles that fly.
LEAST_SPREAD = 0.05


@kernel
def raw_gradient(soils: Soils, i: int) -> tuple[float, float, float, float]:
    """Return dvx/dx, dvx/dy, dvy/dx and dvy/dy (1/s) at particle i."""
    points, near = soils.points, soils.lists[i]
    one = points[i]
    controls = soils.controls[0]
    inverse = 1.0 / controls.reach
    x, y, vx, vy = one.x, one.y, one.vx, one.vy
    ux, uy, wx, wy = 0.0, 0.0, 0.0, 0.0
    for k in range(soils.lengths[i]):
        other = points[near[k]]
        dx, dy = other.x - x, other.y - y
        f = fading(math.sqrt(dx * dx + dy * dy), inverse)
        fu, fw = f * (other.vx - vx), f * (other.vy - vy)
        ux += fu * dx
        uy += fu * dy
        wx += fw * dx
        wy += fw * dy
    scale = controls.area * steepness(controls.smoothing)
    return scale * ux, scale * uy, scale * wx, scale * wy


@kernel
def correction(soils: Soils, i: int) -> tuple[float, float, float]:
    """Return xx, xy and yy of the symmetric B (-) of particle i; one where its neighbours are too few."""
    points, near = soils.points, soils.lists[i]
    one = points[i]
    controls = soils.controls[0]
    inverse, scale = 1.0 / controls.reach, controls.area * steepness(controls.smoothing)
    xx, xy, yy = 0.0, 0.0, 0.0
    for k in range(soils.lengths[i]):
        other = points[near[k]]
        dx, dy = other.x - one.x, other.y - one.y
        f = scale * fading(math.sqrt(dx * dx + dy * dy), inverse)
        xx += f * dx * dx
        xy += f * dx * dy
        yy += f * dy * dy
    least = 0.5 * (xx + yy) - math.sqrt(0.25 * (xx - yy) * (xx - yy) + xy * xy)
    if least < LEAST_SPREAD:
        return 1.0, 0.0, 1.0
    determinant = xx * yy - xy * xy
    return yy / determinant, -xy / determinant, xx / determinant

"""Velocity gradients from neighbours, raw or corrected.

With d = r_j - r_i, V the area s^2 and f = -W'/r > 0, so that grad_i W_ij = f d, the gradient is

    L = sum V (v_j - v_i) (x) f d B,    B = 1 (raw) or M^-1 with M = sum V f d (x) d (corrected; J. Bonet and
    T.-S. L. Lok, Comput. Methods Appl. Mech. Eng. 180 (1999) 97-115),

exact for linear fields where corrected. Forces (momentum.py) are the adjoint of it, with the same B.

Each function deals with the four particles of a cluster, one a lane, and with one neighbour of the cluster after the
other; that a particle is its own neighbour adds zeros.
"""

from blocksim.kernels.common.arrays import Integers, Record, Records
from blocksim.kernels.common.jit import kernel
from blocksim.kernels.common.simd import Lanes, root, select, spread
from blocksim.kernels.sph.wendland_c2 import fading, steepness

# Smallest eigenvalue of M with which a particle is corrected: 1 inside, 0.5 on a flat surface, above 0.1 in a corner.
# What lies beyond is no surface but a few particles that fly.
LEAST_SPREAD = 0.05


@kernel
def raw_gradient(
    controls: Record, points: Records, near: Integers, x: Lanes, y: Lanes, vx: Lanes, vy: Lanes
) -> tuple[Lanes, Lanes, Lanes, Lanes]:
    """Return dvx/dx, dvx/dy, dvy/dx and dvy/dy (1/s) at four places (m) with these velocities (m/s)."""
    inverse = 1.0 / controls.reach
    ux, uy, wx, wy = spread(0.0), spread(0.0), spread(0.0), spread(0.0)
    for k in range(near.size):
        other = points[near[k]]
        dx, dy = other.x - x, other.y - y
        f = fading(root(dx * dx + dy * dy), inverse)
        fu, fw = f * (other.vx - vx), f * (other.vy - vy)
        ux = ux + fu * dx
        uy = uy + fu * dy
        wx = wx + fw * dx
        wy = wy + fw * dy
    scale = controls.area * steepness(controls.smoothing)
    return scale * ux, scale * uy, scale * wx, scale * wy


@kernel
def correction(controls: Record, points: Records, near: Integers, x: Lanes, y: Lanes) -> tuple[Lanes, Lanes, Lanes]:
    """Return xx, xy and yy of the symmetric B (-) at four places (m); one where neighbours are too few."""
    inverse, scale = 1.0 / controls.reach, controls.area * steepness(controls.smoothing)
    xx, xy, yy = spread(0.0), spread(0.0), spread(0.0)
    for k in range(near.size):
        other = points[near[k]]
        dx, dy = other.x - x, other.y - y
        f = scale * fading(root(dx * dx + dy * dy), inverse)
        xx = xx + f * dx * dx
        xy = xy + f * dx * dy
        yy = yy + f * dy * dy
    least = 0.5 * (xx + yy) - root(0.25 * (xx - yy) * (xx - yy) + xy * xy)
    are_few = least < LEAST_SPREAD
    determinant = select(are_few, 1.0, xx * yy - xy * xy)
    return (
        select(are_few, 1.0, yy / determinant),
        select(are_few, 0.0, -xy / determinant),
        select(are_few, 1.0, xx / determinant),
    )

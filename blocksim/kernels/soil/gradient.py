"""Velocity gradients from neighbours, raw or corrected.

With d = r_j - r_i, V the area s^2 and f = -W'/r > 0, so that grad_i W_ij = f d, the gradient is

    L = sum V (v_j - v_i) (x) f d B,    B = 1 (raw) or M^-1 with M = sum V f d (x) d (corrected; J. Bonet and
    T.-S. L. Lok, Comput. Methods Appl. Mech. Eng. 180 (1999) 97-115),

exact for linear fields where corrected. Forces (momentum.py) are the adjoint of it, with the same B.

The velocities are those of the drift, which runs from one end of a step to the other; gradients are taken half way, a
`lag` (s) before the end: the strain of a step is then that of the motion to second order, a turn makes none, and the
work of the stresses is that of the forces at both ends. At the end, a body that turns would grow by the square of the
angle of the step, and a collapse of a few metres a second would be off by half a per cent of its energy.

Each function deals with the four particles of a cluster, one a lane, and with one neighbour of the cluster after the
other; that a particle is its own neighbour adds zeros. Differences are taken the other way round, own values less those
of the neighbour, which changes no bit of the result: processors subtract a number in memory from four at once, but not
four from one, and the loops, which wait for nothing but registers, are up to 15 % faster.
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
    controls: Record, points: Records, near: Integers, x: Lanes, y: Lanes, vx: Lanes, vy: Lanes, lag: float
) -> tuple[Lanes, Lanes, Lanes, Lanes]:
    """Return dvx/dx, dvx/dy, dvy/dx and dvy/dy (1/s) at four places (m) with these velocities (m/s), a lag (s) ago."""
    inverse = 1.0 / controls.reach
    ux, uy, wx, wy = spread(0.0), spread(0.0), spread(0.0), spread(0.0)
    for k in range(near.size):
        other = points[near[k]]
        du, dw = vx - other.vx, vy - other.vy
        dx, dy = x - other.x - lag * du, y - other.y - lag * dw
        f = fading(root(dx * dx + dy * dy), inverse)
        fu, fw = f * du, f * dw
        ux = ux + fu * dx
        uy = uy + fu * dy
        wx = wx + fw * dx
        wy = wy + fw * dy
    scale = controls.area * steepness(controls.smoothing)
    return scale * ux, scale * uy, scale * wx, scale * wy


@kernel
def correction(
    controls: Record, points: Records, near: Integers, x: Lanes, y: Lanes, vx: Lanes, vy: Lanes, lag: float
) -> tuple[Lanes, Lanes, Lanes]:
    """Return xx, xy and yy of the symmetric B (-) at the same places; one where neighbours are too few."""
    inverse, scale = 1.0 / controls.reach, controls.area * steepness(controls.smoothing)
    xx, xy, yy = spread(0.0), spread(0.0), spread(0.0)
    for k in range(near.size):
        other = points[near[k]]
        dx, dy = other.x - x - lag * (other.vx - vx), other.y - y - lag * (other.vy - vy)
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

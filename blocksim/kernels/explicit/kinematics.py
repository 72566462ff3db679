"""Where the contact points of a pair are, how they move, and how long they have been in contact.

Places are taken from the centre of body b, in world axes. The velocity of a point of body a against body b at a place r
is then v + w x r with one v and one w for all points of the pair. A `Point` is passed by value and stays in registers.
"""

from typing import NamedTuple

from blocksim.kernels.common import arrays, jit, tolerances
from blocksim.kernels.explicit.laws import LINEAR, dashpot_weight


class Motion(NamedTuple):
    """Motion of body a against body b at the centre of b: in the last drift, and as predicted at its end."""

    vx: float  # m/s
    vy: float
    spin: float  # rad/s
    end_vx: float
    end_vy: float
    end_spin: float


class Point(NamedTuple):
    """One contact point."""

    x: float  # m, from the centre of b
    y: float
    nx: float  # normal, from b to a
    ny: float
    depth: float  # m
    closing: float  # m, displacement of the last drift against the normal
    slip: float  # m, of a ahead of b along the tangent (-ny, nx)
    closing_rate: float  # m/s, at the end of the drift, predicted with the last accelerations
    slip_rate: float
    share: float  # -, stiffness over that of a corner contact of the pair
    weight: float  # -, of the dashpot: other than one in the first step
    drawn: float  # -, share of the drift that draws the shear spring: less than one in the first step


@jit.kernel
def relative_motion(a: arrays.Record, b: arrays.Record, dx: float, dy: float, time: float) -> Motion:
    """Return the motion of a against b; the end of the drift is `time` (s) ahead, with the last accelerations."""
    vx = a.vx - b.vx + a.spin * dy
    vy = a.vy - b.vy - a.spin * dx
    spin = a.spin - b.spin
    ax = a.ax - b.ax + a.spin_rate * dy
    ay = a.ay - b.ay - a.spin_rate * dx
    return Motion(vx, vy, spin, vx + time * ax, vy + time * ay, spin + time * (a.spin_rate - b.spin_rate))


@jit.kernel
def moving_point(x: float, y: float, nx: float, ny: float, depth: float, motion: Motion, step: float) -> Point:
    """Return a point of a contact that lasts, with its displacements in the last drift and its rates at the end."""
    ux = motion.vx - motion.spin * y
    uy = motion.vy + motion.spin * x
    ex = motion.end_vx - motion.end_spin * y
    ey = motion.end_vy + motion.end_spin * x
    closing = -step * (nx * ux + ny * uy)
    slip = step * (nx * uy - ny * ux)
    return Point(x, y, nx, ny, depth, closing, slip, -(nx * ex + ny * ey), nx * ey - ny * ex, 1.0, 1.0, 1.0)


@jit.rare_kernel
def resolve_point(place: arrays.Record, a: arrays.Record, b: arrays.Record, step: float) -> None:
    """Fill displacements and rates of a point in the work space; full weights."""
    motion = relative_motion(a, b, a.x - b.x, a.y - b.y, 0.5 * step)
    point = moving_point(place.x - b.x, place.y - b.y, place.nx, place.ny, place.depth, motion, step)
    place.closing = point.closing
    place.slipping = point.slip
    place.closing_rate = point.closing_rate
    place.slip_rate = point.slip_rate
    place.weight = place.drawn = 1.0


@jit.kernel
def point_of(place: arrays.Record, b: arrays.Record) -> Point:
    """Return a point of the work space by value."""
    return Point(
        place.x - b.x,
        place.y - b.y,
        place.nx,
        place.ny,
        place.depth,
        place.closing,
        place.slipping,
        place.closing_rate,
        place.slip_rate,
        place.share,
        place.weight,
        place.drawn,
    )


@jit.kernel
def arms(point: Point, dx: float, dy: float, direction: int) -> tuple[float, float]:
    """Return the lever arms (m) of the normal or the tangent of a point about the centres of a and b."""
    if direction == arrays.NORMAL:
        arm = point.x * point.ny - point.y * point.nx
        return arm - (dx * point.ny - dy * point.nx), arm
    arm = point.x * point.nx + point.y * point.ny
    return arm - (dx * point.nx + dy * point.ny), arm


@jit.rare_kernel
def has_just_begun(place: arrays.Record) -> bool:
    """Return True if a point came into contact within the last drift: it is no deeper than it closed, to round-off."""
    return place.closing > 0.0 and place.depth <= place.closing * (1.0 + tolerances.CLOSING_ROUND_OFF)


@jit.rare_kernel
def weigh_first_step(place: arrays.Record, exponent: float) -> None:
    """Set the dashpot weight and the drawn share of the shear spring of a point that was not in contact before.

    The kick at time t covers [t - dt/2, t + dt/2]. A contact with overlap d = s v dt began at t - s dt, so a dashpot of
    constant coefficient acts for 1/2 + s steps (more than one where the kick before missed its beginning), and the last
    drift drew the shear spring for s dt only. A contact that comes deeper than it closed was there before under another
    corner: it keeps the full weight.
    """
    if not has_just_begun(place):
        return
    share = min(place.depth / place.closing, 1.0)
    place.weight = dashpot_weight(exponent, 0.0, share + 0.5, share)
    place.drawn = share


@jit.kernel
def weight_of(point: Point, exponent: float) -> float:
    """Return the dashpot weight of a point, also where it began some steps ago and the coefficient still rises fast.

    Hertz: it goes with the fourth root of time, and one value for each step would leave an error of order dt^(5/4).
    """
    if exponent == LINEAR or point.weight != 1.0 or not 0.0 < point.depth < tolerances.ONSET_STEPS * point.closing:
        return point.weight
    at = point.depth / point.closing
    return dashpot_weight(exponent, max(at - 0.5, 0.0), at + 0.5, at)

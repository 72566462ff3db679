"""Rates, displacements and inverse masses at the contact points of one pair, along the normals or the tangents."""

from blocksim.kernels.common import arrays, jit
from blocksim.kernels.explicit.inertia import Piece, inverse_mass_of
from blocksim.kernels.explicit.laws import dashpot_weight

ROUND_OFF = 1e-6  # of an overlap after one drift: a small difference of places, where the closing is a small product
IMPACT_STEPS = 10.0  # an impact lasts some thirty steps; a face lost in a third of that cannot stop a corner
ONSET_STEPS = 16.0  # after which the mean over a step and the value in its middle differ by less than 1/30000


@jit.kernel
def resolve_point(point: arrays.Record, a: arrays.Record, b: arrays.Record, step: float) -> None:
    """Fill lever arms, displacements of the last drift and rates at its end of one point; full weights.

    Velocities are those of the last drift; the rates at its end are predicted with the last accelerations. Closing
    counts positive against the normal, slip positive when a moves ahead of b along the tangent (-ny, nx).
    """
    half = 0.5 * step
    nx = point.nx
    ny = point.ny
    rxa = point.x - a.x
    rya = point.y - a.y
    rxb = point.x - b.x
    ryb = point.y - b.y
    ux = a.vx - b.vx - rya * a.spin + ryb * b.spin
    uy = a.vy - b.vy + rxa * a.spin - rxb * b.spin
    cx = ux + half * (a.ax - b.ax - rya * a.spin_rate + ryb * b.spin_rate)
    cy = uy + half * (a.ay - b.ay + rxa * a.spin_rate - rxb * b.spin_rate)
    point.normal_arm_a = rxa * ny - rya * nx
    point.normal_arm_b = rxb * ny - ryb * nx
    point.shear_arm_a = rxa * nx + rya * ny
    point.shear_arm_b = rxb * nx + ryb * ny
    point.closing = -step * (nx * ux + ny * uy)
    point.slipping = step * (nx * uy - ny * ux)
    point.closing_rate = -(nx * cx + ny * cy)
    point.slip_rate = nx * cy - ny * cx
    point.weight = 1.0
    point.drawn = 1.0


@jit.rare_kernel
def has_just_begun(point: arrays.Record) -> bool:
    """Return True if a point came into contact within the last drift: it is no deeper than it closed, to round-off."""
    return point.closing > 0.0 and point.depth <= point.closing * (1.0 + ROUND_OFF)


@jit.rare_kernel
def weigh_first_step(point: arrays.Record, exponent: float) -> None:
    """Set the dashpot weight and the drawn share of the shear spring of a point that was not in contact before.

    The kick at time t covers [t - dt/2, t + dt/2]. A contact with overlap d = s v dt began at t - s dt, so a dashpot of
    constant coefficient acts for 1/2 + s steps (more than one where the kick before missed its beginning), and the last
    drift drew the shear spring for s dt only. A contact that comes deeper than it closed was there before under another
    corner: it keeps the full weight.
    """
    if has_just_begun(point):
        share = min(point.depth / point.closing, 1.0)
        point.weight = dashpot_weight(exponent, 0.0, share + 0.5, share)
        point.drawn = share


@jit.rare_kernel
def weigh_onset(point: arrays.Record, exponent: float) -> None:
    """Set the dashpot weight of a point whose contact began some steps ago, where the coefficient still rises fast.

    Hertz: it goes with the fourth root of time, and one value for each step would leave an error of order dt^(5/4).
    """
    if 0.0 < point.depth < ONSET_STEPS * point.closing:
        at = point.depth / point.closing
        point.weight = dashpot_weight(exponent, max(at - 0.5, 0.0), at + 0.5, at)


@jit.rare_kernel
def coupling(point: arrays.Record, of_a: Piece, of_b: Piece) -> float:
    """Return the inverse mass (1/kg) that couples normal and tangent of a point, by its arms about both centres."""
    turning_a = (point.normal_arm_a - of_a.arm) * point.shear_arm_a * of_a.inverse_inertia
    return turning_a + (point.normal_arm_b - of_b.arm) * point.shear_arm_b * of_b.inverse_inertia


@jit.rare_kernel
def mutual_mass(one: arrays.Record, two: arrays.Record, of_a: Piece, of_b: Piece, direction: int) -> float:
    """Return the inverse mass (1/kg) J M^-1 J^T that two points see of one another, along normals or tangents.

    Tangents enclose the angle of the normals, so that one formula for the translation serves both directions.
    """
    cosine = one.nx * two.nx + one.ny * two.ny
    if direction == arrays.NORMAL:
        arms_a, arms_b = (one.normal_arm_a, two.normal_arm_a), (one.normal_arm_b, two.normal_arm_b)
    else:
        arms_a, arms_b = (one.shear_arm_a, two.shear_arm_a), (one.shear_arm_b, two.shear_arm_b)
    return inverse_mass_of(arms_a[0], arms_b[0], arms_a[1], arms_b[1], cosine, of_a, of_b)

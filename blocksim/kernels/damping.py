"""Dashpots of one pair of bodies, as a matrix over its contact points; here for one point and for two.

One dashpot a point would damp a flat landing (two points) differently from a corner (one point). With A the inverse
mass that the points see, k their stiffnesses and B = k^(1/2) A k^(1/2), the damping matrix
C = 2 z k^(1/2) B^(-1/2) k^(1/2) gives every mode of the pair the same damping ratio z: with q = k^(1/2) x the equation
x'' = -A (k x + C x') becomes q'' = -B q - 2 z B^(1/2) q'. Where B is singular (tangents of two points on one face,
sliding points) its pseudo-inverse root is meant.

The rate in the dashpot belongs to the middle of the kick, as the overlap does. It is predicted with the acceleration
of the step before and corrected for the change of this pair's own forces, f = spring + dashpot:
d = C (u + dt/2 A (f_before - f_spring - d)). That is second-order accurate, unbiased at rest, and for a single pair as
stable as an implicit dashpot.
"""

import math

from blocksim.kernels.arrays import Floats, Record, Records
from blocksim.kernels.jit import kernel, rare_kernel
from blocksim.kernels.kinematics import DELASSUS
from blocksim.kernels.matrices import RANK_TOLERANCE, inverse_root_2

SCALED, ROOTED = 1, 2  # indices into the work matrices
BOTH = 3  # pattern of two points with a dashpot
OPERATOR_LIFE = 16  # steps


@kernel
def add_dashpots(
    points: Records, count: int, pattern: int, ratio: float, step: float, operator: Record, work: Floats
) -> None:
    """Add the dashpot forces (N) to `force` of one or two points, which holds the spring force.

    Uses `stiffness`, `rate`, `before`, `weight` of the points and, where the operator is due (`left` is zero), the
    inverse masses in `work`; `pattern` has a bit set for every point with a dashpot. The operator is kept for some
    steps: arms change by less than a thousandth in that time; where stiffnesses change too, the caller makes it due at
    every step. The weight w of first steps enters as w^(1/2) C w^(1/2), so that the dashpots stay passive.
    """
    if operator.left > 0:
        operator.left -= 1
        apply_operator(points, count, operator)
        return
    operator.pattern = pattern
    if count == 1:
        fill_single(points[0], ratio, step, work[DELASSUS], operator, 0)
    elif pattern != BOTH:
        fill_single(points[pattern - 1], ratio, step, work[DELASSUS], operator, pattern - 1)
    elif points[0].weight == points[1].weight and points[0].stiffness == points[1].stiffness:
        fill_two_alike(points[0], ratio, step, work[DELASSUS], operator)
    else:
        fill_two(points, ratio, step, work, operator)
    apply_operator(points, count, operator)
    if step > 0.0 and is_lasting(points, count):
        operator.left = OPERATOR_LIFE


@rare_kernel
def is_lasting(points: Records, count: int) -> bool:
    """Tell whether no point is in its first step of contact, whose weight holds for this step only."""
    for i in range(count):
        if points[i].weight != 1.0:
            return False
    return True


@kernel
def apply_operator(points: Records, count: int, operator: Record) -> None:
    """Add E (u + H (f_before - f_spring)) to the forces of one or two points."""
    one = points[0]
    change_one = one.before - one.force
    if count == 1:
        one.force += operator.e_one * (one.rate + operator.h_one * change_one)
        return
    two = points[1]
    change_two = two.before - two.force
    rate_one = one.rate + operator.h_one * change_one + operator.h_mixed * change_two
    rate_two = two.rate + operator.h_mixed * change_one + operator.h_two * change_two
    one.force += operator.e_one * rate_one + operator.e_mixed * rate_two
    two.force += operator.e_mixed * rate_one + operator.e_two * rate_two


@rare_kernel
def fill_single(point: Record, ratio: float, step: float, delassus: Floats, operator: Record, i: int) -> None:
    """Only point i has a dashpot: c = 2 z sqrt(k/A), E = c/(1 + dt/2 A c)."""
    half = 0.5 * step
    inverse = delassus[i, i]
    c = point.weight * 2.0 * ratio * math.sqrt(point.stiffness / inverse)
    damped = c / (1.0 + half * inverse * c)
    operator.e_one = damped if i == 0 else 0.0
    operator.e_two = damped if i == 1 else 0.0
    operator.e_mixed = 0.0
    operator.h_one = half * delassus[0, 0]
    operator.h_mixed = half * delassus[0, 1]
    operator.h_two = half * delassus[1, 1]


@rare_kernel
def fill_two_alike(point: Record, ratio: float, step: float, delassus: Floats, operator: Record) -> None:
    """Two points of the same stiffness and weight: E = (I + dt/2 C A)^-1 C with C = g A^(-1/2), g = 2 z k^(1/2).

    A^(1/2) = (A + s I)/t with s^2 = det A and t^2 = tr A + 2 s. Parallel tangents make A singular; then A^(-1/2) over
    its range is A tr(A)^(-3/2).
    """
    half = 0.5 * step
    a = delassus[0, 0]
    b = delassus[0, 1]
    d = delassus[1, 1]
    operator.h_one = half * a
    operator.h_mixed = half * b
    operator.h_two = half * d
    g = point.weight * 2.0 * ratio * math.sqrt(point.stiffness)
    trace = a + d
    determinant = a * d - b * b
    if determinant <= RANK_TOLERANCE * trace * trace:
        root = math.sqrt(trace)
        scale = g / (trace * (root + half * g * trace))
        operator.e_one = scale * a
        operator.e_mixed = scale * b
        operator.e_two = scale * d
        return
    s = math.sqrt(determinant)
    t = math.sqrt(trace + 2.0 * s)
    implicit = half * g / t
    m_one = 1.0 + implicit * (a + s)
    m_two = 1.0 + implicit * (d + s)
    m_mixed = implicit * b
    scale = g / (t * s * (m_one * m_two - m_mixed * m_mixed))
    operator.e_one = scale * (m_two * (d + s) + m_mixed * b)
    operator.e_two = scale * (m_one * (a + s) + m_mixed * b)
    operator.e_mixed = -scale * (m_two * b + m_mixed * (a + s))


@rare_kernel
def fill_two(points: Records, ratio: float, step: float, work: Floats, operator: Record) -> None:
    """Two points of different stiffness or weight: E = (I + dt/2 C A)^-1 C, symmetric as C and A are."""
    one = points[0]
    two = points[1]
    half = 0.5 * step
    delassus = work[DELASSUS]
    scaled = work[SCALED]
    rooted = work[ROOTED]
    scaled[0, 0] = delassus[0, 0] * one.stiffness
    scaled[1, 1] = delassus[1, 1] * two.stiffness
    scaled[0, 1] = delassus[0, 1] * math.sqrt(one.stiffness * two.stiffness)
    inverse_root_2(scaled, rooted)
    g_one = math.sqrt(one.stiffness * one.weight)
    g_two = math.sqrt(two.stiffness * two.weight)
    c_one = 2.0 * ratio * g_one * g_one * rooted[0, 0]
    c_mixed = 2.0 * ratio * g_one * g_two * rooted[0, 1]
    c_two = 2.0 * ratio * g_two * g_two * rooted[1, 1]
    a = operator.h_one = half * delassus[0, 0]
    b = operator.h_mixed = half * delassus[0, 1]
    d = operator.h_two = half * delassus[1, 1]
    m_11 = 1.0 + c_one * a + c_mixed * b
    m_12 = c_one * b + c_mixed * d
    m_21 = c_mixed * a + c_two * b
    m_22 = 1.0 + c_mixed * b + c_two * d
    determinant = m_11 * m_22 - m_12 * m_21
    operator.e_one = (m_22 * c_one - m_12 * c_mixed) / determinant
    operator.e_mixed = (m_22 * c_mixed - m_12 * c_two) / determinant
    operator.e_two = (m_11 * c_two - m_21 * c_mixed) / determinant

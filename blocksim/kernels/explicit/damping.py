"""Dashpots of one pair of bodies, as a matrix over its contact points; here for one point and for two.

One dashpot a point would damp a flat landing (two points) differently from a corner (one point). With A the inverse
mass that the points see, k their stiffnesses and B = k^(1/2) A k^(1/2), the damping matrix
C = 2 z k^(1/2) B^(-1/2) k^(1/2) gives every mode of the pair the same damping ratio z: with q = k^(1/2) x the equation
x'' = -A (k x + C x') becomes q'' = -B q - 2 z B^(1/2) q'. Where B is singular (tangents of two points on one face,
sliding points) its pseudo-inverse root is meant.

A corner that slides has another inverse mass along the normal than A_nn: the friction, s mu f against a slip of sign s,
changes its normal rate as well, by -s mu A_nt f, A_nt the coupling of normal and tangent by the arms. As long as it
slides one way the impact is that of one mass, 1/(A_nn - s mu A_nt), on one spring, so that Newton's, Poisson's and the
energetic restitution are the same, and z belongs to that mass. (With A_nn the restitution was that of the ratio
z (1 - s mu A_nt/A_nn)^(1/2): 0.47 to 0.54 for 0.5 at mu = 0.3.) For a corner that sticks, or turns round, the
definitions differ; it has A_nn, as has a face, whose two points friction couples.

The rate in the dashpot belongs to the middle of the kick, as the overlap does. It is predicted with the acceleration
of the step before and corrected for the change of this pair's own forces, f = spring + dashpot:
d = C (u + dt/2 A (f_before - f_spring - d)). That is second-order accurate, unbiased at rest, and for a single pair as
stable as an implicit dashpot.
"""

import math

from blocksim.kernels.common.arrays import AHEAD, BACK, NORMAL, Record
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.explicit.matrices import RANK_TOLERANCE, inverse_root_2

BOTH = 3  # pattern of two points with a dashpot
OPERATOR_LIFE = 32  # steps
LEAST_MASS_SHARE = 0.1  # of the inverse mass without friction


@kernel
def damp_one(operator: Record, force: float, before: float, rate: float) -> float:
    """Return spring and dashpot force (N) of a single point: f + E (u + H (f_before - f))."""
    return force + operator.e_one * (rate + operator.h_one * (before - force))


@kernel
def damp_two(
    operator: Record, one: float, two: float, before_one: float, before_two: float, rate_one: float, rate_two: float
) -> tuple[float, float]:
    """Return spring and dashpot forces (N) of two points: f + E (u + H (f_before - f))."""
    change_one = before_one - one
    change_two = before_two - two
    free_one = rate_one + operator.h_one * change_one + operator.h_mixed * change_two
    free_two = rate_two + operator.h_mixed * change_one + operator.h_two * change_two
    return (
        one + operator.e_one * free_one + operator.e_mixed * free_two,
        two + operator.e_mixed * free_one + operator.e_two * free_two,
    )


@kernel
def fill_single(
    operator: Record, i: int, ratio: float, half: float, inverse: float, stiffness: float, weight: float
) -> None:
    """Only point i has a dashpot: c = 2 z sqrt(k/A), E = c/(1 + dt/2 A c); `inverse` is A (1/kg)."""
    c = weight * 2.0 * ratio * math.sqrt(stiffness / inverse)
    damped = c / (1.0 + half * inverse * c)
    operator.e_one = damped if i == 0 else 0.0
    operator.e_two = damped if i == 1 else 0.0
    operator.e_mixed = 0.0


@kernel
def fill_alike(operator: Record, g: float, half: float, a: float, b: float, d: float) -> None:
    """Two points of the same stiffness and weight: E = (I + dt/2 C A)^-1 C with C = g A^(-1/2), g = 2 z w k^(1/2).

    A = [[a, b], [b, d]], A^(1/2) = (A + s I)/t with s^2 = det A and t^2 = tr A + 2 s. Parallel tangents make A
    singular; then A^(-1/2) over its range is A tr(A)^(-3/2).
    """
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
def fill_different(
    operator: Record, ratio: float, half: float, a: float, b: float, d: float, one: Record, two: Record
) -> None:
    """Points `one` and `two` of different stiffness or weight: E = (I + dt/2 C A)^-1 C, symmetric as C and A are."""
    mixed = math.sqrt(one.stiffness * two.stiffness)
    root_one, root_mixed, root_two = inverse_root_2(a * one.stiffness, b * mixed, d * two.stiffness)
    g_one = math.sqrt(one.stiffness * one.weight)
    g_two = math.sqrt(two.stiffness * two.weight)
    c_one = 2.0 * ratio * g_one * g_one * root_one
    c_mixed = 2.0 * ratio * g_one * g_two * root_mixed
    c_two = 2.0 * ratio * g_two * g_two * root_two
    m_11 = 1.0 + half * (c_one * a + c_mixed * b)
    m_12 = half * (c_one * b + c_mixed * d)
    m_21 = half * (c_mixed * a + c_two * b)
    m_22 = 1.0 + half * (c_mixed * b + c_two * d)
    determinant = m_11 * m_22 - m_12 * m_21
    operator.e_one = (m_22 * c_one - m_12 * c_mixed) / determinant
    operator.e_mixed = (m_22 * c_mixed - m_12 * c_two) / determinant
    operator.e_two = (m_11 * c_two - m_21 * c_mixed) / determinant


@kernel
def sliding_mass(normal: float, coupling: float, friction: float, slides: int) -> float:
    """Return the inverse mass (1/kg) along the normal of a corner that slides; see AHEAD and BACK in arrays.py.

    `normal` and `coupling` (1/kg) are A_nn and A_nt. Where a corner would jam (Painleve) it is bounded, and with it the
    dashpot, which only takes energy however large it is.
    """
    against = friction * coupling
    return max(normal - (against if slides == AHEAD else -against), LEAST_MASS_SHARE * normal)


@kernel
def note_slip(pair: Record, slides: bool, way: float) -> None:
    """Note whether and which way the only contact of a pair slides; its dashpot along the normal follows."""
    now = (AHEAD if way > 0.0 else BACK) if slides else 0
    if pair.slides != now:
        pair.slides = now
        pair.normal_left = 0


@kernel
def keep_masses(operator: Record, half: float, a: float, b: float, d: float) -> None:
    """Note in an operator half a step (s) times the inverse masses [[a, b], [b, d]] (1/kg)."""
    operator.h_one = half * a
    operator.h_mixed = half * b
    operator.h_two = half * d


@kernel
def renew_dashpots(pair: Record) -> None:
    """Have all operators of a pair rebuilt when they are needed next."""
    pair.normal_left = 0
    pair.shear_left = 0


@kernel
def are_dashpots_due(pair: Record, direction: int) -> bool:
    """Return True if an operator of a pair has to be rebuilt before it is used now; if not, count down."""
    left = pair.normal_left if direction == NORMAL else pair.shear_left
    if left == 0:
        return True
    if direction == NORMAL:
        pair.normal_left = left - 1
    else:
        pair.shear_left = left - 1
    return False


@kernel
def count_down(pair: Record) -> None:
    """Note that the operator along the normals of a pair, which is not due, is used in one more step."""
    pair.normal_left -= 1


@kernel
def keep_dashpots(pair: Record, direction: int, pattern: int, left: int) -> None:
    """Note for how many steps an operator of a pair holds, and the bits of the points that have a dashpot in it."""
    if direction == NORMAL:
        pair.normal_left = left
    else:
        pair.shear_left = left
        pair.sticking = pattern

"""Dashpots of one pair of bodies, as a matrix over its contact points.

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

Dashpots of a pair that touches in more than two points, in the three relative coordinates of two rigid bodies.

Any number of points of one pair moves with three coordinates only: the relative velocity of the two bodies at a place
(here the centre of body a, as that of a piece of ground may be far away) and their relative spin, V. With one row g_i
of G a point, its rate is g_i V; with W the 3x3 inverse mass of V the points see A = G W G^T of one another. The damping
matrix above,
C = 2 z k^(1/2) B^(-1/2) k^(1/2) with B = k^(1/2) A k^(1/2), is then

    C = k G D G^T k,   D = 2 z L S^(-3/2) L^T,   S = L^T (G^T k G) L,   W = L L^T,

because (X X^T)^(-1/2) = X (X^T X)^(-3/2) X^T for X = k^(1/2) G L. On V it acts as 2 z W^(-1/2) S^(1/2) W^(-1/2) with
the symmetric root of W. Where S is singular (all normals parallel: a face) the power is taken over its range. First
steps of contacts enter as w^(1/2) C w^(1/2). The forces are d = P y with P = w^(1/2) k G and

    (I + dt/2 D Q W Q^T) y = D (P^T u + dt/2 Q W G^T (f_before - f_spring)),   Q = P^T G,

the correction for the pair's own forces as above.

Small dense matrices of one pair of bodies: roots, products and linear solve, without allocation.
"""

import math

from blocksim.kernels.common.arrays import AHEAD, BACK, NORMAL, Floats, Record, Records
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.common.tolerances import DASHPOT_RANK, EIGEN_ROUND_OFF, EIGEN_SWEEPS, LEAST_MASS_SHARE


@rare_kernel
def inverse_root(eigenvalue: float, largest: float) -> float:
    """Return eigenvalue^(-1/2), or zero outside the range of the matrix (pseudo-inverse)."""
    return 1.0 / math.sqrt(eigenvalue) if eigenvalue > DASHPOT_RANK * largest else 0.0


@rare_kernel
def rotate_pair(matrix: Floats, vectors: Floats, n: int, p: int, q: int) -> None:
    """Zero matrix[p, q] by one Jacobi rotation and turn the eigenvectors with it."""
    theta = 0.5 * (matrix[q, q] - matrix[p, p]) / matrix[p, q]
    t = (1.0 if theta >= 0.0 else -1.0) / (abs(theta) + math.sqrt(theta * theta + 1.0))
    c = 1.0 / math.sqrt(t * t + 1.0)
    s = t * c
    for k in range(n):
        kp = matrix[k, p]
        kq = matrix[k, q]
        matrix[k, p] = c * kp - s * kq
        matrix[k, q] = s * kp + c * kq
    for k in range(n):
        pk = matrix[p, k]
        qk = matrix[q, k]
        matrix[p, k] = c * pk - s * qk
        matrix[q, k] = s * pk + c * qk
        vp = vectors[k, p]
        vq = vectors[k, q]
        vectors[k, p] = c * vp - s * vq
        vectors[k, q] = s * vp + c * vq


@rare_kernel
def sweep_pairs(matrix: Floats, vectors: Floats, n: int) -> None:
    """Rotate every pair of axes once, where it is not diagonal to round-off."""
    for p in range(n - 1):
        for q in range(p + 1, n):
            if abs(matrix[p, q]) > EIGEN_ROUND_OFF * math.sqrt(abs(matrix[p, p] * matrix[q, q])):
                rotate_pair(matrix, vectors, n, p, q)


@rare_kernel
def inverse_three_halves(matrix: Floats, vectors: Floats, out: Floats) -> None:
    """Write the power -3/2 of a symmetric positive 3 x 3 matrix into `out`, over its range only; destroys `matrix`.

    Cyclic Jacobi rotations.
    """
    for i in range(SIZE):
        for j in range(SIZE):
            vectors[i, j] = 1.0 if i == j else 0.0
    for _ in range(EIGEN_SWEEPS):
        sweep_pairs(matrix, vectors, SIZE)
    largest = max(matrix[0, 0], matrix[1, 1], matrix[2, 2])
    for i in range(SIZE):
        for j in range(SIZE):
            total = 0.0
            for k in range(SIZE):
                root = inverse_root(max(matrix[k, k], 0.0), largest)
                total += vectors[i, k] * vectors[j, k] * root * root * root
            out[i, j] = total


@rare_kernel
def cholesky(matrix: Floats, out: Floats) -> None:
    """Write the lower triangle L of a symmetric positive 3 x 3 matrix L L^T into `out`, zeros above it."""
    for i in range(SIZE):
        for j in range(SIZE):
            total = matrix[i, j]
            for k in range(min(i, j)):
                total -= out[i, k] * out[j, k]
            if i == j:
                out[i, i] = math.sqrt(max(total, 0.0))
            else:
                out[i, j] = total / out[j, j] if i > j else 0.0


@rare_kernel
def multiply(left: Floats, right: Floats, out: Floats) -> None:
    """Write the product of two 3 x 3 matrices into `out`, another one."""
    for i in range(SIZE):
        for j in range(SIZE):
            out[i, j] = left[i, 0] * right[0, j] + left[i, 1] * right[1, j] + left[i, 2] * right[2, j]


@rare_kernel
def multiply_transposed(left: Floats, right: Floats, out: Floats) -> None:
    """Write left^T right, 3 x 3, into `out`, another matrix."""
    for i in range(SIZE):
        for j in range(SIZE):
            out[i, j] = left[0, i] * right[0, j] + left[1, i] * right[1, j] + left[2, i] * right[2, j]


@rare_kernel
def solve_in_place(matrix: Floats, right: Floats, n: int) -> None:
    """Solve matrix x = right; x replaces `right`, `matrix` is destroyed.

    Elimination without pivoting: used for I + (damping)(inverse mass), whose leading minors are positive as both
    factors are symmetric and positive.
    """
    for k in range(n):
        pivot = 1.0 / matrix[k, k]
        for i in range(k + 1, n):
            factor = matrix[i, k] * pivot
            for j in range(k + 1, n):
                matrix[i, j] -= factor * matrix[k, j]
            right[i] -= factor * right[k]
    for k in range(n - 1, -1, -1):
        total = right[k]
        for j in range(k + 1, n):
            total -= matrix[k, j] * right[j]
        right[k] = total / matrix[k, k]


BOTH = 3  # pattern of two points with a dashpot


@kernel
def damp(
    operator: Record,
    is_two: bool,
    one: float,
    two: float,
    before_one: float,
    before_two: float,
    rate_one: float,
    rate_two: float,
) -> tuple[float, float]:
    """Return spring and dashpot forces (N) of one or two points: f + E (u + H (f_before - f))."""
    change_one = before_one - one
    if not is_two:
        return one + operator.e_one * (rate_one + operator.h_one * change_one), 0.0
    change_two = before_two - two
    free_one = rate_one + operator.h_one * change_one + operator.h_mixed * change_two
    free_two = rate_two + operator.h_mixed * change_one + operator.h_two * change_two
    return (
        one + operator.e_one * free_one + operator.e_mixed * free_two,
        two + operator.e_mixed * free_one + operator.e_two * free_two,
    )


@kernel
def fill_operator(
    operator: Record,
    pattern: int,
    ratio: float,
    half: float,
    a: float,
    b: float,
    d: float,
    k_one: float,
    k_two: float,
    w_one: float,
    w_two: float,
) -> None:
    """Make E = (I + dt/2 C A)^-1 C of the points in `pattern`; A = [[a, b], [b, d]] (1/kg), `half` = dt/2 (s).

    Of one c = 2 z w (k/A)^(1/2). Of two C = W^(1/2) C0 W^(1/2), and from B^(1/2) = (B + s I)/t, s^2 = det B and
    t^2 = tr B + 2 s, follows C0^-1 = (A + s k^-1)/(2 z t), so that E = W^(1/2) M^-1 W^(1/2) with
    M = C0^-1 + dt/2 W^(1/2) A W^(1/2). Parallel tangents make A singular, a product u u^T; then C = g v v^T with
    v = W^(1/2) k u and g = 2 z (tr B)^(-3/2) over its range, and E = g/(1 + dt/2 g (u v)^2) v v^T.
    """
    if pattern != BOTH:
        is_one = pattern == 1
        inverse = a if is_one else d
        c = 2.0 * ratio * (w_one * math.sqrt(k_one / inverse) if is_one else w_two * math.sqrt(k_two / inverse))
        damped = c / (1.0 + half * inverse * c)
        operator.e_one = damped if is_one else 0.0
        operator.e_two = 0.0 if is_one else damped
        operator.e_mixed = 0.0
        return
    root_one = root_two = 1.0
    if w_one != 1.0 or w_two != 1.0:
        root_one = math.sqrt(w_one)
        root_two = math.sqrt(w_two)
    trace = k_one * a + k_two * d
    determinant = k_one * k_two * (a * d - b * b)
    if determinant <= DASHPOT_RANK * trace * trace:
        side_one = root_one * k_one
        side_two = root_two * k_two
        along = side_one * a + side_two * d
        scale = 2.0 * ratio / (trace * math.sqrt(trace) + half * 2.0 * ratio * along * along)
        operator.e_one = scale * side_one * side_one * a
        operator.e_mixed = scale * side_one * side_two * b
        operator.e_two = scale * side_two * side_two * d
        return
    s = math.sqrt(determinant)
    t = ratio * math.sqrt(trace + 2.0 * s)
    product = k_one * k_two
    over = 1.0 / (product * t)  # one quotient for three
    c = 0.5 * product * over
    m_one = c * a + half * w_one * a + 0.5 * s * k_two * over
    m_two = c * d + half * w_two * d + 0.5 * s * k_one * over
    m_mixed = (c + half * root_one * root_two) * b
    scale = 1.0 / (m_one * m_two - m_mixed * m_mixed)
    operator.e_one = scale * w_one * m_two
    operator.e_mixed = -scale * root_one * root_two * m_mixed
    operator.e_two = scale * w_two * m_one


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
def keep_dashpots(pair: Record, direction: int, pattern: int, left: int) -> None:
    """Note for how many steps an operator of a pair holds, and the bits of the points that have a dashpot in it."""
    if direction == NORMAL:
        pair.normal_left = left
    else:
        pair.shear_left = left
        pair.sticking = pattern


# indices into the work matrices
MOBILITY, STIFFNESS, GAIN, ROOT, FACTOR, PRODUCT, VECTORS, ROWS = range(8)
CHANGE, FREE, ROW = range(3)  # rows of the last one
SIZE = 3


@rare_kernel
def fill_mobility(a: Record, b: Record, out: Floats) -> None:
    """Write the inverse mass W of the relative motion at the centre of a: (1/kg, 1/(kg m), 1/(kg m2) by blocks)."""
    dx = a.x - b.x
    dy = a.y - b.y
    translation = a.inverse_mass + b.inverse_mass
    turning = b.inverse_inertia
    out[0, 0] = translation + turning * dy * dy
    out[1, 1] = translation + turning * dx * dx
    out[0, 1] = out[1, 0] = -turning * dx * dy
    out[0, 2] = out[2, 0] = -turning * dy
    out[1, 2] = out[2, 1] = turning * dx
    out[2, 2] = turning + a.inverse_inertia


@rare_kernel
def fill_row(place: Record, a: Record, direction: int, row: Floats) -> None:
    """Write how the closing rate or the slip rate of a point follows from the relative motion (-, -, m)."""
    x = place.x - a.x
    y = place.y - a.y
    if direction == NORMAL:
        row[0] = -place.nx
        row[1] = -place.ny
        row[2] = -(x * place.ny - y * place.nx)
    else:
        row[0] = -place.ny
        row[1] = place.nx
        row[2] = x * place.nx + y * place.ny


@rare_kernel
def gather(points: Records, count: int, a: Record, direction: int, work: Floats) -> None:
    """Sum over the points: G^T k G, Q = G^T w^(1/2) k G, P^T u and G^T (f_before - f_spring)."""
    vectors = work[ROWS]
    for i in range(SIZE):
        vectors[CHANGE, i] = vectors[FREE, i] = 0.0
        for j in range(SIZE):
            work[STIFFNESS, i, j] = work[PRODUCT, i, j] = 0.0
    for n in range(count):
        point = points[n]
        fill_row(point, a, direction, vectors[ROW])
        weighted = math.sqrt(point.weight) * point.stiffness
        for i in range(SIZE):
            vectors[CHANGE, i] += vectors[ROW, i] * (point.before - point.force)
            vectors[FREE, i] += vectors[ROW, i] * weighted * point.rate
            for j in range(SIZE):
                outer = vectors[ROW, i] * vectors[ROW, j]
                work[STIFFNESS, i, j] += point.stiffness * outer
                work[PRODUCT, i, j] += weighted * outer


@rare_kernel
def fill_gain(ratio: float, work: Floats) -> None:
    """Write D = 2 z L S^(-3/2) L^T; uses all matrices but the product and the vectors."""
    cholesky(work[MOBILITY], work[ROOT])
    multiply(work[STIFFNESS], work[ROOT], work[GAIN])
    multiply_transposed(work[ROOT], work[GAIN], work[FACTOR])
    inverse_three_halves(work[FACTOR], work[VECTORS], work[GAIN])
    multiply(work[ROOT], work[GAIN], work[FACTOR])
    for i in range(SIZE):
        for j in range(SIZE):
            total = 0.0
            for k in range(SIZE):
                total += work[FACTOR, i, k] * work[ROOT, j, k]
            work[GAIN, i, j] = 2.0 * ratio * total


@rare_kernel
def solve_forces(step: float, work: Floats) -> None:
    """Leave y in the row CHANGE of the vectors: (I + dt/2 D Q W Q^T) y = D (P^T u + dt/2 Q W G^T (f_before - f))."""
    vectors = work[ROWS]
    half = 0.5 * step
    multiply(work[PRODUCT], work[MOBILITY], work[FACTOR])  # Q W; Q is symmetric
    for i in range(SIZE):
        for j in range(SIZE):
            vectors[FREE, i] += half * work[FACTOR, i, j] * vectors[CHANGE, j]
    multiply(work[FACTOR], work[PRODUCT], work[STIFFNESS])
    multiply(work[GAIN], work[STIFFNESS], work[FACTOR])
    for i in range(SIZE):
        vectors[CHANGE, i] = 0.0
        for j in range(SIZE):
            vectors[CHANGE, i] += work[GAIN, i, j] * vectors[FREE, j]
            work[FACTOR, i, j] = half * work[FACTOR, i, j] + (1.0 if i == j else 0.0)
    solve_in_place(work[FACTOR], vectors[CHANGE], SIZE)


@rare_kernel
def add_coupled_dashpots(
    points: Records, count: int, a: Record, b: Record, direction: int, ratio: float, step: float, work: Floats
) -> None:
    """Add the dashpot forces (N) to `force` of every point, which holds the spring force.

    Points without stiffness (they slide) have no dashpot.
    """
    if ratio == 0.0:
        return
    fill_mobility(a, b, work[MOBILITY])
    gather(points, count, a, direction, work)
    fill_gain(ratio, work)
    solve_forces(step, work)
    vectors = work[ROWS]
    for n in range(count):
        point = points[n]
        fill_row(point, a, direction, vectors[ROW])
        total = 0.0
        for i in range(SIZE):
            total += vectors[ROW, i] * vectors[CHANGE, i]
        point.force += math.sqrt(point.weight) * point.stiffness * total

"""Small dense matrices of one pair of bodies: roots, products and linear solve, without allocation."""

import math

from blocksim.kernels.common.arrays import Floats
from blocksim.kernels.common.jit import rare_kernel

# eigenvalues below this share of the largest count as zero: tangents of points on one face are parallel, so that
# their matrix has rank one up to the difference of two overlaps
RANK_TOLERANCE = 1e-4
SIZE = 3
SWEEPS = 6  # quadratic convergence: five bring any 3 x 3 matrix to round-off
ROUND_OFF = 1e-15


@rare_kernel
def inverse_root(eigenvalue: float, largest: float) -> float:
    """Return eigenvalue^(-1/2), or zero outside the range of the matrix (pseudo-inverse)."""
    return 1.0 / math.sqrt(eigenvalue) if eigenvalue > RANK_TOLERANCE * largest else 0.0


@rare_kernel
def inverse_root_2(a: float, b: float, d: float) -> tuple[float, float, float]:
    """Return the inverse square root of the symmetric positive matrix [[a, b], [b, d]], over its range only."""
    middle = 0.5 * (a + d)
    half = 0.5 * (a - d)
    radius = math.sqrt(half * half + b * b)
    high = inverse_root(middle + radius, middle + radius)
    low = inverse_root(max(middle - radius, 0.0), middle + radius)
    # f(A) = mean I + slope (A - middle I) for any function f of a 2 x 2 matrix with eigenvalues middle +- radius
    mean = 0.5 * (high + low)
    slope = 0.5 * (high - low) / radius if radius > 0.0 else 0.0
    return mean + slope * half, slope * b, mean - slope * half


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
            if abs(matrix[p, q]) > ROUND_OFF * math.sqrt(abs(matrix[p, p] * matrix[q, q])):
                rotate_pair(matrix, vectors, n, p, q)


@rare_kernel
def inverse_three_halves(matrix: Floats, vectors: Floats, out: Floats) -> None:
    """Write the power -3/2 of a symmetric positive 3 x 3 matrix into `out`, over its range only; destroys `matrix`.

    Cyclic Jacobi rotations.
    """
    for i in range(SIZE):
        for j in range(SIZE):
            vectors[i, j] = 1.0 if i == j else 0.0
    for _ in range(SWEEPS):
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

"""Small dense matrices of one pair's contact points: inverse square root and linear solve, without allocation."""

import math

from blocksim.kernels.arrays import Floats
from blocksim.kernels.jit import rare_kernel

# eigenvalues below this share of the largest count as zero: tangents of points on one face are parallel, so that
# their matrix has rank one up to the difference of two overlaps
RANK_TOLERANCE = 1e-4
SWEEPS = 12
ROUND_OFF = 1e-15


@rare_kernel
def inverse_root(eigenvalue: float, largest: float) -> float:
    """Return eigenvalue^(-1/2), or zero outside the range of the matrix (pseudo-inverse)."""
    return 1.0 / math.sqrt(eigenvalue) if eigenvalue > RANK_TOLERANCE * largest else 0.0


@rare_kernel
def inverse_root_2(matrix: Floats, out: Floats) -> None:
    """Write the inverse square root of a symmetric positive 2 x 2 matrix into `out`, over its range only."""
    a = matrix[0, 0]
    b = matrix[0, 1]
    d = matrix[1, 1]
    middle = 0.5 * (a + d)
    half = 0.5 * (a - d)
    radius = math.sqrt(half * half + b * b)
    high = inverse_root(middle + radius, middle + radius)
    low = inverse_root(max(middle - radius, 0.0), middle + radius)
    # f(A) = mean I + slope (A - middle I) for any function f of a 2 x 2 matrix with eigenvalues middle +- radius
    mean = 0.5 * (high + low)
    slope = 0.5 * (high - low) / radius if radius > 0.0 else 0.0
    out[0, 0] = mean + slope * half
    out[1, 1] = mean - slope * half
    out[0, 1] = slope * b
    out[1, 0] = slope * b


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
def inverse_root_n(matrix: Floats, vectors: Floats, out: Floats, n: int) -> None:
    """Write the pseudo-inverse square root of a symmetric positive n x n matrix into `out`; destroys `matrix`.

    Cyclic Jacobi rotations; n is 3 to 8 and rare (both corners of one block and one of the other, deep inside).
    """
    for i in range(n):
        for j in range(n):
            vectors[i, j] = 1.0 if i == j else 0.0
    for _ in range(SWEEPS):
        sweep_pairs(matrix, vectors, n)
    largest = 0.0
    for i in range(n):
        largest = max(largest, matrix[i, i])
    for i in range(n):
        for j in range(n):
            total = 0.0
            for k in range(n):
                total += vectors[i, k] * vectors[j, k] * inverse_root(max(matrix[k, k], 0.0), largest)
            out[i, j] = total


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

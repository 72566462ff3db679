"""Dashpots of a pair that touches in more than two points, in the three relative coordinates of two rigid bodies.

Any number of points of one pair moves with three coordinates only: the relative velocity of the two bodies at a place
(here the centre of body a) and their relative spin, V. With one row g_i of G a point, its rate is g_i V; with W the 3x3
inverse mass of V the points see A = G W G^T of one another. The damping matrix of damping.py,
C = 2 z k^(1/2) B^(-1/2) k^(1/2) with B = k^(1/2) A k^(1/2), is then

    C = k G D G^T k,   D = 2 z L S^(-3/2) L^T,   S = L^T (G^T k G) L,   W = L L^T,

because (X X^T)^(-1/2) = X (X^T X)^(-3/2) X^T for X = k^(1/2) G L. On V it acts as 2 z W^(-1/2) S^(1/2) W^(-1/2) with
the symmetric root of W. Where S is singular (all normals parallel: a face) the power is taken over its range. First
steps of contacts enter as w^(1/2) C w^(1/2). The forces are d = P y with P = w^(1/2) k G and

    (I + dt/2 D Q W Q^T) y = D (P^T u + dt/2 Q W G^T (f_before - f_spring)),   Q = P^T G,

the correction for the pair's own forces of damping.py.
"""

import math

from blocksim.kernels.common.arrays import NORMAL, Floats, Record, Records
from blocksim.kernels.common.jit import rare_kernel
from blocksim.kernels.explicit.matrices import (
    cholesky,
    inverse_three_halves,
    multiply,
    multiply_transposed,
    solve_in_place,
)

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
def fill_row(point: Record, direction: int, row: Floats) -> None:
    """Write how the closing rate or the slip rate of a point follows from the relative motion (-, -, m)."""
    if direction == NORMAL:
        row[0] = -point.nx
        row[1] = -point.ny
        row[2] = -point.normal_arm_a
    else:
        row[0] = -point.ny
        row[1] = point.nx
        row[2] = point.shear_arm_a


@rare_kernel
def gather(points: Records, count: int, direction: int, work: Floats) -> None:
    """Sum over the points: G^T k G, Q = G^T w^(1/2) k G, P^T u and G^T (f_before - f_spring)."""
    vectors = work[ROWS]
    for i in range(SIZE):
        vectors[CHANGE, i] = vectors[FREE, i] = 0.0
        for j in range(SIZE):
            work[STIFFNESS, i, j] = work[PRODUCT, i, j] = 0.0
    for n in range(count):
        point = points[n]
        fill_row(point, direction, vectors[ROW])
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
def add_coupled_dashpots(points: Records, count: int, direction: int, ratio: float, step: float, work: Floats) -> None:
    """Add the dashpot forces (N) to `force` of every point, which holds the spring force; `work` holds the mobility.

    Points without stiffness (they slide) have no dashpot.
    """
    gather(points, count, direction, work)
    fill_gain(ratio, work)
    solve_forces(step, work)
    vectors = work[ROWS]
    for n in range(count):
        point = points[n]
        fill_row(point, direction, vectors[ROW])
        total = 0.0
        for i in range(SIZE):
            total += vectors[ROW, i] * vectors[CHANGE, i]
        point.force += math.sqrt(point.weight) * point.stiffness * total

"""Small matrix functions against numpy's eigenvalues and solver."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from blocksim.kernels.common.tolerances import DASHPOT_RANK
from blocksim.kernels.explicit.damping import (
    inverse_three_halves,
    solve_in_place,
)

SEEDS = st.integers(0, 10_000)


def positive(n: int, rank: int, seed: int) -> np.ndarray:
    """Return a random symmetric positive n x n matrix with eigenvalues from 1 to 100, `rank` of them not zero."""
    random = np.random.default_rng(seed)
    basis, _ = np.linalg.qr(random.normal(size=(n, n)))
    values = np.where(np.arange(n) < rank, random.uniform(1.0, 100.0, n), 0.0)
    matrix = (basis * values) @ basis.T
    return np.asarray(0.5 * (matrix + matrix.T))


def power(matrix: np.ndarray, exponent: float) -> np.ndarray:
    """Return a power of a symmetric matrix over its range."""
    values, vectors = np.linalg.eigh(matrix)
    kept = values > DASHPOT_RANK * values.max()
    return np.asarray((vectors[:, kept] * values[kept] ** exponent) @ vectors[:, kept].T)


def by_jacobi(matrix: np.ndarray) -> np.ndarray:
    out = np.zeros((3, 3))
    inverse_three_halves(matrix.copy(), np.zeros((3, 3)), out)
    return out


@given(seed=SEEDS, rank=st.integers(1, 3))
def test_power_of_three_agrees_with_eigenvalues(seed: int, rank: int) -> None:
    matrix = positive(3, rank, seed)
    assert by_jacobi(matrix) == pytest.approx(power(matrix, -1.5), abs=1e-12)


def test_zero_matrix_has_the_root_zero_not_infinity() -> None:
    assert not by_jacobi(np.zeros((3, 3))).any()


@given(n=st.integers(1, 8), seed=SEEDS)
def test_solve_agrees_with_numpy_for_identity_plus_product_of_positive_matrices(n: int, seed: int) -> None:
    matrix = np.eye(n) + positive(n, max(1, n - 1), seed) @ positive(n, n, seed + 1)
    right = np.random.default_rng(seed).normal(size=n)
    solution = right.copy()
    solve_in_place(matrix.copy(), solution, n)
    assert solution == pytest.approx(np.linalg.solve(matrix, right), rel=1e-8, abs=1e-10)

"""Small matrix functions against numpy's eigenvalues and solver."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import sqrtm

from blocksim.kernels.matrices import (
    RANK_TOLERANCE,
    inverse_root,
    inverse_root_2,
    inverse_root_n,
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


def pseudo_inverse_root(matrix: np.ndarray) -> np.ndarray:
    values, vectors = np.linalg.eigh(matrix)
    kept = values > RANK_TOLERANCE * values.max()
    return np.asarray((vectors[:, kept] / np.sqrt(values[kept])) @ vectors[:, kept].T)


def root_by_jacobi(matrix: np.ndarray) -> np.ndarray:
    n = len(matrix)
    out = np.zeros((8, 8))
    work = np.zeros((8, 8))
    work[:n, :n] = matrix
    inverse_root_n(work, np.zeros((8, 8)), out, n)
    assert not out[n:].any()
    return out[:n, :n]


@pytest.mark.parametrize("n", range(1, 9))
@given(seed=SEEDS)
def test_inverse_root_of_any_size_agrees_with_eigenvalues(n: int, seed: int) -> None:
    for rank in {n, max(1, n - 1), min(n, 3)}:
        matrix = positive(n, rank, seed)
        assert root_by_jacobi(matrix) == pytest.approx(pseudo_inverse_root(matrix), abs=1e-12)


@given(seed=SEEDS)
def test_inverse_root_is_the_inverse_of_the_matrix_root(seed: int) -> None:
    matrix = positive(4, 4, seed)
    assert root_by_jacobi(matrix) == pytest.approx(np.linalg.inv(sqrtm(matrix)), abs=1e-11)


@given(seed=SEEDS, rank=st.integers(1, 2))
def test_closed_form_of_two_agrees_with_eigenvalues(seed: int, rank: int) -> None:
    matrix = positive(2, rank, seed)
    out = np.zeros((2, 2))
    inverse_root_2(matrix, out)
    assert out == pytest.approx(pseudo_inverse_root(matrix), abs=1e-12)


@pytest.mark.parametrize(
    "matrix", [np.diag([4.0, 4.0]), np.diag([4.0, 0.0]), np.diag([0.0, 9.0]), np.full((2, 2), 3.0)]
)
def test_special_matrices_of_two_agree_with_eigenvalues(matrix: np.ndarray) -> None:
    out = np.zeros((2, 2))
    inverse_root_2(matrix, out)
    assert out == pytest.approx(pseudo_inverse_root(matrix), abs=1e-14)


def test_zero_matrix_has_the_root_zero_not_infinity() -> None:
    out = np.ones((2, 2))
    inverse_root_2(np.zeros((2, 2)), out)
    assert not out.any()
    assert not root_by_jacobi(np.zeros((3, 3))).any()


def test_eigenvalues_below_the_rank_tolerance_count_as_zero() -> None:
    assert inverse_root(0.9 * RANK_TOLERANCE, 1.0) == 0.0
    assert inverse_root(1.1 * RANK_TOLERANCE, 1.0) == pytest.approx((1.1 * RANK_TOLERANCE) ** -0.5)


@pytest.mark.parametrize("n", range(1, 9))
@given(seed=SEEDS)
def test_solve_agrees_with_numpy_for_identity_plus_product_of_positive_matrices(n: int, seed: int) -> None:
    matrix = np.eye(n) + positive(n, max(1, n - 1), seed) @ positive(n, n, seed + 1)
    right = np.random.default_rng(seed).normal(size=n)
    solution = right.copy()
    solve_in_place(matrix.copy(), solution, n)
    assert solution == pytest.approx(np.linalg.solve(matrix, right), rel=1e-8, abs=1e-10)

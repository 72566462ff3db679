"""Dashpots of one or two points: the same damping ratio for every mode, passive, as defined."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from blocksim.kernels.arrays import OPERATOR, POINT, zeros
from blocksim.kernels.damping import BOTH, OPERATOR_LIFE, add_dashpots
from blocksim.kernels.kinematics import DELASSUS

if TYPE_CHECKING:
    from blocksim.kernels.arrays import Records

STEP = 2e-7
K = 1e9
SEEDS = st.integers(0, 10_000)


def inverse_masses(n: int, seed: int, *, parallel: bool = False) -> np.ndarray:
    """Return what n points of a pair see (1/kg): of rank three at most, of rank one for tangents on one face."""
    random = np.random.default_rng(seed)
    jacobian = random.uniform(-1.0, 1.0, (n, 3)) + np.array([2.0, 0.0, 0.0])
    if parallel:
        jacobian[1:] = jacobian[0]
    return np.asarray(10.0 * jacobian @ jacobian.T)


def contact_points(n: int, seed: int, *, stiffness: tuple[float, ...] = (), weight: float = 1.0) -> Records:
    random = np.random.default_rng(seed)
    points = zeros(2, POINT)
    points.weight[:n] = weight
    points.stiffness[:n] = stiffness or K
    points.rate[:n] = random.normal(size=n)
    points.before[:n] = random.uniform(0.0, 100.0, n)
    points.force[:n] = random.uniform(0.0, 100.0, n)
    return points


def work_with(delassus: np.ndarray) -> np.ndarray:
    work = np.zeros((8, 3, 3))
    work[DELASSUS, : len(delassus), : len(delassus)] = delassus
    return work


def damping_matrix(points: Records, delassus: np.ndarray, ratio: float) -> np.ndarray:
    """Return C, which is what a step of no length leaves of the dashpots: the force for each rate alone."""
    n, columns = len(delassus), []
    points.before[:] = points.force[:] = 0.0
    for j in range(n):
        points.rate[:n] = np.eye(n)[j]
        operator = zeros(1, OPERATOR)[0]
        add_dashpots(points, n, (1 << n) - 1, ratio, 0.0, operator, work_with(delassus))
        columns.append(points.force[:n].copy())
        points.force[:] = 0.0
    return np.array(columns).T


def by_definition(points: Records, delassus: np.ndarray, ratio: float) -> np.ndarray:
    """Return the dashpot forces from d = C (u + dt/2 A (f_before - f_spring - d)), solved by numpy."""
    n = len(delassus)
    root = np.sqrt(points.stiffness[:n] * points.weight[:n])
    scale = np.sqrt(points.stiffness[:n])
    values, vectors = np.linalg.eigh(scale[:, None] * delassus * scale)
    inverse = [value**-0.5 if value > 1e-4 * values.max() else 0.0 for value in values]
    c = 2.0 * ratio * root[:, None] * ((vectors * inverse) @ vectors.T) * root
    free = points.rate[:n] + 0.5 * STEP * delassus @ (points.before[:n] - points.force[:n])
    return np.asarray(np.linalg.solve(np.eye(n) + 0.5 * STEP * c @ delassus, c @ free))


def added(points: Records, delassus: np.ndarray, ratio: float, pattern: int) -> np.ndarray:
    n, before = len(delassus), points.force.copy()
    add_dashpots(points, n, pattern, ratio, STEP, zeros(1, OPERATOR)[0], work_with(delassus))
    assert not (points.force - before)[n:].any()
    return np.asarray((points.force - before)[:n])


@pytest.mark.parametrize("ratio", [0.05, 0.3, 0.9])
@pytest.mark.parametrize("stiffness", [(K,), (K, K), (K, 0.2 * K)])
@given(seed=SEEDS)
def test_every_mode_of_a_pair_has_the_asked_damping_ratio(
    stiffness: tuple[float, ...], ratio: float, seed: int
) -> None:
    n = len(stiffness)
    delassus = inverse_masses(n, seed) + 5.0 * np.eye(n)
    damping = damping_matrix(contact_points(n, seed, stiffness=stiffness), delassus, ratio)
    motion = np.block([[np.zeros((n, n)), np.eye(n)], [-delassus * stiffness, -delassus @ damping]])  # x, x'
    modes = np.linalg.eigvals(motion)
    assert -modes.real / np.abs(modes) == pytest.approx(np.full(2 * n, ratio), rel=1e-6)


@pytest.mark.parametrize("parallel", [False, True])
@given(seed=SEEDS)
def test_dashpots_never_feed_energy(parallel: bool, seed: int) -> None:
    points = contact_points(2, seed)
    points.weight[:] = np.random.default_rng(seed).uniform(0.5, 1.5, 2)
    damping = damping_matrix(points, inverse_masses(2, seed, parallel=parallel), 0.7)
    assert damping == pytest.approx(damping.T, rel=1e-9, abs=1e-9 * np.abs(damping).max())
    assert np.linalg.eigvalsh(damping).min() > -1e-9 * np.abs(damping).max()


@pytest.mark.parametrize("weight", [0.6, 1.0, 1.4])
@pytest.mark.parametrize("ratio", [0.1, 1.0, 5.0])
@given(seed=SEEDS)
def test_one_point_gets_the_dashpot_of_its_own_mass(ratio: float, weight: float, seed: int) -> None:
    delassus = inverse_masses(1, seed)
    points = contact_points(1, seed, weight=weight)
    expected = by_definition(points, delassus, ratio)
    assert added(points, delassus, ratio, 1) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("parallel", [False, True])
@pytest.mark.parametrize(
    ("stiffness", "weights"), [((K, K), (1.0, 1.0)), ((K, K), (0.6, 1.3)), ((K, 0.1 * K), (1.0, 0.7))]
)
@given(seed=SEEDS, ratio=st.sampled_from([0.1, 1.0, 5.0]))
def test_two_points_follow_the_definition(
    parallel: bool, stiffness: tuple[float, ...], weights: tuple[float, ...], ratio: float, seed: int
) -> None:
    delassus = inverse_masses(2, seed, parallel=parallel) + (0.0 if parallel else 2.0) * np.eye(2)
    points = contact_points(2, seed, stiffness=stiffness)
    points.weight[:] = weights
    expected = by_definition(points, delassus, ratio)
    size = np.abs(expected).max()
    assert added(points, delassus, ratio, BOTH) == pytest.approx(expected, rel=1e-7, abs=1e-9 * size)


@pytest.mark.parametrize("sticking", [1, 2])
@given(seed=SEEDS)
def test_sliding_point_beside_a_sticking_one_has_no_dashpot(sticking: int, seed: int) -> None:
    delassus = inverse_masses(2, seed) + 2.0 * np.eye(2)
    points = contact_points(2, seed)
    points.stiffness[2 - sticking] = 0.0
    expected = by_definition(points, delassus, 0.7)
    forces = added(points, delassus, 0.7, sticking)
    assert forces[2 - sticking] == 0.0
    assert forces == pytest.approx(expected, rel=1e-9)


def test_operator_is_kept_for_lasting_contacts_and_then_made_anew() -> None:
    operator = zeros(1, OPERATOR)[0]
    work = work_with(inverse_masses(2, 1) + np.eye(2))
    for left in [*range(OPERATOR_LIFE, -1, -1), OPERATOR_LIFE]:
        add_dashpots(contact_points(2, 1), 2, BOTH, 0.7, STEP, operator, work)
        assert operator.left == left


def test_operator_of_a_first_step_is_not_kept() -> None:
    operator = zeros(1, OPERATOR)[0]
    work = work_with(inverse_masses(2, 1) + np.eye(2))
    add_dashpots(contact_points(2, 1, weight=0.7), 2, BOTH, 0.7, STEP, operator, work)
    assert operator.left == 0


def test_operator_of_a_step_without_length_is_not_kept() -> None:
    operator = zeros(1, OPERATOR)[0]
    work = work_with(inverse_masses(2, 1) + np.eye(2))
    add_dashpots(contact_points(2, 1), 2, BOTH, 0.7, 0.0, operator, work)
    assert operator.left == 0

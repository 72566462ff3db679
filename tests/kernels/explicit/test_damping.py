"""Dashpots: the same damping ratio for every mode, as defined for any number of points."""

from __future__ import annotations

from math import cos, pi, sin
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, strategies as st

from blocksim.kernels.common.arrays import NORMAL, OPERATOR, PAIR, POINT, SHEAR, zeros
from blocksim.kernels.common.tolerances import DASHPOT_RANK
from blocksim.kernels.explicit.damping import (
    BOTH,
    SIZE,
    add_coupled_dashpots,
    are_dashpots_due,
    damp,
    fill_operator,
    inverse_three_halves,
    keep_dashpots,
    keep_masses,
)
from blocksim.kernels.explicit.kinematics import resolve_point
from blocksim.verification.scene import HEIGHT, WIDTH
from tests.kernels.references import dashpots_by_definition, delassus
from tests.kernels.scenes import make_body

if TYPE_CHECKING:
    from blocksim.kernels.common.arrays import Record, Records
    from tests.conftest import Start


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
    points = zeros(n, POINT)
    points.weight = weight
    points.stiffness = stiffness or K
    points.rate = random.normal(size=n)
    points.before = random.uniform(0.0, 100.0, n)
    points.force = random.uniform(0.0, 100.0, n)
    return points


def operator_of(points: Records, masses: np.ndarray, ratio: float, pattern: int, step: float = STEP) -> Record:
    """Return the operator of one or two points as the kernels make it."""
    operator, half = zeros(1, OPERATOR)[0], 0.5 * step
    one, two = points[0], points[-1]
    a, b, d = masses[0, 0], masses[0, -1], masses[-1, -1]
    keep_masses(operator, half, a, b, d)
    weights = one.weight, two.weight
    fill_operator(operator, pattern, ratio, half, a, b, d, one.stiffness, two.stiffness, *weights)
    return operator


def damped(points: Records, operator: Record) -> np.ndarray:
    """Return spring and dashpot forces of all points."""
    one, two, n = points[0], points[-1], points.size
    return np.array(damp(operator, n == 2, one.force, two.force, one.before, two.before, one.rate, two.rate)[:n])


def damping_matrix(points: Records, masses: np.ndarray, ratio: float) -> np.ndarray:
    """Return C, which is what a step of no length leaves of the dashpots: the force for each rate alone."""
    n, columns = len(masses), []
    points.before = points.force = 0.0
    operator = operator_of(points, masses, ratio, (1 << n) - 1, 0.0)
    for unit in np.eye(n):
        points.rate = unit
        columns.append(damped(points, operator))
    return np.array(columns).T


@pytest.mark.parametrize("stiffness", [(K,), (K, K), (K, 0.2 * K)])
@given(seed=SEEDS, ratio=st.sampled_from([0.05, 0.3, 0.9]))
def test_every_mode_of_a_pair_has_the_asked_damping_ratio(
    stiffness: tuple[float, ...], ratio: float, seed: int
) -> None:
    n = len(stiffness)
    masses = inverse_masses(n, seed) + 5.0 * np.eye(n)
    damping = damping_matrix(contact_points(n, seed, stiffness=stiffness), masses, ratio)
    motion = np.block([[np.zeros((n, n)), np.eye(n)], [-masses * stiffness, -masses @ damping]])  # x, x'
    modes = np.linalg.eigvals(motion)
    assert -modes.real / np.abs(modes) == pytest.approx(np.full(2 * n, ratio), rel=1e-6)


@pytest.mark.parametrize("direction", [NORMAL, SHEAR])
def test_operator_of_one_direction_is_due_after_as_many_uses_as_it_was_kept_for(direction: int) -> None:
    pair = zeros(1, PAIR)[0]
    keep_dashpots(pair, NORMAL, BOTH, 9)
    keep_dashpots(pair, SHEAR, 2, 9)
    keep_dashpots(pair, direction, 1, 3)
    assert [are_dashpots_due(pair, direction) for _ in range(5)] == [False] * 3 + [True] * 2
    assert (pair.normal_left, pair.shear_left) == ((0, 9) if direction == NORMAL else (9, 0))
    assert pair.sticking == (2 if direction == NORMAL else 1)  # normals have their dashpots always


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize("friction", [0.1, 0.5])
@pytest.mark.parametrize("restitution", [0.2, 0.5, 0.8])
def test_corner_that_slides_rebounds_as_asked(start: Start, restitution: float, friction: float, way: float) -> None:
    """With the mass of a corner without friction it left at 0.45 to 0.57 of its speed where 0.5 was asked."""
    turned, speed = pi / 6.0, 1.0
    x = 0.5 * (HEIGHT * sin(turned) - WIDTH * cos(turned))
    y = -0.5 * (WIDTH * sin(turned) + HEIGHT * cos(turned))
    falling = {"y": 1e-7 - y, "angle": turned, "velocity": [3.0 * way, -speed]}
    scene = start([falling], restitution=restitution, ground_friction=friction, gravity=0.0)
    scene.to_step(20)
    while scene.contacts > 0:
        scene.to_step(scene.steps + 5)
    block = scene.bodies[0]
    assert way * (block.vx - block.spin * y) > 0.0  # it has slid all the time
    assert block.vy + block.spin * x == pytest.approx(restitution * speed, abs=2e-3)


def scene(seed: int, n: int, *, parallel: bool) -> tuple[Record, Record, Records]:
    """Return two bodies and n points between them with random forces and stiffnesses; normals alike or not."""
    random = np.random.default_rng(seed)
    a, b = make_body(0.1, 0.2, 0.3), make_body(0.12, 0.18, -0.5, width=0.05, mass=0.3)
    for body in (a, b):
        for name in ("vx", "vy", "spin"):
            body[name] = random.normal()
    points = zeros(n, POINT)
    angle = random.uniform(-np.pi, np.pi)
    for point in points:
        angle = angle if parallel else random.uniform(-np.pi, np.pi)
        point.x, point.y = 0.11 + 0.01 * random.normal(), 0.19 + 0.01 * random.normal()
        point.nx, point.ny = np.cos(angle), np.sin(angle)
        resolve_point(point, a, b, STEP)
    points.stiffness = random.uniform(1e6, 1e8, n)
    points.weight = random.uniform(0.5, 1.5, n)
    points.before, points.force = random.uniform(0.0, 100.0, (2, n))
    return a, b, points


def added(points: Records, a: Record, b: Record, direction: int, ratio: float) -> np.ndarray:
    work, before = np.zeros((8, SIZE, SIZE)), points.force.copy()
    add_coupled_dashpots(points, points.size, a, b, direction, ratio, STEP, work)
    return np.asarray(points.force - before)


@pytest.mark.parametrize("parallel", [False, True])
@pytest.mark.parametrize("direction", [NORMAL, SHEAR])
@given(seed=SEEDS, n=st.integers(3, 40), ratio=st.sampled_from([0.1, 1.0, 5.0]))
def test_any_number_of_points_follows_the_definition(
    direction: int, parallel: bool, ratio: float, n: int, seed: int
) -> None:
    a, b, points = scene(seed, n, parallel=parallel)
    resolved = points.closing_rate if direction == NORMAL else points.slip_rate
    points.rate = resolved
    expected = dashpots_by_definition(points, delassus(points, a, b, direction), ratio, STEP)
    forces = added(points, a, b, direction, ratio)
    assert forces == pytest.approx(expected, rel=1e-6, abs=1e-6 * np.abs(expected).max())


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

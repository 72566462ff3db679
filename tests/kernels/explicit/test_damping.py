"""Dashpots: the same damping ratio for every mode, as defined for any number of points."""

from __future__ import annotations

from math import cos, pi, sin
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from blocksim.kernels.common.arrays import NORMAL, OPERATOR, PAIR, POINT, SHEAR, zeros
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
    from tests.conftest import Start


STEP = 2e-7
K = 1e9
SEEDS = st.integers(0, 10_000)


def damping_matrix(stiffness: tuple[float, ...], masses: np.ndarray, ratio: float) -> np.ndarray:
    """Return C, which is what a step of no length leaves of the dashpots: the force for each rate alone."""
    operator, n = zeros(1, OPERATOR)[0], len(stiffness)
    seen = masses[0, 0], masses[0, -1], masses[-1, -1]
    keep_masses(operator, 0.0, *seen)
    fill_operator(operator, (1 << n) - 1, ratio, 0.0, *seen, stiffness[0], stiffness[-1], 1.0, 1.0)
    return np.array([damp(operator, n == 2, 0.0, 0.0, 0.0, 0.0, unit[0], unit[-1])[:n] for unit in np.eye(n)]).T


@pytest.mark.parametrize("stiffness", [(K,), (K, K), (K, 0.2 * K)])
@given(seed=SEEDS, ratio=st.sampled_from([0.05, 0.3, 0.9]))
def test_every_mode_of_a_pair_has_the_asked_damping_ratio(
    stiffness: tuple[float, ...], ratio: float, seed: int
) -> None:
    n = len(stiffness)
    rows = np.random.default_rng(seed).uniform(-1.0, 1.0, (n, 3)) + np.array([2.0, 0.0, 0.0])
    masses = 10.0 * rows @ rows.T + 5.0 * np.eye(n)  # 1/kg
    damping = damping_matrix(stiffness, masses, ratio)
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


@pytest.mark.parametrize("parallel", [False, True])
@pytest.mark.parametrize("direction", [NORMAL, SHEAR])
@given(seed=SEEDS, n=st.integers(3, 40), ratio=st.sampled_from([0.1, 1.0, 5.0]))
def test_any_number_of_points_follows_the_definition(
    direction: int, parallel: bool, ratio: float, n: int, seed: int
) -> None:
    """Points between two moving bodies, with random forces and stiffnesses; normals alike or not."""
    random = np.random.default_rng(seed)
    points: Any = zeros(n, POINT)
    a, b = make_body(0.1, 0.2, 0.3), make_body(0.12, 0.18, -0.5, width=0.05, mass=0.3)
    for body in (a, b):
        body.vx, body.vy, body.spin = random.normal(size=3)
    angle = random.uniform(-np.pi, np.pi)
    for point in points:
        angle = angle if parallel else random.uniform(-np.pi, np.pi)
        point.x, point.y = np.array([0.11, 0.19]) + 0.01 * random.normal(size=2)
        point.nx, point.ny = np.cos(angle), np.sin(angle)
        resolve_point(point, a, b, STEP)
    points.stiffness, points.weight = random.uniform(1e6, 1e8, n), random.uniform(0.5, 1.5, n)
    points.before, points.force = random.uniform(0.0, 100.0, (2, n))
    resolved = points.closing_rate if direction == NORMAL else points.slip_rate
    points.rate, before = resolved, points.force.copy()
    expected = dashpots_by_definition(points, delassus(points, a, b, direction), ratio, STEP)
    add_coupled_dashpots(points, n, a, b, direction, ratio, STEP, np.zeros((8, SIZE, SIZE)))
    assert points.force - before == pytest.approx(expected, rel=1e-6, abs=1e-6 * np.abs(expected).max())


@given(seed=SEEDS, rank=st.integers(1, 3))
def test_power_of_three_agrees_with_eigenvalues(seed: int, rank: int) -> None:
    """A matrix of eigenvalues from 1 to 100, `rank` of them not zero."""
    random, found = np.random.default_rng(seed), np.zeros((3, 3))
    basis, _ = np.linalg.qr(random.normal(size=(3, 3)))
    values = np.where(np.arange(3) < rank, random.uniform(1.0, 100.0, 3), 0.0)
    powers = np.array([value**-1.5 if value else 0.0 for value in values])
    inverse_three_halves((basis * values) @ basis.T, np.zeros((3, 3)), found)
    assert found == pytest.approx((basis * powers) @ basis.T, abs=1e-12)

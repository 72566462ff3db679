"""Dashpots of many points in three relative coordinates against the definition with the full matrix of all points."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, strategies as st

from blocksim.kernels.common.arrays import NORMAL, POINT, SHEAR, zeros
from blocksim.kernels.explicit.damping import SIZE, add_coupled_dashpots
from blocksim.kernels.explicit.kinematics import resolve_point
from tests.kernels.conftest import dashpots_by_definition, delassus

if TYPE_CHECKING:
    from blocksim.kernels.common.arrays import Record, Records
    from tests.kernels.conftest import MakeBody

STEP = 2e-7
SEEDS = st.integers(0, 10_000)


def scene(make_body: MakeBody, seed: int, n: int, *, parallel: bool) -> tuple[Record, Record, Records]:
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
    make_body: MakeBody, direction: int, parallel: bool, ratio: float, n: int, seed: int
) -> None:
    a, b, points = scene(make_body, seed, n, parallel=parallel)
    resolved = points.closing_rate if direction == NORMAL else points.slip_rate
    points.rate = resolved
    expected = dashpots_by_definition(points, delassus(points, a, b, direction), ratio, STEP)
    forces = added(points, a, b, direction, ratio)
    assert forces == pytest.approx(expected, rel=1e-6, abs=1e-6 * np.abs(expected).max())

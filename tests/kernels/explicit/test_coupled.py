"""Dashpots of many points in three relative coordinates against the definition with the full matrix of all points."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, strategies as st

from blocksim.kernels.common.arrays import NORMAL, POINT, SHEAR, zeros
from blocksim.kernels.explicit.damping import SIZE, add_coupled_dashpots, fill_mobility, fill_row
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


@pytest.mark.parametrize("direction", [NORMAL, SHEAR])
@given(seed=SEEDS)
def test_rows_and_mobility_give_the_inverse_masses_that_points_see(
    make_body: MakeBody, direction: int, seed: int
) -> None:
    a, b, points = scene(make_body, seed, 5, parallel=False)
    mobility, rows = np.zeros((SIZE, SIZE)), np.zeros((5, SIZE))
    fill_mobility(a, b, mobility)
    for point, row in zip(points, rows, strict=True):
        fill_row(point, a, direction, row)
    assert rows @ mobility @ rows.T == pytest.approx(delassus(points, a, b, direction), rel=1e-10, abs=1e-9)


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


@given(seed=SEEDS)
def test_points_that_slide_have_no_dashpot(make_body: MakeBody, seed: int) -> None:
    a, b, points = scene(make_body, seed, 6, parallel=True)
    points.rate = points.slip_rate
    points.stiffness[[1, 4]] = 0.0
    forces = added(points, a, b, SHEAR, 0.7)
    assert not forces[[1, 4]].any()
    assert forces[[0, 2, 3, 5]].all()


@given(seed=SEEDS)
def test_more_particles_on_a_face_damp_it_just_as_much(make_body: MakeBody, seed: int) -> None:
    """Resultant force and torque of a face in rigid approach depend on its stiffness, not on the number of points."""
    random = np.random.default_rng(seed)
    a, b = make_body(0.0, 0.0125), make_body(0.0, -0.1, mass=1.0)
    a.vy, a.spin = random.normal(size=2)
    wrenches = []
    for n in (8, 64):
        points = zeros(n, POINT)
        points.ny = 1.0
        points.x = 0.016 * (2.0 * np.arange(n) + 1.0 - n) / n
        points.stiffness = 1e8 / n
        for point in points:
            resolve_point(point, a, b, STEP)
        points.rate = points.closing_rate
        forces = added(points, a, b, NORMAL, 0.5)
        wrenches.append((forces.sum(), (forces * points.x).sum()))
    assert wrenches[0] == pytest.approx(wrenches[1], rel=0.02)

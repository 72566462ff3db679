"""Rates and inverse masses at contact points against rigid-body kinematics written with numpy."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from blocksim.kernels.common.arrays import (
    CONTACT,
    INTERACTION,
    NORMAL,
    OPERATOR,
    PAIR,
    POINT,
    SHEAR,
    SLOTS,
    zeros,
)
from blocksim.kernels.explicit.forces import Touch, inverse_masses
from blocksim.kernels.explicit.kinematics import point_of, resolve_point, weigh_first_step
from blocksim.kernels.explicit.laws import LINEAR
from tests.kernels.conftest import delassus

if TYPE_CHECKING:
    from blocksim.kernels.common.arrays import Record, Records
    from tests.kernels.conftest import MakeBody

STEP = 1e-6
SEEDS = st.integers(0, 10_000)


def scene(make_body: MakeBody, seed: int, count: int) -> tuple[Record, Record, Records]:
    """Return two moving bodies and `count` points between them with random normals."""
    random = np.random.default_rng(seed)
    a, b = make_body(0.1, 0.2, 0.3), make_body(0.12, 0.18, -0.5, width=0.05, mass=0.3)
    for body in (a, b):
        for name in ("vx", "vy", "spin", "ax", "ay", "spin_rate"):
            body[name] = random.normal()
    points = zeros(SLOTS, POINT)
    for point in points[:count]:
        angle = random.uniform(-np.pi, np.pi)
        point.x, point.y = 0.11 + 0.01 * random.normal(), 0.19 + 0.01 * random.normal()
        point.nx, point.ny = np.cos(angle), np.sin(angle)
        resolve_point(point, a, b, STEP)
    return a, b, points


def jacobian(point: Record, a: Record, b: Record, direction: np.ndarray) -> np.ndarray:
    """Return what the relative velocity of a against b along a direction is of (v_a, w_a, v_b, w_b)."""
    arms = [direction[1] * (point.x - body.x) - direction[0] * (point.y - body.y) for body in (a, b)]
    return np.array([*direction, arms[0], *-direction, -arms[1]])


def directions(point: Record) -> tuple[np.ndarray, np.ndarray]:
    return np.array([point.nx, point.ny]), np.array([-point.ny, point.nx])


@given(seed=SEEDS)
def test_displacements_and_rates_are_those_of_rigid_bodies(make_body: MakeBody, seed: int) -> None:
    a, b, points = scene(make_body, seed, 1)
    point = points[0]
    velocity = np.array([a.vx, a.vy, a.spin, b.vx, b.vy, b.spin])
    acceleration = np.array([a.ax, a.ay, a.spin_rate, b.ax, b.ay, b.spin_rate])
    normal, tangent = (jacobian(point, a, b, direction) for direction in directions(point))
    later = velocity + 0.5 * STEP * acceleration
    assert point.closing == pytest.approx(-STEP * normal @ velocity, abs=1e-20)
    assert point.slipping == pytest.approx(STEP * tangent @ velocity, abs=1e-20)
    assert point.closing_rate == pytest.approx(-normal @ later, abs=1e-14)
    assert point.slip_rate == pytest.approx(tangent @ later, abs=1e-14)


@given(seed=SEEDS, count=st.integers(1, 2))
def test_inverse_masses_are_those_of_the_jacobian(make_body: MakeBody, seed: int, count: int) -> None:
    a, b, points = scene(make_body, seed, count)
    some: Any = points[:count]
    contact, operator = zeros(1, CONTACT)[0], zeros(1, OPERATOR)[0]
    touch = Touch(zeros(1, PAIR)[0], a, b, zeros(1, INTERACTION)[0], contact, contact, operator, operator)
    one, two = (point_of(points[i], b) for i in (0, count - 1))
    for direction in (NORMAL, SHEAR):
        expected = delassus(some, a, b, direction)
        found = inverse_masses(touch, one, two, count == 2, direction)
        assert found == pytest.approx((expected[0, 0], expected[0, -1], expected[-1, -1]), rel=1e-10, abs=1e-10)


@pytest.mark.parametrize(("depth", "weight"), [(0.0, 0.5), (0.25e-6, 0.75), (1e-6, 1.5)])
def test_first_step_weighs_the_dashpot_by_the_time_in_contact(depth: float, weight: float) -> None:
    point = zeros(1, POINT)[0]
    point.weight = point.drawn = 1.0
    point.closing, point.depth = 1e-6, depth
    weigh_first_step(point, LINEAR)
    assert point.weight == pytest.approx(weight)
    assert point.drawn == pytest.approx(depth / 1e-6)

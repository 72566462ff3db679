"""Motion of the support from the scenario to the kernels."""

from __future__ import annotations

from math import cos, pi, radians, sin
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.kernels.common.supports import acceleration, displacement, piece_at
from blocksim.verification.scene import scenario_of
from blocksim.world.build import build_world
from blocksim.world.excitation import support_pieces

if TYPE_CHECKING:
    from blocksim.scenario import Scenario

SHAKING: dict[str, Any] = {"kind": "harmonic", "amplitude": 0.01, "frequency": 5.0, "direction": "30 deg"}


def scenario(**motion: object) -> Scenario:
    return scenario_of([{"y": 0.5}], motion={**SHAKING, **motion}, time={"end": 2.0})


def displaced(of: Scenario, time: float) -> float:
    records = support_pieces(of)
    return float(displacement(records[piece_at(records, 0, time)], time))


def direction_of(one: Scenario) -> tuple[float, float]:
    controls = build_world(one).controls[0]
    return float(controls.motion_x), float(controls.motion_y)


def test_support_without_motion_has_no_direction_and_stays() -> None:
    still = scenario_of([{"y": 0.5}])
    records = support_pieces(still)
    assert displacement(records[0], 10.0) == 0.0
    assert [build_world(still).controls[0][name] for name in ("motion_x", "motion_y")] == [0.0, 0.0]


def test_direction_counts_counter_clockwise_from_plus_x() -> None:
    assert direction_of(scenario()) == pytest.approx((cos(radians(30)), sin(radians(30))))
    controls = build_world(scenario(direction="90 deg")).controls[0]
    assert [controls.motion_x, controls.motion_y] == pytest.approx([0.0, 1.0], abs=1e-15)


@pytest.mark.parametrize("time", [0.25, 0.333, 1.0, 1.987])
def test_harmonic_motion_is_a_sine_after_its_ramp(time: float) -> None:
    of, speed = scenario(), 2.0 * pi * 5.0
    assert displaced(of, time) == pytest.approx(0.01 * sin(speed * time), abs=1e-9)
    records = support_pieces(of)
    found = acceleration(records[piece_at(records, 0, time)], time)
    assert found == pytest.approx(-0.01 * speed**2 * sin(speed * time), abs=1e-3 * 0.01 * speed**2)


def test_motion_rests_before_its_start_and_after_its_duration() -> None:
    of = scenario(start=0.5, duration=1.0)
    assert displaced(of, 0.4) == 0.0
    assert abs(displaced(of, 0.9)) > 0.0
    last = support_pieces(of)[-1]
    assert last.start == pytest.approx(1.5)
    assert (last.c1, last.c2, last.c3) == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)


def test_pieces_join_without_jump_of_place_or_velocity() -> None:
    records = support_pieces(scenario(duration=1.5))
    lengths = np.diff(records.start)
    one: Any = records[:-1]
    two: Any = records[1:]
    ends = one.c0 + lengths * (one.c1 + lengths * (one.c2 + lengths * one.c3))
    speeds = one.c1 + lengths * (2.0 * one.c2 + lengths * 3.0 * one.c3)
    assert ends == pytest.approx(two.c0, abs=1e-15)
    assert speeds == pytest.approx(two.c1, abs=1e-12)


def test_all_that_moves_with_the_support_is_listed_where_it_starts() -> None:
    bodies = [{"y": 0.5, "fixed": True}, {"x": 0.2, "y": 0.5}, {"x": 0.4, "y": 0.7, "fixed": True}]
    world = build_world(scenario_of(bodies, motion=SHAKING, time={"end": 2.0}))
    assert world.moved.body.tolist() == [0, 2, 3]
    assert world.moved.x.tolist() == [0.0, 0.4, 0.0]
    assert world.moved.y.tolist() == [0.5, 0.7, 0.0]
    assert not world.moved.fx.any()
    assert not world.moved.fy.any()

"""Motion of the support from the scenario to the kernels."""

from __future__ import annotations

from math import cos, radians, sin
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.kernels.common.supports import displacement, piece_at
from blocksim.scenario.motion import displacement_and_velocity, motion_pieces
from blocksim.verification.scene import scenario_of
from blocksim.world.build import build_world
from blocksim.world.excitation import support_pieces

if TYPE_CHECKING:
    from blocksim.scenario import Scenario

SHAKING: dict[str, Any] = {"kind": "harmonic", "amplitude": 0.01, "frequency": 5.0, "direction": "30 deg"}


def scenario(**motion: object) -> Scenario:
    return scenario_of([{"y": 0.5}], motion={**SHAKING, **motion}, time={"end": 2.0})


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


def test_pieces_are_those_of_the_scenario_and_each_is_found_by_its_time() -> None:
    of = scenario(start=0.5, duration=1.0)
    records, pieces = support_pieces(of), motion_pieces(of)
    found = np.stack([records.c0, records.c1, records.c2, records.c3], axis=1)
    assert records.start.tolist() == pieces.times[: records.size].tolist()
    assert found[: len(pieces.coefficients)].tolist() == pieces.coefficients.tolist()
    times = np.array([0.4, 0.7, 0.9, 1.6])
    places = [displacement(records[piece_at(records, 0, time)], time) for time in times]
    assert places == pytest.approx(displacement_and_velocity(pieces, times)[0], abs=1e-15)


def test_all_that_moves_with_the_support_is_listed_where_it_starts() -> None:
    bodies = [{"y": 0.5, "fixed": True}, {"x": 0.2, "y": 0.5}, {"x": 0.4, "y": 0.7, "fixed": True}]
    world = build_world(scenario_of(bodies, motion=SHAKING, time={"end": 2.0}))
    assert world.moved.body.tolist() == [0, 2, 3]
    assert world.moved.x.tolist() == [0.0, 0.4, 0.0]
    assert world.moved.y.tolist() == [0.5, 0.7, 0.0]
    assert not world.moved.fx.any()
    assert not world.moved.fy.any()

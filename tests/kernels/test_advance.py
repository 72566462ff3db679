"""What ends a run, and that a run starts only once."""

from __future__ import annotations

from math import inf, nan
from typing import TYPE_CHECKING

import pytest

from blocksim.kernels.arrays import AT_REST, NOT_FINITE, OVERLAP_LIMIT, REACHED

if TYPE_CHECKING:
    from collections.abc import Callable

    from blocksim.kernels.arrays import World
    from tests.conftest import Start

FALLING = {"y": 0.03, "angle": 0.3}
SOFT = {"stiffness_scale": 1e-4}  # a hundredth of the steps


def with_value(name: str, value: float) -> Callable[[World], None]:
    def change(world: World) -> None:
        world.bodies[0][name] = value

    return change


def test_overlap_beyond_a_share_of_the_smallest_side_stops_the_run(start: Start) -> None:
    small = {**FALLING, "height": 0.01, "y": 0.02}
    for body, limit in ((FALLING, 0.05 * 0.025), (small, 0.05 * 0.01)):
        thrown = {**body, "velocity": [0.0, -1.0]}
        scene = start([thrown], contact={"normal_stiffness": 1e4}).to_time(1.0)
        assert scene.status == OVERLAP_LIMIT
        assert limit < scene.measured()[-1] < limit + 2.0 * scene.step


@pytest.mark.usefixtures("compiler")  # the cosine of infinity is an exception in Python, not a number in IEEE
@pytest.mark.parametrize("name", ["x", "y", "angle", "vx", "vy", "spin"])
@pytest.mark.parametrize("value", [nan, inf])
def test_state_that_is_not_finite_stops_the_run(start: Start, name: str, value: float) -> None:
    scene = start([{"y": 1.0}], change=with_value(name, value)).to_time(1e-2)
    assert scene.status == NOT_FINITE
    assert scene.time == pytest.approx(1e-4, rel=0.01)


def test_overlap_beyond_the_limit_stops_the_run(start: Start) -> None:
    scene = start([FALLING], contact={"normal_stiffness": 100.0, "max_overlap": 2e-4}).to_time(1.0)
    assert scene.status == OVERLAP_LIMIT
    assert 2e-4 < scene.measured()[-1] < 4e-4


def test_rest_must_last_before_it_stops_the_run(start: Start) -> None:
    rest = {"stop_at_rest": True, "rest_speed": 2e-2, "rest_hold": 0.02}
    scene = start([{"y": 0.0125}], time=rest, contact=SOFT).to_time(1.0)
    assert scene.status == AT_REST
    assert scene.time == pytest.approx(0.02, abs=1e-3)


def test_block_at_the_top_of_its_flight_is_not_at_rest(start: Start) -> None:
    rest = {"stop_at_rest": True, "rest_speed": 1e-2, "rest_hold": 0.02}
    scene = start([{"y": 1.0, "velocity": [0.0, 0.1]}], time=rest, contact=SOFT).to_time(0.1)
    assert scene.status == REACHED


def test_spinning_block_is_not_at_rest(start: Start) -> None:
    rest = {"stop_at_rest": True, "rest_speed": 1e-4, "rest_hold": 0.01}
    scene = start([{"y": 1.0, "spin": 0.02}], gravity=0.0, time=rest, contact=SOFT).to_time(0.05)
    assert scene.status == REACHED


def test_no_rest_is_looked_for_where_it_must_not_stop_the_run(start: Start) -> None:
    assert start([{"y": 0.0125}], time={"stop_at_rest": False}, contact=SOFT).to_time(0.1).status == REACHED


def test_start_moves_nothing_and_happens_once(start: Start) -> None:
    scene = start([FALLING])
    assert scene.steps == 0
    assert [scene.bodies[0].y, scene.bodies[0].vy] == [0.03, 0.0]
    assert scene.bodies[0].ay == pytest.approx(-9.81)
    before = scene.bodies.tobytes()
    assert scene.to_step(0).bodies.tobytes() == before
    assert scene.to_step(7).steps == 7

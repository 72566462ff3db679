"""What ends a run, that a run starts only once, and that it does not matter in how many calls it is made."""

from __future__ import annotations

from math import inf, nan
from typing import TYPE_CHECKING

import numpy as np
import pytest

from blocksim.bench.harness import pushed_wall
from blocksim.kernels.common.arrays import AT_REST, GROUP, MOTION_PIECE, NOT_FINITE, OVERLAP_LIMIT, REACHED, zeros
from blocksim.kernels.explicit.energy import tallied
from blocksim.verification.scene import Simulation
from blocksim.world.build import build_world
from tests.kernels.crews import bits

if TYPE_CHECKING:
    from collections.abc import Callable

    from blocksim.kernels.common.arrays import World
    from tests.conftest import Start

FALLING = {"y": 0.03, "angle": 0.3}
SOFT = {"stiffness_scale": 1e-4}  # a hundredth of the steps


def with_value(name: str, value: float) -> Callable[[World], None]:
    def change(world: World) -> None:
        world.bodies[0][name] = value

    return change


@pytest.mark.parametrize(
    ("body", "contact", "limit"),
    [
        (FALLING, {}, 0.05 * 0.025),
        ({**FALLING, "height": 0.01, "y": 0.02}, {}, 0.05 * 0.01),
        (FALLING, {"max_overlap": 2e-4}, 2e-4),
    ],
)
def test_overlap_beyond_the_limit_or_a_share_of_the_smallest_side_stops_the_run(
    start: Start, body: dict[str, object], contact: dict[str, object], limit: float
) -> None:
    thrown = {**body, "velocity": [0.0, -1.0]}
    scene = start([thrown], contact={"normal_stiffness": 1e4, **contact}).to_time(1.0)
    assert scene.status == OVERLAP_LIMIT
    assert limit < scene.ledger_row()[-1] < limit + 2.0 * scene.step


@pytest.mark.usefixtures("compiler")  # the cosine of infinity is an exception in Python, not a number in IEEE
@pytest.mark.parametrize("name", ["x", "y", "angle", "vx", "vy", "spin"])
@pytest.mark.parametrize("value", [nan, inf])
def test_state_that_is_not_finite_stops_the_run(start: Start, name: str, value: float) -> None:
    scene = start([{"y": 1.0}], change=with_value(name, value)).to_time(1e-2)
    assert scene.status == NOT_FINITE
    assert scene.time == pytest.approx(1e-4, rel=0.01)


def test_rest_must_last_before_it_stops_the_run(start: Start) -> None:
    rest = {"stop_at_rest": True, "rest_speed": 2e-2, "rest_hold": 0.02}
    scene = start([{"y": 0.0125}], time=rest, contact=SOFT).to_time(1.0)
    assert scene.status == AT_REST
    assert scene.time == pytest.approx(0.02, abs=1e-3)


@pytest.mark.parametrize(
    ("body", "gravity", "speed", "hold"),
    [
        ({"y": 1.0, "velocity": [0.0, 0.1]}, 9.81, 1e-2, 0.02),  # at the top of its flight
        ({"y": 1.0, "spin": 0.02}, 0.0, 1e-4, 0.01),
    ],
)
def test_flying_and_spinning_blocks_are_not_at_rest(
    start: Start, body: dict[str, object], gravity: float, speed: float, hold: float
) -> None:
    rest = {"stop_at_rest": True, "rest_speed": speed, "rest_hold": hold}
    assert start([body], gravity=gravity, time=rest, contact=SOFT).to_time(5.0 * hold).status == REACHED


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


HEAP = [
    {"x": 0.036 * i + 0.005 * row, "y": 0.0125 + 0.025 * row, "velocity": [0.3 * row, 0.0]}
    for row in range(3)
    for i in range(3)
]


def shake(world: World) -> None:
    """Move the support to and fro once."""
    pieces = zeros(3, MOTION_PIECE)
    pieces.start = 0.0, 0.02, 0.04
    pieces.c0, pieces.c1 = (0.0, 4e-3, 0.0), (0.2, -0.2, 0.0)
    world.motion[:] = pieces[0]
    world.controls.motion_x = 1.0


@pytest.mark.parametrize("change", [None, shake])
@pytest.mark.parametrize("contact", [SOFT, {**SOFT, "law": "hertz-mindlin", "max_overlap": 5e-3}])
def test_one_call_for_all_steps_gives_the_bits_of_one_call_a_step(
    start: Start, contact: dict[str, object], change: Callable[[World], None] | None, pace: int
) -> None:
    at_once, one_by_one = (start(HEAP, contact=contact, change=change) for _ in range(2))
    last = 2000 // pace**2
    at_once.to_step(last)
    for step in range(1, last + 1):
        one_by_one.to_step(step)
    assert at_once.steps == one_by_one.steps == last
    assert at_once.world.clock[0].rebuilds == one_by_one.world.clock[0].rebuilds
    for name in ("bodies", "clock", "ledger", "pairs", "operators"):
        assert bits(getattr(at_once.world, name)) == bits(getattr(one_by_one.world, name)), name
    assert bits(at_once.contact_records) == bits(one_by_one.contact_records)
    assert at_once.contact_records.size > 10


@pytest.mark.usefixtures("compiler")
def test_ledger_of_many_groups_is_complete() -> None:
    wall = Simulation(build_world(pushed_wall(8, 8, contact={**SOFT, "max_overlap": 5e-3}))).to_time(0.05)
    tallies = wall.world.ledger
    assert np.count_nonzero(tallies.dashpot) == (wall.bodies.size - 1) // GROUP + 1 == 4
    assert not tallies.travel_work[1:].any()
    assert not tallies.largest_kinetic[1:].any()
    assert tallied(tallies) == pytest.approx(
        (tallies.dashpot.sum(), tallies.friction.sum(), tallies.broken.sum()), rel=1e-12
    )
    assert wall.residual() < 1e-3

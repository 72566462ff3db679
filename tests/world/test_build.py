"""From a scenario to arrays, and how its support moves."""

from collections.abc import Mapping
from typing import Any

import pytest

from blocksim.kernels.common.arrays import (
    BODY as BODY_RECORD,
    GROUP,
    Records,
    zeros,
)
from blocksim.scenario import Scenario
from blocksim.verification.scene import scenario_of
from blocksim.world import memory
from blocksim.world.build import (
    MOST_LARGE,
    build_world,
    cell_radius,
    with_more_room,
)
from blocksim.world.memory import SceneTooLargeError

BODY = {"x": 0.1, "y": 0.2}


def scenario(body: Mapping[str, object] | None = None, *more: Mapping[str, object], **tables: Any) -> Scenario:
    return scenario_of([{**BODY, **(body or {})}, *more], **tables)


def test_rest_is_looked_for_only_where_it_may_stop_the_run() -> None:
    assert build_world(scenario(time={"stop_at_rest": False})).controls[0].rest_checks == 0
    controls = build_world(scenario(time={"rest_hold": 0.02})).controls[0]
    held = controls.rest_checks * controls.check_every * controls.step
    assert 0.02 <= held < 0.0203
    assert build_world(scenario(time={"rest_hold": 0.0})).controls[0].rest_checks == 1


@pytest.mark.parametrize("more", [0, GROUP - 2, GROUP - 1, 3 * GROUP])
def test_every_group_of_bodies_has_a_tally_of_its_own(more: int) -> None:
    world = build_world(scenario(None, *({**BODY, "x": 0.1 * i} for i in range(2, 2 + more))))
    assert world.ledger.size > (world.bodies.size - 1) // GROUP


def test_more_room_than_there_is_memory_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    world = build_world(scenario())
    monkeypatch.setattr(memory, "available_bytes", lambda: 1000)
    with pytest.raises(SceneTooLargeError):
        with_more_room(world)


def radii(*values: float) -> Records:
    """Return bodies of these half diagonals, and a half-plane."""
    bodies = zeros(len(values) + 1, BODY_RECORD)
    bodies.radius[:-1] = values
    return bodies


def test_few_bodies_that_are_much_larger_stay_out_of_the_grid() -> None:
    assert cell_radius(radii(*[1.0] * 8, 50.0)) == 1.0
    assert cell_radius(radii(*[1.0] * 7, 50.0, 60.0)) == 50.0  # more than one in eight are not few
    assert cell_radius(radii(*[1.0] * 2000, *[50.0] * MOST_LARGE)) == 1.0
    assert cell_radius(radii(*[1.0] * 2000, *[50.0] * (MOST_LARGE + 1))) == 50.0

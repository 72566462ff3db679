"""From a scenario to arrays, and how its support moves."""

from __future__ import annotations

from math import ceil, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.kernels.common.arrays import (
    BODY as BODY_RECORD,
    GROUP,
    Records,
    zeros,
)
from blocksim.kernels.common.supports import displacement, piece_at
from blocksim.scenario.motion import displacement_and_velocity, motion_pieces
from blocksim.verification.scene import HEIGHT, WIDTH, scenario_of
from blocksim.world import memory
from blocksim.world.build import (
    GROWTH,
    MOST_LARGE,
    build_world,
    cell_radius,
    with_more_room,
    with_threads,
)
from blocksim.world.excitation import support_pieces
from blocksim.world.memory import SceneTooLargeError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from blocksim.scenario import Scenario

W, H = WIDTH, HEIGHT
BODY = {"x": 0.1, "y": 0.2}


def scenario(body: Mapping[str, object] | None = None, *more: Mapping[str, object], **tables: Any) -> Scenario:
    return scenario_of([{**BODY, **(body or {})}, *more], **tables)


def test_rest_is_looked_for_only_where_it_may_stop_the_run() -> None:
    assert build_world(scenario(time={"stop_at_rest": False})).controls[0].rest_checks == 0
    controls = build_world(scenario(time={"rest_hold": 0.02})).controls[0]
    held = controls.rest_checks * controls.check_every * controls.step
    assert 0.02 <= held < 0.0203
    assert build_world(scenario(time={"rest_hold": 0.0})).controls[0].rest_checks == 1


def test_automatic_step_resolves_the_oscillation_on_two_corners() -> None:
    world = build_world(scenario())
    frequency = sqrt(2.0 * world.interactions[1, 0].normal_stiffness / world.bodies[0].mass)
    assert 0.02 < frequency * world.controls[0].step < 0.1


@pytest.mark.parametrize("model", ["surface", "kernel"])
def test_more_room_keeps_what_there_is(model: str) -> None:
    world = build_world(scenario(contact={"model": model, "particle_spacing": 4e-3}))
    world.pairs.a[:] = np.arange(world.pairs.size)
    world.contacts.spring[:] = 7.0
    world.candidates[:] = 3
    world.operators.h_one[:] = 5.0
    world.pairs.normal_left[:] = 5
    world.ledger[0].friction = 11.0
    wider = with_more_room(world)
    used = world.pairs.size
    assert wider.pairs.size == len(wider.candidates) == ceil(GROWTH * used)
    for name in ("pairs", "contacts", "candidates", "operators"):
        old, new = getattr(world, name), getattr(wider, name)
        assert (new[:used] == old).all(), name
        assert not new[used:].view(np.uint8).any(), name
        assert (new.dtype, new.shape) == (old.dtype, (wider.pairs.size, *old.shape[1:])), name
    assert wider.ledger[0].friction == 11.0
    assert wider.bodies is world.bodies


@pytest.mark.parametrize("more", [0, GROUP - 2, GROUP - 1, GROUP, 3 * GROUP])
def test_every_group_of_bodies_has_a_tally_of_its_own_whatever_the_room_for_pairs(more: int) -> None:
    world = build_world(scenario(None, *({**BODY, "x": 0.1 * i} for i in range(2, 2 + more))))
    last = (world.bodies.size - 1) // GROUP
    assert world.ledger.size > last
    world.ledger.friction[last] = 11.0
    wider = with_more_room(world)
    assert wider.ledger is world.ledger


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_threads_have_a_share_each_and_as_much_room_between_them_as_there_is_for_pairs(threads: int) -> None:
    world = with_threads(build_world(scenario()), threads)
    for roomy in (world, with_more_room(world)):
        assert roomy.shares.size == threads
        assert roomy.between.size == (1 if threads == 1 else roomy.pairs.size)


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


SHAKING: dict[str, Any] = {"kind": "harmonic", "amplitude": 0.01, "frequency": 5.0, "direction": "30 deg"}


def shaken(**motion: object) -> Scenario:
    return scenario_of([{"y": 0.5}], motion={**SHAKING, **motion}, time={"end": 2.0})


def test_pieces_are_those_of_the_scenario_and_each_is_found_by_its_time() -> None:
    of = shaken(start=0.5, duration=1.0)
    records, pieces = support_pieces(of), motion_pieces(of)
    found = np.stack([records.c0, records.c1, records.c2, records.c3], axis=1)
    assert records.start.tolist() == pieces.times[: records.size].tolist()
    assert found[: len(pieces.coefficients)].tolist() == pieces.coefficients.tolist()
    times = np.array([0.4, 0.7, 0.9, 1.6])
    places = [displacement(records[piece_at(records, 0, time)], time) for time in times]
    assert places == pytest.approx(displacement_and_velocity(pieces, times)[0], abs=1e-15)

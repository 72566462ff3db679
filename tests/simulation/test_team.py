"""Several threads on one world: the same bits as one, however many, and none where they would only wait."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING

import numpy as np
import pytest

from blocksim.bench.harness import pushed_wall
from blocksim.errors import InvalidInputError
from blocksim.simulation import simulate
from blocksim.simulation.provenance import state_hash
from blocksim.simulation.schemes import ALONE, BODIES_A_THREAD, Team, team_for, useful_threads
from blocksim.world import build
from blocksim.world.build import build_world

if TYPE_CHECKING:
    from blocksim.kernels.common.arrays import World
    from blocksim.scenario import Scenario

STEPS = 1500
COLUMNS, ROWS = 12, 18


def wall(columns: int = COLUMNS, rows: int = ROWS, end: float = 1.0) -> Scenario:
    """Return a wall that falls to pieces within a tenth of a second."""
    return pushed_wall(columns, rows, contact={"stiffness_scale": 2e-4}, time={"end": end, "safety": 0.1})


def same_bits(one: World, other: World) -> bool:
    """Compare everything that moves or is tallied."""
    pairs = [(one.bodies[:-1], other.bodies[:-1]), (one.ledger, other.ledger)]
    return all(np.array_equal(a[name], b[name]) for a, b in pairs for name in a.dtype.names or ())


@pytest.fixture(scope="module")
def alone() -> World:
    """Return the wall as one thread leaves it."""
    return ALONE.advance(build_world(wall()), STEPS)[0]


@pytest.mark.parametrize("threads", [2, 3])
def test_threads_do_not_change_a_bit_of_a_collapse_nor_of_its_ledger(alone: World, threads: int) -> None:
    with Team(threads) as together:
        world, status = build_world(wall()), 0
        for last in (0, 7, STEPS // 2, STEPS):  # a team continues where it stopped
            world, status = together.advance(world, last)
    assert status == 0
    assert world.clock[0].rebuilds > 5
    assert same_bits(world, alone)


def test_team_makes_room_for_more_pairs_and_continues(alone: World, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(build, "PAIRS_PER_BODY", 1)
    world = build_world(wall())
    capacity = world.pairs.size
    with Team(2) as together:
        world, _ = together.advance(world, STEPS)
    assert world.pairs.size > capacity
    assert world.between.size == world.pairs.size
    assert same_bits(world, alone)


def test_team_goes_from_one_scene_to_another_whatever_room_that_takes() -> None:
    few, many = (pushed_wall(8, 4, contact={"model": "kernel", "particle_spacing": d}) for d in (5e-3, 1e-3))
    with Team(2) as together:
        for scenario in (few, many):
            worlds = [one.advance(build_world(scenario), 20)[0] for one in (together, ALONE)]
            assert same_bits(*worlds)


def test_run_with_threads_ends_in_the_same_state_and_says_how_many_there_were() -> None:
    runs = [simulate(wall(end=0.02), threads=threads) for threads in (1, 2, 8)]
    assert len({run.summary.final_state_sha256 for run in runs}) == 1
    assert len({run.summary.energy_J for run in runs}) == 1
    assert [run.summary.threads for run in runs] == [1, 2, useful_threads(8, COLUMNS * ROWS)]


def test_threads_that_would_only_wait_are_not_used() -> None:
    assert [useful_threads(4, bodies) for bodies in (3, 199, 200, 399, 400, 10_000)] == [1, 1, 2, 3, 4, 4]
    few = build_world(wall(4, 4))
    assert team_for(few, 4).threads == 1
    assert state_hash(team_for(few, 4).advance(few, 10)[0]) == state_hash(few)
    assert BODIES_A_THREAD == 100  # the README says from how many blocks on threads help


@pytest.mark.parametrize("threads", [0, -1])
def test_less_than_one_thread_is_refused(threads: int) -> None:
    with pytest.raises(ValueError, match=f"threads must be at least 1, not {threads}"):
        simulate(wall(), threads=threads)


def test_system_without_more_threads_is_an_error_and_nothing_hangs(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        message = "can't start new thread"
        raise RuntimeError(message)

    monkeypatch.setattr(ThreadPoolExecutor, "submit", refuse)
    with pytest.raises(InvalidInputError, match="2 threads cannot be started here: can't start new thread"):
        Team(2).__enter__()

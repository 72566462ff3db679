"""Threads that advance one world together: shares of bodies and pairs, the same bits as one alone, nobody waits."""

from __future__ import annotations

import copy
import threading
from math import nan
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.kernels.common.arrays import (
    ARRIVED,
    AT_REST,
    MEETINGS,
    NOT_FINITE,
    OVERLAP_LIMIT,
    PAIRS_FULL,
    REACHED,
    TEAM_SIZE,
    TEAM_WORDS,
    Integers,
    World,
)
from blocksim.kernels.common.barrier import barrier
from blocksim.kernels.common.jit import config, entry_kernel
from blocksim.kernels.common.mechanics import kick_and_drift
from blocksim.kernels.explicit.partition import add_from_before, partition
from blocksim.kernels.explicit.step import advance, advance_in_team, forces_between, forces_within
from blocksim.verification.scene import HEIGHT
from blocksim.world.build import empty_lists, with_more_room, with_threads
from tests.kernels.scenes import SCENES, soft_world, wall

if TYPE_CHECKING:
    from collections.abc import Callable

PATIENCE = 600.0  # s, until threads that do not come back count as waiting for ever
WORK_SPACE = ("points", "matrices", "before", "action")  # of one thread each


def in_threads(*tasks: Callable[[], object]) -> list[Any]:
    """Run tasks at the same time and return what they return; fail where one does not come back."""
    results: list[Any] = [None] * len(tasks)

    def run(k: int) -> None:
        results[k] = tasks[k]()

    threads = [threading.Thread(target=run, args=(k,), daemon=True) for k in range(len(tasks))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(PATIENCE)
    assert not any(thread.is_alive() for thread in threads), "threads wait for one another for ever"
    return results


def crew(world: World, size: int) -> list[World]:
    """Return one world as each of `size` threads has it."""
    first = with_threads(world, size)
    spaces = [{name: getattr(first, name).copy() for name in WORK_SPACE} for _ in range(1, size)]
    return [first, *(first._replace(**space) for space in spaces)]


def together(worlds: list[World], last_step: int) -> int:
    """Advance a world by all of its threads; return the status code, which must be the same from all."""
    worlds[0].team[TEAM_SIZE] = len(worlds)
    tasks = [lambda k=k: int(advance_in_team(worlds[k], last_step, k)) for k in range(len(worlds))]
    statuses = in_threads(*tasks)
    assert set(statuses) == {statuses[0]}
    return int(statuses[0])


def alone(world: World, last_step: int) -> int:
    """Advance a world by one thread, which must not wait for any other."""
    return int(in_threads(lambda: advance(world, last_step))[0])


def advanced(world: World, last_step: int, size: int) -> tuple[World, int]:
    """Return a copy of a world advanced by `size` threads with as much room as it takes, and the status code."""
    copied = copy.deepcopy(world)
    while True:
        worlds = crew(copied, size)
        status = alone(worlds[0], last_step) if size == 1 else together(worlds, last_step)
        if status != PAIRS_FULL:
            return worlds[0], status
        copied = with_more_room(copied)


def bits(records: Any) -> dict[str, bytes]:
    """Return the bits of all fields; what lies between them is nobody's."""
    return {name: records[name].tobytes() for name in records.dtype.names or ()}


def touching(world: World) -> Any:
    """Return the records of all contacts there are, pair after pair."""
    count = int(world.clock[0].pair_count)
    is_active = np.arange(world.contacts.shape[1]) < world.pairs.active[:count, np.newaxis]
    return world.contacts[:count][is_active]


def assert_same_bits(one: World, other: World) -> None:
    """Compare all that lasts, the ledger tally by tally; only which pairs are between shares may differ."""
    count = int(one.clock[0].pair_count)
    assert count == other.clock[0].pair_count
    for name in ("bodies", "clock", "ledger", "moved"):
        assert bits(getattr(one, name)) == bits(getattr(other, name)), name
    pairs, others = (bits(world.pairs[:count]) for world in (one, other))
    for name in pairs.keys() - {"is_between"}:
        assert pairs[name] == others[name], name
    assert bits(one.operators[:count]) == bits(other.operators[:count])
    assert bits(touching(one)) == bits(touching(other))


def contacts_between(world: World) -> set[tuple[int, int, int, int]]:
    """Return bodies, slot and face of all contacts of pairs whose bodies are of two shares."""
    count = int(world.clock[0].pair_count)
    return {
        (int(pair.a), int(pair.b), int(contact.slot), int(contact.face))
        for pair, contacts in zip(world.pairs[:count], world.contacts[:count], strict=True)
        if pair.is_between
        for contact in contacts[: pair.active]
    }


CREW = 5  # threads


@pytest.fixture(scope="module")
def moving() -> Callable[[str], World]:
    """Return a copy of a scene under way whose bodies have just drifted, with room for several threads."""
    made: dict[str, World] = {}

    def make(scene: str) -> World:
        if scene not in made:
            start, steps = SCENES[scene]
            world = start()
            if config.DISABLE_JIT:
                advance(world, 0)
                world.bodies["vx"][: world.bodies.size // 2] += 0.2
            else:
                world, _ = advanced(world, steps // 2, 1)
            kick_and_drift(world.bodies, 0, world.bodies.size, float(world.controls[0].step))
            made[scene] = with_threads(world, CREW)
        return copy.deepcopy(made[scene])

    return make


def step_of(world: World) -> float:
    return float(world.controls[0].step)


def evaluate_in_shares(world: World, size: int, *, goes_on: bool = False) -> None:
    """Evaluate all forces as threads do, one after the other."""
    partition(world, size)
    step = step_of(world)
    for share in world.shares[:size]:
        forces_between(world, share, step)
    for share in world.shares[:size]:
        add_from_before(world, share)
    for share in world.shares[:size]:
        forces_within(world, share, step, goes_on)


@pytest.mark.parametrize("goes_on", [False, True])
@pytest.mark.parametrize("size", [2, CREW])
@pytest.mark.parametrize("scene", [name for name in SCENES if name != "kernel"])
def test_forces_of_several_shares_have_the_bits_of_one(
    moving: Callable[[str], World], scene: str, size: int, *, goes_on: bool
) -> None:
    one, several = moving(scene), moving(scene)
    evaluate_in_shares(one, 1, goes_on=goes_on)
    evaluate_in_shares(several, size, goes_on=goes_on)
    assert several.pairs.is_between.any()
    assert not one.pairs.is_between.any()
    assert_same_bits(one, several)


COMPILED = pytest.mark.usefixtures("compiler")  # what threads tell one another, no interpreter can
MANY = 7  # more than there are groups of bodies, and than most machines have cores


@entry_kernel
def meet_often(team: Integers, places: Integers, k: int, rounds: int) -> int:
    """Note after which meeting thread k is, and return how often another one was not where it must be."""
    faults = 0
    for n in range(1, rounds + 1):
        places[8 * k] = n
        barrier(team)
        for other in range(team[TEAM_SIZE]):
            faults += places[8 * other] != n
        barrier(team)
    return faults


@COMPILED
@pytest.mark.parametrize("size", [1, 2, MANY])
def test_nobody_leaves_a_meeting_before_everybody_has_come(size: int) -> None:
    team, places = np.zeros(TEAM_WORDS, dtype=np.int64), np.zeros(8 * MANY, dtype=np.int64)
    team[TEAM_SIZE] = size
    faults = in_threads(*(lambda k=k: meet_often(team, places, k, 200) for k in range(size)))
    assert faults == [0] * size
    assert team[ARRIVED] == 0
    assert team[MEETINGS] == (400 if size > 1 else 0)


@COMPILED
@pytest.mark.parametrize("scene", SCENES)
def test_three_threads_give_the_bits_of_one_while_contacts_between_their_shares_begin_and_end(
    scene: str,
) -> None:
    start, steps = SCENES[scene]
    world = start()
    begun: set[object] = set()
    ended: set[object] = set()
    before: set[tuple[int, int, int, int]] = set()
    for last in range(0, steps + 1, steps // 20):
        world, _ = advanced(world, last, 3)
        now = contacts_between(world)
        begun, ended, before = begun | (now - before), ended | (before - now), now
    assert len(begun) > 20
    assert len(ended) > 10
    assert np.count_nonzero(world.ledger.dashpot) >= 3
    assert np.count_nonzero(world.ledger.friction) >= 3
    one, status = advanced(start(), steps, 1)
    assert status == REACHED
    assert_same_bits(world, one)


def overlapping() -> World:
    """Return a wall whose blocks soon overlap too much."""
    return wall(max_overlap=1e-4)


def burst() -> World:
    """Return a wall one of whose last blocks is nowhere."""
    world = wall()
    world.bodies[60].vx = nan
    return world


def resting() -> World:
    """Return blocks that lie on the ground, and some on them."""
    below = [{"x": 0.033 * i, "y": 0.5 * HEIGHT} for i in range(30)]
    above = [{"x": 0.033 * i + 0.016, "y": 1.5 * HEIGHT} for i in range(29)]
    rest = {"stop_at_rest": True, "rest_speed": 2e-2, "rest_hold": 5e-3}
    return soft_world([*below, *above], time=rest)


ENDS: dict[int, Callable[[], World]] = {OVERLAP_LIMIT: overlapping, NOT_FINITE: burst, AT_REST: resting}


@COMPILED
@pytest.mark.parametrize("size", [2, MANY])
@pytest.mark.parametrize("status", ENDS)
def test_what_ends_a_run_ends_it_for_all_threads_at_the_same_step(status: int, size: int) -> None:
    one, ended = advanced(ENDS[status](), 10_000, 1)
    assert ended == status
    assert 0 < one.clock[0].steps < 10_000
    worlds = crew(ENDS[status](), size)
    assert together(worlds, 10_000) == status
    assert_same_bits(worlds[0], one)


def cramped() -> World:
    """Return a wall with room for one pair."""
    world = wall()
    return world._replace(**empty_lists(1, world.candidates.shape[1], world.before))


@COMPILED
def test_full_list_sends_all_threads_back_before_anything_has_moved() -> None:
    worlds, untouched = crew(cramped(), 3), cramped()
    for _ in range(2):
        assert together(worlds, 100) == PAIRS_FULL
    assert worlds[0].clock[0].steps == worlds[0].clock[0].pair_count == worlds[0].clock[0].is_started == 0
    for name in ("x", "y", "angle", "vx", "vy", "spin"):
        assert worlds[0].bodies[name].tobytes() == untouched.bodies[name].tobytes(), name
    assert bits(worlds[0].ledger) == bits(untouched.ledger)

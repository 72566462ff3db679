"""Threads that advance one world together: the same bits as one alone, and nobody waits for ever."""

from __future__ import annotations

from functools import cache
from math import nan
from typing import TYPE_CHECKING, Protocol

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
)
from blocksim.kernels.common.barrier import barrier
from blocksim.kernels.common.jit import entry_kernel
from blocksim.verification.scene import HEIGHT
from blocksim.world.build import empty_lists
from tests.kernels.crews import advanced, assert_same_bits, bits, contacts_between, crew, in_threads, together
from tests.kernels.scenes import SCENES, soft_world, wall

if TYPE_CHECKING:
    from collections.abc import Callable

    from blocksim.kernels.common.arrays import World

pytestmark = pytest.mark.usefixtures("compiler")  # what threads tell one another, no interpreter can
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


@pytest.mark.parametrize("size", [1, 2, MANY])
def test_nobody_leaves_a_meeting_before_everybody_has_come(size: int) -> None:
    team, places = np.zeros(TEAM_WORDS, dtype=np.int64), np.zeros(8 * MANY, dtype=np.int64)
    team[TEAM_SIZE] = size
    faults = in_threads(*(lambda k=k: meet_often(team, places, k, 200) for k in range(size)))
    assert faults == [0] * size
    assert team[ARRIVED] == 0
    assert team[MEETINGS] == (400 if size > 1 else 0)


class ByOne(Protocol):
    """Return a scene advanced by one thread; the signature of the fixture `by_one`."""

    def __call__(self, scene: str, share: float = 1.0) -> World:
        """`share` of its steps; all calls with the same arguments share the world."""


@pytest.fixture(scope="module")
def by_one() -> ByOne:
    """Return every scene, advanced by one thread."""

    @cache
    def make(scene: str, share: float = 1.0) -> World:
        start, steps = SCENES[scene]
        world, status = advanced(start(), round(share * steps), 1)
        assert status == REACHED
        return world

    return make


@pytest.mark.parametrize("scene", SCENES)
def test_three_threads_give_the_bits_of_one_while_contacts_between_their_shares_begin_and_end(
    by_one: ByOne, scene: str
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
    assert_same_bits(world, by_one(scene))


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


def test_full_list_sends_all_threads_back_before_anything_has_moved() -> None:
    worlds, untouched = crew(cramped(), 3), cramped()
    for _ in range(2):
        assert together(worlds, 100) == PAIRS_FULL
    assert worlds[0].clock[0].steps == worlds[0].clock[0].pair_count == worlds[0].clock[0].is_started == 0
    for name in ("x", "y", "angle", "vx", "vy", "spin"):
        assert worlds[0].bodies[name].tobytes() == untouched.bodies[name].tobytes(), name
    assert bits(worlds[0].ledger) == bits(untouched.ledger)

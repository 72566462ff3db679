"""Candidate pairs against brute force, what pairs bring along from list to list, and lists that run full."""

from __future__ import annotations

import copy
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.kernels.common.arrays import PAIRS_FULL, REACHED, SLOTS
from blocksim.kernels.common.integrate import place_all_corners
from blocksim.kernels.explicit.sides import MOST_CORNERS
from blocksim.kernels.explicit.step import advance
from blocksim.world.build import empty_lists, with_more_room
from tests.kernels.crews import bits, listed
from tests.kernels.rectangles import corners, distances, gap, in_frame

if TYPE_CHECKING:
    from collections.abc import Callable

    from blocksim.kernels.common.arrays import Record, World
    from tests.conftest import Simulation, Start

COUNT = 30


def scattered(start: Start, seed: int, skin: float) -> Simulation:
    """Throw blocks, two of them fixed, into a heap that no scenario would allow."""

    def scatter(world: World) -> None:
        random = np.random.default_rng(seed)
        bodies: Any = world.bodies[:-1]
        bodies.x, bodies.y = random.uniform(0.0, 0.15, COUNT), random.uniform(0.0, 0.15, COUNT)
        bodies.angle = random.uniform(-4.0, 4.0, COUNT)
        bodies.cos, bodies.sin = np.cos(bodies.angle), np.sin(bodies.angle)
        controls = world.controls[0]
        controls.skin, controls.approach = skin, 0.0
        controls.cell_width = 2.0 * controls.cell_radius + skin

    bodies = [{"x": 0.1 * i, "y": 0.1, "fixed": i < 2, "width": 0.01 + 0.001 * i} for i in range(COUNT)]
    return start(bodies, change=scatter)


def near_corners(owner: Record, other: Record, reach: float) -> list[int]:
    beyond = (np.abs(in_frame(corners(owner), other)) - (other.half_x, other.half_y)).max(axis=1)
    return np.flatnonzero(beyond <= reach).tolist()


def distance(one: Record, two: Record) -> float:
    """Return the distance of two rectangles: zero, or that of a corner of one from the other."""
    if gap(one, two) <= 0.0:
        return 0.0
    return float(min(distances(corners(one), two).min(), distances(corners(two), one).min()))


def pairs_by_brute_force(world: World, within: Callable[[Record, Record], float]) -> dict[tuple[int, int], list[int]]:
    """Return the candidate corners of every pair that is `within` reach; pairs and corners sorted."""
    bodies, reach = world.bodies, float(world.controls[0].skin)
    found: dict[tuple[int, int], list[int]] = {}
    for i, j in combinations(range(COUNT), 2):
        is_free = bodies[i].inverse_mass or bodies[j].inverse_mass
        if is_free and within(bodies[i], bodies[j]) <= reach:
            of_b = near_corners(bodies[j], bodies[i], reach)
            found[i, j] = near_corners(bodies[i], bodies[j], reach) + [k + MOST_CORNERS for k in of_b]
    for i in range(COUNT):
        if bodies[i].inverse_mass:
            found[i, COUNT] = [k for k in range(4) if corners(bodies[i])[k, 1] <= reach]
    return {pair: near for pair, near in sorted(found.items()) if near}


@pytest.mark.parametrize("skin", [1e-4, 2e-3, 2e-2])
@pytest.mark.parametrize("seed", range(2))
def test_list_misses_no_corner_within_reach_and_has_none_beyond(start: Start, seed: int, skin: float) -> None:
    world = listed(scattered(start, seed, skin).world)
    count = int(world.clock[0].pair_count)
    found = {
        (int(pair.a), int(pair.b)): near[: pair.near].tolist()
        for pair, near in zip(world.pairs[:count], world.candidates[:count], strict=True)
    }
    assert list(found) == sorted(found)
    assert len(found) > 20
    needed, allowed = pairs_by_brute_force(world, distance), pairs_by_brute_force(world, gap)
    assert {pair: found.get(pair) for pair in needed} == needed
    assert {pair: allowed.get(pair) for pair in found} == found


def unstarted(start: Start) -> World:
    """Return twelve blocks about to fall on one another, before their first step."""
    kept: list[World] = []
    bodies = [{"x": 0.036 * (i % 3) + 0.004 * (i // 3), "y": 0.013 + 0.026 * (i // 3)} for i in range(12)]
    start(
        bodies,
        contact={"stiffness_scale": 1e-5},
        change=lambda world: kept.append(copy.deepcopy(world)),
    )
    return kept[0]


def cramped(world: World) -> World:
    """Return an unstarted world with room for one pair."""
    return world._replace(**empty_lists(1, SLOTS, world.before))


def run(world: World, last_step: int) -> tuple[World, int]:
    """Advance with as much room as it takes; return the world and how often it ran full."""
    grown = 0
    while (status := advance(world, last_step)) == PAIRS_FULL:
        world = with_more_room(world)
        grown += 1
    assert status == REACHED
    return world, grown


def test_full_list_stops_before_anything_has_moved(start: Start) -> None:
    world = cramped(unstarted(start))
    place_all_corners(world.bodies)  # as advance does before anything else
    before = bits(world.bodies) | bits(world.clock)
    for _ in range(2):
        assert advance(world, 1000) == PAIRS_FULL
        assert bits(world.bodies) | bits(world.clock) == before
    assert world.clock[0].steps == 0
    assert world.clock[0].pair_count == 0


def test_run_continued_with_more_room_has_the_same_bits(start: Start, pace: int) -> None:
    roomy, never = run(unstarted(start), 1000 // pace)
    grown, often = run(cramped(unstarted(start)), 1000 // pace)
    assert never == 0
    assert often >= 3
    count = int(roomy.clock[0].pair_count)
    assert count > 8
    for name in ("bodies", "clock", "ledger"):
        assert bits(getattr(roomy, name)) == bits(getattr(grown, name)), name
    for name in ("pairs", "contacts", "operators"):
        assert bits(getattr(roomy, name)[:count]) == bits(getattr(grown, name)[:count]), name
    assert (roomy.candidates[:count] == grown.candidates[:count]).all()

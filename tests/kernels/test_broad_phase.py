"""Candidate pairs against brute force, and lists that run full."""

from __future__ import annotations

import copy
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.kernels.advance import advance
from blocksim.kernels.arrays import NO_FACE, PAIRS_FULL, REACHED, SLOTS
from blocksim.kernels.broad_phase import rebuild_pairs
from blocksim.world.build import empty_lists, with_more_room

if TYPE_CHECKING:
    from collections.abc import Callable

    from blocksim.kernels.arrays import Record, World
    from tests.conftest import Simulation, Start

SIGNS = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
COUNT = 30


def scattered(start: Start, seed: int, skin: float) -> Simulation:
    """Throw blocks, two of them fixed, into a heap that no scenario would allow."""

    def scatter(world: World) -> None:
        random = np.random.default_rng(seed)
        bodies: Any = world.bodies[:-1]
        bodies.x, bodies.y = random.uniform(0.0, 0.15, COUNT), random.uniform(0.0, 0.15, COUNT)
        bodies.angle = random.uniform(-4.0, 4.0, COUNT)
        bodies.cos, bodies.sin = np.cos(bodies.angle), np.sin(bodies.angle)
        world.controls[0].skin = skin

    bodies = [{"x": 0.1 * i, "y": 0.1, "fixed": i < 2, "width": 0.01 + 0.001 * i} for i in range(COUNT)]
    return start(bodies, change=scatter)


def corners(body: Record) -> np.ndarray:
    c, s = np.cos(body.angle), np.sin(body.angle)
    return np.asarray(SIGNS * (body.half_x, body.half_y) @ np.array([[c, s], [-s, c]]) + (body.x, body.y))


def near_corners(owner: Record, other: Record, reach: float) -> list[int]:
    c, s = np.cos(other.angle), np.sin(other.angle)
    local = np.abs((corners(owner) - (other.x, other.y)) @ np.array([[c, -s], [s, c]]))
    return [k for k in range(4) if local[k, 0] <= other.half_x + reach and local[k, 1] <= other.half_y + reach]


def gap(one: Record, two: Record) -> float:
    """Return the largest gap between the projections of the corners on the four face normals."""
    gaps = []
    for angle in (one.angle, one.angle + np.pi / 2, two.angle, two.angle + np.pi / 2):
        a, b = (corners(body) @ (np.cos(angle), np.sin(angle)) for body in (one, two))
        gaps.append(max(b.min() - a.max(), a.min() - b.max()))
    return float(max(gaps))


def distance(one: Record, two: Record) -> float:
    """Return the distance of two rectangles: zero, or that of a corner of one from the other."""
    if gap(one, two) <= 0.0:
        return 0.0
    shortest = np.inf
    for owner, other in ((one, two), (two, one)):
        c, s = np.cos(other.angle), np.sin(other.angle)
        local = np.abs((corners(owner) - (other.x, other.y)) @ np.array([[c, -s], [s, c]]))
        outside = np.maximum(local - (other.half_x, other.half_y), 0.0)
        shortest = min(shortest, float(np.hypot(*outside.T).min()))
    return shortest


def pairs_by_brute_force(world: World, within: Callable[[Record, Record], float]) -> dict[tuple[int, int], list[int]]:
    """Return the candidate corners of every pair that is `within` reach; pairs and corners sorted."""
    bodies, reach = world.bodies, float(world.controls[0].skin)
    found: dict[tuple[int, int], list[int]] = {}
    for i, j in combinations(range(COUNT), 2):
        is_free = bodies[i].inverse_mass or bodies[j].inverse_mass
        if is_free and within(bodies[i], bodies[j]) <= reach:
            of_b = near_corners(bodies[j], bodies[i], reach)
            found[i, j] = near_corners(bodies[i], bodies[j], reach) + [k + SLOTS // 2 for k in of_b]
    for i in range(COUNT):
        if bodies[i].inverse_mass:
            found[i, COUNT] = [k for k in range(4) if corners(bodies[i])[k, 1] <= reach]
    return {pair: near for pair, near in sorted(found.items()) if near}


@pytest.mark.parametrize("skin", [1e-4, 2e-3, 2e-2])
@pytest.mark.parametrize("seed", range(2))
def test_list_misses_no_corner_within_reach_and_has_none_beyond(start: Start, seed: int, skin: float) -> None:
    world = scattered(start, seed, skin).world
    while not rebuild_pairs(world):
        world = with_more_room(world)
    count = int(world.clock[0].pair_count)
    listed = {
        (int(pair.a), int(pair.b)): near[: pair.near].tolist()
        for pair, near in zip(world.pairs[:count], world.candidates[:count], strict=True)
    }
    assert list(listed) == sorted(listed)
    assert len(listed) > 20
    needed, allowed = pairs_by_brute_force(world, distance), pairs_by_brute_force(world, gap)
    assert {pair: listed.get(pair) for pair in needed} == needed
    assert {pair: allowed.get(pair) for pair in listed} == listed


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


def run(world: World, last_step: int) -> tuple[World, int]:
    """Advance with as much room as it takes; return the world and how often it ran full."""
    grown = 0
    while (status := advance(world, last_step)) == PAIRS_FULL:
        world = with_more_room(world)
        grown += 1
    assert status == REACHED
    return world, grown


def test_full_list_stops_before_anything_has_moved(start: Start) -> None:
    world = unstarted(start)
    world = world._replace(**empty_lists(1, SLOTS))
    before = world.bodies.tobytes()
    assert advance(world, 1000) == PAIRS_FULL
    assert world.bodies.tobytes() == before
    assert world.clock[0].steps == 0
    assert world.clock[0].pair_count == 0


def test_run_continued_with_more_room_has_the_same_bits(start: Start, pace: int) -> None:
    roomy, never = run(unstarted(start), 1000 // pace)
    grown, often = run(unstarted(start)._replace(**empty_lists(1, SLOTS)), 1000 // pace)
    assert never == 0
    assert often >= 3
    count = int(roomy.clock[0].pair_count)
    assert count > 8
    for name in ("bodies", "clock", "ledger"):
        assert getattr(roomy, name).tobytes() == getattr(grown, name).tobytes(), name
    for name in ("pairs", "slots", "candidates", "operators"):
        assert getattr(roomy, name)[:count].tobytes() == getattr(grown, name)[:count].tobytes(), name


def test_more_room_in_the_middle_of_a_run_changes_no_bit(start: Start, pace: int) -> None:
    straight, _ = run(unstarted(start), 800 // pace)
    halfway, _ = run(unstarted(start), 500 // pace)
    widened, _ = run(with_more_room(halfway), 800 // pace)
    assert straight.bodies.tobytes() == widened.bodies.tobytes()


def test_history_of_a_pair_is_carried_over_and_that_of_a_lost_pair_is_gone(start: Start) -> None:
    scene = start([{"y": 0.0125}, {"x": 0.05, "y": 0.0125}], tilt=-0.2, contact={"stiffness_scale": 1e-4}).to_time(0.01)
    world = scene.world
    held = scene.slots[1, :2].copy()
    assert world.clock[0].pair_count == 2
    assert np.abs(held.spring).min() > 0.0
    world.bodies[0].y += 1.0
    assert rebuild_pairs(world)
    assert world.clock[0].pair_count == 1
    assert world.slots[0, :2].tobytes() == held.tobytes()
    world.bodies[0].y -= 1.0
    assert rebuild_pairs(world)
    assert (world.slots[0].face == NO_FACE).all()
    assert not world.slots.spring[0].any()
    assert world.slots[1, :2].tobytes() == held.tobytes()

"""The grid of the broad phase finds what looking at every pair would, and history stays with its pair."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from blocksim.kernels.common.arrays import NORMAL, PAIR, SHEAR, Records, World, zeros
from blocksim.kernels.common.integrate import renew_rotations
from blocksim.kernels.common.neighbours import list_pairs
from blocksim.kernels.explicit.broad_phase import carry_history
from blocksim.verification.scene import scenario_of
from blocksim.world.build import build_world, empty_lists
from tests.kernels.references import apart

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    Sides = Callable[[np.random.Generator, int], NDArray[np.float64]]

COUNT = 64
HILL = {"ground": {"profile": [[-1.0, 0.2], [0.0, 0.0], [0.3, -0.1], [5.0, 0.4]]}}
WALLS = {"walls": [{"from": [0.1, 0.5], "to": [0.1, 0.0]}]}


def alike(_: np.random.Generator, count: int) -> NDArray[np.float64]:
    return np.full((count, 2), (0.032, 0.025))


def up_to(ratio: float) -> Sides:
    """Return how to draw sides of which the largest is `ratio` times the smallest, all sizes equally often."""

    def draw(random: np.random.Generator, count: int) -> NDArray[np.float64]:
        return np.asarray(0.01 * ratio ** random.uniform(0.0, 1.0, (count, 2)))

    return draw


def planks(random: np.random.Generator, count: int) -> NDArray[np.float64]:
    sides = up_to(2.0)(random, count)
    sides[::12] = 1.5, 0.01
    return sides


def heap(seed: int, sides: Sides, area: float, **tables: Any) -> World:
    """Return blocks all over a square, overlapping as no scenario would allow; every ninth one is fixed."""
    random = np.random.default_rng(seed)
    bodies = [
        {"x": float(i), "y": 1.0, "fixed": i % 9 == 0, "width": width, "height": height}
        for i, (width, height) in enumerate(sides(random, COUNT).tolist())
    ]
    world = build_world(scenario_of(bodies, **tables))
    blocks: Any = world.bodies[:COUNT]
    blocks.x, blocks.y = random.uniform(-area / 2, area / 2, (2, COUNT))
    blocks.angle = random.uniform(-4.0, 4.0, COUNT)
    renew_rotations(world.bodies)
    return world


def expected_neighbours(world: World) -> list[list[int]]:
    """Return for every body those after it that are within the skin, unless both are fixed."""
    bodies, reach = world.bodies[:-1].view(np.recarray), float(world.controls[0].skin)
    way = np.hypot(bodies.x - bodies.x[:, None], bodies.y - bodies.y[:, None])
    is_free = bodies.inverse_mass > 0.0
    may = np.triu((way <= bodies.radius + bodies.radius[:, None] + reach) & (is_free | is_free[:, None]), 1)
    return [
        [j for j in np.flatnonzero(row).tolist() if apart(bodies[i], bodies[j]) <= reach] for i, row in enumerate(may)
    ]


def found_neighbours(world: World) -> list[list[int]]:
    """Return the same from the list of pairs, sorted or not, without the ground."""
    ground, reach = world.bodies.size - 1, float(world.controls[0].skin)
    kept: Any = zeros(ground * ground, PAIR)
    found: list[list[int]] = [[] for _ in range(ground)]
    for a, b in kept[: list_pairs(world, kept, None, reach, True)][["a", "b"]].tolist():
        if b < ground:
            found[a].append(b)
    others = kept[: list_pairs(world, kept, 0.5 * np.full(ground + 1, reach), 0.0, False)][["a", "b"]].tolist()
    assert sorted(pair for pair in others if pair[1] < ground) == [(a, b) for a in range(ground) for b in found[a]]
    return found


HEAPS = [
    pytest.param(alike, 0.4, {}, 0, id="alike"),
    pytest.param(up_to(50.0), 2.0, {}, 5, id="one to fifty"),
    pytest.param(planks, 0.8, {}, 6, id="planks"),
    pytest.param(alike, 0.5, HILL | WALLS, 4, id="slabs"),
]


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize(("sides", "area", "tables", "large"), HEAPS)
def test_grid_finds_the_pairs_that_looking_at_all_of_them_finds(
    seed: int, sides: Sides, area: float, tables: dict[str, Any], large: int
) -> None:
    world = heap(seed, sides, area, **tables)
    expected = expected_neighbours(world)
    assert found_neighbours(world) == expected
    assert sum(map(len, expected)) > 20
    is_large = world.bodies.radius[:-1] > world.controls[0].cell_radius
    assert world.large.tolist() == np.flatnonzero(is_large).tolist()
    assert large <= is_large.sum() <= COUNT // 8


BODIES = 12
CAPACITY = BODIES * (BODIES - 1) // 2


@pytest.fixture(scope="module")
def worlds() -> dict[str, World]:
    """Return a world with room for all pairs, with contacts of either kind."""
    bodies = [{"x": 0.04 * i, "y": 1.0} for i in range(BODIES)]
    contact = {"particle_spacing": 0.008}
    made = {
        model: build_world(scenario_of(bodies, contact={"model": model, **contact})) for model in ("surface", "kernel")
    }
    for world in made.values():
        world.controls.approach = 1.0  # m: all are near to one another
    return {
        model: world._replace(**empty_lists(CAPACITY, world.candidates.shape[1], world.before))
        for model, world in made.items()
    }


def drawn_pairs(random: np.random.Generator, share: float) -> list[tuple[int, int]]:
    every = [(a, b) for a in range(BODIES) for b in range(a + 1, BODIES)]
    return [pair for pair in every if random.random() < share]


def fill_list(world: World, pairs: list[tuple[int, int]], random: np.random.Generator) -> None:
    """List pairs with made-up contacts, operators, duplicates and axes; every other pair or so touches."""
    for p, (a, b) in enumerate(pairs):
        pair = world.pairs[p]
        pair.a, pair.b = a, b
        pair.active = random.integers(0, 3)
        pair.duplicates = random.integers(0, 256) if pair.active else 0
        pair.axis = random.integers(0, 4)
        pair.normal_left, pair.shear_left, pair.sticking = random.integers(0, 17, 3)
        pair.slides = random.integers(0, 3)
        for contact in world.contacts[p, : pair.active]:
            for name in contact.dtype.names:
                contact[name] = random.integers(1, 10**6)
        for direction in (NORMAL, SHEAR):
            world.operators[p, direction].e_one = random.random()
    world.clock[0].pair_count = len(pairs)


def remembered(world: World, pairs: Records, count: int) -> dict[tuple[int, int], tuple[object, ...]]:
    """Return what every pair that touches remembers."""
    return {
        (int(pair.a), int(pair.b)): (
            int(pair.axis),
            int(pair.duplicates),
            (int(pair.normal_left), int(pair.shear_left), int(pair.sticking), int(pair.slides)),
            world.contacts[p, : pair.active].tobytes(),
            world.operators[p].tobytes(),
        )
        for p, pair in enumerate(pairs[:count])
        if pair.active
    }


@pytest.mark.parametrize("model", ["surface", "kernel"])
@given(seed=st.integers(0, 10**6), shares=st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0)))
def test_every_pair_keeps_its_own_history_wherever_it_moves_in_the_list(
    worlds: dict[str, World], model: str, seed: int, shares: tuple[float, float]
) -> None:
    world, random = worlds[model], np.random.default_rng(seed)
    old, new = drawn_pairs(random, shares[0]), drawn_pairs(random, shares[1])
    fill_list(world, old, random)
    before = remembered(world, world.pairs, len(old))
    axes = {(int(pair.a), int(pair.b)): int(pair.axis) for pair in world.pairs[: len(old)]}
    for near, (a, b) in zip(world.near_pairs, new, strict=False):
        near.a, near.b = a, b
    assert carry_history(world, len(new)) == len(new)
    after = remembered(world, world.pairs, len(new))
    assert after == {pair: history for pair, history in before.items() if pair in set(new)}
    assert world.pairs.axis[: len(new)].tolist() == [axes.get(pair, 0) for pair in new]

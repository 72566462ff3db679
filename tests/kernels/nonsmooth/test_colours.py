"""Colours of the pair list, and impulses carried from one list to the next."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.kernels.nonsmooth.arrays import AWAY, COLOURS, TOUCHING
from blocksim.kernels.nonsmooth.neighbours import frame_of_supports, most_packs, rebuild
from blocksim.kernels.nonsmooth.packs import gather
from tests.kernels.nonsmooth.scenes import Block, listed, listed_constraints, pairs_of, place, posed

if TYPE_CHECKING:
    from blocksim.kernels.nonsmooth.arrays import Nonsmooth


def crowd(seed: int, count: int = 30) -> list[Block]:
    """Return blocks that overlap one another all over, some of them fixed."""
    random = np.random.default_rng(seed)
    places = random.uniform(0.0, 0.12, (count, 2))
    return [Block(x, y, random.uniform(-4.0, 4.0), fixed=i % 7 == 3) for i, (x, y) in enumerate(places)]


def comb() -> list[Block]:
    """Return a beam with more blocks on it than there are colours."""
    teeth = [Block(0.006 * i, 0.03, width=0.005, height=0.02) for i in range(COLOURS + 6)]
    return [Block(0.2, 0.0125, width=0.5), *teeth]


def of_colours(scene: Nonsmooth) -> list[list[tuple[int, int]]]:
    """Return the pairs of every colour that there is."""
    constraints = listed_constraints(scene)
    used = int(scene.contacts.stepping[0].colours)
    assert scene.begins[0] == 0
    assert np.all(scene.begins[used:] == constraints.size)
    return [
        list(zip(constraints.a[i:j].tolist(), constraints.b[i:j].tolist(), strict=True))
        for i, j in pairwise(scene.begins[: used + 1])
    ]


def free_bodies(scene: Nonsmooth, pairs: list[tuple[int, int]]) -> list[int]:
    return [i for pair in pairs for i in pair if scene.contacts.states.inverse_mass[i] > 0.0]


@pytest.mark.parametrize("seed", range(3))
def test_no_two_pairs_of_a_colour_share_a_free_body_and_all_have_one(seed: int) -> None:
    scene = listed(posed(crowd(seed)))
    colours = of_colours(scene)
    assert len(colours) > 6
    for pairs in colours:
        free = free_bodies(scene, pairs)
        assert pairs
        assert len(set(free)) == len(free)
    everything = [pair for pairs in colours for pair in pairs]
    assert len(set(everything)) == len(everything) == listed_constraints(scene).size
    meets = np.bincount(free_bodies(scene, everything))
    assert meets.max() <= len(colours) <= 2 * meets.max() - 1  # of a greedy colouring


def test_fixed_bodies_and_the_ground_take_no_colour() -> None:
    scene = listed(posed([Block(0.04 * i, 0.0125) for i in range(9)]))
    assert [len(pairs) for pairs in of_colours(scene)] == [9]


def test_pairs_beyond_the_last_colour_are_solved_one_by_one() -> None:
    scene = listed(posed(comb()))
    colours = of_colours(scene)
    assert len(colours) == COLOURS
    for pairs in colours[:-1]:
        free = free_bodies(scene, pairs)
        assert len(set(free)) == len(free)
    assert sum(0 in pair for pair in colours[-1]) > 1  # they all push the beam
    constraints: Any = listed_constraints(scene)
    constraints.reach = TOUCHING
    gather(scene.contacts, scene.begins)
    first, last = scene.contacts.ends[COLOURS - 1 : COLOURS + 1]
    assert last - first == len(colours[-1])
    assert np.all(scene.contacts.packs["count"][first:last] == 1)
    assert last <= most_packs(scene) <= scene.contacts.packs.size


def test_constraints_know_how_the_materials_of_their_bodies_touch() -> None:
    scene = listed(posed(crowd(0), friction=0.25, ground_friction=0.75))
    for constraint in listed_constraints(scene):
        expected = 0.75 if constraint.b == scene.world.bodies.size - 1 else 0.25
        assert scene.contacts.materials[constraint.material].kinetic_friction == expected


def test_impulses_go_with_their_pair_into_the_next_list() -> None:
    scene = listed(posed(crowd(1)))
    constraints: Any = listed_constraints(scene)
    names = ("nx", "ny", "normal_one", "normal_two", "shear")
    random = np.random.default_rng(0)
    for name in names:
        constraints[name] = random.uniform(1.0, 2.0, constraints.size)
    constraints["reach"] = np.where(np.arange(constraints.size) % 3 == 0, AWAY, TOUCHING)
    kept = {
        (int(constraint.a), int(constraint.b)): [constraint[name] for name in names]
        for constraint in constraints
        if constraint.reach != AWAY
    }
    before = pairs_of(scene)
    moved = [Block(one.x + 0.01 * (i % 3), one.y, one.angle) for i, one in enumerate(crowd(1))]
    place(scene, moved)
    assert rebuild(scene, frame_of_supports(scene))
    after = listed_constraints(scene)
    assert before - pairs_of(scene)
    assert pairs_of(scene) - before
    carried = 0
    for constraint in after:
        expected = kept.get((int(constraint.a), int(constraint.b)))
        assert [constraint[name] for name in names] == (expected or [0.0] * 5)
        carried += expected is not None
    assert carried > 20

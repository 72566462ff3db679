"""The pair list of rigid contacts: nobody who may touch is left out, and it is not made too often."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.kernels.nonsmooth.neighbours import update_pairs
from tests.kernels.nonsmooth.references import apart, corners
from tests.kernels.nonsmooth.scenes import Block, listed, listed_constraints, pairs_of, posed

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from blocksim.kernels.nonsmooth.arrays import Nonsmooth

STEP = 1e-3  # s
BLOCKS = 24
SEEDS = (0, 1)


def cloud(seed: int, area: float, rate: float) -> list[Block]:
    """Return blocks of many sizes all over a square, a plank among them, every ninth one fixed."""
    random = np.random.default_rng(seed)
    found = []
    for i in range(BLOCKS):
        fixed = i % 9 == 4
        sides = (0.4, 0.01) if i == 7 else random.uniform(0.01, 0.03, 2)
        vx, vy, spin = np.zeros(3) if fixed else rate * random.normal(size=3) * (1.0, 1.0, 20.0)
        x, y, angle = random.uniform(0.0, (area, area, 6.0))
        found.append(Block(x, y, angle, vx, vy, spin, sides[0], sides[1], fixed))
    return found


def near(scene: Nonsmooth, reaches: NDArray[np.float64]) -> set[tuple[int, int]]:
    """Return all pairs whose gap is at most the sum of both reaches (m), with the ground, the last, at most one."""
    bodies = scene.world.bodies
    ground = bodies.size - 1
    free = bodies.inverse_mass > 0.0
    limit = np.add.outer(reaches, reaches)
    ways = np.hypot(np.subtract.outer(bodies.x, bodies.x), np.subtract.outer(bodies.y, bodies.y))
    may = (ways <= np.add.outer(bodies.radius, bodies.radius) + limit) & np.logical_or.outer(free, free)
    found = {
        (i, j) for i, j in combinations(range(ground), 2) if may[i, j] and apart(bodies[i], bodies[j]) <= limit[i, j]
    }
    lowest = [float(corners(bodies[i])[:, 1].min()) for i in range(ground)]
    return found | {(i, ground) for i in range(ground) if free[i] and lowest[i] <= bodies.y[ground] + reaches[i]}


def fly(scene: Nonsmooth) -> None:
    """Move all bodies by one step, with nothing in their way."""
    bodies: Any = scene.world.bodies
    bodies.x += STEP * bodies.vx
    bodies.y += STEP * bodies.vy
    bodies.angle += STEP * bodies.spin
    bodies["cos"], bodies["sin"] = np.cos(bodies.angle), np.sin(bodies.angle)


@pytest.mark.parametrize("seed", SEEDS)
def test_list_has_all_pairs_whose_reaches_meet_each_once(seed: int) -> None:
    scene = listed(posed(cloud(seed, 0.15, 0.1), step=STEP))
    constraints = listed_constraints(scene)
    assert len(pairs_of(scene)) == constraints.size
    assert np.all(constraints.a < constraints.b)
    reaches = scene.reaches
    assert len(set(reaches.tolist())) > BLOCKS // 3  # by speed
    expected = near(scene, reaches)
    assert pairs_of(scene) == expected
    assert len(pairs_of(scene)) > BLOCKS


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("rate", [0.2, 2.0])
def test_whoever_is_within_the_margin_of_a_step_is_in_the_list(seed: int, rate: float) -> None:
    """The margin is at least what any two bodies may come nearer in the step; bodies turn and fly on."""
    scene = listed(posed(cloud(seed, 0.3, rate), step=STEP))
    bodies = scene.world.bodies
    for _ in range(8):
        scene = listed(scene)
        margin = float(scene.contacts.stepping[0].margin)
        speeds = np.hypot(bodies.vx, bodies.vy) + bodies.radius * np.abs(bodies.spin) + STEP * 9.81
        least = float(scene.contacts.stepping[0].least_reach)
        assert margin >= min(least, STEP * np.sort(speeds)[-2:].sum())
        closest = np.full(BLOCKS + 1, 0.5 * STEP * np.minimum(speeds, margin / STEP))
        closest[BLOCKS] = 0.0
        missing = near(scene, closest) - pairs_of(scene)
        assert not missing
        fly(scene)
    assert scene.world.clock[0].rebuilds > 1


def row_of_blocks(vx: float, vy: float = 0.0, *, fixed: bool = False) -> list[Block]:
    blocks = [Block(0.04 * i, 1.0, vx=vx, vy=vy) for i in range(5)]
    return [*blocks, Block(0.5, 0.0125, fixed=True)] if fixed else blocks


@pytest.mark.parametrize(
    ("blocks", "is_new"),
    [
        (row_of_blocks(3.0), False),
        (row_of_blocks(3.0, fixed=True), True),
        (row_of_blocks(0.0, -3.0), True),
        (row_of_blocks(0.0), False),
    ],
    ids=["together", "towards something fixed", "towards the ground", "at rest"],
)
def test_list_is_made_again_only_where_bodies_come_nearer_to_something(blocks: list[Block], is_new: bool) -> None:
    scene = listed(posed(blocks, step=STEP, gravity=0.0))
    for _ in range(20):
        fly(scene)
        scene = listed(scene)
    assert bool(scene.world.clock[0].rebuilds > 1) is is_new


def test_body_that_only_turns_uses_up_its_reach() -> None:
    scene = listed(posed([Block(0.0, 1.0, spin=300.0), Block(0.04, 1.0)], step=STEP, gravity=0.0))
    for _ in range(40):
        fly(scene)
        scene = listed(scene)
    assert scene.world.clock[0].rebuilds > 1


def test_list_that_does_not_fit_leaves_everything_as_it_was() -> None:
    scene = posed([Block(0.001 * i, 1.0) for i in range(8)], step=STEP)
    assert scene.contacts.constraints.size < 28
    before = scene.contacts.constraints.copy()
    assert not update_pairs(scene)
    assert np.array_equal(scene.contacts.constraints, before)
    assert len(pairs_of(listed(scene))) == 28


def test_two_fixed_blocks_are_no_pair() -> None:
    blocks = [Block(0.0, 0.0125, fixed=True), Block(0.02, 0.0125, fixed=True), Block(0.01, 0.0375)]
    assert pairs_of(listed(posed(blocks))) == {(0, 2), (1, 2)}

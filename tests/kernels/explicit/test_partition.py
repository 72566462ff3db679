"""Bodies and pairs divided among threads: everything once, sums in the order of the list, losses in their tallies."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.kernels.common.arrays import GROUP, LEDGER, zeros
from blocksim.kernels.common.integrate import accelerate_and_kick, kick_and_drift
from blocksim.kernels.common.jit import config
from blocksim.kernels.explicit.partition import add_from_before, add_kept, keep, partition
from blocksim.kernels.explicit.persistent_forces import CHANGED, TOUCHING, persistent_forces
from blocksim.kernels.explicit.step import advance, changed_forces, forces_between, forces_within
from blocksim.world.build import with_threads
from tests.kernels.crews import advanced, assert_same_bits, bits
from tests.kernels.scenes import SCENES, among_fixed, rows, shake, soft_world, with_pairs

if TYPE_CHECKING:
    from collections.abc import Callable

    from blocksim.kernels.common.arrays import World


SIZES = (1, 2, 3, 7)  # threads


WORLDS: dict[str, Callable[[], World]] = {
    "many rows": lambda: soft_world(rows(20, 6)),
    "fewer blocks than threads": lambda: soft_world(rows(3, 1)),
    "one more than groups": lambda: soft_world(rows(11, 3)),
    "no pairs": lambda: soft_world([{"x": 0.1 * i, "y": 1.0} for i in range(40)]),
    "among moving supports": lambda: shake(among_fixed()),
}


@pytest.mark.parametrize("name", WORLDS)
def test_everything_is_in_exactly_one_share_that_begins_at_a_whole_group(name: str) -> None:
    """Bodies, pairs, and the pairs between shares: those whose second body is another's and gets a force."""
    world = with_threads(with_pairs(WORLDS[name]()), SIZES[-1])
    pairs: Any = world.pairs[: world.clock[0].pair_count]
    for size in SIZES:
        partition(world, size)
        shares: Any = world.shares[:size]
        for first, last, count in (
            (shares.first_body, shares.last_body, world.bodies.size),
            (shares.first_pair, shares.last_pair, pairs.size),
        ):
            assert (first[0], last[-1]) == (0, count)
            assert first[1:].tolist() == last[:-1].tolist()
            assert (first <= last).all()
        owner = np.searchsorted(shares.last_body, np.arange(world.bodies.size), side="right")
        between = (owner[pairs.a] != owner[pairs.b]) & (world.bodies.counts[pairs.b] == 1)
        assert pairs.is_between.astype(bool).tolist() == between.tolist()
        expected = np.flatnonzero(between)
        assert world.between.pair[: expected.size].tolist() == expected.tolist()
        for k, share in enumerate(shares):
            assert (owner[pairs.a[share.first_pair : share.last_pair]] == k).all()
            assert share.first_body % GROUP == 0 or share.first_body == share.last_body == world.bodies.size
            own = expected[(expected >= share.first_pair) & (expected < share.last_pair)]
            assert world.between.pair[share.first_between : share.last_between].tolist() == own.tolist()
        tasks = [m for share in shares for m in range(share.first_task, share.last_task)]
        assert tasks == list(range(expected.size))
        lengths = shares.last_task.astype(int) - shares.first_task
        assert lengths.max() - lengths.min() <= 1
    assert bool(pairs.is_between.any()) == (name in {"many rows", "one more than groups", "among moving supports"})


TALLIED = ("dashpot", "friction", "broken")
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
@pytest.mark.parametrize("size", [2, 3, CREW])
@pytest.mark.parametrize("scene", ["wall", "among moving supports", "on hills", "discs"])
def test_forces_of_several_shares_have_the_bits_of_one(
    moving: Callable[[str], World], scene: str, size: int, *, goes_on: bool
) -> None:
    one, several = moving(scene), moving(scene)
    evaluate_in_shares(one, 1, goes_on=goes_on)
    evaluate_in_shares(several, size, goes_on=goes_on)
    assert several.pairs.is_between.any()
    assert not one.pairs.is_between.any()
    assert_same_bits(one, several)


def test_every_group_of_bodies_has_the_losses_of_its_pairs_in_its_own_tally(moving: Callable[[str], World]) -> None:
    world, apart = moving("wall"), moving("wall")
    before, step = world.ledger.copy(), step_of(world)
    evaluate_in_shares(world, 1)
    count = int(world.clock[0].pair_count)
    tallies = zeros(count, LEDGER)
    for p, pair in enumerate(apart.pairs[:count]):
        kind, effect = persistent_forces(apart, p, step, apart.particles)
        if kind == CHANGED:
            changed_forces(apart, p, step, tallies[p])
        else:
            keep(apart.action[0], effect, kind == TOUCHING)
            tallies[p].dashpot, tallies[p].friction = add_kept(apart, pair, apart.action[0], tallies[p])
    assert np.count_nonzero(tallies.dashpot) > GROUP
    groups = world.pairs.a[:count] // GROUP
    assert groups.max() == 3
    for name in TALLIED:
        gained = world.ledger[name] - before[name]
        expected = np.bincount(groups, tallies[name], world.ledger.size)
        scale = 1e-12 * max(float(np.abs(before[name]).max()), float(np.abs(expected).max()))
        assert gained == pytest.approx(expected, abs=scale), name
    for body in apart.bodies[:-1]:
        accelerate_and_kick(body, apart.controls[0], step)
    assert bits(world.bodies) == bits(apart.bodies)

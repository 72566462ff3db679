"""Bodies and pairs divided among threads: everything once, sums in the order of the list, losses in their tallies."""

from __future__ import annotations

import copy
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.kernels.common.arrays import ACTION, GROUP, LEDGER, zeros
from blocksim.kernels.common.integrate import accelerate_and_kick, kick_and_drift
from blocksim.kernels.common.jit import config
from blocksim.kernels.explicit.partition import (
    add_from_before,
    add_kept,
    keep,
    pairs_before,
    partition,
)
from blocksim.kernels.explicit.persistent_forces import CHANGED, TOUCHING, persistent_forces
from blocksim.kernels.explicit.step import advance, changed_forces, forces_between, forces_within
from blocksim.world.build import with_threads
from tests.kernels.crews import advanced, assert_same_bits, bits
from tests.kernels.scenes import SCENES, among_fixed, on_hills, rows, shake, soft_world, with_pairs

if TYPE_CHECKING:
    from collections.abc import Callable

    from blocksim.kernels.common.arrays import Record, World


MOST = 7  # threads
SIZES = (1, 2, 3, MOST)


def lying(columns: int, count: int) -> World:
    return soft_world(rows(columns, count))


def apart() -> World:
    """Return blocks in the air that no list has a pair of."""
    return soft_world([{"x": 0.1 * i, "y": 1.0} for i in range(40)])


def falling() -> World:
    """Return blocks in the air but for the last ones, which all pairs are of."""
    return soft_world(
        [{"x": 0.1 * i, "y": 1.0} for i in range(40)] + [{**row, "x": row["x"] + 5.0} for row in rows(5, 2)]
    )


WORLDS: dict[str, Callable[[], World]] = {
    "many rows": lambda: lying(20, 6),
    "fewer blocks than threads": lambda: lying(3, 1),
    "one block": lambda: lying(1, 1),
    "as many as a group": lambda: lying(GROUP // 2, 2),
    "one more than groups": lambda: lying(11, 3),
    "no pairs": apart,
    "pairs at the end": falling,
    "among fixed blocks": among_fixed,
    "among moving supports": lambda: shake(among_fixed()),
    "on hills": on_hills,
}


@pytest.fixture(scope="module")
def worlds() -> dict[str, World]:
    """Return all worlds, their pairs listed, with room for as many threads as there are at most."""
    return {name: with_threads(with_pairs(make()), MOST) for name, make in WORLDS.items()}


@pytest.fixture(params=WORLDS)
def world(request: pytest.FixtureRequest, worlds: dict[str, World]) -> World:
    """Return one world after the other."""
    return worlds[request.param]


def pairs_of(world: World) -> Any:
    return world.pairs[: world.clock[0].pair_count]


@pytest.mark.parametrize("size", SIZES)
def test_every_body_and_every_pair_is_in_exactly_one_share_that_begins_at_a_whole_group(
    world: World, size: int
) -> None:
    partition(world, size)
    shares: Any = world.shares[:size]
    for first, last, count in (
        (shares.first_body, shares.last_body, world.bodies.size),
        (shares.first_pair, shares.last_pair, int(world.clock[0].pair_count)),
    ):
        assert (first[0], last[-1]) == (0, count)
        assert first[1:].tolist() == last[:-1].tolist()
        assert (first <= last).all()
    for share in shares:
        a = pairs_of(world).a[share.first_pair : share.last_pair]
        assert ((share.first_body <= a) & (a < share.last_body)).all()
        assert share.first_body % GROUP == 0 or share.first_body == share.last_body == world.bodies.size


@pytest.mark.parametrize("size", SIZES)
def test_pairs_between_shares_are_those_whose_second_body_is_anothers_and_gets_a_force(world: World, size: int) -> None:
    partition(world, size)
    owner = np.zeros(world.bodies.size, dtype=int)
    for k, share in enumerate(world.shares[:size]):
        owner[share.first_body : share.last_body] = k
    expected: list[int] = []
    for p, pair in enumerate(pairs_of(world)):
        is_between = bool(owner[pair.a] != owner[pair.b] and world.bodies[pair.b].counts)
        assert bool(pair.is_between) == is_between
        expected += [p] if is_between else []
    assert world.between.pair[: len(expected)].tolist() == expected
    for share in world.shares[:size]:
        own = [p for p in expected if share.first_pair <= p < share.last_pair]
        assert world.between.pair[share.first_between : share.last_between].tolist() == own
    assert size > 1 or not expected


@pytest.mark.parametrize("size", SIZES)
def test_tasks_cover_the_pairs_between_shares_once_and_evenly(world: World, size: int) -> None:
    partition(world, size)
    shares: Any = world.shares[:size]
    count = int(pairs_of(world).is_between.sum())
    tasks = [m for share in shares for m in range(share.first_task, share.last_task)]
    assert tasks == list(range(count))
    lengths = shares.last_task.astype(int) - shares.first_task
    assert lengths.max() - lengths.min() <= 1


def test_number_of_pairs_before_a_body_is_that_of_smaller_first_bodies(world: World) -> None:
    first = pairs_of(world).a
    for body in range(world.bodies.size + 1):
        assert pairs_before(world, body) == (first < body).sum()


def totals(body: Record) -> list[float]:
    return [float(body.fx), float(body.fy), float(body.torque), int(body.pairs_now)]


def two_blocks(*, is_between: bool = False) -> World:
    world = with_pairs(soft_world([{"y": 1.0}, {"x": 0.033, "y": 1.0}]))
    world.pairs[0].is_between = is_between
    return world


def test_losses_of_changed_contacts_are_tallied_at_once_even_where_nothing_touches_any_more() -> None:
    world, tally, action = two_blocks(), zeros(1, LEDGER)[0], zeros(1, ACTION)[0]
    action.fx, action.dashpot, action.friction, action.broken, action.is_changed = 1.0, 5.0, 6.0, 7.0, 1
    tally.dashpot, tally.friction, tally.broken = 10.0, 20.0, 30.0
    assert add_kept(world, world.pairs[0], action, tally) == (0.0, 0.0)
    assert (tally.dashpot, tally.friction, tally.broken) == (15.0, 26.0, 37.0)
    assert totals(world.bodies[0]) == totals(world.bodies[1]) == [0.0, 0.0, 0.0, 0]


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


SOME = ["wall", "among moving supports", "on hills", "discs"]


@pytest.mark.parametrize("goes_on", [False, True])
@pytest.mark.parametrize("size", [2, 3, CREW])
@pytest.mark.parametrize("scene", SOME)
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

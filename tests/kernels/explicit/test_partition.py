"""Bodies and pairs divided among threads: everything once, and sums in the order of the list."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.kernels.common.arrays import ACTION, GROUP, LEDGER, zeros
from blocksim.kernels.explicit.forces import Effect
from blocksim.kernels.explicit.partition import (
    add_kept,
    keep,
    pairs_before,
    partition,
)
from blocksim.world.build import with_threads
from tests.kernels.crews import among_fixed, listed, on_hills, rows, shake, soft_world

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
    return {name: with_threads(listed(make()), MOST) for name, make in WORLDS.items()}


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


EFFECT = Effect(fx=1.0, fy=2.0, torque_a=3.0, torque_b=4.0, dashpot=5.0, friction=6.0)


def two_blocks(*, is_between: bool = False) -> World:
    world = listed(soft_world([{"y": 1.0}, {"x": 0.033, "y": 1.0}]))
    world.pairs[0].is_between = is_between
    return world


@pytest.mark.parametrize("is_between", [False, True])
@pytest.mark.parametrize("touches", [False, True])
def test_what_is_kept_of_a_steady_pair_goes_to_its_bodies_and_its_losses_to_the_caller(
    *, touches: bool, is_between: bool
) -> None:
    world, tally = two_blocks(is_between=is_between), zeros(1, LEDGER)[0]
    action = zeros(1, ACTION)[0]
    action.is_changed, action.broken = 1, 9.0  # of the step before
    keep(action, EFFECT, touches)
    assert add_kept(world, world.pairs[0], action, tally) == (5.0, 6.0)
    assert totals(world.bodies[0]) == ([1.0, 2.0, 3.0, 1] if touches else [0.0, 0.0, 0.0, 0])
    assert totals(world.bodies[1]) == ([-1.0, -2.0, -4.0, 1] if touches and not is_between else [0.0, 0.0, 0.0, 0])
    assert (tally.dashpot, tally.friction, tally.broken) == (0.0, 0.0, 0.0)


def test_losses_of_changed_contacts_are_tallied_at_once_even_where_nothing_touches_any_more() -> None:
    world, tally, action = two_blocks(), zeros(1, LEDGER)[0], zeros(1, ACTION)[0]
    action.fx, action.dashpot, action.friction, action.broken, action.is_changed = 1.0, 5.0, 6.0, 7.0, 1
    tally.dashpot, tally.friction, tally.broken = 10.0, 20.0, 30.0
    assert add_kept(world, world.pairs[0], action, tally) == (0.0, 0.0)
    assert (tally.dashpot, tally.friction, tally.broken) == (15.0, 26.0, 37.0)
    assert totals(world.bodies[0]) == totals(world.bodies[1]) == [0.0, 0.0, 0.0, 0]

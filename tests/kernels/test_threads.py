"""Threads that advance one world together: shares of bodies and pairs have the bits of one, and so do their ends."""

import copy
from collections.abc import Callable
from math import nan
from typing import Any

import numpy as np
import pytest

from blocksim.kernels.common.arrays import AT_REST, NOT_FINITE, OVERLAP_LIMIT, World
from blocksim.kernels.common.jit import config
from blocksim.kernels.common.mechanics import kick_and_drift
from blocksim.kernels.explicit.partition import add_from_before, partition
from blocksim.kernels.explicit.step import advance, forces_between, forces_within
from blocksim.simulation.schemes import ALONE, Team
from blocksim.verification.scene import HEIGHT
from blocksim.world.build import with_threads
from tests.kernels.scenes import SCENES, soft_world, wall


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
                world, _ = ALONE.advance(world, steps // 2)
            kick_and_drift(world.bodies, 0, world.bodies.size, float(world.controls[0].step))
            made[scene] = with_threads(world, CREW)
        return copy.deepcopy(made[scene])

    return make


def evaluate_in_shares(world: World, size: int, *, goes_on: bool) -> None:
    """Evaluate all forces as threads do, one after the other."""
    partition(world, size)
    step = float(world.controls[0].step)
    for share in world.shares[:size]:
        forces_between(world, share, step)
    for share in world.shares[:size]:
        add_from_before(world, share)
    for share in world.shares[:size]:
        forces_within(world, share, step, goes_on)


@pytest.mark.parametrize("goes_on", [False, True])
@pytest.mark.parametrize("scene", SCENES)
def test_forces_of_several_shares_have_the_bits_of_one(
    moving: Callable[[str], World], scene: str, *, goes_on: bool
) -> None:
    one, several = moving(scene), moving(scene)
    evaluate_in_shares(one, 1, goes_on=goes_on)
    evaluate_in_shares(several, CREW, goes_on=goes_on)
    assert several.pairs.is_between.any()
    assert not one.pairs.is_between.any()
    assert_same_bits(one, several)


MANY = 7  # more than there are groups of bodies, and than most machines have cores


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


@pytest.mark.usefixtures("compiler")  # what threads tell one another, no interpreter can
@pytest.mark.parametrize("status", ENDS)
def test_what_ends_a_run_ends_it_for_all_threads_at_the_same_step(status: int) -> None:
    one, ended = ALONE.advance(ENDS[status](), 10_000)
    with Team(MANY) as team:
        other, ended_together = team.advance(ENDS[status](), 10_000)
    assert ended == ended_together == status
    assert 0 < one.clock[0].steps < 10_000
    assert_same_bits(other, one)

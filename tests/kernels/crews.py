"""Threads that advance one world together, and the scenes and comparisons that tests of them share."""

from __future__ import annotations

import copy
import threading
from typing import TYPE_CHECKING, Any

import numpy as np

from blocksim.kernels.common.arrays import PAIRS_FULL, TEAM_SIZE, World
from blocksim.kernels.explicit.step import advance, advance_in_team
from blocksim.world.build import with_more_room, with_threads

if TYPE_CHECKING:
    from collections.abc import Callable


PATIENCE = 600.0  # s, until threads that do not come back count as waiting for ever
WORK_SPACE = ("points", "matrices", "before", "action")  # of one thread each


def in_threads(*tasks: Callable[[], object]) -> list[Any]:
    """Run tasks at the same time and return what they return; fail where one does not come back."""
    results: list[Any] = [None] * len(tasks)

    def run(k: int) -> None:
        results[k] = tasks[k]()

    threads = [threading.Thread(target=run, args=(k,), daemon=True) for k in range(len(tasks))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(PATIENCE)
    assert not any(thread.is_alive() for thread in threads), "threads wait for one another for ever"
    return results


def crew(world: World, size: int) -> list[World]:
    """Return one world as each of `size` threads has it."""
    first = with_threads(world, size)
    spaces = [{name: getattr(first, name).copy() for name in WORK_SPACE} for _ in range(1, size)]
    return [first, *(first._replace(**space) for space in spaces)]


def together(worlds: list[World], last_step: int) -> int:
    """Advance a world by all of its threads; return the status code, which must be the same from all."""
    worlds[0].team[TEAM_SIZE] = len(worlds)
    tasks = [lambda k=k: int(advance_in_team(worlds[k], last_step, k)) for k in range(len(worlds))]
    statuses = in_threads(*tasks)
    assert set(statuses) == {statuses[0]}
    return int(statuses[0])


def alone(world: World, last_step: int) -> int:
    """Advance a world by one thread, which must not wait for any other."""
    return int(in_threads(lambda: advance(world, last_step))[0])


def advanced(world: World, last_step: int, size: int) -> tuple[World, int]:
    """Return a copy of a world advanced by `size` threads with as much room as it takes, and the status code."""
    copied = copy.deepcopy(world)
    while True:
        worlds = crew(copied, size)
        status = alone(worlds[0], last_step) if size == 1 else together(worlds, last_step)
        if status != PAIRS_FULL:
            return worlds[0], status
        copied = with_more_room(copied)


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


def contacts_between(world: World) -> set[tuple[int, int, int, int]]:
    """Return bodies, slot and face of all contacts of pairs whose bodies are of two shares."""
    count = int(world.clock[0].pair_count)
    return {
        (int(pair.a), int(pair.b), int(contact.slot), int(contact.face))
        for pair, contacts in zip(world.pairs[:count], world.contacts[:count], strict=True)
        if pair.is_between
        for contact in contacts[: pair.active]
    }

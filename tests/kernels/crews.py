"""Threads that advance one world together, and the scenes and comparisons that tests of them share."""

from __future__ import annotations

import copy
import threading
from typing import TYPE_CHECKING, Any

import numpy as np

from blocksim.bench.harness import pushed_wall
from blocksim.kernels.common.arrays import MOTION_PIECE, PAIRS_FULL, TEAM_SIZE, World, zeros
from blocksim.kernels.common.integrate import place_all_corners
from blocksim.kernels.explicit.broad_phase import rebuild_pairs
from blocksim.kernels.explicit.step import advance, advance_in_team
from blocksim.verification.scene import HEIGHT, scenario_of
from blocksim.world.build import build_world, with_more_room, with_threads

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping


PATIENCE = 600.0  # s, until threads that do not come back count as waiting for ever
WORK_SPACE = ("points", "matrices", "before", "action")  # of one thread each
SOFT = {"stiffness_scale": 1e-4, "max_overlap": 5e-3}  # a hundredth of the steps


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


def rows(columns: int, count: int, **more: Any) -> list[dict[str, Any]]:
    """Return blocks in rows that lie on one another, a few of them already moving."""
    return [
        {"x": 0.034 * i + 0.008 * row, "y": HEIGHT * (row + 0.5), "velocity": [0.3 * row + 0.1 * (i % 3), 0.0], **more}
        for row in range(count)
        for i in range(columns)
    ]


def shake(world: World) -> World:
    """Return a world whose support moves to and fro once."""
    pieces = zeros(3, MOTION_PIECE)
    pieces.start = 0.0, 0.03, 0.06
    pieces.c0, pieces.c1 = (0.0, 9e-3, 0.0), (0.3, -0.3, 0.0)
    world.controls.motion_x = 1.0
    return world._replace(motion=pieces)


def soft_world(bodies: list[dict[str, Any]], **tables: Any) -> World:
    contact: Mapping[str, object] = {"restitution": 0.2, **SOFT, **tables.pop("contact", {})}
    friction = {"block_block": 0.31, "block_ground": 0.38}
    time = {"stop_at_rest": False, **tables.pop("time", {})}
    return build_world(scenario_of(bodies, contact=contact, friction=friction, time=time, **tables))


def wall(**contact: object) -> World:
    """Return a wall that falls to pieces: four groups of bodies, all of which touch others."""
    return build_world(pushed_wall(8, 8, contact={**SOFT, **contact}))


def among_fixed() -> World:
    """Return rows of blocks between fixed ones, whose numbers are before, among and after theirs."""
    fixed = [{"x": 0.034 * i - 0.002, "y": HEIGHT * 6.5 + 0.0016, "fixed": True, "angle": 0.1} for i in range(9)]
    post = {"x": 0.034 * 9 + 0.01, "y": 0.5 * HEIGHT, "fixed": True}
    blocks = rows(9, 6)
    return soft_world([*fixed[:5], *blocks[:20], post, *blocks[20:], *fixed[5:]])


def on_hills() -> World:
    """Return blocks that fall onto hills: the pieces of ground are bodies of their own."""
    profile = [[0.1 * i - 0.3, 0.02 * (i % 2)] for i in range(12)]
    blocks = [
        {
            "x": 0.0375 * i + 0.004 * row,
            "y": 0.04 + 0.033 * row,
            "velocity": [0.2, -0.3 * row],
            "angle": 0.2 * (i % 3 - 1),
        }
        for row in range(5)
        for i in range(9)
    ]
    return soft_world(blocks, ground={"profile": profile})


def with_particles(model: str) -> World:
    """Return rows of blocks that touch at particles."""
    return soft_world(rows(9, 6), contact={"model": model, "particle_spacing": 8e-3})


SCENES: dict[str, tuple[Callable[[], World], int]] = {  # and steps
    "wall": (wall, 4000),
    "wall with Hertz law": (lambda: wall(law="hertz-mindlin"), 4000),
    "among fixed blocks": (among_fixed, 4000),
    "among moving supports": (lambda: shake(among_fixed()), 4000),
    "on hills": (on_hills, 4000),
    "on moving hills": (lambda: shake(on_hills()), 4000),
    "discs": (lambda: with_particles("particles"), 600),
    "kernel": (lambda: with_particles("kernel"), 600),
}


def listed(world: World) -> World:
    """Return a world whose pairs are listed, before anything has moved."""
    place_all_corners(world.bodies)  # as advance does before anything else
    while not rebuild_pairs(world):
        world = with_more_room(world)
    return world

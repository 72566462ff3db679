"""A heap of random hexagons by all engines at the same step: the CPU time it takes, and how alike the heaps are.

Hexagons start apart from one another and fall. As with the wall no block ends where another engine puts it, so heaps
are compared by the distributions of their final positions.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from blocksim.bench.measurement import Findings, Measurement, Number, Setting
from blocksim.bench.peers.engine import Final, Scene
from blocksim.bench.peers.series import heap_racers
from blocksim.bench.peers.wall import distances
from blocksim.bench.scenes import WALL_RESTITUTION, Table, hexagon_heap

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from blocksim.bench.peers.engine import Solver
    from blocksim.scenario import Scenario

ROUNDS = 3  # of engines in turns, at most


class Heap(NamedTuple):
    """Hexagons in a row, rows, and how long they are watched."""

    columns: int
    rows: int
    end: float  # s

    def make(self, contact: Table | None = None, time: Table | None = None) -> Scenario:
        """Return its scenario with more keys of [contact] and [time]."""
        return hexagon_heap(self.columns, self.rows, contact, time)

    def scene(self) -> Scene:
        """Return it, let go."""
        return Scene(self.make, np.zeros(self.columns * self.rows), WALL_RESTITUTION, self.end)


FULL, SMALL = Heap(40, 25, 1.0), Heap(5, 4, 0.1)


def measure(setting: Setting) -> Findings:
    """Measure the engines in turns, so that what else the machine does slows all of them."""
    heap = SMALL if setting.quick else FULL
    racers = heap_racers()
    rounds = [
        {name: solver.solve(heap.scene()) for name, solver in racers.items()}
        for _ in range(min(ROUNDS, setting.repeats))
    ]
    meaning = f"{heap.columns * heap.rows} random hexagons of 20 to 40 mm that fall, {heap.end:g} s"
    return Findings(tuple(_numbers(racers, rounds)), notes=(meaning, *_compared(rounds[-1])))


def _numbers(racers: Mapping[str, Solver], rounds: Sequence[Mapping[str, Final]]) -> Iterator[Number]:
    """Yield the CPU time of the first one, and how many times as long the others take."""
    first, *others = racers
    yield Number(f"{first}, {racers[first].setting}", "CPU s", tuple(one[first].seconds for one in rounds))
    for name in others:
        yield Number(f"{name}: times that", "", tuple(one[name].seconds / one[first].seconds for one in rounds))


def _compared(finals: Mapping[str, Final]) -> Iterator[str]:
    """Yield how high heaps are in the mean, and how far apart from that of the first engine."""
    (_, own), *_ = finals.items()
    for name, final in finals.items():
        x, y = distances(own, final)
        yield f"{name}: mean height of the centres {1e3 * final.y.mean():.1f} mm, {x:.1f} and {y:.1f} mm off in x and y"


HEAP = Measurement(
    "heap",
    "heap of hexagons, also by pymunk and Box2D",
    measure,
    quick="20 hexagons for 0.1 s instead of 1000 for 1 s",
)

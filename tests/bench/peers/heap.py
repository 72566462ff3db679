"""A heap of random hexagons by all engines at the same step: the CPU time it takes, and how alike the heaps are.

Hexagons start apart from one another and fall. Heaps are chaotic: no block ends where another engine puts it, so they
are compared by the distributions of their final positions, that of x and that of y, by the area between the cumulative
curves (Wasserstein-1 distance): the mean distance of the sorted positions.
"""

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.bench.harness import (
    FRICTION,
    SIDES,
    WALL_RESTITUTION,
    Benchmark,
    Effort,
    Readings,
    Table,
    one_structure,
)
from blocksim.scenario import Scenario
from tests.bench.peers.engine import Final, Scene, raced
from tests.bench.peers.series import heap_racers

ROUNDS = 3  # of engines in turns, at most
HEXAGONS, HEXAGONS_GAP = (0.02, 0.04), 0.002  # m, smallest and largest of a heap, and the least distance at the start


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


def hexagon_heap(columns: int, rows: int, contact: Table | None = None, time: Table | None = None) -> Scenario:
    """Return random hexagons of 20 to 40 mm in rows, apart from one another, that fall to a heap."""
    sizes = {"smallest": HEXAGONS[0], "largest": HEXAGONS[1], "fewest_sides": 6, "most_sides": 6}
    heap = {"kind": "rubble", "block": "stone", "columns": columns, "count": columns * rows, "gap": HEXAGONS_GAP}
    more = {"contact": {"restitution": WALL_RESTITUTION, **(contact or {})}, "friction": FRICTION}
    more["time"] = {"end": 1.0, "stop_at_rest": False, **(time or {})}
    stone = {"depth": SIDES["length"], "material": "aluminium"}
    return one_structure("hexagon_heap", {"stone": stone}, {**heap, **sizes}, more)


FULL, SMALL = Heap(40, 25, 1.0), Heap(5, 4, 0.1)


def measure(effort: Effort) -> Readings:
    """Measure the engines in turns."""
    heap = SMALL if effort.quick else FULL
    numbers, finals = raced(heap_racers(), heap.scene, min(ROUNDS, effort.repeats))
    meaning = f"{heap.columns * heap.rows} random hexagons of 20 to 40 mm that fall, {heap.end:g} s"
    return Readings(tuple(numbers), notes=(meaning, *_compared(finals)))


def _compared(finals: Mapping[str, Final]) -> Iterator[str]:
    """Yield how high heaps are in the mean, and how far apart from that of the first engine."""
    (_, own), *_ = finals.items()
    for name, final in finals.items():
        x, y = 1e3 * wasserstein(own.x, final.x), 1e3 * wasserstein(own.y, final.y)
        yield f"{name}: mean height of the centres {1e3 * final.y.mean():.1f} mm, {x:.1f} and {y:.1f} mm off in x and y"


def wasserstein(one: NDArray[np.float64], two: NDArray[np.float64]) -> float:
    """Return the Wasserstein-1 distance of two samples of the same size."""
    return float(np.abs(np.sort(one) - np.sort(two)).mean())


HEAP = Benchmark(
    "heap", "heap of hexagons, also by pymunk and Box2D", measure, quick="20 hexagons for 0.1 s instead of 1000 for 1 s"
)

"""The pushed wall by all engines: how much the heap changes with a step half as long, and the CPU time it takes.

A thousand blocks are chaotic: no block ends where it did a step length before. What can converge is the heap, so final
positions are compared as distributions, by the area between their cumulative curves (Wasserstein-1 distance): the mean
distance of the sorted positions, by x and by y apart.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from blocksim.bench.harness import LOW_COURSES, WALL_RESTITUTION, Benchmark, Effort, Number, pushed_wall, single
from blocksim.scenario.structures.base import draws
from tests.bench.peers.engine import Final, Readings, Scene, Series, Solver
from tests.bench.peers.series import wall_racers, wall_series
from tests.bench.peers.work_precision import Curve, Panel

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray

JITTER = 1e-6  # m
SEED = 2
ROUNDS = 3  # of engines in turns, at most


class Size(NamedTuple):
    """A wall, and how long it is watched."""

    columns: int
    rows: int
    end: float  # s

    def scene(self, shift: float = 0.0) -> Scene:
        """Return it with every block shifted at random by up to `shift` (m)."""
        make = functools.partial(pushed_wall, self.columns, self.rows, upright=LOW_COURSES)
        return Scene(make, shift * (2.0 * draws(SEED, self.columns * self.rows) - 1.0), WALL_RESTITUTION, self.end)


FULL, SMALL = Size(40, 25, 1.0), Size(8, 5, 0.1)


@dataclass(frozen=True)
class Computed:
    """One series, and the same with another start at its last but one level."""

    series: Series
    finals: tuple[Final, ...]
    jittered: Final

    @property
    def changes(self) -> NDArray[np.float64]:
        """Distances (levels - 1, 2; mm) in x and y from each level to the next."""
        return np.array([distances(one, two) for one, two in zip(self.finals, self.finals[1:], strict=False)])

    @property
    def scatter(self) -> tuple[float, float]:
        """Distances (mm) in x and y between two starts within a micrometre: less than that says nothing."""
        return distances(self.finals[-2], self.jittered)


def wasserstein(one: NDArray[np.float64], two: NDArray[np.float64]) -> float:
    """Return the Wasserstein-1 distance of two samples of the same size."""
    return float(np.abs(np.sort(one) - np.sort(two)).mean())


def distances(one: Final, two: Final) -> tuple[float, float]:
    """Return the distances (mm) of the distributions of x and of y."""
    return 1e3 * wasserstein(one.x, two.x), 1e3 * wasserstein(one.y, two.y)


def measure(effort: Effort) -> Readings:
    """Measure all engines; one run a level, as each takes seconds to a minute."""
    size = SMALL if effort.quick else FULL
    computed = [_computed(series, size) for series in wall_series(quick=effort.quick)]
    numbers = [number for one in computed for number in _numbers(one)]
    numbers += raced(wall_racers(), size.scene, min(ROUNDS, effort.repeats), ", in turns")[0]
    last = computed[-1]  # the explicit one
    meaning = (
        f"{size.columns * size.rows} blocks, {size.end:g} s; change: mean distance of the sorted final x "
        "(Wasserstein-1) from a level to the next, with half the step"
    )
    notes = (meaning, *(_compared(one, last) for one in computed[:-1]), *(_scattered(one) for one in computed))
    curves = tuple(_curve(one) for one in computed)
    scatter = max(one.scatter[0] for one in computed)
    panel = Panel("pushed wall", "change of final x at half the step (mm)", curves, scatter, "starts within 1 µm")
    details = tuple(detail for one in computed for detail in _details(one))
    return Readings(tuple(numbers), notes=notes, details=details, panel=panel)


def _computed(series: Series, size: Size) -> Computed:
    finals = tuple(solver.solve(size.scene()) for solver in series.levels)
    return Computed(series, finals, series.levels[-2].solve(size.scene(JITTER)))


def _numbers(one: Computed) -> list[Number]:
    names = [f"{one.series.label}, {solver.setting.removeprefix('step ')}" for solver in one.series.levels]
    seconds = [single(name, "CPU s", final.seconds) for name, final in zip(names, one.finals, strict=True)]
    changes = [single(f"{name}, change", "mm", x) for name, (x, _) in zip(names, one.changes, strict=False)]
    return seconds + changes


def raced(
    racers: Mapping[str, Solver], scene: Callable[[], Scene], rounds: int, how: str = ""
) -> tuple[list[Number], dict[str, Final]]:
    """Return the CPU time of the first one, and how many times as long the others take; and the last finals of all.

    They run in turns, so that what else the machine does slows all of them.
    """
    finals = [{name: solver.solve(scene()) for name, solver in racers.items()} for _ in range(rounds)]
    first, *others = racers
    own = Number(f"{first}, {racers[first].setting}{how}", "CPU s", tuple(one[first].seconds for one in finals))
    ratios = [tuple(one[name].seconds / one[first].seconds for one in finals) for name in others]
    numbers = [own, *(Number(f"{name}: times that", "", ratio) for name, ratio in zip(others, ratios, strict=True))]
    return numbers, finals[-1]


def _compared(one: Computed, other: Computed) -> str:
    x, y = distances(one.finals[-1], other.finals[-1])
    return (
        f"{one.series.label}: its finest heap differs from that of {other.series.label} by {x:.1f} mm in x and "
        f"{y:.1f} mm in y"
    )


def _scattered(one: Computed) -> str:
    x, y = one.scatter
    return f"{one.series.label}: starts within 1 µm differ by {x:.1f} mm in x and {y:.1f} mm in y"


def _curve(one: Computed) -> Curve:
    seconds = np.array([final.seconds for final in one.finals[:-1]])
    return Curve(one.series.label, one.series.engine, seconds, error=one.changes[:, 0])


def _details(one: Computed) -> list[dict[str, object]]:
    changes = [*one.changes.tolist(), [None, None]]
    return [
        {
            "series": one.series.label,
            "setting": solver.setting,
            "cpu_s": final.seconds,
            "change_x_mm": change[0],
            "change_y_mm": change[1],
            "mean_x_m": float(final.x.mean()),
            "mean_y_m": float(final.y.mean()),
            "largest_x_m": float(final.x.max()),
        }
        for solver, final, change in zip(one.series.levels, one.finals, changes, strict=True)
    ]


WALL = Benchmark(
    "wall",
    "pushed wall, also by pymunk and Box2D",
    measure,
    quick="a wall of 40 blocks for 0.1 s instead of 1000 for 1 s, two levels",
)

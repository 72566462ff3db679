"""The three blocks by all engines: distance from the engine's own converged answer, and the CPU time it takes."""

import functools
import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from blocksim.bench.harness import RESTITUTION, Benchmark, Effort, Number, Table, TimeSteps, single, three_blocks
from blocksim.scenario import Scenario
from blocksim.scenario.structures.base import draws
from tests.bench.peers.box2d_v3 import Box2Dv3, library
from tests.bench.peers.engine import (
    Box2D,
    Final,
    Nonsmooth,
    Pymunk,
    Readings,
    Scene,
    Series,
    Solver,
    call_time,
    empty_space,
    empty_world,
)
from tests.bench.peers.series import BOX2D, BOX2D_V3, NONSMOOTH, PYMUNK, three_blocks_series
from tests.bench.peers.work_precision import Curve, Panel

STARTS, QUICK_STARTS = 16, 2
JITTER = 1e-6  # m
SEED = 1
END = 0.4  # s; the blocks rest from about 0.3 s
CLOSE = 0.2  # mm


@dataclass(frozen=True)
class Level:
    """All starts at one setting of one engine."""

    solver: Solver
    off: NDArray[np.float64]  # (starts,) mm, of the block that is farthest off
    seconds: NDArray[np.float64]  # (starts,) CPU time


@dataclass(frozen=True)
class Answer:
    """The cheapest setting of a series whose error is small, of which all finer ones' are too: not right by chance."""

    series: Series
    level: Level | None  # None where there is none

    @property
    def seconds(self) -> float:
        """CPU time, infinite where there is none."""
        return np.inf if self.level is None else float(np.median(self.level.seconds))

    @property
    def number(self) -> Number:
        """For the table."""
        if self.level is None:
            return single(f"{self.series.label}: none", "CPU ms", np.inf)
        samples = tuple((1e3 * self.level.seconds).tolist())
        return Number(f"{self.series.label}: {self.level.solver.setting}", "CPU ms", samples)


def starts(count: int, restitution: float = RESTITUTION) -> list[Scene]:
    """Return the scene with all blocks shifted at random by up to a micrometre."""

    def make(*, contact: Table | None = None, time: Table | None = None) -> Scenario:
        return three_blocks({"restitution": restitution, **(contact or {})}, time)

    return [Scene(make, JITTER * (2.0 * row - 1.0), restitution, END) for row in draws(SEED, count, 3)]


def measure(restitution: float, effort: Effort) -> Readings:
    """Measure all engines."""
    scenes = starts(QUICK_STARTS if effort.quick else STARTS, restitution)
    references: dict[str, list[Final]] = {}
    curves, answers, details = [], [], []
    for series in three_blocks_series(restitution, quick=effort.quick):
        if series.engine not in references:
            references[series.engine] = [series.reference.solve(scene) for scene in scenes]
        levels = [_level(solver, scenes, references[series.engine]) for solver in series.levels]
        curves.append(_curve(series, levels))
        answers.append(_answer(series, levels))
        details += [_detail(series, level) for level in levels]
    calls = _calls(scenes[0])
    numbers = [*(answer.number for answer in answers), *_ratios(answers, calls, scenes[0])]
    numbers += [single(f"{engine}: a call from Python", "µs", 1e6 * seconds) for engine, seconds in calls.items()]
    meaning = (
        f"error: of the block farthest from where the same engine's finest setting has it at {END:g} s, median of "
        f"{len(scenes)} starts within 1 µm; CPU time of the steps only"
    )
    notes = (meaning, *(_ends(engine, finals) for engine, finals in references.items()))
    panel = Panel(f"three blocks, restitution {restitution:g}", "error (mm)", tuple(curves), CLOSE, f"{CLOSE:g} mm")
    return Readings(tuple(numbers), notes=notes, details=tuple(details), panel=panel)


def _level(solver: Solver, scenes: list[Scene], references: list[Final]) -> Level:
    finals = [solver.solve(scene) for scene in scenes]
    off = [np.hypot(one.x - ref.x, one.y - ref.y).max() for one, ref in zip(finals, references, strict=True)]
    return Level(solver, 1e3 * np.array(off), np.array([final.seconds for final in finals]))


def _answer(series: Series, levels: list[Level]) -> Answer:
    close = itertools.takewhile(lambda level: float(np.median(level.off)) <= CLOSE, reversed(levels))
    return Answer(series, min(close, key=lambda level: float(np.median(level.seconds)), default=None))


def _calls(scene: Scene) -> dict[str, float]:
    """Return what a call from Python takes (s) with nothing to compute: one a step, but for blocksim one a run."""
    third = {} if library() is None else {BOX2D_V3: call_time(Box2Dv3(1e-3, 1), Box2Dv3(1e-3, 1).empty_world())}
    return third | {
        PYMUNK: call_time(Pymunk(1e-3, 1), empty_space()),
        BOX2D: call_time(Box2D(1e-3, 1), empty_world()),
        NONSMOOTH: Nonsmooth(TimeSteps(1e-3)).call_time(scene),
    }


def _ratios(answers: list[Answer], calls: dict[str, float], scene: Scene) -> list[Number]:
    """Return how many times as long as the non-smooth scheme others take, each at its cheapest; without calls too."""
    best = {answer.series.engine: answer for answer in sorted(answers, key=lambda one: -one.seconds)}
    if NONSMOOTH not in best or best[NONSMOOTH].level is None:
        return []
    own = best.pop(NONSMOOTH)
    found = [single(f"{engine}: times non-smooth", "", one.seconds / own.seconds) for engine, one in best.items()]
    computing = _without_calls(own, calls, scene)
    return found + [
        single(f"{engine}: the same without calls", "", _without_calls(one, calls, scene) / computing)
        for engine, one in best.items()
        if engine in calls
    ]


def _without_calls(answer: Answer, calls: dict[str, float], scene: Scene) -> float:
    count = 0 if answer.level is None else answer.level.solver.calls(scene)
    return answer.seconds - count * calls[answer.series.engine]


def _curve(series: Series, levels: list[Level]) -> Curve:
    off = np.array([np.percentile(level.off, (25.0, 50.0, 75.0)) for level in levels])
    seconds = np.array([np.median(level.seconds) for level in levels])
    return Curve(series.label, series.engine, seconds, error=off[:, 1], low=off[:, 0], high=off[:, 2])


def _ends(engine: str, finals: list[Final]) -> str:
    """Report the final places of blocks 2 and 3 by an engine, and the scatter over its starts."""
    x = 1e3 * np.array([final.x for final in finals])
    middle, apart = np.median(x, axis=0), np.ptp(x, axis=0)
    return (
        f"{engine}, converged: blocks 2 and 3 at x = {middle[1]:.2f} and {middle[2]:.2f} mm, the starts up to "
        f"{apart[1]:.2g} and {apart[2]:.2g} mm apart"
    )


def _detail(series: Series, level: Level) -> dict[str, object]:
    return {
        "series": series.label,
        "setting": level.solver.setting,
        "error_mm": float(np.median(level.off)),
        "errors_mm": level.off.tolist(),
        "cpu_s": float(np.median(level.seconds)),
        "cpu_seconds": level.seconds.tolist(),
    }


PAPER = Benchmark(
    "three-blocks",
    "three blocks to within 0.2 mm, also by pymunk and Box2D",
    functools.partial(measure, RESTITUTION),
    quick="2 starts and three coarse levels of each engine, against a level that is not much finer",
)
WITHOUT_RESTITUTION = Benchmark(
    "three-blocks-e0", "the same without restitution", functools.partial(measure, 0.0), quick=PAPER.quick
)

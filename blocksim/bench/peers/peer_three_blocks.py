"""The three blocks by all engines: distance from the engine's own converged answer, and the CPU time it takes."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from blocksim.bench.measurement import Findings, Number, Setting, single
from blocksim.bench.peers.blocksim_engine import Blocksim
from blocksim.bench.peers.box2d_engine import Box2D, empty_world
from blocksim.bench.peers.packages import require_all
from blocksim.bench.peers.pymunk_engine import Pymunk, empty_space
from blocksim.bench.peers.scene import Final, Scene, Series, Solver
from blocksim.bench.peers.stepper import call_time
from blocksim.bench.scenes import RESTITUTION, three_blocks
from blocksim.scenario.structures.base import draws
from blocksim.view.work_precision import Curve, Panel

if TYPE_CHECKING:
    from numpy.typing import NDArray

QUICK = "2 starts and three coarse levels of each engine, against a level that is not much finer"
STARTS, QUICK_STARTS = 16, 2
JITTER = 1e-6  # m
SEED = 1
END = 0.4  # s; the blocks rest from about 0.3 s
CLOSE = 0.2  # mm
STEPS = (4e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5)  # s
SCALES = (1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 1e-1, 3e-1)
QUICK_LEVELS = 3


@dataclass(frozen=True)
class Level:
    """All starts at one setting of one engine."""

    solver: Solver
    off: NDArray[np.float64]  # (starts,) mm, of the block that is farthest off
    seconds: NDArray[np.float64]  # (starts,) CPU time


def all_series(*, quick: bool) -> tuple[Series, ...]:
    """Return every engine with few and many iterations, blocksim with long and short steps."""
    if quick:
        steps, scales = STEPS[:QUICK_LEVELS], SCALES[:QUICK_LEVELS]
        finest: tuple[Solver, ...] = (Pymunk(STEPS[3], 30), Box2D(STEPS[3], 30), Blocksim(SCALES[3], 0.1))
    else:
        steps, scales = STEPS, SCALES
        # single precision: with steps below 20 µs the answers of Box2D begin to wander
        finest = (Pymunk(5e-6, 100), Box2D(2e-5, 50), Blocksim(1.0, 0.05))
    return (
        *(_peer("pymunk", Pymunk, steps, count, finest[0]) for count in (10, 30)),
        *(_peer("Box2D", Box2D, steps, count, finest[1]) for count in (10, 50)),
        *(
            Series("blocksim", f"blocksim, safety {safety:g}", _stiffnesses(scales, safety), finest[2])
            for safety in (0.1, 0.05)
        ),
    )


def _peer(name: str, engine: type[Pymunk | Box2D], steps: tuple[float, ...], iterations: int, finest: Solver) -> Series:
    levels = tuple(engine(step, iterations) for step in steps)
    return Series(name, f"{name}, {iterations} iterations", levels, finest)


def _stiffnesses(scales: tuple[float, ...], safety: float) -> tuple[Solver, ...]:
    return tuple(Blocksim(scale, safety) for scale in scales)


def starts(count: int) -> list[Scene]:
    """Return the scene with all blocks shifted at random by up to a micrometre."""
    return [Scene(three_blocks, JITTER * (2.0 * row - 1.0), RESTITUTION, END) for row in draws(SEED, count, 3)]


def measure(setting: Setting) -> Findings:
    """Measure all engines."""
    require_all()
    scenes = starts(QUICK_STARTS if setting.quick else STARTS)
    references: dict[str, list[Final]] = {}
    curves, numbers, details = [], [], []
    for series in all_series(quick=setting.quick):
        if series.engine not in references:
            references[series.engine] = [series.reference.solve(scene) for scene in scenes]
        levels = [_level(solver, scenes, references[series.engine]) for solver in series.levels]
        curves.append(_curve(series, levels))
        numbers.append(_time_to_answer(series, levels))
        details += [_detail(series, level) for level in levels]
    numbers += _calls()
    meaning = (
        f"error: of the block farthest from where the same engine's finest setting has it at {END:g} s, median of "
        f"{len(scenes)} starts within 1 µm; CPU time of the steps only"
    )
    notes = (meaning, *(_answer(engine, finals) for engine, finals in references.items()))
    panel = Panel("three blocks", "error (mm)", tuple(curves), CLOSE, f"{CLOSE:g} mm")
    return Findings(tuple(numbers), notes=notes, details=tuple(details), panel=panel)


def _level(solver: Solver, scenes: list[Scene], references: list[Final]) -> Level:
    finals = [solver.solve(scene) for scene in scenes]
    off = [np.hypot(one.x - ref.x, one.y - ref.y).max() for one, ref in zip(finals, references, strict=True)]
    return Level(solver, 1e3 * np.array(off), np.array([final.seconds for final in finals]))


def _time_to_answer(series: Series, levels: list[Level]) -> Number:
    """Return the CPU time of the cheapest level whose error is small; infinite where there is none."""
    close = settled(levels)
    if not close:
        return single(f"{series.label}: no setting", "CPU ms", np.inf)
    best = min(close, key=lambda level: float(np.median(level.seconds)))
    samples = tuple((1e3 * best.seconds).tolist())
    return Number(f"{series.label}: {best.solver.setting}", "CPU ms", samples)


def settled(levels: list[Level]) -> list[Level]:
    """Return the levels whose error is small, all finer ones' too: coarse steps can be right by chance."""
    close = itertools.takewhile(lambda level: float(np.median(level.off)) <= CLOSE, reversed(levels))
    return list(close)


def _calls() -> list[Number]:
    """Return what the others' figures hold of Python: one call a step, of an empty scene."""
    return [
        single("pymunk: a call, empty scene", "µs", 1e6 * call_time(Pymunk(1e-3, 1), empty_space())),
        single("Box2D: a call, empty scene", "µs", 1e6 * call_time(Box2D(1e-3, 1), empty_world())),
    ]


def _curve(series: Series, levels: list[Level]) -> Curve:
    off = np.array([np.percentile(level.off, (25.0, 50.0, 75.0)) for level in levels])
    seconds = np.array([np.median(level.seconds) for level in levels])
    return Curve(series.label, series.engine, seconds, error=off[:, 1], low=off[:, 0], high=off[:, 2])


def _answer(engine: str, finals: list[Final]) -> str:
    """Tell where an engine puts blocks 2 and 3, and how far its starts end apart."""
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

"""The three blocks: time of a step, and time to an answer that finer settings do not change."""

from __future__ import annotations

import itertools
import statistics
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from blocksim.bench.measurement import Findings, Number, Setting, repeated
from blocksim.bench.scenes import three_blocks
from blocksim.bench.timing import Rerun, Timed
from blocksim.simulation.loop import last_step_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

QUICK = "0.01 s instead of 0.4 s at full stiffness, converged answer against a hundredth of the stiffness"
DURATION, QUICK_DURATION = 0.4, 0.01  # s
SCALES = (1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 1e-1, 3e-1, 1.0)
QUICK_SCALES = (1e-4, 1e-3, 1e-2)
SAFETIES = (0.1, 0.05)
CLOSE = 0.2e-3  # m


@dataclass(frozen=True)
class Level:
    """One way to compute the collapse."""

    scale: float
    safety: float
    centres: NDArray[np.float64]  # (2, 3) m, at rest
    seconds: tuple[float, ...]  # CPU time of every repeat
    steps: int

    @property
    def median(self) -> float:
        """CPU seconds."""
        return statistics.median(self.seconds)

    def off(self, other: Level) -> float:
        """Return how far (m) the block that differs most ends from where it ends in another way."""
        return float(np.hypot(*(self.centres - other.centres)).max())


def measure(setting: Setting) -> Findings:
    """Measure both."""
    scales = QUICK_SCALES if setting.quick else SCALES
    rows = [[_solved(scale, safety, setting.repeats) for scale in scales] for safety in SAFETIES]
    levels = [level for row in rows for level in row]
    finest = levels[-1]
    close = [level for row in rows for level in settled(row, finest)]
    cheapest = min(close, key=lambda level: level.median)
    numbers = (
        _step_time(setting),
        Number("time to a converged answer", "CPU ms", tuple(1e3 * one for one in cheapest.seconds)),
        Number("the stiffest run, its measure", "CPU ms", tuple(1e3 * one for one in finest.seconds)),
    )
    note = (
        f"converged: here and at all greater stiffnesses, centres at rest within {1e3 * CLOSE:g} mm of the stiffest "
        f"run (stiffness_scale {finest.scale:g}, safety {finest.safety:g}); the cheapest of {len(close)} such settings "
        f"of {len(levels)} has stiffness_scale {cheapest.scale:g}, safety {cheapest.safety:g}, {cheapest.steps} steps, "
        f"and is off by {1e3 * cheapest.off(finest):.2f} mm"
    )
    return Findings(numbers, notes=(note,), details=tuple(_detail(level, finest) for level in levels))


def settled(levels: Sequence[Level], finest: Level) -> list[Level]:
    """Return the levels, soft to stiff, that are close to the finest, all stiffer ones too: one can be so by chance."""
    return list(itertools.takewhile(lambda level: level.off(finest) <= CLOSE, reversed(levels)))


def _step_time(setting: Setting) -> Number:
    """At the aluminium's own stiffness, with the blocks at rest for the last quarter."""
    scene = Rerun(three_blocks(time={"stop_at_rest": False}))
    last = last_step_of(QUICK_DURATION if setting.quick else DURATION, scene.step)
    return repeated("a step", "ns", lambda: 1e9 * scene.run(last).seconds / last, setting.repeats)


def _solved(scale: float, safety: float, repeats: int) -> Level:
    """Run until the blocks rest."""
    scenario = three_blocks(contact={"stiffness_scale": scale}, time={"safety": safety})
    scene = Rerun(scenario)
    last = last_step_of(scenario.time.end, scene.step)
    runs: list[Timed] = [scene.run(last) for _ in range(repeats)]
    bodies = runs[-1].bodies
    return Level(scale, safety, np.array([bodies.x, bodies.y]), tuple(run.seconds for run in runs), runs[-1].steps)


def _detail(level: Level, finest: Level) -> dict[str, object]:
    return {
        "stiffness_scale": level.scale,
        "safety": level.safety,
        "steps": level.steps,
        "off_mm": 1e3 * level.off(finest),
        "cpu_ms": 1e3 * level.median,
        "x_mm": [1e3 * x for x in level.centres[0].tolist()],
    }

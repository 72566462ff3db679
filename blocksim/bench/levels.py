"""One collapse of the three blocks at several settings, and the settings that are fine enough."""

from __future__ import annotations

import itertools
import statistics
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from blocksim.bench.timing import Rerun
from blocksim.simulation.loop import last_step_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from blocksim.scenario import Scenario

CLOSE = 0.2e-3  # m


@dataclass(frozen=True)
class Level:
    """One way to compute the collapse."""

    setting: Mapping[str, float]  # its keys of the scenario
    centres: NDArray[np.float64]  # (2, 3) m, at rest
    seconds: tuple[float, ...]  # CPU time of every repeat
    steps: int

    @property
    def told(self) -> str:
        """For people."""
        return ", ".join(f"{name} {value:g}" for name, value in self.setting.items())

    @property
    def median(self) -> float:
        """CPU seconds."""
        return statistics.median(self.seconds)

    def off(self, other: Level) -> float:
        """Return the largest distance (m) between final positions of a block by this and another way."""
        return float(np.hypot(*(self.centres - other.centres)).max())

    def detail(self, finest: Level) -> dict[str, object]:
        """Return it for programs."""
        return {
            **self.setting,
            "steps": self.steps,
            "off_mm": 1e3 * self.off(finest),
            "cpu_ms": 1e3 * self.median,
            "x_mm": [1e3 * x for x in self.centres[0].tolist()],
        }


def settled(levels: Sequence[Level], finest: Level) -> list[Level]:
    """Return the levels, coarse to fine, that are close to the finest, all finer ones too: one can be so by chance."""
    return list(itertools.takewhile(lambda level: level.off(finest) <= CLOSE, reversed(levels)))


def solved(setting: Mapping[str, float], scenario: Scenario, repeats: int) -> Level:
    """Run until the blocks rest."""
    scene = Rerun(scenario)
    last = last_step_of(scenario.time.end, scene.step)
    runs = [scene.run(last) for _ in range(repeats)]
    bodies = runs[-1].bodies  # every run ends with the same bits
    return Level(setting, np.array([bodies.x, bodies.y]), tuple(run.seconds for run in runs), runs[-1].steps)

"""blocksim with either scheme: springs, whose step follows from their stiffness, or impulses, with a step of choice."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from blocksim.bench.harness import Rerun
from blocksim.simulation.loop import last_step_of
from blocksim.simulation.schemes import ALONE
from tests.bench.peers.engine import Final, Scene, timed

if TYPE_CHECKING:
    from collections.abc import Mapping

    from blocksim.bench.harness import TimeSteps

CALLS = 1000  # that are timed with nothing to do
Table = dict[str, object]


class Blocksim(ABC):
    """One setting of a scheme."""

    @property
    @abstractmethod
    def setting(self) -> str:
        """For people."""

    @abstractmethod
    def tables(self) -> tuple[Table, Table]:
        """Return keys of [contact] and of [time]."""

    def calls(self, scene: Scene) -> int:  # noqa: ARG002 - others have one a step
        """Return how often Python calls the engine for a scene."""
        return 1

    def solve(self, scene: Scene) -> Final:
        """Compute the scene. Not counted: building the world and what a run does once, as the others' scenes are not.

        A run that fails, as when soft blocks overlap too far, ends at positions that are NaN.
        """
        start = self._started(scene, {"end": scene.end, "stop_at_rest": False})
        run = start.attempt(last_step_of(scene.end, start.step))
        places = np.array([run.bodies.x, run.bodies.y])
        x, y = places if run.outcome.status == "finished" else np.full_like(places, np.nan)
        return Final(x, y, run.seconds)

    def call_time(self, scene: Scene) -> float:
        """Return the seconds that a call from Python costs where there is nothing to compute."""
        return timed(ALONE.advance, (self._started(scene, {}).scene, 0), CALLS) / CALLS

    def _started(self, scene: Scene, more: Mapping[str, object]) -> Rerun:
        contact, time = self.tables()
        return Rerun(scene.make(contact=contact, time={**time, **more}), scene.shift)


@dataclass(frozen=True)
class Explicit(Blocksim):
    """One stiffness and safety of the step."""

    scale: float  # stiffness_scale
    safety: float

    @property
    def setting(self) -> str:
        """For people."""
        return f"stiffness {self.scale:g}"

    def tables(self) -> tuple[Table, Table]:
        """Return stiffness and step."""
        return {"stiffness_scale": self.scale}, {"safety": self.safety}


@dataclass(frozen=True)
class Nonsmooth(Blocksim):
    """One step and its parts, also where it is longer than what is safe: the error will tell."""

    stepping: TimeSteps

    @property
    def setting(self) -> str:
        """For people."""
        return self.stepping.setting

    def tables(self) -> tuple[Table, Table]:
        """Return step, parts and sweeps."""
        return {}, self.stepping.time(force_step=True)

"""blocksim with either scheme: springs, whose step follows from their stiffness, or impulses, with a step of choice."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from blocksim.bench.peers.scene import Final, Scene
from blocksim.simulation.loop import last_step_of
from blocksim.simulation.outcome import BY_CODE
from blocksim.simulation.schemes import build_scene
from blocksim.simulation.team import ALONE

if TYPE_CHECKING:
    from collections.abc import Mapping

    from blocksim.bench.stepping import Stepping

CALLS = 1000  # that are timed with nothing to do


class Blocksim(ABC):
    """One setting of a scheme."""

    @property
    @abstractmethod
    def setting(self) -> str:
        """For people."""

    @property
    @abstractmethod
    def contact(self) -> Mapping[str, object]:
        """Keys of [contact]."""

    @property
    @abstractmethod
    def time(self) -> Mapping[str, object]:
        """Keys of [time]."""

    def calls(self, scene: Scene) -> int:  # noqa: ARG002 - others have one a step
        """Return how often Python calls the engine for a scene."""
        return 1

    def solve(self, scene: Scene) -> Final:
        """Compute the scene. Not counted: building the world and what a run does once, as the others' scenes are not.

        A run that fails, as when soft blocks overlap too far, ends at positions that are NaN.
        """
        times = {**self.time, "end": scene.end, "stop_at_rest": False}
        own = build_scene(scene.make(contact=self.contact, time=times))
        own.world.bodies.x[:-1] += scene.shift
        last = last_step_of(scene.end, float(own.world.controls[0].step))
        own, _ = ALONE.advance(own, 0)
        began = time.process_time()
        own, status = ALONE.advance(own, last)
        seconds = time.process_time() - began
        found = np.array([own.world.bodies.x[:-1], own.world.bodies.y[:-1]])
        if not BY_CODE[status].is_finished:
            found[:] = np.nan
        return Final(found[0], found[1], seconds)

    def call_time(self, scene: Scene) -> float:
        """Return the seconds that a call from Python costs where there is nothing to compute."""
        own, _ = ALONE.advance(build_scene(scene.make(contact=self.contact, time=self.time)), 0)
        began = time.process_time()
        for _ in range(CALLS):
            own, _ = ALONE.advance(own, 0)
        return (time.process_time() - began) / CALLS


@dataclass(frozen=True)
class Explicit(Blocksim):
    """One stiffness and safety of the step."""

    scale: float  # stiffness_scale
    safety: float

    @property
    def setting(self) -> str:
        """For people."""
        return f"stiffness {self.scale:g}"

    @property
    def contact(self) -> Mapping[str, object]:
        """Stiffness."""
        return {"stiffness_scale": self.scale}

    @property
    def time(self) -> Mapping[str, object]:
        """Step."""
        return {"safety": self.safety}


@dataclass(frozen=True)
class Nonsmooth(Blocksim):
    """One step and its parts, also where it is longer than what is safe: the error will tell."""

    stepping: Stepping

    @property
    def setting(self) -> str:
        """For people."""
        return self.stepping.setting

    @property
    def contact(self) -> Mapping[str, object]:
        """Nothing."""
        return {}

    @property
    def time(self) -> Mapping[str, object]:
        """Step, parts and sweeps."""
        return self.stepping.time(force_step=True)

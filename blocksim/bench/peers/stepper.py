"""Common base of engines with a chosen step: the timed loop."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from blocksim.bench.peers.scene import Final

if TYPE_CHECKING:
    from collections.abc import Callable

    from blocksim.bench.peers.scene import Scene

CALLS = 20_000  # that are timed on an empty scene


@dataclass(frozen=True)
class Stepper(ABC):
    """One step length and number of iterations."""

    step: float  # s
    iterations: int
    units: ClassVar[float] = 1.0  # lengths of the engine in a metre

    @property
    def setting(self) -> str:
        """For people."""
        return f"step {1e3 * self.step:g} ms"

    def calls(self, scene: Scene) -> int:
        """Return the number of steps: each is a call from Python."""
        return round(scene.end / self.step)

    def solve(self, scene: Scene) -> Final:
        """Compute the scene. Not counted: making it."""
        world, bodies = self.made(scene)
        seconds = timed(*self.call(world), count=self.calls(scene))
        x, y = np.array([body.position for body in bodies]).T / self.units
        return Final(x, y, seconds)

    @abstractmethod
    def made(self, scene: Scene) -> tuple[Any, list[Any]]:
        """Return the engine's world and its blocks."""

    @abstractmethod
    def call(self, world: Any) -> tuple[Callable[..., object], tuple[Any, ...]]:
        """Return the function of a step, and its arguments."""


def timed(call: Callable[..., object], arguments: tuple[Any, ...], count: int) -> float:
    """Return the CPU seconds of so many calls."""
    began = time.process_time()
    for _ in range(count):
        call(*arguments)
    return time.process_time() - began


def call_time(stepper: Stepper, empty: Any) -> float:
    """Return the seconds that a call from Python costs where there is nothing to compute."""
    return timed(*stepper.call(empty), count=CALLS) / CALLS

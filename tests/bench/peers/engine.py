"""What engines have in common: a scene, its result, and the timed loop over steps."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from blocksim.bench import harness
from blocksim.scenario import PlacedBody, Scenario, place_bodies

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from tests.bench.peers.work_precision import Panel

Floats = NDArray[np.float64]
CALLS = 20_000  # that are timed on an empty scene


@dataclass(frozen=True)
class Readings(harness.Readings):
    """Result of a measurement, with its part of the work-precision picture."""

    panel: Panel | None = None


class Make(Protocol):
    """Make the scene's scenario with more keys of [contact] and [time]."""

    def __call__(
        self, *, contact: Mapping[str, object] | None = None, time: Mapping[str, object] | None = None
    ) -> Scenario:
        """Return it."""


@dataclass(frozen=True)
class Scene:
    """Blocks on level ground, let go at time zero; they are not turned."""

    make: Make
    shift: Floats  # (b,) m, along x, of every block at the start
    restitution: float
    end: float  # s

    def placed(self) -> list[PlacedBody]:
        """Return the blocks at the start."""
        bodies = place_bodies(self.make())
        return [body._replace(x=body.x + by) for body, by in zip(bodies, self.shift.tolist(), strict=True)]


class Final(NamedTuple):
    """Centres (m) of all blocks at the end, and the CPU seconds that the engine's steps took."""

    x: Floats
    y: Floats
    seconds: float


class Solver(Protocol):
    """An engine at one setting."""

    @property
    def setting(self) -> str:
        """The refined quantity, as text."""

    def calls(self, scene: Scene) -> int:
        """Return how often Python calls the engine for a scene."""

    def solve(self, scene: Scene) -> Final:
        """Compute the scene up to its end."""


@dataclass(frozen=True)
class Series:
    """Settings of one engine from coarse to fine, and its converged reference."""

    engine: str
    label: str
    levels: tuple[Solver, ...]
    reference: Solver


@dataclass(frozen=True)
class Stepper(ABC):
    """An engine that Python calls for every step: one step length and number of iterations."""

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

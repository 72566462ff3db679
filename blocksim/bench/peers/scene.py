"""A scene for several engines, and the result of an engine."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from blocksim.scenario import PlacedBody, Scenario, place_bodies

if TYPE_CHECKING:
    from collections.abc import Mapping

Floats = NDArray[np.float64]


class Make(Protocol):
    """Make the scene's scenario with more keys of [contact] and [time]."""

    def __call__(
        self, *, contact: Mapping[str, object] | None = None, time: Mapping[str, object] | None = None
    ) -> Scenario:
        """Return it."""


@dataclass(frozen=True)
class Scene:
    """Equal blocks on level ground, let go at time zero."""

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

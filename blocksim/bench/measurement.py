"""Definition of a measurement of speed, and its result: numbers with their samples."""

from __future__ import annotations

import statistics
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from blocksim.view.work_precision import Panel

REPEATS = 5


@dataclass(frozen=True)
class Number:
    """One measured quantity: the samples of all repeats, in `unit`."""

    quantity: str
    unit: str
    samples: tuple[float, ...]

    @property
    def median(self) -> float:
        """The number that is reported."""
        return statistics.median(self.samples)

    @property
    def smallest(self) -> float:
        """Lower end of the spread."""
        return min(self.samples)

    @property
    def largest(self) -> float:
        """Upper end of the spread."""
        return max(self.samples)

    @property
    def is_repeated(self) -> bool:
        """Return True if there is a spread at all."""
        return len(self.samples) > 1


@dataclass(frozen=True)
class Setting:
    """Settings of a measurement."""

    quick: bool = False  # its shortened size
    repeats: int = REPEATS


@dataclass(frozen=True)
class Findings:
    """Result of a measurement."""

    numbers: tuple[Number, ...]
    notes: tuple[str, ...] = ()  # notes on the numbers
    details: tuple[Mapping[str, object], ...] = ()  # more of it, for programs
    panel: Panel | None = None  # part of the work-precision picture


@dataclass(frozen=True)
class Measurement:
    """One entry of the registry."""

    name: str
    title: str
    measure: Callable[[Setting], Findings]
    quick: str  # what the quick size leaves out


def repeated(quantity: str, unit: str, sample: Callable[[], float], repeats: int) -> Number:
    """Return a number with its samples."""
    return Number(quantity, unit, tuple(float(sample()) for _ in range(repeats)))


def single(quantity: str, unit: str, value: float) -> Number:
    """Return a number that needs no repeats: counted, or computed from others."""
    return Number(quantity, unit, (float(value),))

"""A measurement of speed: definition, run, numbers with their samples, machine, and the whole as data."""

from __future__ import annotations

import json
import os
import statistics
import time
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

from blocksim.simulation.provenance import environment

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence


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

    def to_dict(self) -> dict[str, object]:
        """Return it for programs."""
        names = ("quantity", "unit", "median", "smallest", "largest")
        return {**{name: getattr(self, name) for name in names}, "samples": list(self.samples)}


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


@dataclass(frozen=True)
class Measurement:
    """One entry of the registry."""

    name: str
    title: str
    measure: Callable[[Setting], Findings]
    quick: str  # what the quick size leaves out

    def run(self, setting: Setting) -> Outcome:
        """Run it."""
        began = time.perf_counter()
        findings = self.measure(setting)
        return Outcome(self, setting, findings, time.perf_counter() - began)


@dataclass(frozen=True)
class Outcome:
    """Result of a measurement, and its duration."""

    measurement: Measurement
    setting: Setting
    findings: Findings
    seconds: float

    @property
    def shortened(self) -> str:
        """What was left out; empty for the full size."""
        return self.measurement.quick if self.setting.quick else ""

    def to_dict(self) -> dict[str, object]:
        """Return it for programs; nothing is rounded."""
        return {
            "name": self.measurement.name,
            "title": self.measurement.title,
            "shortened": self.shortened,
            "seconds": round(self.seconds, 2),
            "numbers": [one.to_dict() for one in self.findings.numbers],
            "notes": list(self.findings.notes),
            "details": [dict(one) for one in self.findings.details],
        }


def report(machine: Machine, outcomes: Sequence[Outcome]) -> dict[str, object]:
    """Return everything for programs; numbers that are not finite become None, as JSON has none."""
    found = {"machine": machine.to_dict(), "measurements": [outcome.to_dict() for outcome in outcomes]}
    plain: dict[str, object] = json.loads(json.dumps(found), parse_constant=lambda _: None)
    return plain


def repeat(quantity: str, unit: str, sample: Callable[[], float], repeats: int) -> Number:
    """Return a number with its samples."""
    return Number(quantity, unit, tuple(float(sample()) for _ in range(repeats)))


def single(quantity: str, unit: str, value: float) -> Number:
    """Return a number that needs no repeats: counted, or computed from others."""
    return Number(quantity, unit, (float(value),))


BUSY = 0.5  # processes at work on average over the last minute, before anything was measured


@dataclass(frozen=True)
class Machine:
    """Processor, system, versions, and load at the start."""

    processor: str
    cores: int
    platform: str
    python: str
    numba: str
    numpy: str
    blocksim: str
    code: str
    load: float | None  # None where the system does not report it

    @property
    def is_busy(self) -> bool:
        """Return True if other processes share the machine, so that times are too long and scatter."""
        return self.load is not None and self.load > BUSY

    def lines(self) -> list[str]:
        """Return it as text."""
        load = "unknown" if self.load is None else f"{self.load:.2f}"
        found = [
            f"{self.processor}, {self.cores} cores, load {load} at the start",
            f"blocksim {self.blocksim}, Python {self.python}, numba {self.numba}, numpy {self.numpy}",
            self.platform,
        ]
        if self.is_busy:
            found.append("Other processes are running: times are upper bounds and scatter.")
        return found

    def to_dict(self) -> dict[str, object]:
        """Return it for programs."""
        return {**asdict(self), "busy": self.is_busy}


def this_machine() -> Machine:
    """Return this machine with its present load."""
    found = environment()
    names = ("processor", "platform", "python", "numba", "numpy", "blocksim", "code")
    return Machine(cores=os.cpu_count() or 1, load=_load(), **{name: found[name] for name in names})


def _load() -> float | None:
    try:
        return round(os.getloadavg()[0], 2)
    except (AttributeError, OSError):  # some systems have none
        return None

"""A measurement of speed: definition, run, numbers with their samples, machine, and the whole as data."""

import json
import os
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from blocksim.simulation.provenance import environment

REPEATS = 5
BUSY = 0.5  # processes at work on average over the last minute, before anything was measured


@dataclass(frozen=True)
class Number:
    """One measured quantity: the samples of all repeats, in `unit`; a single one where it is counted or computed."""

    quantity: str
    unit: str
    samples: tuple[float, ...]

    @property
    def median(self) -> float:
        """The number that is reported."""
        return statistics.median(self.samples)


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

    def run(self, setting: Setting) -> "Outcome":
        """Run it."""
        began = time.perf_counter()
        findings = self.measure(setting)
        return Outcome(self, self.quick if setting.quick else "", findings, time.perf_counter() - began)


@dataclass(frozen=True)
class Outcome:
    """Result of a measurement, and its duration."""

    measurement: Measurement
    shortened: str  # what was left out; empty for the full size
    findings: Findings
    seconds: float


def repeat(quantity: str, unit: str, sample: Callable[[], float], repeats: int) -> Number:
    """Return a number with its samples."""
    return Number(quantity, unit, tuple(float(sample()) for _ in range(repeats)))


def single(quantity: str, unit: str, value: float) -> Number:
    """Return a number that needs no repeats: counted, or computed from others."""
    return Number(quantity, unit, (float(value),))


def report(machine: Mapping[str, object], outcomes: Sequence[Outcome]) -> dict[str, object]:
    """Return everything for programs, not rounded; numbers that are not finite become None, as JSON has none."""
    measurements = [
        {
            "name": outcome.measurement.name,
            "title": outcome.measurement.title,
            "shortened": outcome.shortened,
            "seconds": round(outcome.seconds, 2),
            "numbers": [
                {
                    "quantity": one.quantity,
                    "unit": one.unit,
                    "median": one.median,
                    "smallest": min(one.samples),
                    "largest": max(one.samples),
                    "samples": list(one.samples),
                }
                for one in outcome.findings.numbers
            ],
            "notes": list(outcome.findings.notes),
            "details": [dict(one) for one in outcome.findings.details],
        }
        for outcome in outcomes
    ]
    found = {"machine": machine, "measurements": measurements}
    plain: dict[str, object] = json.loads(json.dumps(found), parse_constant=lambda _: None)
    return plain


def this_machine() -> dict[str, Any]:
    """Return processor, system, versions and load at the start, None where the system does not report it.

    Where other processes share the machine it is busy: times are too long and scatter.
    """
    try:
        load = round(os.getloadavg()[0], 2)
    except (AttributeError, OSError):  # some systems have none
        load = None
    found = environment()
    versions = {name: found[name] for name in ("platform", "python", "numba", "numpy", "blocksim", "code")}
    busy = load is not None and load > BUSY
    return {"processor": found["processor"], "cores": os.cpu_count() or 1, **versions, "load": load, "busy": busy}


def machine_lines(machine: Mapping[str, Any]) -> list[str]:
    """Return a machine as text."""
    load = "unknown" if machine["load"] is None else f"{machine['load']:.2f}"
    programs = ((name, machine[name.lower()]) for name in ("blocksim", "Python", "numba", "numpy"))
    busy = ["Other processes are running: times are upper bounds and scatter."] if machine["busy"] else []
    return [
        f"{machine['processor']}, {machine['cores']} cores, load {load} at the start",
        ", ".join(f"{name} {version}" for name, version in programs),
        machine["platform"],
        *busy,
    ]

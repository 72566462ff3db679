"""Running measurements: findings, times, and the whole as data."""

from __future__ import annotations

import json
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from blocksim.bench.machine import Machine
    from blocksim.bench.measurement import Findings, Measurement, Number, Setting


@dataclass(frozen=True)
class Outcome:
    """Result of a measurement, and its duration."""

    measurement: Measurement
    setting: Setting
    findings: Findings
    seconds: float

    def to_dict(self) -> dict[str, object]:
        """Return it for programs; nothing is rounded."""
        return {
            "name": self.measurement.name,
            "title": self.measurement.title,
            "shortened": self.measurement.quick if self.setting.quick else "",
            "seconds": round(self.seconds, 2),
            "numbers": [_number(one) for one in self.findings.numbers],
            "notes": list(self.findings.notes),
            "details": [dict(one) for one in self.findings.details],
        }


def _number(one: Number) -> dict[str, object]:
    return {
        "quantity": one.quantity,
        "unit": one.unit,
        "median": one.median,
        "smallest": one.smallest,
        "largest": one.largest,
        "samples": list(one.samples),
    }


def run_measurement(measurement: Measurement, setting: Setting) -> Outcome:
    """Run one measurement."""
    began = time.perf_counter()
    findings = measurement.measure(setting)
    return Outcome(measurement, setting, findings, time.perf_counter() - began)


def report(machine: Machine, outcomes: Sequence[Outcome]) -> dict[str, object]:
    """Return everything for programs; numbers that are not finite become None, as JSON has none."""
    found = {"machine": machine.to_dict(), "measurements": [outcome.to_dict() for outcome in outcomes]}
    plain: dict[str, object] = json.loads(json.dumps(found), parse_constant=lambda _: None)
    return plain

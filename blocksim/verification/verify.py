"""Running cases: rows, verdicts and times."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace

from blocksim.verification.case import Case, Row, Setting, Verdict


@dataclass(frozen=True)
class Outcome:
    """Measurements of a case."""

    case: Case
    setting: Setting
    rows: tuple[Row, ...]
    seconds: float

    @property
    def inside(self) -> bool:
        """Return True if every row is inside its tolerance."""
        return all(row.verdict == Verdict.INSIDE for row in self.rows)

    @property
    def remark(self) -> str:
        """Reason for being outside, if known."""
        return "" if self.inside else self.case.remarks.get(self.setting.model, "")

    def to_dicts(self) -> list[dict[str, object]]:
        """Return one flat record a row."""
        common = {
            "case": self.case.id,
            "title": self.case.title,
            "source": self.case.source,
            "model": self.setting.model,
            "law": self.setting.law,
            "scheme": self.setting.scheme,
            "shortened": self.case.quick if self.setting.quick else "",
            "remark": self.remark,
        }
        return [
            {
                **common,
                "quantity": row.quantity,
                "unit": row.unit,
                "expected": row.expected,
                "measured": row.measured,
                "error": row.error,
                "tolerance": row.tolerance,
                "tolerance_kind": tolerance_kind(row),
                "verdict": str(row.verdict),
                "seconds": round(self.seconds, 2),
            }
            for row in self.rows
        ]


def tolerance_kind(row: Row) -> str:
    """Return `relative` (a share of the expected number), `at least` (a lower bound) or `absolute` (in the unit)."""
    if row.at_least:
        return "at least"
    return "relative" if row.relative else "absolute"


def prepared(setting: Setting) -> Setting:
    """Return the setting in which a case is run: rigid contacts in full, as that is quick."""
    return setting if setting.has_springs else replace(setting, quick=False)


def run_case(case: Case, setting: Setting) -> Outcome:
    """Run one case."""
    setting = prepared(setting)
    began = time.perf_counter()
    rows = tuple(case.measure(setting))
    return Outcome(case, setting, rows, time.perf_counter() - began)


def number(value: float, digits: int = 4) -> str:
    """Return a number as text: so many significant digits, a dash for NaN."""
    if not math.isfinite(value):
        return "–"
    text = f"{value:.{digits}g}"
    return "0" if text == "-0" else text.replace("e-0", "e-").replace("e+0", "e+").replace("-", "−")


def expected_text(row: Row) -> str:
    """Return the expected number."""
    return f"≥ {number(row.expected)}" if row.at_least else number(row.expected)


def error_text(row: Row) -> str:
    """Return the error; in per cent where the tolerance is."""
    return f"{number(100.0 * row.error, 2)} %" if row.relative else number(row.error, 2)


def tolerance_text(row: Row) -> str:
    """Return the tolerance as the table of cases states it."""
    if row.at_least:
        return "–"
    return f"{number(100.0 * row.tolerance)} %" if row.relative else number(row.tolerance, 2)

"""A verification case: rows of expected and measured numbers with a tolerance, its run, and numbers as text."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import TYPE_CHECKING, Any

from blocksim.scenario.models.stepping import SCHEMES, SPRINGS
from blocksim.verification.scene import Scene, Simulation

if TYPE_CHECKING:
    from collections.abc import Sequence

    from blocksim.kernels.common.arrays import World


VELOCITY_TOLERANCE = 1e-6
"""Of the non-smooth scheme (m/s) at steps given by hand: studies of the step know no unsolved impulses."""


class Verdict(StrEnum):
    """Verdict of a row."""

    INSIDE = "inside"
    OUTSIDE = "outside"


@dataclass(frozen=True)
class Row:
    """One measured number. All but a relative tolerance (a share) is in `unit`."""

    quantity: str
    unit: str
    expected: float
    measured: float
    tolerance: float
    relative: bool = False
    at_least: bool = False  # `expected` is a lower bound

    @property
    def error(self) -> float:
        """Measured less expected, as a share of the expected number where the tolerance is one; 0 beyond a bound."""
        difference = self.measured - self.expected
        if self.at_least:
            return min(difference, 0.0)
        return difference / abs(self.expected) if self.relative else difference

    @property
    def verdict(self) -> Verdict:
        """Inside the tolerance or not; a number that is not finite is outside."""
        return Verdict.INSIDE if abs(self.error) <= self.tolerance else Verdict.OUTSIDE


@dataclass(frozen=True)
class Setting:
    """Settings of a case."""

    model: str = "surface"
    law: str = "linear"
    quick: bool = False  # the case's shortened size, where it has one
    scheme: str = SPRINGS
    rigid_step: float | None = None  # s, of the non-smooth scheme, without substeps; None for what users get

    @property
    def has_springs(self) -> bool:
        """Return True if contacts are springs; they are impulses with Newton's restitution otherwise."""
        return SCHEMES[self.scheme].has_springs

    @property
    def stepping(self) -> dict[str, object]:
        """Keys of [time] that the scheme needs; the defaults unless a step is given."""
        if self.has_springs:
            return {}
        if self.rigid_step is None:
            return {"scheme": self.scheme}
        steps = {"step": self.rigid_step, "substeps": 1, "velocity_tolerance": VELOCITY_TOLERANCE}
        return {"scheme": self.scheme, **steps}

    def distinct(self, spacings: Sequence[float]) -> Sequence[float]:
        """Return the particle spacings (m) that a case must try: one for contacts without particles."""
        return spacings if self.has_springs else spacings[:1]

    def stepped(self, step: float) -> Setting:
        """Return the same setting with another step (s) of the non-smooth scheme; the explicit one is left as it is."""
        return replace(self, rigid_step=step)

    @property
    def hertzian(self) -> bool:
        """Return True if the stiffness of a contact changes with its overlap."""
        return self.law == "hertz-mindlin"

    def scene(self, bodies: Sequence[Mapping[str, object]], **values: Any) -> Scene:
        """Return a scene with this model and law; `values` are more fields of Scene."""
        contact = {"model": self.model, "law": self.law, **values.pop("contact", {})}
        time = {**self.stepping, **values.pop("time", {})}
        return Scene(bodies, contact=contact, time=time, **values)

    def start(
        self,
        bodies: Sequence[Mapping[str, object]],
        change: Callable[[World], None] | None = None,
        **values: Any,
    ) -> Simulation:
        """Start such a scene."""
        return self.scene(bodies, **values).start(change)


Measure = Callable[[Setting], Iterable[Row]]


@dataclass(frozen=True)
class Case:
    """One line of the verification table."""

    id: str
    title: str
    source: str  # equation or reference of the expected number
    measure: Measure
    quick: str = ""  # what the quick size leaves out; empty where there is but one size
    remarks: Mapping[str, str] = field(default_factory=dict)  # model: why it may be outside
    not_for: Mapping[str, str] = field(default_factory=dict)  # scheme: why the case does not apply to it


def absolute(quantity: str, unit: str, expected: float, measured: float, tolerance: float) -> Row:
    """Return a row whose tolerance is in the unit."""
    return Row(quantity, unit, float(expected), float(measured), tolerance)


def relative(quantity: str, unit: str, expected: float, measured: float, tolerance: float) -> Row:
    """Return a row whose tolerance is a share of the expected number."""
    return Row(quantity, unit, float(expected), float(measured), tolerance, relative=True)


def at_least(quantity: str, unit: str, bound: float, measured: float) -> Row:
    """Return a row that is inside where the measured number is not below the bound."""
    return Row(quantity, unit, bound, float(measured), 0.0, at_least=True)


def count(quantity: str, expected: int, measured: int) -> Row:
    """Return a row of counted outcomes; all must be as expected."""
    return Row(quantity, "", float(expected), float(measured), 0.0)


def farthest(expected: float, values: Iterable[float]) -> float:
    """Return the value that is farthest from the expected one; NaN counts as farthest."""
    return max(values, key=lambda value: abs(value - expected) if value == value else float("inf"))  # noqa: PLR0124


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


def case_setting(setting: Setting) -> Setting:
    """Return the setting in which a case is run: rigid contacts in full, as that is quick."""
    return setting if setting.has_springs else replace(setting, quick=False)


def run_case(case: Case, setting: Setting) -> Outcome:
    """Run one case."""
    setting = case_setting(setting)
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

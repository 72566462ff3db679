"""A verification case: rows of expected and measured numbers with a tolerance, its run, and numbers as text."""

import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

from blocksim.kernels.common.arrays import World
from blocksim.scenario.laws import LAWS, LINEAR
from blocksim.scenario.models.timeline import SCHEMES, SPRINGS
from blocksim.verification.scene import CaseScene, SteppedScene

NUMBERS = ("quantity", "unit", "expected", "measured", "error", "tolerance")  # of a row, for programs
VELOCITY_TOLERANCE = 1e-6
"""Of the non-smooth scheme (m/s) at steps given by hand: studies of the step know no unsolved impulses."""


def number(value: float, digits: int = 4) -> str:
    """Return a number as text: so many significant digits, a dash for NaN."""
    if not math.isfinite(value):
        return "–"
    text = f"{value:.{digits}g}"
    return "0" if text == "-0" else text.replace("e-0", "e-").replace("e+0", "e+").replace("-", "−")


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
    def is_inside(self) -> bool:
        """Return True if it is inside the tolerance; a number that is not finite is outside."""
        return bool(abs(self.error) <= self.tolerance)

    @property
    def texts(self) -> dict[str, str]:
        """The row as the table of cases states it, column by column; an error in per cent where the tolerance is."""
        per_cent, unit = (100.0, " %") if self.relative else (1.0, "")
        tolerance = number(per_cent * self.tolerance, 4 if self.relative else 2) + unit
        return {
            "quantity": f"{self.quantity}, {self.unit}" if self.unit else self.quantity,
            "expected": f"≥ {number(self.expected)}" if self.at_least else number(self.expected),
            "measured": number(self.measured),
            "error": number(per_cent * self.error, 2) + unit,
            "tolerance": "–" if self.at_least else tolerance,
            "verdict": "inside" if self.is_inside else "outside",
        }


relative = partial(Row, relative=True)
"""A row whose tolerance is a share of the expected number."""
at_least = partial(Row, tolerance=0.0, at_least=True)
"""A row that is inside where the measured number is not below the expected one."""


def count(quantity: str, expected: int, measured: int) -> Row:
    """Return a row of counted outcomes; all must be as expected."""
    return Row(quantity, "", float(expected), float(measured), 0.0)


@dataclass(frozen=True)
class Setting:
    """Settings of a case."""

    model: str = "surface"
    law: str = LINEAR.name
    quick: bool = False  # the case's shortened size, where it has one
    scheme: str = SPRINGS
    rigid_step: float | None = None  # s, of the non-smooth scheme, without substeps; None for what users get

    @property
    def has_springs(self) -> bool:
        """Return True if contacts are springs; they are impulses with Newton's restitution otherwise."""
        return SCHEMES[self.scheme].has_springs

    def distinct(self, spacings: Sequence[float]) -> Sequence[float]:
        """Return the particle spacings (m) that a case must try: one for contacts without particles."""
        return spacings if self.has_springs else spacings[:1]

    @property
    def hertzian(self) -> bool:
        """Return True if the stiffness of a contact changes with its overlap."""
        return not LAWS[self.law].is_linear

    def scene(self, bodies: Sequence[Mapping[str, object]], **values: Any) -> CaseScene:
        """Return a scene with this model, law and stepping; `values` are more fields of CaseScene."""
        contact = {"model": self.model, "law": self.law, **values.pop("contact", {})}
        stepping: dict[str, object] = {} if self.has_springs else {"scheme": self.scheme}
        if stepping and self.rigid_step is not None:
            stepping |= {"step": self.rigid_step, "substeps": 1, "velocity_tolerance": VELOCITY_TOLERANCE}
        return CaseScene(bodies, contact=contact, time={**stepping, **values.pop("time", {})}, **values)

    def start(
        self, bodies: Sequence[Mapping[str, object]], change: Callable[[World], None] | None = None, **values: Any
    ) -> SteppedScene:
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
    not_for: Mapping[str, str] = field(default_factory=dict)  # scheme, model or law: why the case does not apply to it


def farthest(expected: float, values: Iterable[float]) -> float:
    """Return the value that is farthest from the expected one; NaN counts as farthest."""
    return max(values, key=lambda value: math.inf if math.isnan(value) else abs(value - expected))


@dataclass(frozen=True)
class CaseOutcome:
    """Measurements of a case."""

    case: Case
    setting: Setting
    rows: tuple[Row, ...]
    seconds: float

    @property
    def inside(self) -> bool:
        """Return True if every row is inside its tolerance."""
        return all(row.is_inside for row in self.rows)

    @property
    def remark(self) -> str:
        """Reason for being outside, if known."""
        return "" if self.inside else self.case.remarks.get(self.setting.model, "")

    def to_dicts(self) -> list[dict[str, object]]:
        """Return one flat record a row.

        A tolerance is `relative` (a share of the expected number), `at least` (none, of a lower bound) or `absolute`
        (in the unit).
        """
        return [
            {
                "case": self.case.id,
                "title": self.case.title,
                "source": self.case.source,
                "model": self.setting.model,
                "law": self.setting.law,
                "scheme": self.setting.scheme,
                "shortened": self.case.quick if self.setting.quick else "",
                "remark": self.remark,
                **{name: getattr(row, name) for name in NUMBERS},
                "tolerance_kind": "at least" if row.at_least else "relative" if row.relative else "absolute",
                "verdict": row.texts["verdict"],
                "seconds": round(self.seconds, 2),
            }
            for row in self.rows
        ]


def run_case(case: Case, setting: Setting) -> CaseOutcome:
    """Run one case; with rigid contacts in full, as that is quick."""
    setting = setting if setting.has_springs else replace(setting, quick=False)
    began = time.perf_counter()
    rows = tuple(case.measure(setting))
    return CaseOutcome(case, setting, rows, time.perf_counter() - began)

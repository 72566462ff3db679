"""Rows of sweep.csv: what is kept of a case, how it stands in a cell, and whether it is inside all measured ranges.

A column of varied values is a number column where every value is one, and has a unit where some value was typed with
one; its head is then `ground.tilt [deg]`, as in a table of cases. All other values stand as they were given.
"""

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from blocksim.analysis import compare, curves, experiment
from blocksim.errors import BlocksimError, InvalidInputError
from blocksim.scenario import Model, Scenario, Sweep, input_files, spelling, units
from blocksim.simulation import instruments
from blocksim.simulation.trajectory import COLUMNS, Columns

if TYPE_CHECKING:
    import pandas as pd

    from blocksim.simulation.loop import Outcome
    from blocksim.simulation.results import Summary

Row = dict[str, object]
FINISHED = "finished"  # status of a run that has come to its end
TABLE = "sweep.csv"  # rows of all cases; it makes a folder one of a sweep
X = ".x_mm"  # of every block that a row has, after its name
KEPT = ("x_mm", "y_mm", "rotation_deg", "left_mm", "right_mm")  # of the final table, for every block
QUARTER = 90.0  # deg
DIGITS = 12  # of a number in the table: more show the rounding of the unit
HEAD = re.compile(r"(?P<key>.*?) \[(?P<unit>[^\[\]]+)\]")
FORMULA = ("=", "+", "-", "@", "\t", "\r")
MARK = "'"  # spreadsheets show what follows as text
NUMBERS = "if"  # kinds of numpy
LEAST_COMMON = 2  # columns that a table of final positions has at least, misspelt ones aside


def row_of(end: "Outcome | Summary", seconds: float, observed: Mapping[str, object], final: Columns) -> Row:
    """Return the row of a case that was run; `seconds` are simulated, so they are the same on every machine."""
    row: Row = {"status": end.status, "reason": end.reason, "seconds": seconds, **observed}
    for block, *values in zip(final["block"], *(final[name] for name in KEPT), strict=True):
        row |= {f"{block}.{name}": value for name, value in zip(KEPT, values, strict=True)}
    return row


def row_of_error(error: Exception) -> Row:
    """Return the row of a case that could not be run."""
    is_ours = isinstance(error, BlocksimError)
    reason = str(error) if is_ours else f"internal error: {type(error).__name__}: {error}"
    return {"status": "failed", "reason": reason, "seconds": 0.0}


def invalid_row(problem: str) -> Row:
    """Return the row of a case whose values do not go together."""
    return {"status": "invalid", "reason": problem, "seconds": 0.0}


def quarter_turns(rotations: Iterable[float]) -> tuple[int, ...]:
    """Return the class of an outcome: the rotations (degrees) of all blocks, rounded to quarters of a turn."""
    return tuple(round(rotation / QUARTER) * int(QUARTER) for rotation in rotations)


@dataclass(frozen=True)
class Head:
    """A column of varied values; `unit` is empty where they stand as they were given."""

    key: str
    unit: str = ""

    @classmethod
    def read(cls, name: str) -> "Head":
        """Take the name of a column apart."""
        found = HEAD.fullmatch(name)
        return cls(name) if found is None else cls(found["key"], found["unit"])

    @property
    def is_angle(self) -> bool:
        """Return True for a unit of angles, as friction angles have it."""
        return bool(self.unit) and units.parse_unit(self.unit).dimension == units.ANGLE.dimension

    def __str__(self) -> str:
        """Return the name of the column."""
        return f"{self.key} [{self.unit}]" if self.unit else self.key

    def cell(self, value: object) -> object:
        """Return a value as it stands in the column."""
        if not self.unit:
            return value
        return float(f"{si_number(value) / float(units.parse_unit(self.unit).factor):.{DIGITS}g}")


def heads_of(sweep: Sweep) -> tuple[Head, ...]:
    """Return the columns of the keys that a sweep varies: with the first unit that was typed, where all are numbers."""
    heads = []
    for key, values in sweep.vary.items():
        head = Head(key, str(getattr(values, "unit", "")))
        if isinstance(values, tuple):
            typed = (units.unit_in(value) for value in values if isinstance(value, str))
            head = Head(key, next(filter(None, typed), ""))
            are_numbers = all(
                not isinstance(value, bool) and (isinstance(value, int | float) or bool(units.unit_in(str(value))))
                for value in values
            )
            # friction angles among friction coefficients: no unit holds for both
            are_mixed = head.is_angle and not all(isinstance(value, str) or value == 0 for value in values)
            head = head if are_numbers and not are_mixed else Head(key)
        heads.append(head)
    return tuple(heads)


def si_number(value: object) -> float:
    """Return a value as a scenario takes it in SI; NaN for what is no number."""
    if isinstance(value, str):
        return units.parse_quantity(value)[0]
    return float(value) if isinstance(value, int | float) else math.nan


def as_cell(value: object) -> object:
    """Return a value as it may stand in a table; a text that would be computed gets an apostrophe before it.

    Values and reasons may come from the scenario of a stranger. Numbers and quantities ("-5 deg") stay as they are.
    """
    if not isinstance(value, str) or not value.startswith(FORMULA):
        return value
    for read in (float, lambda text: units.parse_quantity(text, units.NUMBER)):
        with suppress(ValueError):
            read(value)
            return value
    return f"{MARK}{value}"


@dataclass(frozen=True)
class Range:
    """The limits of one measured quantity of one block (mm or degrees); `column` is its column in the final table."""

    block: str
    column: str
    lower: float
    upper: float

    def holds(self, value: float) -> bool:
        """Return True if a value is inside, ends included."""
        return self.lower <= value <= self.upper


def ranges_of(table: experiment.ExperimentTable) -> tuple[Range, ...]:
    """Return the limits of every measured quantity, as `compare` has them."""
    column_of = {name: quantity.final_column for name, quantity in experiment.QUANTITIES.items()}
    return tuple(
        Range(one.block, column_of[one.quantity], *compare.limits(one.quantity, one.mean, one.minimum, one.maximum))
        for one in table.summaries()
    )


def values_at(final: Columns, ranges: Sequence[Range]) -> list[float]:
    """Return the values of a final table (mm, degrees) that the ranges are about."""
    rows = {name: row for row, name in enumerate(final["block"])}
    return [float(final[one.column][rows[one.block]]) for one in ranges]


@dataclass(frozen=True)
class Ranges:
    """The limits (mm, degrees) of every measured quantity, by the name of its column in sweep.csv."""

    source: str
    limits: Mapping[str, Range]

    @classmethod
    def of(cls, scenario: Scenario) -> "Ranges | None":
        """Return the measured ranges that a scenario is compared with, if it names any."""
        return None if scenario.experiment is None else cls.read(scenario.experiment.table)

    @classmethod
    def read(cls, table: Path | str) -> "Ranges":
        """Take the limits of an experiment table by the rules of `compare`. Raises what reading it raises."""
        measured = experiment.load_table(table)
        return cls(measured.source, {f"{one.block}.{one.column}": one for one in ranges_of(measured)})

    def hold(self, row: Mapping[str, object]) -> bool:
        """Return True if everything measured is inside; a block that a case does not have is not."""
        values = ((row.get(name), limits) for name, limits in self.limits.items())
        return all(isinstance(value, float) and limits.holds(value) for value, limits in values)

    def inside(self, table: "pd.DataFrame") -> "pd.Series":
        """Return which rows of a table are inside. Raises InvalidInputError for no such block, or no numbers."""
        missing = [name for name in self.limits if name not in table]
        if missing:
            raise InvalidInputError(f"{self.source} measures {missing[0]}, but the sweep has no such column")
        texts = [name for name in self.limits if table[name].dtype.kind not in NUMBERS and table[name].notna().any()]
        if texts:
            raise InvalidInputError(f"the column {texts[0]} of the sweep does not hold numbers only")
        lower, upper = ([getattr(one, end) for one in self.limits.values()] for end in ("lower", "upper"))
        values = table[list(self.limits)]
        return ((values >= lower) & (values <= upper)).all(axis=1)


CURVES_OF = {
    instruments.ACTUATOR: "displacement_mm,force_kN",
    instruments.POINT: "time_s,dx_mm",
    instruments.FORCE: "time_s,fx_N",
    instruments.JOINT: "time_s,opening_mm",
}
"""Two quantities of each kind of probe with their units, as examples."""


def check_experiment(model: Model, path: Path | str | None = None) -> tuple[str, ...]:
    """Check that a table, or that which a scenario names, goes with the blocks: better now than after the run.

    Returns warnings of measured values that are far from the others.
    """
    named = model.scenario.experiment
    path = path or (named.table if named else None)
    if path is None:
        return ()
    _refuse_other_columns(model, Path(path))
    if experiment.has_curves(path):
        table, known = curves.load_curves(path), model.probes
        for name in table.curves:
            if name not in known:
                hint = spelling.did_you_mean_or_list(name, known) if known else f"use {_headers(model)}"
                raise InvalidInputError(f"{table.source}: unknown probe '{name}', {hint}")
            _refuse_other_quantities(table, name, known[name].kind)
        return table.warnings
    names = [body.name for body in model.bodies]
    unknown = dict.fromkeys(COLUMNS[1:], [0.0] * len(names))
    measured = experiment.load_table(path)
    compare.compare_final({"block": names, **unknown}, measured)
    return measured.warnings


def _refuse_other_columns(model: Model, path: Path) -> None:
    """Refuse a table that has neither final positions nor curves, with the columns that this scenario takes."""
    try:
        table = input_files.read_table(path)
    except InvalidInputError as error:  # whatever reads it says what is wrong in it
        if not str(error).endswith(input_files.EMPTY):
            return
        raise InvalidInputError(f"{error}; its first line is {_headers(model)}") from None
    names = tuple(head.text for head in table.heads)
    is_curve = names[: len(curves.FIRST)] == curves.FIRST and len(names) == len(curves.FIRST) + 2
    if not is_curve and len({*names} & {*experiment.COLUMNS}) < LEAST_COMMON:
        input_files.raise_problems([table.header.problem(f"these columns are not known; use {_headers(model)}")])


def _headers(model: Model) -> str:
    """Return the first lines that a measured table of a scenario may have: of its probes, and of final positions."""
    named = {probe.kind: name for name, probe in reversed(model.probes.items())}
    texts = []
    for kind, columns in CURVES_OF.items():
        if kind in named:
            template = "experiment-curve" if kind == instruments.ACTUATOR else "experiment-response"
            texts.append(f"{','.join(curves.FIRST)},{columns} ({kind} '{named[kind]}': blocksim new {template} NAME)")
    return " or ".join([*texts, f"{','.join(experiment.COLUMNS)} (final positions: blocksim new experiment NAME)"])


def _refuse_other_quantities(table: curves.CurveTable, name: str, kind: str) -> None:
    """Refuse quantities that a probe does not record, and units of other kinds."""
    known = {curves.TIME: "s", **instruments.COLUMNS.get(kind, {})}
    for axis in (table.x, table.y) if kind in instruments.COLUMNS else ():
        if axis.name not in known:
            hint = spelling.did_you_mean_or_list(axis.name, known, "it has")
            raise InvalidInputError(f"{table.source}: probe '{name}' records no {axis.name}, {hint}")
        if known[axis.name] != "1" and units.unit_factor(axis.unit, known[axis.name]) is None:
            what = f"{axis.unit} is not a unit of the {axis.name} of probe '{name}', which is in {known[axis.name]}"
            raise InvalidInputError(f"{table.source}: {axis.column}: {what}")

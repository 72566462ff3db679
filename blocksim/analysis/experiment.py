"""Measured tables: the repeats of a laboratory experiment, and sizes and materials of its blocks."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from math import fsum, inf, isfinite, nan, pi, sqrt
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

from blocksim.analysis import outliers
from blocksim.errors import InvalidInputError, Problem
from blocksim.scenario import input_files, spelling, units

if TYPE_CHECKING:
    import pandas as pd


CURVES = "probe"  # first column of a table of curves; see curves.py
COLUMNS = ("block", "quantity", "unit", "replicate", "value")
LONGEST_NAME = 100  # characters in a block name
LARGEST_VALUE = 1e9  # mm or degrees: squares and sums stay far from overflow
LARGEST_REPLICATE = 1_000_000
MISSING = ("", "nan", "na")  # texts, in lower case, of a cell without a value
MOST_NAMES = 8  # that a message lists


@dataclass(frozen=True)
class MeasuredQuantity:
    """A measured quantity of a block: its stored unit and its column in the final table."""

    unit: str
    final_column: str
    meaning: str


NO_ROWS = "the table has a header and no rows"
QUANTITIES = {
    "x": MeasuredQuantity("mm", "x_mm", "centre along the ground"),
    "y": MeasuredQuantity("mm", "y_mm", "centre above the ground"),
    "rotation": MeasuredQuantity("deg", "rotation_deg", "rotation, counter-clockwise positive"),
    "left": MeasuredQuantity("mm", "left_mm", "leftmost point"),
    "right": MeasuredQuantity("mm", "right_mm", "rightmost point"),
}


class Measurement(NamedTuple):
    """One row of a table: `value` in mm or degrees, as `unit` says."""

    block: str
    quantity: str
    unit: str
    replicate: int
    value: float


class Statistics(NamedTuple):
    """Statistics of the repeats of one quantity of one block, in mm or degrees; `s` is NaN for a single repeat."""

    block: str
    quantity: str
    unit: str
    mean: float
    s: float  # sample standard deviation, divisor n - 1
    n: int
    minimum: float
    maximum: float


@dataclass(frozen=True, eq=False)
class ExperimentTable:
    """The measured repeats of one experiment.

    `measurements` stand in the file's order; rows without a value are only in `missing` (value NaN).
    `source` is the path as it was given, `notes` the comment lines, `places` where each block is first named,
    `warnings` name values that are far from the other repeats.
    """

    measurements: tuple[Measurement, ...]
    source: str
    notes: tuple[str, ...] = ()
    missing: tuple[Measurement, ...] = ()
    places: Mapping[str, input_files.TableCell] = field(default_factory=dict, repr=False)
    warnings: tuple[str, ...] = ()

    @property
    def data(self) -> "pd.DataFrame":
        """Block, quantity, unit (mm or deg), replicate and value, one row a measurement."""
        import pandas as pd

        return pd.DataFrame(list(self.measurements))

    @property
    def blocks(self) -> tuple[str, ...]:
        """The measured blocks, in order of first appearance."""
        return tuple(dict.fromkeys(one.block for one in self.measurements))

    @property
    def messages(self) -> tuple[str, ...]:
        """Notes for the reader of a comparison: values that are far from the others, and missing ones."""
        warnings = tuple(f"warning: {text}" for text in self.warnings)
        if not self.missing:
            return warnings
        first, more = self.missing[0], len(self.missing) - 1
        text = f"{self.source}: replicate {first.replicate} has no {first.quantity} of block '{first.block}'"
        return (*warnings, text + (f" (and {more} more such rows)" if more else ""))

    def refuse_unknown(self, blocks: Sequence[str], whose: str) -> None:
        """Raise InvalidInputError, with every place in the file, for measured blocks that are not among `blocks`."""
        unknown = [block for block in self.blocks if block not in blocks]
        known = f"but {whose} has only {quote_names(blocks)}"
        located = [
            self.places[block].problem(f"the table measures block '{block}', {known}")
            for block in unknown
            if block in self.places
        ]
        if located:
            input_files.raise_problems(located)
        if unknown:
            raise InvalidInputError(f"{self.source} measures block {quote_names(unknown)}, {known}")

    def absence_messages(self, blocks: Sequence[str]) -> tuple[str, ...]:
        """Return a message that names those of `blocks` that are not in the table; none where all are."""
        names = [block for block in blocks if block not in self.blocks]
        if len(names) > 1:
            return (f"blocks {quote_names(names)} are not in {self.source}; they are not compared",)
        return tuple(f"block '{name}' is not in {self.source}; it is not compared" for name in names)

    def values(self, block: str, quantity: str) -> "pd.Series":
        """Return the repeats (mm or deg) of one quantity of one block by replicate; empty if unmeasured."""
        data = self.data
        chosen = data[(data["block"] == block) & (data["quantity"] == quantity)]
        return chosen.set_index("replicate")["value"].sort_index()

    def statistics(self) -> "pd.DataFrame":
        """Return `summaries` as a table, a row a pair."""
        import pandas as pd

        return pd.DataFrame(list(self.summaries()))

    def summaries(self) -> tuple[Statistics, ...]:
        """Return the statistics of every pair of block and quantity, in order of first appearance."""
        repeats: dict[tuple[str, str, str], list[float]] = {}
        for one in self.measurements:
            repeats.setdefault((one.block, one.quantity, one.unit), []).append(one.value)
        rows = []
        for pair, values in repeats.items():
            n, mean = len(values), fsum(values) / len(values)
            s = sqrt(fsum((value - mean) ** 2 for value in values) / (n - 1)) if n > 1 else nan
            rows.append(Statistics(*pair, mean, s, n, min(values), max(values)))
        return tuple(rows)


def quote_names(names: Sequence[str]) -> str:
    """List names for a message, a long list cut short."""
    return spelling.list_names([f"'{name}'" for name in names], MOST_NAMES)


def has_curves(path: Path | str) -> bool:
    """Return True if a table is one of curves of probes, by its first column. Raises InputMissingError."""
    with suppress(InvalidInputError):  # what is wrong in it is said by whatever reads it
        return input_files.read_table(Path(path)).heads[0].text == CURVES
    return False


def load_table(path: Path | str) -> ExperimentTable:
    """Read a measured table (`block,quantity,unit,replicate,value`, `#` starts a comment line).

    Lengths are converted to mm and angles to degrees. A row whose value is empty or NaN says that this repeat has none.
    Raises InputMissingError when the file cannot be read and InvalidInputError with every mistake, located by line and
    column.
    """
    if has_curves(path):
        raise InvalidInputError(f"{path}: curves of probes; a table of final positions ({','.join(COLUMNS)}) is needed")
    table = input_files.read_table(Path(path), COLUMNS)
    rows = []
    first_lines: dict[tuple[str, str, int], int] = {}
    for row in table.rows:
        one = _measurement(row, table.problems)
        if one is not None:
            rows.append((one, row))
            cell = row["replicate"]
            first = first_lines.setdefault((one.block, one.quantity, one.replicate), cell.line.number)
            if first != cell.line.number:
                what = f"block '{one.block}', {one.quantity}, replicate {one.replicate}"
                table.problems.append(cell.problem(f"{what} is already given in line {first}"))
    if not table.rows and not table.problems:
        table.problems.append(table.header.problem(NO_ROWS))
    measured = tuple(one for one, _ in rows if isfinite(one.value))
    known = {(one.block, one.quantity) for one in measured}
    for one, row in rows:
        if (one.block, one.quantity) not in known:
            known.add((one.block, one.quantity))
            message = f"block '{one.block}', {one.quantity} has no value in any replicate"
            table.problems.append(row["value"].problem(message))
    if table.problems:
        input_files.raise_problems(table.problems)
    missing = tuple(one for one, _ in rows if not isfinite(one.value))
    warnings = tuple(_far_values(rows))
    places = {row["block"].text: row["block"] for row in reversed(table.rows)}
    return ExperimentTable(measured, str(path), table.notes, missing, places, warnings)


def _far_values(rows: Sequence[tuple[Measurement, dict[str, input_files.TableCell]]]) -> Iterator[str]:
    """Yield a warning with its line for every value that is far from the other repeats."""
    repeats: dict[tuple[str, str, str], list[tuple[Measurement, dict[str, input_files.TableCell]]]] = {}
    for one, row in rows:
        if isfinite(one.value):
            repeats.setdefault((one.block, one.quantity, one.unit), []).append((one, row))
    for (block, quantity, unit), found in repeats.items():
        values = [one.value for one, _ in found]
        for place, why in outliers.far_values(values, outliers.READINGS[unit], unit):
            one, row = found[place]
            line = row["value"].line
            where = f"{input_files.relative_path(line.where)}:{line.number}"
            yield f"{where}: block {block}, {quantity}, replicate {one.replicate}: {why}"


def _measurement(row: dict[str, input_files.TableCell], problems: list[Problem]) -> Measurement | None:
    """Check one row; None after recording its problems. The value is NaN for an empty cell."""
    before = len(problems)
    block, number, unit, cell = (row[name] for name in ("block", "replicate", "unit", "value"))
    quantity = QUANTITIES.get(row["quantity"].text)
    if not block.text:
        problems.append(block.problem("the block has no name"))
    elif len(block.text) > LONGEST_NAME:
        problems.append(block.problem(f"the name has {len(block.text)} characters, at most {LONGEST_NAME}"))
    if quantity is None:
        name = row["quantity"].text
        hint = spelling.did_you_mean_or_list(name, QUANTITIES, "allowed")
        problems.append(row["quantity"].problem(f"unknown quantity '{name}', {hint}"))
    is_number = number.text.isascii() and number.text.isdigit() and len(number.text) <= len(str(LARGEST_REPLICATE))
    if not is_number or not 1 <= int(number.text) <= LARGEST_REPLICATE:
        problems.append(number.problem(f"'{number.text}' is not a repeat number; count repeats as 1, 2, 3, ..."))
    factor = 1.0 if quantity is None else units.unit_factor(unit.text, quantity.unit)
    if quantity is not None and factor is None:
        kind, allowed = ("an angle", "deg or rad") if quantity.unit == "deg" else ("a length", "mm, cm or m")
        found = f"'{unit.text}' is not the unit of {kind}" if unit.text else "no unit"
        problems.append(unit.problem(f"{found}; write {allowed}"))
    value = nan
    if cell.text.lower() not in MISSING:
        try:
            value = cell.number() * (factor or 1.0)
        except ValueError as error:
            problems.append(cell.problem(str(error)))
    if abs(value) > LARGEST_VALUE:
        problems.append(cell.problem(f"'{cell.text}' is too large, at most {LARGEST_VALUE:g} mm or degrees"))
    if quantity is None or len(problems) > before:
        return None
    return Measurement(block.text, row["quantity"].text, quantity.unit, int(number.text), value)


PROPERTY_COLUMNS = ("property", "unit", "value")


class Interval(NamedTuple):
    """The SI unit of a property and the open interval its value lies in."""

    unit: str
    above: float
    below: float = inf


PROPERTIES = {
    "width": Interval("m", 0.0),
    "height": Interval("m", 0.0),
    "length": Interval("m", 0.0),
    "overlap": Interval("m", 0.0),
    "unit_weight": Interval("N/m^3", 0.0),
    "density": Interval("kg/m^3", 0.0),
    "young_modulus": Interval("Pa", 0.0),
    "poisson_ratio": Interval("1", -1.0, 0.5),
    "friction_block_block": Interval("1", 0.0),
    "friction_block_ground": Interval("1", 0.0),
    "ground_friction_angle": Interval("rad", 0.0, pi / 2),
}


@dataclass(frozen=True)
class PropertyTable:
    """Measured properties by name, in SI; `source` is the path as it was given, `notes` the comment lines."""

    values: Mapping[str, float]
    source: str
    notes: tuple[str, ...] = ()


def load_properties(path: Path | str) -> PropertyTable:
    """Read a table of properties (`property,unit,value`; `#` starts a comment line; unit `1`: a pure number).

    Raises InputMissingError when the file cannot be read and InvalidInputError with every mistake located.
    """
    table = input_files.read_table(Path(path), PROPERTY_COLUMNS)
    values: dict[str, float] = {}
    for row in table.rows:
        cell, unit = row["property"], row["unit"]
        name = cell.text
        if name not in PROPERTIES:
            hint = spelling.did_you_mean_or_list(name, PROPERTIES, "allowed", len(PROPERTIES))
            table.problems.append(cell.problem(f"unknown property '{name}', {hint}"))
            continue
        if name in values:
            table.problems.append(cell.problem(f"'{name}' is given twice"))
        interval = PROPERTIES[name]
        factor = units.unit_factor(unit.text, interval.unit)
        if factor is None:
            found = f"'{unit.text}'" if unit.text else "nothing"
            table.problems.append(unit.problem(f"{found} is not a unit of {name}, write for example {interval.unit}"))
            continue
        try:
            value = row["value"].number() * factor
        except ValueError as error:
            table.problems.append(row["value"].problem(str(error)))
            continue
        if interval.above < value < interval.below:
            values[name] = value
            continue
        si = "" if interval.unit == "1" else f" {interval.unit}"
        limit = "" if interval.below == inf else f" and below {interval.below:g}{si}"
        complaint = f"{value:g}{si} is impossible, it must be above {interval.above:g}{si}{limit}"
        table.problems.append(row["value"].problem(complaint))
    if not table.rows and not table.problems:
        table.problems.append(table.header.problem(NO_ROWS))
    if table.problems:
        input_files.raise_problems(table.problems)
    return PropertyTable(values=MappingProxyType(values), source=str(path), notes=table.notes)

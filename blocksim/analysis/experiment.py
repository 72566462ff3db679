"""Measured tables: the repeats of a laboratory experiment, as a tidy table and as statistics.

Tables of measured properties: sizes and materials of the blocks of an experiment, in SI.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from math import fsum, inf, isfinite, nan, pi, sqrt
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

from blocksim.errors import InvalidInputError
from blocksim.scenario.input_files import Cell, Table, raise_problems, read_table
from blocksim.scenario.spelling import list_names, suggestion
from blocksim.scenario.units import unit_factor

if TYPE_CHECKING:
    import pandas as pd


COLUMNS = ("block", "quantity", "unit", "replicate", "value")
LONGEST_NAME = 100  # characters in a block name
LARGEST_VALUE = 1e9  # mm or degrees: squares and sums stay far from overflow
LARGEST_REPLICATE = 1_000_000
MISSING = ("", "nan", "na")  # texts, in lower case, of a cell without a value
MOST_NAMES = 8  # that a message lists


@dataclass(frozen=True)
class Quantity:
    """A measured quantity of a block: its stored unit and its column in the final table."""

    unit: str
    final_column: str
    meaning: str


QUANTITIES = {
    "x": Quantity("mm", "x_mm", "centre along the ground"),
    "y": Quantity("mm", "y_mm", "centre above the ground"),
    "rotation": Quantity("deg", "rotation_deg", "rotation, counter-clockwise positive"),
    "left": Quantity("mm", "left_mm", "leftmost point"),
    "right": Quantity("mm", "right_mm", "rightmost point"),
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
    `source` is the path as it was given, `notes` the comment lines, `places` where each block is first named.
    """

    measurements: tuple[Measurement, ...]
    source: str
    notes: tuple[str, ...] = ()
    missing: tuple[Measurement, ...] = ()
    places: Mapping[str, Cell] = field(default_factory=dict, repr=False)

    @property
    def data(self) -> "pd.DataFrame":
        """Block, quantity, unit (mm or deg), replicate and value, one row a measurement."""
        return _frame(self.measurements)

    @property
    def blocks(self) -> tuple[str, ...]:
        """The measured blocks, in order of first appearance."""
        return tuple(dict.fromkeys(one.block for one in self.measurements))

    @property
    def quantities(self) -> tuple[str, ...]:
        """The measured quantities, in order of first appearance."""
        return tuple(dict.fromkeys(one.quantity for one in self.measurements))

    @property
    def replicates(self) -> tuple[int, ...]:
        """The numbers of the repeats, ascending; a block need not appear in all of them."""
        return tuple(sorted({one.replicate for one in self.measurements}))

    @property
    def messages(self) -> tuple[str, ...]:
        """Notes for the reader of a comparison: missing values."""
        if not self.missing:
            return ()
        first, more = self.missing[0], len(self.missing) - 1
        text = f"{self.source}: replicate {first.replicate} has no {first.quantity} of block '{first.block}'"
        return (text + (f" (and {more} more such rows)" if more else ""),)

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
            raise_problems(located)
        if unknown:
            message = f"{self.source} measures block {quote_names(unknown)}, {known}"
            raise InvalidInputError(message)

    def unmeasured(self, blocks: Sequence[str]) -> tuple[str, ...]:
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
        return _frame(self.summaries())

    def summaries(self) -> tuple[Statistics, ...]:
        """Return the statistics of every pair of block and quantity, in order of first appearance."""
        repeats: dict[tuple[str, str, str], list[float]] = {}
        for one in self.measurements:
            repeats.setdefault((one.block, one.quantity, one.unit), []).append(one.value)
        return tuple(_statistics(*pair, values) for pair, values in repeats.items())


def quote_names(names: Sequence[str]) -> str:
    """List names for a message, a long list cut short."""
    return list_names([f"'{name}'" for name in names], MOST_NAMES)


def _frame(rows: Iterable[Any]) -> "pd.DataFrame":
    """Return rows with names as a table of pandas."""
    import pandas as pd

    return pd.DataFrame(list(rows))


def _statistics(block: str, quantity: str, unit: str, values: list[float]) -> Statistics:
    n, mean = len(values), fsum(values) / len(values)
    s = sqrt(fsum((value - mean) ** 2 for value in values) / (n - 1)) if n > 1 else nan
    return Statistics(block, quantity, unit, mean, s, n, min(values), max(values))


def load_table(path: Path | str) -> ExperimentTable:
    """Read a measured table (`block,quantity,unit,replicate,value`, `#` starts a comment line).

    Lengths are converted to mm and angles to degrees. A row whose value is empty or NaN says that this repeat has none.
    Raises InputMissingError when the file cannot be read and InvalidInputError with every mistake, located by line and
    column.
    """
    table = read_table(Path(path), COLUMNS)
    rows = []
    first_lines: dict[tuple[str, str, int], int] = {}
    for row in table.rows:
        measurement = _measurement(row, table)
        if measurement is not None:
            _note_repetition(measurement, row["replicate"], first_lines, table)
            rows.append((measurement, row))
    measured = tuple(one for one, _ in rows if isfinite(one.value))
    _note_emptiness(rows, measured, table)
    if table.problems:
        raise_problems(table.problems)
    missing = tuple(one for one, _ in rows if not isfinite(one.value))
    places = {row["block"].text: row["block"] for row in reversed(table.rows)}
    return ExperimentTable(measured, str(path), table.notes, missing, places)


def _note_emptiness(
    rows: Sequence[tuple[Measurement, dict[str, Cell]]], measured: Sequence[Measurement], table: Table
) -> None:
    """Record a problem if there is no row, and for every quantity of a block without a value in any repeat."""
    if not table.rows and not table.problems:
        table.problems.append(table.header.problem("the table has a header and no rows"))
    known = {(one.block, one.quantity) for one in measured}
    for one, row in rows:
        if (one.block, one.quantity) not in known:
            known.add((one.block, one.quantity))
            message = f"block '{one.block}', {one.quantity} has no value in any replicate"
            table.problems.append(row["value"].problem(message))


def _measurement(row: dict[str, Cell], table: Table) -> Measurement | None:
    """Check one row; None after recording its problems."""
    before = len(table.problems)
    name = row["quantity"].text
    quantity = QUANTITIES.get(name)
    _check_name(row["block"], table)
    if quantity is None:
        complaint = f"unknown quantity '{name}', {suggestion(name, tuple(QUANTITIES))}"
        table.problems.append(row["quantity"].problem(complaint))
    replicate = _replicate(row["replicate"], table)
    factor = 1.0 if quantity is None else _factor(row["unit"], quantity, table)
    value = _value(row["value"], factor, table)
    if quantity is None or len(table.problems) > before:
        return None
    return Measurement(row["block"].text, name, quantity.unit, replicate, value)


def _note_repetition(
    measurement: Measurement, cell: Cell, first_lines: dict[tuple[str, str, int], int], table: Table
) -> None:
    """Record a problem when the same repeat of the same quantity was read before."""
    key = (measurement.block, measurement.quantity, measurement.replicate)
    first = first_lines.setdefault(key, cell.line.number)
    if first != cell.line.number:
        what = f"block '{key[0]}', {key[1]}, replicate {key[2]}"
        table.problems.append(cell.problem(f"{what} is already given in line {first}"))


def _check_name(cell: Cell, table: Table) -> None:
    if not cell.text:
        table.problems.append(cell.problem("the block has no name"))
    elif len(cell.text) > LONGEST_NAME:
        table.problems.append(cell.problem(f"the name has {len(cell.text)} characters, at most {LONGEST_NAME}"))


def _replicate(cell: Cell, table: Table) -> int:
    """Return the number of the repeat; 0 after recording a problem."""
    is_number = cell.text.isascii() and cell.text.isdigit() and len(cell.text) <= len(str(LARGEST_REPLICATE))
    if is_number and 1 <= int(cell.text) <= LARGEST_REPLICATE:
        return int(cell.text)
    table.problems.append(cell.problem(f"'{cell.text}' is not a repeat number; count repeats as 1, 2, 3, ..."))
    return 0


def _factor(cell: Cell, quantity: Quantity, table: Table) -> float:
    """Return the factor to mm or deg; 1 after recording a problem."""
    factor = unit_factor(cell.text, quantity.unit)
    if factor is not None:
        return factor
    kind, allowed = ("an angle", "deg or rad") if quantity.unit == "deg" else ("a length", "mm, cm or m")
    found = f"'{cell.text}' is not the unit of {kind}" if cell.text else "no unit"
    table.problems.append(cell.problem(f"{found}; write {allowed}"))
    return 1.0


def _value(cell: Cell, factor: float, table: Table) -> float:
    """Return the value in mm or deg; NaN for an empty cell, 0 after recording a problem."""
    if cell.text.lower() in MISSING:
        return nan
    try:
        value = cell.number() * factor
    except ValueError as error:
        table.problems.append(cell.problem(str(error)))
        return 0.0
    if abs(value) > LARGEST_VALUE:
        table.problems.append(cell.problem(f"'{cell.text}' is too large, at most {LARGEST_VALUE:g} mm or degrees"))
    return value


PROPERTY_COLUMNS = ("property", "unit", "value")


@dataclass(frozen=True)
class Bounds:
    """The SI unit of a property and the open interval its value lies in."""

    unit: str
    above: float
    below: float = inf


PROPERTIES = {
    "width": Bounds("m", 0.0),
    "height": Bounds("m", 0.0),
    "length": Bounds("m", 0.0),
    "overlap": Bounds("m", 0.0),
    "unit_weight": Bounds("N/m^3", 0.0),
    "density": Bounds("kg/m^3", 0.0),
    "young_modulus": Bounds("Pa", 0.0),
    "poisson_ratio": Bounds("1", -1.0, 0.5),
    "friction_block_block": Bounds("1", 0.0),
    "friction_block_ground": Bounds("1", 0.0),
    "ground_friction_angle": Bounds("rad", 0.0, pi / 2),
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
    table = read_table(Path(path), PROPERTY_COLUMNS)
    values: dict[str, float] = {}
    for row in table.rows:
        _read_property(row, values, table)
    if not table.rows and not table.problems:
        table.problems.append(table.header.problem("the table has a header and no rows"))
    if table.problems:
        raise_problems(table.problems)
    return PropertyTable(values=MappingProxyType(values), source=str(path), notes=table.notes)


def _read_property(row: dict[str, Cell], values: dict[str, float], table: Table) -> None:
    """Check one row and store its value in SI, or record its error."""
    name = row["property"].text
    bounds = PROPERTIES.get(name)
    if bounds is None:
        complaint = f"unknown property '{name}', {suggestion(name, tuple(PROPERTIES))}"
        table.problems.append(row["property"].problem(complaint))
        return
    if name in values:
        table.problems.append(row["property"].problem(f"'{name}' is given twice"))
    factor = unit_factor(row["unit"].text, bounds.unit)
    if factor is None:
        found = f"'{row['unit'].text}'" if row["unit"].text else "nothing"
        table.problems.append(row["unit"].problem(f"{found} is not a unit of {name}, write for example {bounds.unit}"))
        return
    try:
        values[name] = _within(row["value"].number() * factor, bounds)
    except ValueError as error:
        table.problems.append(row["value"].problem(str(error)))


def _within(value: float, bounds: Bounds) -> float:
    """Return the value; raises ValueError when it lies outside its interval."""
    if bounds.above < value < bounds.below:
        return value
    unit = "" if bounds.unit == "1" else f" {bounds.unit}"
    limit = "" if bounds.below == inf else f" and below {bounds.below:g}{unit}"
    message = f"{value:g}{unit} is impossible, it must be above {bounds.above:g}{unit}{limit}"
    raise ValueError(message)

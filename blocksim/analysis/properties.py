"""Tables of measured properties: sizes and materials of the blocks of an experiment, in SI."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, pi
from pathlib import Path
from types import MappingProxyType

from blocksim.scenario.csv_table import Cell, Table, raise_problems, read_table
from blocksim.scenario.spelling import suggestion
from blocksim.scenario.units import unit_factor

COLUMNS = ("property", "unit", "value")


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
    table = read_table(Path(path), COLUMNS)
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

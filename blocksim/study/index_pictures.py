"""The table of a sensitivity study, read back and drawn as a tornado."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from blocksim.errors import InvalidInputError, Problem
from blocksim.scenario.csv_table import Cell, raise_problems, read_open_table
from blocksim.view.layout import OWN, Paper
from blocksim.view.tornado import Bars, draw_tornado

TORNADO = "tornado"
LARGEST_FILE = 10_000_000  # bytes
HEAD = ("output", "unit", "key")
UNITLESS = ("share", "")


@dataclass(frozen=True)
class Shown:
    """The columns of a method that a picture shows, what the bars mean, and what their dark parts do."""

    value: str
    half_width: str
    part: str
    labels: tuple[str, str]
    has_unit: bool


METHODS = (
    Shown("ST", "± ST", "S1", ("total share of the variance, 95 % interval", "share of the key alone"), has_unit=False),
    Shown("mu*", "±", "", ("mean change over a key's range, 95 % interval", ""), has_unit=True),
)


def anything_goes(_: Path) -> None:
    """Accept any place for a picture."""


def draw_indices(
    table: Path,
    path: Path | None = None,
    kind: str | None = None,
    paper: Paper = OWN,
    *,
    ready: Callable[[Path], None] = anything_goes,
) -> Path:
    """Draw the table of a sensitivity study; return the picture's path (default: that of the table, as PNG).

    `ready` is asked as in `draw_sweep`.
    Raises what `read_indices` raises, InvalidInputError for an unknown picture format or another kind, OutputError.
    """
    if kind not in {None, TORNADO}:
        message = f"{table}: a table of indices is drawn as {TORNADO!r}, not as {kind!r}"
        raise InvalidInputError(message)
    panels, labels = read_indices(table)
    path = path or Path(f"{table.stem}.png")
    ready(path)
    draw_tornado(panels, labels, path, title="Which inputs matter", paper=paper)
    return path


def read_indices(path: Path) -> tuple[list[Bars], tuple[str, str]]:
    """Return the bars of every result and what they mean.

    Raises InputMissingError or InvalidInputError, with every mistake located.
    """
    heads, table = read_open_table(path, LARGEST_FILE)
    names = [head.text for head in heads]
    shown = next((one for one in METHODS if {*HEAD, one.value, one.half_width} <= set(names)), None)
    if shown is None:
        message = "not the table of `blocksim sensitivity --out`: no columns output, unit, key and ST or mu*"
        raise_problems([table.header.problem(message)])
    rows = [{name: _read(cell, table.problems) for name, cell in row.items()} for row in table.rows]
    if table.problems:
        raise_problems(table.problems)
    if not rows:
        message = f"{path}: no result varies; nothing to draw"
        raise InvalidInputError(message)
    panels = []
    for output in dict.fromkeys(str(row["output"]) for row in rows):
        own = [row for row in rows if row["output"] == output]
        columns = {name: np.array([row[name] for row in own], dtype=np.float64) for name in own[0] if name not in HEAD}
        unit = str(own[0]["unit"])
        bracket = f" ({unit})" if shown.has_unit and unit not in UNITLESS else ""
        keys = tuple(str(row["key"]) for row in own)
        value, half_width = columns[shown.value], columns[shown.half_width]
        panels.append(Bars(f"{output}{bracket}", keys, value, half_width, columns.get(shown.part)))
    return panels, shown.labels


def _read(cell: Cell, problems: list[Problem]) -> str | float:
    """Return the text of a name or the number of an index; 0 after noting a problem."""
    if cell.column in HEAD:
        return cell.text
    try:
        return cell.number() if cell.text not in {"", "nan"} else float("nan")
    except ValueError as error:
        problems.append(cell.problem(str(error)))
        return 0.0

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
    outputs = dict.fromkeys(str(row["output"]) for row in rows)
    return [_bars([row for row in rows if row["output"] == output], shown) for output in outputs], shown.labels


def _read(cell: Cell, problems: list[Problem]) -> str | float:
    """Return the text of a name or the number of an index; 0 after noting a problem."""
    if cell.column in HEAD:
        return cell.text
    if cell.text in {"", "nan"}:
        return float("nan")
    try:
        return cell.number()
    except ValueError as error:
        problems.append(cell.problem(str(error)))
        return 0.0


def _bars(rows: list[dict[str, str | float]], shown: Shown) -> Bars:
    def column(name: str) -> np.ndarray:
        return np.array([row[name] for row in rows], dtype=np.float64)

    unit = str(rows[0]["unit"])
    bracket = f" ({unit})" if shown.has_unit and unit not in UNITLESS else ""
    part = column(shown.part) if shown.part and shown.part in rows[0] else None
    keys = tuple(str(row["key"]) for row in rows)
    return Bars(f"{rows[0]['output']}{bracket}", keys, column(shown.value), column(shown.half_width), part)

"""The final table: where every block ended, in mm and degrees, for people and spreadsheets.

Inside it is a dictionary of columns; pandas, whose import takes longer than the collapse of three blocks, comes in only
when somebody asks for a DataFrame.
"""

import csv
import io
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from blocksim.errors import InputMissingError, InvalidInputError
from blocksim.simulation.frames import Frames

if TYPE_CHECKING:
    import pandas as pd

Columns = dict[str, list[Any]]  # by the names in COLUMNS, a value a block: its name, then numbers

COLUMNS = (
    "block",
    "x_mm",
    "y_mm",
    "rotation_deg",
    "left_mm",
    "right_mm",
    "bottom_mm",
    "top_mm",
    "vx_mm_s",
    "vy_mm_s",
    "spin_deg_s",
)
MILLI = 1e3


def final_columns(frames: Frames) -> Columns:
    """Return the table of the last frame: a value a block, columns as in `COLUMNS`.

    x, y is the centre; rotation the angle turned since the start, counter-clockwise positive, not wrapped; left, right,
    bottom and top are the extents of the turned rectangle.
    """
    x, y, angle = frames.x[-1], frames.y[-1], frames.angle[-1]
    cos, sin = np.abs(np.cos(angle)), np.abs(np.sin(angle))
    half_width = 0.5 * (cos * frames.size_x + sin * frames.size_y)
    half_height = 0.5 * (sin * frames.size_x + cos * frames.size_y)
    values = (
        MILLI * x,
        MILLI * y,
        np.degrees(frames.rotation[-1]),
        MILLI * (x - half_width),
        MILLI * (x + half_width),
        MILLI * (y - half_height),
        MILLI * (y + half_height),
        MILLI * frames.vx[-1],
        MILLI * frames.vy[-1],
        np.degrees(frames.spin[-1]),
    )
    return dict(zip(COLUMNS, (list(frames.names), *(column.tolist() for column in values)), strict=True))


def as_frame(columns: Columns) -> "pd.DataFrame":
    """Return the same table for people who know pandas."""
    import pandas as pd  # noqa: PLC0415 - a third of a second that a run does not pay

    return pd.DataFrame(columns)


def final_table(frames: Frames) -> "pd.DataFrame":
    """Return the table of the last frame for people who know pandas."""
    return as_frame(final_columns(frames))


def rows_of(columns: Columns) -> list[dict[str, Any]]:
    """Return the same table as a list of rows."""
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def csv_text(columns: Columns) -> str:
    """Return the text of a file that gives all numbers back to the last bit; NaN is an empty cell."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    rows = zip(*columns.values(), strict=True)
    writer.writerows([name, *("" if math.isnan(value) else value for value in values)] for name, *values in rows)
    return text.getvalue()


def read_table(path: Path) -> Columns:
    """Return a final table from its file. Raises InputMissingError or InvalidInputError."""
    try:
        with path.open(encoding="utf-8", newline="") as file:
            return _columns_of([line for line in csv.reader(file) if line])
    except FileNotFoundError:
        message = f"{path}: no such file"
        raise InputMissingError(message) from None
    except (OSError, ValueError, csv.Error) as error:
        message = f"{path}: not a final table: {error}"
        raise InvalidInputError(message) from error


def _columns_of(lines: list[list[str]]) -> Columns:
    """Return the columns in the lines of a file. Raises ValueError."""
    if not lines or tuple(lines[0]) != COLUMNS:
        raise ValueError(f"the columns have to be {','.join(COLUMNS)}")
    names, *texts = zip(*lines[1:], strict=True) if lines[1:] else [()] * len(COLUMNS)
    numbers = ([_number(text) for text in column] for column in texts)
    return dict(zip(COLUMNS, (list(names), *numbers), strict=True))


def _number(text: str) -> float:
    """Return the number of a cell to the last bit; an empty cell is one that is not finite."""
    return float(text) if text else math.nan

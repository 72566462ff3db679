"""The final table: where every block ended, in mm and degrees, for people and spreadsheets.

Inside it is a dictionary of columns; pandas, whose import takes longer than the collapse of three blocks, comes in only
when somebody asks for a DataFrame.
"""

import csv
import io
import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from blocksim.errors import InvalidInputError
from blocksim.scenario.bounded_read import MEGABYTE, read_limited
from blocksim.simulation.frames import Floats, Frames
from blocksim.world.systems.blocks import boxes_around

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
MOST_BYTES = 400 * MEGABYTE  # of final.csv; a million blocks take half of it


def final_columns(frames: Frames) -> Columns:
    """Return the table of the last frame: a value a block, columns as in `COLUMNS`.

    x, y is the centre; rotation the angle turned since the start, counter-clockwise positive, not wrapped; left, right,
    bottom and top are the extents of the turned block.
    """
    motion = np.stack([one[-1] for one in (frames.x, frames.y, frames.angle, frames.vx, frames.vy, frames.spin)])
    shapes = np.stack([frames.size_x, frames.size_y, frames.start_angle])
    values = final_values(motion, shapes, frames.outlines)
    return dict(zip(COLUMNS, (list(frames.names), *values.tolist()), strict=True))


def final_values(motion: Floats, shapes: Floats, outlines: Floats | None = None) -> Floats:
    """Return the numbers (..., 10, b) of the tables of states, columns as in `COLUMNS`.

    `motion` (..., 6, b) holds x, y, angle and their rates, `shapes` (..., 3, b) sides along the body's own axes and the
    angle at the start, all SI. `outlines` (..., b, k, 2) are corners along these axes, where any is no rectangle.
    """
    x, y, angle, vx, vy, spin = (motion[..., k, :] for k in range(6))
    size_x, size_y, start_angle = (shapes[..., k, :] for k in range(3))
    # of one state at a time: what is computed together may decide on the last digit
    cos, sin = (
        np.reshape([turn(one) for one in angle.reshape(-1, max(x.shape[-1], 1))], x.shape) for turn in (np.cos, np.sin)
    )
    if outlines is None:
        cos, sin = np.abs(cos), np.abs(sin)
        half_width = 0.5 * (cos * size_x + sin * size_y)
        half_height = 0.5 * (sin * size_x + cos * size_y)
        extents = [x - half_width, x + half_width, y - half_height, y + half_height]
    else:
        low, high = boxes_around(outlines, x, y, angle)
        extents = [low[..., 0], high[..., 0], low[..., 1], high[..., 1]]
    values = (
        MILLI * x,
        MILLI * y,
        np.degrees(angle - start_angle),
        *(MILLI * one for one in extents),
        MILLI * vx,
        MILLI * vy,
        np.degrees(spin),
    )
    return np.stack(values, axis=-2)


def as_frame(columns: Columns) -> "pd.DataFrame":
    """Return the same table for people who know pandas."""
    import pandas as pd

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
    writer.writerows([name, *("" if value != value else value for value in values)] for name, *values in rows)  # noqa: PLR0124 - NaN alone is not itself, and other cells are words
    return text.getvalue()


def read_table(path: Path) -> Columns:
    """Return a final table from its file. Raises InputMissingError or InvalidInputError."""
    try:
        text = read_limited(path, MOST_BYTES).decode()
        return _columns_of(line for line in csv.reader(io.StringIO(text, newline="")) if line)
    except (ValueError, csv.Error) as error:
        message = f"{path}: not a final table: {error}"
        raise InvalidInputError(message) from error


def _columns_of(lines: Iterator[list[str]]) -> Columns:
    """Return the columns in the lines of a file, which are not kept. Raises ValueError."""
    if tuple(next(lines, ())) != COLUMNS:
        raise ValueError(f"the columns must be {','.join(COLUMNS)}")
    columns: Columns = {name: [] for name in COLUMNS}
    for number, cells in enumerate(lines, start=1):
        if len(cells) != len(COLUMNS):
            raise ValueError(f"row {number} has {len(cells)} cells, not {len(COLUMNS)}")
        for column, value in zip(columns.values(), (cells[0], *map(_number, cells[1:])), strict=True):
            column.append(value)
    return columns


def _number(text: str) -> float:
    """Return the number of a cell to the last bit; an empty cell is one that is not finite."""
    return float(text) if text else math.nan

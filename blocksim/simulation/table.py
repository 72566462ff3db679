"""The final table: where every block ended, in mm and degrees, for people and spreadsheets."""

import math
from pathlib import Path

import numpy as np
import pandas as pd

from blocksim.errors import InputMissingError, InvalidInputError
from blocksim.simulation.frames import Frames

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


def final_table(frames: Frames, frame: int = -1) -> pd.DataFrame:
    """Return the table of one frame, the last by default: a row a block, columns as in `COLUMNS`.

    x, y is the centre; rotation the angle turned since the start, counter-clockwise positive, not wrapped; left, right,
    bottom and top are the extents of the turned rectangle.
    """
    x, y, angle = frames.x[frame], frames.y[frame], frames.angle[frame]
    cos, sin = np.abs(np.cos(angle)), np.abs(np.sin(angle))
    half_width = 0.5 * (cos * frames.size_x + sin * frames.size_y)
    half_height = 0.5 * (sin * frames.size_x + cos * frames.size_y)
    values = (
        MILLI * x,
        MILLI * y,
        np.degrees(frames.rotation[frame]),
        MILLI * (x - half_width),
        MILLI * (x + half_width),
        MILLI * (y - half_height),
        MILLI * (y + half_height),
        MILLI * frames.vx[frame],
        MILLI * frames.vy[frame],
        np.degrees(frames.spin[frame]),
    )
    return pd.DataFrame(dict(zip(COLUMNS, (list(frames.names), *values), strict=True)))


def read_table(path: Path) -> pd.DataFrame:
    """Return a final table from its file. Raises InputMissingError or InvalidInputError."""
    try:
        texts = pd.read_csv(path, dtype=str, keep_default_na=False)
        final = texts.assign(**{name: [_number(text) for text in texts[name]] for name in texts.columns[1:]})
    except FileNotFoundError:
        message = f"{path}: no such file"
        raise InputMissingError(message) from None
    except (OSError, ValueError) as error:
        message = f"{path}: not a final table: {str(error).strip()}"
        raise InvalidInputError(message) from error
    if tuple(final.columns) != COLUMNS:
        message = f"{path}: not a final table: the columns have to be {','.join(COLUMNS)}"
        raise InvalidInputError(message)
    return final


def _number(text: str) -> float:
    """Return the number of a cell to the last bit; an empty cell is one that is not finite."""
    return float(text) if text else math.nan

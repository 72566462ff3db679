"""All frames of a run as one tidy CSV table: one row per frame and block, units in the heads."""

import csv
import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from blocksim.simulation.atomic import replacing
from blocksim.simulation.frames import Frames

COLUMNS = ("time_s", "block", "x_mm", "y_mm", "rotation_deg", "vx_mm_s", "vy_mm_s", "spin_deg_s")
MILLI = 1e3
Row = list[float | str]


def write_csv(path: Path, frames: Frames) -> int:
    """Write all frames and return their number.

    Rotation is the angle turned since the start, not wrapped. Numbers can be read back to the last bit; what is not
    finite is an empty cell. Raises OutputError, and leaves an older file as it was then.
    """
    with replacing(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for frame in range(len(frames)):
            writer.writerows(_rows(frames, frame))
    return len(frames)


def _rows(frames: Frames, frame: int) -> Iterator[Row]:
    """Give the rows of one frame, one a block."""
    time = float(frames.time[frame])
    columns = (
        MILLI * frames.x[frame],
        MILLI * frames.y[frame],
        np.degrees(frames.rotation[frame]),
        MILLI * frames.vx[frame],
        MILLI * frames.vy[frame],
        np.degrees(frames.spin[frame]),
    )
    for name, *values in zip(frames.names, *(column.tolist() for column in columns), strict=True):
        yield [time, name, *(value if math.isfinite(value) else "" for value in values)]

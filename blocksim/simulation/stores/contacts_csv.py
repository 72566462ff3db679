"""The contacts of all frames as one tidy CSV table: a row a frame and contact, units in the heads."""

import csv
import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from blocksim.simulation.atomic import replacing
from blocksim.simulation.contacts import BODIES, Contacts
from blocksim.simulation.frames import Frames

MILLI = 1e3
LENGTHS = {"x_mm": "x", "y_mm": "y", "overlap_mm": "overlap"}
PLAIN = {
    "normal_x": "normal_x",
    "normal_y": "normal_y",
    "normal_force_N": "normal_force",
    "shear_force_N": "shear_force",
}
COLUMNS = ("time_s", *BODIES, *LENGTHS, *PLAIN)
NOBODY = ""
"""Name of what is no block: the ground, or a wall."""


def write_contacts_csv(path: Path, frames: Frames, contacts: Contacts) -> int:
    """Write all contacts and return their number.

    Bodies are named as in the table of frames; the cell of the ground or a wall is empty. Numbers that are lengths are
    in mm, all others can be read back to the last bit. Raises OutputError, and leaves an older file as it was then.
    """
    with replacing(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for frame in range(len(contacts)):
            writer.writerows(_rows(frames, contacts, frame))
    return len(contacts.rows)


def _rows(frames: Frames, contacts: Contacts, frame: int) -> Iterator[list[float | str]]:
    """Give the rows of one frame."""
    rows = contacts.at(frame)
    time = float(frames.time[frame])
    names = np.array([*frames.names, NOBODY], dtype=object)  # the support has number -1
    bodies = (names[rows[name]] for name in BODIES)
    columns = [*(MILLI * rows[name] for name in LENGTHS.values()), *(rows[name] for name in PLAIN.values())]
    for one, other, *values in zip(*bodies, *(column.tolist() for column in columns), strict=True):
        yield [time, one, other, *(value if math.isfinite(value) else "" for value in values)]

"""Frames and contacts of a run as tidy CSV tables: a row per frame and block, or per frame and contact.

Units are in the heads, lengths in mm. Numbers can be read back to the last bit; what is not finite is an empty cell.
"""

import csv
import math
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np

from blocksim.simulation.atomic import replacing
from blocksim.simulation.contacts import BODIES, UNITS, Contacts
from blocksim.simulation.frames import Frames
from blocksim.simulation.probe_series import WRITTEN
from blocksim.world.systems.blocks import BLOCKS
from blocksim.world.systems.system import Floats, System, Track

FRAME_COLUMNS = ("time_s", "block", *(one.column for one in BLOCKS.outputs))
CONTACT_NUMBERS = sorted(UNITS, key=lambda name: "m1N".index(UNITS[name]))  # lengths, directions, forces
CONTACT_COLUMNS = ("time_s", *BODIES, *(f"{name}{WRITTEN[UNITS[name]][0]}" for name in CONTACT_NUMBERS))
NOBODY = ""
"""Name of what is no block: the ground, or a wall."""
Row = list[float | str]


def write_frames_csv(path: Path, frames: Frames) -> int:
    """Write all frames and return their number; every system beside the blocks into a table beside this one.

    Rotation is the angle turned since the start, not wrapped. Raises OutputError, and leaves an older file as it was
    then.
    """
    for track in frames.tracks:
        columns = track.columns()
        heads = ("time_s", track.system.element, *columns)
        _write(table_of(path, track.system), heads, _frame_rows(frames.time, track, [*columns.values()]))
    return len(frames)


def table_of(path: Path, system: System) -> Path:
    """Return the table of a system: that which was named for the blocks, or one beside it."""
    return path if system is BLOCKS else path.with_name(f"{path.stem}_{system.name}{path.suffix}")


def write_contacts_csv(path: Path, frames: Frames, contacts: Contacts) -> int:
    """Write all contacts and return their number.

    Bodies are named as in the table of frames; the cell of the ground or a wall is empty. Raises OutputError, and
    leaves an older file as it was then.
    """
    rows = (row for frame in range(len(contacts)) for row in _contact_rows(frames, contacts, frame))
    _write(path, CONTACT_COLUMNS, rows)
    return len(contacts.rows)


def _write(path: Path, columns: Sequence[str], rows: Iterable[Row]) -> None:
    with replacing(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(rows)


def _frame_rows(times: Floats, track: Track, columns: Sequence[Floats]) -> Iterator[Row]:
    """Yield the rows of all frames, one per element."""
    for frame, time in enumerate(times.tolist()):
        for name, *values in zip(track.names, *(column[frame].tolist() for column in columns), strict=True):
            yield [time, name, *(value if math.isfinite(value) else "" for value in values)]


def _contact_rows(frames: Frames, contacts: Contacts, frame: int) -> Iterator[Row]:
    """Yield the rows of one frame, one per contact."""
    rows = contacts.at(frame)
    time = float(frames.time[frame])
    names = np.array([*frames.names, NOBODY], dtype=object)  # the support has number -1
    bodies = (names[rows[name]] for name in BODIES)
    columns = [WRITTEN[UNITS[name]][1] * rows[name] for name in CONTACT_NUMBERS]
    for one, other, *values in zip(*bodies, *(column.tolist() for column in columns), strict=True):
        yield [time, one, other, *(value if math.isfinite(value) else "" for value in values)]

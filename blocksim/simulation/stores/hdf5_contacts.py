"""The contacts of all frames in run.h5, where they were asked for: a data set a column, and where each frame's end.

They are written and flushed with the frames they belong to, before `n_committed` counts those.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from blocksim.simulation.contacts import BODIES, CONTACT_ROW, UNITS, Contacts, Rows, empty_rows

GROUP = "contacts"
ENDS = f"{GROUP}/end"
COLUMN_UNITS = {**dict.fromkeys(BODIES, "1"), **UNITS}
CHUNK_ROWS = 1024


def create_contacts(file: Any, chunk_rows: int) -> None:
    """Create the data sets, empty; `chunk_rows` of those with a row a frame."""
    _create(file, ENDS, np.dtype(np.int64), "1", chunk_rows)
    for name, unit in COLUMN_UNITS.items():
        _create(file, f"{GROUP}/{name}", CONTACT_ROW[name], unit, CHUNK_ROWS)


def _create(file: Any, name: str, kind: np.dtype[Any], unit: str, chunk_rows: int) -> None:
    file.create_dataset(name, (0,), dtype=kind, maxshape=(None,), chunks=(chunk_rows,)).attrs["unit"] = unit


def bytes_of_contacts(tables: Sequence[Rows]) -> int:
    """Return the most bytes that adding the contacts of some frames takes, chunks that are begun included."""
    rows = sum(len(table) for table in tables) + 2 * CHUNK_ROWS
    return rows * CONTACT_ROW.itemsize


def append_contacts(file: Any, tables: Sequence[Rows]) -> None:
    """Write the contacts of some frames, one table each, after those that are there."""
    before = file[f"{GROUP}/{BODIES[0]}"].shape[0]
    rows = np.concatenate(tables)
    for name in COLUMN_UNITS:
        _append(file[f"{GROUP}/{name}"], rows[name])
    _append(file[ENDS], before + np.cumsum([len(table) for table in tables]))


def _append(data_set: Any, values: Any) -> None:
    count = data_set.shape[0]
    data_set.resize(count + len(values), axis=0)
    data_set[count:] = values


def read_contacts(file: Any, frames: int) -> Contacts | None:
    """Return the contacts of the first `frames` frames, None where none were stored.

    Raises KeyError or ValueError where columns are missing or do not go together.
    """
    if GROUP not in file:
        return None
    ends = file[ENDS][:frames].astype(np.int64)
    if len(ends) != frames or (np.diff(ends, prepend=0) < 0).any():
        raise ValueError(f"{ENDS} does not count the contacts of {frames} frames")
    count = int(ends[-1]) if frames else 0
    rows = empty_rows(count)
    for name in COLUMN_UNITS:
        column = file[f"{GROUP}/{name}"]
        if column.shape[0] < count:
            raise ValueError(f"{GROUP}/{name} has {column.shape[0]} of {count} contacts")
        rows[name] = column[:count]
    return Contacts(ends, rows)

"""The contacts of all frames in run.h5, where they were asked for: a data set a column, and where each frame's end.

They are written and flushed with the frames they belong to, before `n_committed` counts those.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from blocksim.simulation.contacts import BODIES, CONTACT_ROW, SUPPORT, UNITS, Contacts, Rows, empty_rows
from blocksim.simulation.stores import hdf5_open as safety

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


def read_contacts(path: Path, file: Any, frames: int, bodies: int) -> Contacts | None:
    """Return the contacts of the first `frames` frames of a file, None where none were stored.

    Raises KeyError or ValueError where columns are missing, do not go together or name no body.
    """
    if not safety.has(file, GROUP):
        return None
    ends = safety.data_set(file, ENDS, 1)[:frames].astype(np.int64)
    if len(ends) != frames or (np.diff(ends, prepend=0) < 0).any():
        raise ValueError(f"{ENDS} does not count the contacts of {frames} frames")
    count = int(ends[-1]) if frames else 0
    columns = {name: safety.data_set(file, f"{GROUP}/{name}", 1) for name in COLUMN_UNITS}
    safety.refuse_too_many(path, {f"{GROUP}/{name}": one for name, one in columns.items()}, count, "contacts")
    rows = empty_rows(count)
    for name, column in columns.items():
        rows[name] = column[:count]
    for name, least in zip(BODIES, (0, SUPPORT), strict=True):
        if count and not (least <= rows[name].min() and rows[name].max() < bodies):
            raise ValueError(f"{GROUP}/{name} names bodies that are not among the {bodies}")
    return Contacts(ends, rows)

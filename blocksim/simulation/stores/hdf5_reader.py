"""Reads run.h5: of a finished run, of one that was killed, and of one that is still going on."""

import os
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from blocksim.errors import InputMissingError, InvalidInputError
from blocksim.scenario import Scenario, place_bodies
from blocksim.simulation.frames import Frames
from blocksim.simulation.recorder import MOTION, Rows, frames_from_rows
from blocksim.simulation.stores import hdf5_layout as layout
from blocksim.simulation.stores.hdf5_contacts import read_contacts

SUPERBLOCK = struct.Struct("<8sBxxB16xQ")  # signature, version, consistency flags, end of file
SIGNATURE = b"\x89HDF\r\n\x1a\n"
SUPERBLOCK_VERSION = 3
SWMR_FLAG = 4


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    if not path.is_file():
        message = f"{path}: no such file"
        raise InputMissingError(message)
    try:
        file = h5py.File(path, "r", **({"libver": "latest", "swmr": True} if _is_left_open(path) else {}))
    except OSError as error:
        message = f"{path}: not a readable HDF5 file: {error}"
        raise InvalidInputError(message) from error
    with file:
        yield file


def _is_left_open(path: Path) -> bool:
    """Tell whether a writer has not closed the file: it was killed, or is still at work.

    Looked up in the superblock (HDF5 file format specification, II.A), because HDF5 tries for ever to read a damaged
    file in SWMR mode. Raises InvalidInputError for a file that is cut off.
    """
    with path.open("rb") as file:
        head = file.read(SUPERBLOCK.size)
        size = file.seek(0, os.SEEK_END)
    if len(head) < SUPERBLOCK.size:
        return False
    signature, version, flags, end = SUPERBLOCK.unpack(head)
    is_open = signature == SIGNATURE and version == SUPERBLOCK_VERSION and bool(flags & SWMR_FLAG)
    if is_open and size < end:
        message = f"{path}: not a complete run file: cut off at {size} of {end} bytes"
        raise InvalidInputError(message)
    return is_open


def read_frames(path: Path, scenario: Scenario) -> Frames:
    """Return the committed frames of a run file; `scenario` is the one that lies beside it.

    Raises InputMissingError, or InvalidInputError when the file is not one of ours, damaged or still empty.
    """
    placed = place_bodies(scenario)
    with _opened(path) as file:
        try:
            count = int(file[layout.COMMITTED][()])
            steps = file[layout.STEP][:count]
            time_step = float(file[layout.STEP].attrs["time_step"])
            motion = np.stack([file[f"{layout.BLOCKS}/{name}"][:count] for name in MOTION], axis=1)
            ledger = tuple(name for name in file[layout.OBSERVABLES] if name not in layout.COUNTED_UNITS)
            names = (*ledger, *layout.COUNTED_UNITS)
            measured = np.stack([file[f"{layout.OBSERVABLES}/{name}"][:count] for name in names], axis=1)
            contacts = read_contacts(file, count)
        except (KeyError, OSError, RuntimeError, TypeError, ValueError) as error:
            message = f"{path}: not a complete run file: {error}"
            raise InvalidInputError(message) from error
    if count == 0 or motion.shape != (count, len(MOTION), len(placed)) or len(measured) != count:
        message = (
            f"{path}: holds {len(motion)} frames, {count} announced, of {motion.shape[-1]} bodies, not {len(placed)}"
        )
        raise InvalidInputError(message)
    return frames_from_rows(placed, time_step, Rows(steps, motion, measured, ledger, contacts))

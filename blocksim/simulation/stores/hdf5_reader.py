"""Reads run.h5: of a finished run, of one that was killed, and of one that is still in progress."""

import math
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from blocksim.errors import InvalidInputError
from blocksim.scenario import PlacedBody, Scenario, place_bodies
from blocksim.simulation.frames import Frames
from blocksim.simulation.recorder import MOTION, Rows, frames_from_rows
from blocksim.simulation.stores import hdf5_layout as layout
from blocksim.simulation.stores import hdf5_open as safety
from blocksim.simulation.stores.hdf5_contacts import read_contacts
from blocksim.simulation.stores.hdf5_open import DAMAGE, is_left_open, opened

PAUSES = (0.05, 0.2)  # s


def read_frames(path: Path, scenario: Scenario) -> Frames:
    """Return the committed frames of a run file; `scenario` is the one that lies beside it.

    Raises InputMissingError, or InvalidInputError when the file is not one of ours, damaged or still empty. What a run
    that continues writes at this moment may look like damage, so a file without an end is tried a few times.
    """
    return read_placed(path, place_bodies(scenario))


def read_placed(path: Path, placed: Sequence[PlacedBody]) -> Frames:
    """Return the committed frames of a run file of blocks that were placed so. Raises as `read_frames`."""
    for pause in PAUSES:
        try:
            return _frames(path, placed)
        except InvalidInputError:
            if not is_left_open(path):
                raise
            time.sleep(pause)
    return _frames(path, placed)


def _frames(path: Path, placed: Sequence[PlacedBody]) -> Frames:
    with opened(path) as file:
        try:
            time_step, rows = _read(path, file, len(placed))
        except DAMAGE as error:
            message = f"{path}: not a complete run file: {safety.short_cause(error)}"
            raise InvalidInputError(message) from error
    return frames_from_rows(placed, time_step, rows)


def _read(path: Path, file: Any, bodies: int) -> tuple[float, Rows]:
    """Return step (s) and rows of all committed frames, after looking at what would be read."""
    count = int(safety.data_set(file, layout.COMMITTED, 0)[()])
    steps = safety.data_set(file, layout.STEP, 1)
    moving = {name: safety.data_set(file, f"{layout.BLOCKS}/{name}", 2) for name in MOTION}
    ledger = tuple(name for name in safety.group(file, layout.OBSERVABLES) if name not in layout.COUNTED_UNITS)
    names = (*ledger, *layout.COUNTED_UNITS)
    measured = {name: safety.data_set(file, f"{layout.OBSERVABLES}/{name}", 1) for name in names}
    found = {one.shape[1] for one in moving.values()}
    if found != {bodies}:
        raise ValueError(f"holds {'/'.join(map(str, sorted(found)))} bodies, not {bodies}")
    if count <= 0:
        raise ValueError("holds no frame: the run was killed before its first one, or has just started")
    safety.refuse_too_many(path, {layout.STEP: steps, **moving, **measured}, count)
    rows = Rows(
        steps[:count],
        np.stack([one[:count] for one in moving.values()], axis=1, dtype=np.float64),
        np.stack([one[:count] for one in measured.values()], axis=1, dtype=np.float64),
        ledger,
        read_contacts(path, file, count, bodies),
    )
    return _time_step(steps, rows.steps), rows


def _time_step(data_set: Any, steps: NDArray[np.int64]) -> float:
    """Return the time step (s) that goes with numbers of steps; raises ValueError where they make no times."""
    time_step = float(data_set.attrs["time_step"])
    if steps.dtype.kind != "i" or steps.min() < 0:
        raise ValueError("its step numbers are invalid")
    if not (math.isfinite(time_step * float(steps.max())) and time_step > 0.0):
        raise ValueError(f"its time step of {time_step:g} s is invalid")
    return time_step

"""Reads run.h5: of a finished run, of one that was killed, and of one that is still in progress."""

import math
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from blocksim.errors import InvalidInputError
from blocksim.scenario import Scenario, place_bodies
from blocksim.simulation.frames import Frames
from blocksim.simulation.recorder import Rows, frames_from_rows
from blocksim.simulation.stores import hdf5_layout as layout
from blocksim.simulation.stores import hdf5_open as safety
from blocksim.simulation.stores.hdf5_contacts import read_contacts
from blocksim.simulation.stores.hdf5_open import DAMAGE, is_left_open, opened
from blocksim.world.systems import others_of
from blocksim.world.systems.blocks import blocks_placed
from blocksim.world.systems.system import Present

PAUSES = (0.05, 0.2)  # s


def read_frames(path: Path, scenario: Scenario) -> Frames:
    """Return the committed frames of a run file; `scenario` is the one that lies beside it.

    Raises InputMissingError, or InvalidInputError when the file is not one of ours, damaged or still empty. What a run
    that continues writes at this moment may look like damage, so a file without an end is tried a few times.
    """
    return read_systems(path, (blocks_placed(place_bodies(scenario)), *others_of(scenario)))


def read_systems(path: Path, systems: Sequence[Present]) -> Frames:
    """Return the committed frames of a run file of these systems, blocks first. Raises as `read_frames`."""
    for pause in PAUSES:
        try:
            return _frames(path, systems)
        except InvalidInputError:
            if not is_left_open(path):
                raise
            time.sleep(pause)
    return _frames(path, systems)


def _frames(path: Path, systems: Sequence[Present]) -> Frames:
    with opened(path) as file:
        try:
            time_step, rows = _read(path, file, systems)
        except DAMAGE as error:
            message = f"{path}: not a complete run file: {safety.short_cause(error)}"
            raise InvalidInputError(message) from error
    return frames_from_rows(systems, time_step, rows)


def _read(path: Path, file: Any, systems: Sequence[Present]) -> tuple[float, Rows]:
    """Return step (s) and rows of all committed frames, after looking at what would be read."""
    count = int(safety.data_set(file, layout.COMMITTED, 0)[()])
    steps = safety.data_set(file, layout.STEP, 1)
    moving = [{place: safety.data_set(file, place, 2) for place in layout.places_of(one.system)} for one in systems]
    ledger = tuple(name for name in safety.group(file, layout.OBSERVABLES) if name not in layout.COUNTED_UNITS)
    names = (*ledger, *layout.COUNTED_UNITS)
    measured = {name: safety.data_set(file, f"{layout.OBSERVABLES}/{name}", 1) for name in names}
    for present, sets in zip(systems, moving, strict=True):
        found = {one.shape[1] for one in sets.values()}
        if found != {present.count}:
            what = "bodies" if present is systems[0] else present.system.name
            raise ValueError(f"holds {'/'.join(map(str, sorted(found)))} {what}, not {present.count}")
    if count <= 0:
        raise ValueError("holds no frame: the run was killed before its first one, or has just started")
    every = {name: one for sets in moving for name, one in sets.items()}
    safety.refuse_too_many(path, {layout.STEP: steps, **every, **measured}, count)
    rows = Rows(
        steps[:count],
        tuple(np.stack([one[:count] for one in sets.values()], axis=1, dtype=np.float64) for sets in moving),
        np.stack([one[:count] for one in measured.values()], axis=1, dtype=np.float64),
        ledger,
        read_contacts(path, file, count, systems[0].count),
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

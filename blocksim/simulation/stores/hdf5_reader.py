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
from blocksim.simulation.contacts import BODIES, SUPPORT, Contacts, empty_rows
from blocksim.simulation.frames import Frames
from blocksim.simulation.recorder import Rows, frames_from_rows
from blocksim.simulation.stores import hdf5_layout as layout
from blocksim.simulation.stores import hdf5_open as safety
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
    ledger = tuple(name for name in safety.group(file, layout.OBSERVABLES) if name not in layout.COUNTED_UNITS)
    table = layout.sets_of_frames(systems, ledger, math.nan, 1, contacts=False)
    sets = {one.name: safety.data_set(file, one.name, 1 + len(one.row)) for one in table if one.name != layout.TIME}
    for present in systems:
        found = {sets[place].shape[1] for place in layout.places_of(present.system)}
        if found != {present.count}:
            what = "bodies" if present is systems[0] else present.system.name
            raise ValueError(f"holds {'/'.join(map(str, sorted(found)))} {what}, not {present.count}")
    if count <= 0:
        raise ValueError("holds no frame: the run was killed before its first one, or has just started")
    safety.refuse_too_many(path, sets, count)
    values = {name: one[:count] for name, one in sets.items()}
    observables = [values[f"{layout.OBSERVABLES}/{name}"] for name in layout.measured_units(ledger)]
    rows = Rows(
        values[layout.STEP],
        tuple(
            np.stack([values[place] for place in layout.places_of(one.system)], axis=1, dtype=np.float64)
            for one in systems
        ),
        np.stack(observables, axis=1, dtype=np.float64),
        ledger,
        _contacts(path, file, count, systems[0].count),
    )
    return _time_step(sets[layout.STEP], rows.steps), rows


def _contacts(path: Path, file: Any, frames: int, bodies: int) -> Contacts | None:
    """Return the contacts of the first frames of a file, None where none were stored.

    Raises KeyError or ValueError where columns are missing, do not go together or name no body.
    """
    if not safety.has(file, layout.CONTACTS):
        return None
    ends = safety.data_set(file, layout.ENDS, 1)[:frames].astype(np.int64)
    if len(ends) != frames or (np.diff(ends, prepend=0) < 0).any():
        raise ValueError(f"{layout.ENDS} does not count the contacts of {frames} frames")
    count = int(ends[-1]) if frames else 0
    sets = {one.name: safety.data_set(file, one.name, 1) for one in layout.sets_of_contacts()}
    safety.refuse_too_many(path, sets, count, "contacts")
    rows = empty_rows(count)
    for name, one in sets.items():
        rows[name.removeprefix(f"{layout.CONTACTS}/")] = one[:count]
    for name, least in zip(BODIES, (0, SUPPORT), strict=True):
        if count and not (least <= rows[name].min() and rows[name].max() < bodies):
            raise ValueError(f"{layout.CONTACTS}/{name} names bodies that are not among the {bodies}")
    return Contacts(ends, rows)


def _time_step(data_set: Any, steps: NDArray[np.int64]) -> float:
    """Return the time step (s) that goes with numbers of steps; raises ValueError where they make no times."""
    time_step = float(data_set.attrs["time_step"])
    if steps.dtype.kind != "i" or steps.min() < 0:
        raise ValueError("its step numbers are invalid")
    if not (math.isfinite(time_step * float(steps.max())) and time_step > 0.0):
        raise ValueError(f"its time step of {time_step:g} s is invalid")
    return time_step

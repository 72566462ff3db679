"""run.h5: the table of its data sets, and reading frames, contacts and probes."""

import math
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from blocksim.errors import InvalidInputError
from blocksim.scenario import Scenario, place_bodies
from blocksim.scenario.events import probe_names
from blocksim.simulation.frames import BODIES, CONTACT_ROW, SUPPORT, UNITS, Contacts, Frames, empty_rows
from blocksim.simulation.probes import CHUNK_ROWS, ProbeSeries
from blocksim.simulation.recorder import Frame, Rows, frames_from_rows
from blocksim.simulation.stores import hdf5_files as safety
from blocksim.simulation.stores.hdf5_files import DAMAGE, is_left_open, open_hdf5
from blocksim.world.systems import others_of
from blocksim.world.systems.blocks import BLOCKS as _BLOCKS
from blocksim.world.systems.blocks import blocks_placed
from blocksim.world.systems.system import System, SystemInScene

PARTICLES = "particles"
BLOCKS = f"{PARTICLES}/{_BLOCKS.name}"
OBSERVABLES = "observables"
COMMITTED = "n_committed"
STEP = f"{BLOCKS}/step"
TIME = f"{BLOCKS}/time"
SCENARIO_TEXT = "parameters/scenario"
OUTLINES = "outlines"  # of every element, where they are no rectangles: (b, k, 2), the last corner repeated
CONTACTS = "contacts"
ENDS = f"{CONTACTS}/end"
PROBES = "probes"
PROBE_STEP, PROBE_TIME = "step", "time"

COUNTED_UNITS = {"contact_count": "1", "largest_overlap": "m"}
TEXT_UNIT = "TOML"
Values = NDArray[Any]


@dataclass(frozen=True)
class DataSet:
    """A data set that grows while a run continues, by rows of frames or of samples of a probe."""

    name: str
    unit: str
    of: Callable[[Any], Values]  # its rows in frames, or in a ProbeSeries
    kind: Any = np.float64
    row: tuple[int, ...] = ()  # shape of a row
    chunk: int = CHUNK_ROWS  # rows
    is_sum: bool = False  # what it counts goes on from its last row

    def create(self, file: Any) -> None:
        """Create it, empty."""
        # a scene may have no blocks; a chunk of nothing cannot be
        chunks, most = (self.chunk, *(one or 1 for one in self.row)), (None, *(one or None for one in self.row))
        data_set = file.create_dataset(self.name, (0, *self.row), dtype=self.kind, maxshape=most, chunks=chunks)
        data_set.attrs["unit"] = self.unit

    def room(self, values: Values) -> int:
        """Return the most bytes that adding these rows takes, chunks that are begun included."""
        return (len(values) + 2 * self.chunk) * math.prod(self.row) * int(np.dtype(self.kind).itemsize)

    def append(self, file: Any, values: Values) -> None:
        """Write rows after those that are there."""
        data_set = file[self.name]
        count = data_set.shape[0]
        before = data_set[count - 1] if self.is_sum and count else 0
        data_set.resize(count + len(values), axis=0)
        data_set[count:] = before + values if self.is_sum else values


def places_of(system: System) -> list[str]:
    """Return the data sets of what frames keep of a system, in the order of its `quantities`."""
    return [f"{PARTICLES}/{system.name}/{one.name}" for one in system.quantities]


def measured_units(ledger: Iterable[str]) -> dict[str, str]:
    """Return the units of all that is measured at every frame, given the names of the energies."""
    return {**dict.fromkeys(ledger, "J"), **COUNTED_UNITS}


def sets_of_frames(
    systems: Sequence[SystemInScene], ledger: Iterable[str], time_step: float, chunk: int, *, contacts: bool
) -> Iterator[DataSet]:
    """Yield the data sets of frames with steps of `time_step` (s), in chunks of so many rows.

    Each `of` takes a list of frames. Contacts are among them where these are recorded.
    """
    yield DataSet(STEP, "1", _steps, np.int64, chunk=chunk)
    yield DataSet(TIME, "s", lambda frames: _steps(frames) * time_step, chunk=chunk)
    for number, present in enumerate(systems):
        for k, (place, one) in enumerate(zip(places_of(present.system), present.system.quantities, strict=True)):
            yield DataSet(place, one.stored_unit, partial(_state, number, k), row=(present.count,), chunk=chunk)
    for k, (name, unit) in enumerate(measured_units(ledger).items()):
        yield DataSet(f"{OBSERVABLES}/{name}", unit, partial(_measured, k), chunk=chunk)
    if contacts:
        yield DataSet(ENDS, "1", _ends, np.int64, chunk=chunk, is_sum=True)
        yield from sets_of_contacts()


def sets_of_contacts() -> Iterator[DataSet]:
    """Yield the data sets with a row a contact."""
    for name, unit in {**dict.fromkeys(BODIES, "1"), **UNITS}.items():
        yield DataSet(f"{CONTACTS}/{name}", unit, partial(_contact_column, name), CONTACT_ROW[name])


def sets_of_probe(probe: ProbeSeries) -> Iterator[DataSet]:
    """Yield the data sets of the samples of a probe; each `of` takes a ProbeSeries with these columns."""
    place = f"{PROBES}/{probe.name}"
    yield DataSet(f"{place}/{PROBE_STEP}", "1", attrgetter("step"), np.int64)
    yield DataSet(f"{place}/{PROBE_TIME}", "s", attrgetter("time"))
    for name, unit in probe.units.items():
        yield DataSet(f"{place}/{name}", unit, partial(_column, name))


def constants_of(present: SystemInScene) -> Iterator[tuple[str, str, Values]]:
    """Yield what is written once of a system: place, unit, values."""
    place = f"{PARTICLES}/{present.system.name}"
    for one, values in zip(present.system.constants, present.elements.constants, strict=True):
        yield f"{place}/{one.name}", one.stored_unit, values
    if present.elements.outlines is not None:
        yield f"{place}/{OUTLINES}", "m", present.elements.outlines


def _steps(frames: Sequence[Frame]) -> Values:
    return np.array([frame.step for frame in frames])


def _state(system: int, quantity: int, frames: Sequence[Frame]) -> Values:
    return np.stack([frame.states[system][quantity] for frame in frames])


def _measured(place: int, frames: Sequence[Frame]) -> Values:
    return np.array([frame.measured[place] for frame in frames])


def _ends(frames: Sequence[Frame]) -> Values:
    return np.cumsum([0 if frame.contacts is None else len(frame.contacts) for frame in frames])


def _contact_column(name: str, frames: Sequence[Frame]) -> Values:
    return np.concatenate([(empty_rows(0) if one.contacts is None else one.contacts)[name] for one in frames])


def _column(name: str, probe: ProbeSeries) -> Values:
    return probe.columns[name]


def read_probes(path: Path, scenario: Scenario) -> dict[str, ProbeSeries]:
    """Return the samples of all probes of a scenario in a run file, by name.

    Raises InputMissingError, or InvalidInputError for a damaged file or one without these probes.
    """
    names = probe_names(scenario)
    if not names:
        return {}
    with open_hdf5(path) as file:
        try:
            return {name: _samples(path, file, name) for name in names}
        except DAMAGE as error:
            message = f"{path}: its probes cannot be read: {safety.short_cause(error)}"
            raise InvalidInputError(message) from error


def _samples(path: Path, file: Any, name: str) -> ProbeSeries:
    place = f"{PROBES}/{name}"
    count = int(safety.data_set(file, f"{place}/{COMMITTED}", 0)[()])
    found = safety.group(file, place)
    sets = {one: safety.data_set(file, f"{place}/{one}", 1) for one in found if one != COMMITTED}
    if count < 0:
        raise ValueError(f"{place} holds {count} samples")
    safety.refuse_too_many(path, {f"{place}/{one}": data for one, data in sets.items()}, count, "samples")
    columns = {
        one: np.asarray(data[:count], dtype=np.float64)
        for one, data in sets.items()
        if one not in (PROBE_STEP, PROBE_TIME)
    }
    steps = np.asarray(sets[PROBE_STEP][:count], dtype=np.int64)
    if (np.diff(steps) <= 0).any():
        raise ValueError(f"{place}/{PROBE_STEP} does not increase")
    units = {one: _text(sets[one].attrs["unit"]) for one in columns}
    times = np.asarray(sets[PROBE_TIME][:count], dtype=np.float64)
    return ProbeSeries(name, _text(file[place].attrs["kind"]), steps, times, columns, units)


def _text(value: Any) -> str:
    return value.decode() if isinstance(value, bytes) else str(value)


PAUSES = (0.05, 0.2)  # s


def read_frames(path: Path, scenario: Scenario) -> Frames:
    """Return the committed frames of a run file; `scenario` is the one that lies beside it.

    Raises InputMissingError, or InvalidInputError when the file is not one of ours, damaged or still empty. What a run
    that continues writes at this moment may look like damage, so a file without an end is tried a few times.
    """
    return read_systems(path, (blocks_placed(place_bodies(scenario)), *others_of(scenario)))


def read_systems(path: Path, systems: Sequence[SystemInScene]) -> Frames:
    """Return the committed frames of a run file of these systems, blocks first. Raises as `read_frames`."""
    for pause in PAUSES:
        try:
            return _frames(path, systems)
        except InvalidInputError:
            if not is_left_open(path):
                raise
            time.sleep(pause)
    return _frames(path, systems)


def _frames(path: Path, systems: Sequence[SystemInScene]) -> Frames:
    with open_hdf5(path) as file:
        try:
            time_step, rows = _read(path, file, systems)
        except DAMAGE as error:
            message = f"{path}: not a complete run file: {safety.short_cause(error)}"
            raise InvalidInputError(message) from error
    return frames_from_rows(systems, time_step, rows)


def _read(path: Path, file: Any, systems: Sequence[SystemInScene]) -> tuple[float, Rows]:
    """Return step (s) and rows of all committed frames, after looking at what would be read."""
    count = int(safety.data_set(file, COMMITTED, 0)[()])
    ledger = tuple(name for name in safety.group(file, OBSERVABLES) if name not in COUNTED_UNITS)
    table = sets_of_frames(systems, ledger, math.nan, 1, contacts=False)
    sets = {one.name: safety.data_set(file, one.name, 1 + len(one.row)) for one in table if one.name != TIME}
    for present in systems:
        found = {sets[place].shape[1] for place in places_of(present.system)}
        if found != {present.count}:
            what = "bodies" if present is systems[0] else present.system.name
            raise ValueError(f"holds {'/'.join(map(str, sorted(found)))} {what}, not {present.count}")
    if count <= 0:
        raise ValueError("holds no frame: the run was killed before its first one, or has just started")
    safety.refuse_too_many(path, sets, count)
    values = {name: one[:count] for name, one in sets.items()}
    observables = [values[f"{OBSERVABLES}/{name}"] for name in measured_units(ledger)]
    rows = Rows(
        values[STEP],
        tuple(
            np.stack([values[place] for place in places_of(one.system)], axis=1, dtype=np.float64) for one in systems
        ),
        np.stack(observables, axis=1, dtype=np.float64),
        ledger,
        _contacts(path, file, count, systems[0].count),
    )
    return _time_step(sets[STEP], rows.steps), rows


def _contacts(path: Path, file: Any, frames: int, bodies: int) -> Contacts | None:
    """Return the contacts of the first frames of a file, None where none were stored.

    Raises KeyError or ValueError where columns are missing, do not go together or name no body.
    """
    if not safety.has(file, CONTACTS):
        return None
    ends = safety.data_set(file, ENDS, 1)[:frames].astype(np.int64)
    if len(ends) != frames or (np.diff(ends, prepend=0) < 0).any():
        raise ValueError(f"{ENDS} does not count the contacts of {frames} frames")
    count = int(ends[-1]) if frames else 0
    sets = {one.name: safety.data_set(file, one.name, 1) for one in sets_of_contacts()}
    safety.refuse_too_many(path, sets, count, "contacts")
    rows = empty_rows(count)
    for name, one in sets.items():
        rows[name.removeprefix(f"{CONTACTS}/")] = one[:count]
    for name, least in zip(BODIES, (0, SUPPORT), strict=True):
        if count and not (least <= rows[name].min() and rows[name].max() < bodies):
            raise ValueError(f"{CONTACTS}/{name} names bodies that are not among the {bodies}")
    return Contacts(ends, rows)


def _time_step(data_set: Any, steps: NDArray[np.int64]) -> float:
    """Return the time step (s) that goes with numbers of steps; raises ValueError where they make no times."""
    time_step = float(data_set.attrs["time_step"])
    if steps.dtype.kind != "i" or steps.min() < 0:
        raise ValueError("its step numbers are invalid")
    if not (math.isfinite(time_step * float(steps.max())) and time_step > 0.0):
        raise ValueError(f"its time step of {time_step:g} s is invalid")
    return time_step

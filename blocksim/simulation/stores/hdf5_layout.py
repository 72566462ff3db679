"""What stands where in run.h5, and in which unit: one table of data sets, which writer and readers loop over.

Groups are named after H5MD. Every data set says its unit in the attribute `unit`. `n_committed` is the number of frames
that are whole, and in the group of a probe that of its samples: a reader takes no more. Contacts, where they were asked
for, have a row a contact, and where each frame's end.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from blocksim.simulation.contacts import BODIES, CONTACT_ROW, UNITS, empty_rows
from blocksim.simulation.probe_series import CHUNK_ROWS, ProbeSeries
from blocksim.simulation.recorder import Frame
from blocksim.world.systems.blocks import BLOCKS as _BLOCKS
from blocksim.world.systems.system import Present, System

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
    systems: Sequence[Present], ledger: Iterable[str], time_step: float, chunk: int, *, contacts: bool
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


def constants_of(present: Present) -> Iterator[tuple[str, str, Values]]:
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

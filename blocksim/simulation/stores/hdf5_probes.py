"""The samples of probes in run.h5: a group a probe, a data set a column.

They are written and flushed with the frames, and only then `n_committed` of the group says how many there are.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from blocksim.errors import InvalidInputError
from blocksim.scenario import Scenario
from blocksim.scenario.probes import probe_names
from blocksim.simulation.probe_series import CHUNK_ROWS, ProbeSeries
from blocksim.simulation.stores import hdf5_open as safety
from blocksim.simulation.stores.hdf5_open import DAMAGE, opened

GROUP = "probes"
STEP, TIME, COMMITTED = "step", "time", "n_committed"
OWN = (STEP, TIME, COMMITTED)


def create_probes(file: Any, probes: Iterable[ProbeSeries]) -> None:
    """Create the data sets, empty, with the columns of these probes."""
    for probe in probes:
        group = file.create_group(f"{GROUP}/{probe.name}", track_order=True)
        group.attrs["kind"] = probe.kind
        group.create_dataset(COMMITTED, (), dtype=np.int64).attrs["unit"] = "1"
        for name, (kind, unit) in _types(probe).items():
            data_set = group.create_dataset(name, (0,), dtype=kind, maxshape=(None,), chunks=(CHUNK_ROWS,))
            data_set.attrs["unit"] = unit


def _types(probe: ProbeSeries) -> dict[str, tuple[type, str]]:
    return {STEP: (np.int64, "1"), TIME: (np.float64, "s"), **{k: (np.float64, u) for k, u in probe.units.items()}}


def bytes_of_probes(probes: Iterable[ProbeSeries]) -> int:
    """Return the most bytes that adding these samples takes, chunks that are begun included."""
    return sum(8 * (len(probe) + 2 * CHUNK_ROWS) * (2 + len(probe.columns)) for probe in probes)


def append_probes(file: Any, probes: Iterable[ProbeSeries]) -> None:
    """Write samples after those that are there; they count once `commit_probes` has been called."""
    for probe in probes:
        if len(probe):
            group = file[f"{GROUP}/{probe.name}"]
            count = int(group[COMMITTED][()])
            for name, values in {STEP: probe.step, TIME: probe.time, **probe.columns}.items():
                data_set = group[name]
                data_set.resize(count + len(probe), axis=0)
                data_set[count:] = values


def commit_probes(file: Any, probes: Iterable[ProbeSeries]) -> None:
    """Count the samples of these probes, which have been flushed."""
    for probe in probes:
        if len(probe):
            group = file[f"{GROUP}/{probe.name}"]
            group[COMMITTED][()] = group[STEP].shape[0]


def read_probes(path: Path, scenario: Scenario) -> dict[str, ProbeSeries]:
    """Return the samples of all probes of a scenario in a run file, by name.

    Raises InputMissingError, or InvalidInputError for a damaged file or one without these probes.
    """
    names = probe_names(scenario)
    if not names:
        return {}
    with opened(path) as file:
        try:
            return {name: _read(path, file, name) for name in names}
        except DAMAGE as error:
            message = f"{path}: its probes cannot be read: {safety.short_cause(error)}"
            raise InvalidInputError(message) from error


def _read(path: Path, file: Any, name: str) -> ProbeSeries:
    place = f"{GROUP}/{name}"
    count = int(safety.data_set(file, f"{place}/{COMMITTED}", 0)[()])
    found = safety.group(file, place)
    sets = {one: safety.data_set(file, f"{place}/{one}", 1) for one in found if one != COMMITTED}
    if count < 0:
        raise ValueError(f"{place} holds {count} samples")
    safety.refuse_too_many(path, {f"{place}/{one}": data for one, data in sets.items()}, count, "samples")
    columns = {one: np.asarray(data[:count], dtype=np.float64) for one, data in sets.items() if one not in OWN}
    steps = np.asarray(sets[STEP][:count], dtype=np.int64)
    if (np.diff(steps) <= 0).any():
        raise ValueError(f"{place}/{STEP} does not increase")
    units = {one: _text(sets[one].attrs["unit"]) for one in columns}
    times = np.asarray(sets[TIME][:count], dtype=np.float64)
    return ProbeSeries(name, _text(file[place].attrs["kind"]), steps, times, columns, units)


def _text(value: Any) -> str:
    return value.decode() if isinstance(value, bytes) else str(value)

"""Reads the samples of probes from run.h5: a group a probe, a data set a column."""

from pathlib import Path
from typing import Any

import numpy as np

from blocksim.errors import InvalidInputError
from blocksim.scenario import Scenario
from blocksim.scenario.probes import probe_names
from blocksim.simulation.probe_series import ProbeSeries
from blocksim.simulation.stores import hdf5_layout as layout
from blocksim.simulation.stores import hdf5_open as safety
from blocksim.simulation.stores.hdf5_open import DAMAGE, opened


def read_probes(path: Path, scenario: Scenario) -> dict[str, ProbeSeries]:
    """Return the samples of all probes of a scenario in a run file, by name.

    Raises InputMissingError, or InvalidInputError for a damaged file or one without these probes.
    """
    names = probe_names(scenario)
    if not names:
        return {}
    with opened(path) as file:
        try:
            return {name: _samples(path, file, name) for name in names}
        except DAMAGE as error:
            message = f"{path}: its probes cannot be read: {safety.short_cause(error)}"
            raise InvalidInputError(message) from error


def _samples(path: Path, file: Any, name: str) -> ProbeSeries:
    place = f"{layout.PROBES}/{name}"
    count = int(safety.data_set(file, f"{place}/{layout.COMMITTED}", 0)[()])
    found = safety.group(file, place)
    sets = {one: safety.data_set(file, f"{place}/{one}", 1) for one in found if one != layout.COMMITTED}
    if count < 0:
        raise ValueError(f"{place} holds {count} samples")
    safety.refuse_too_many(path, {f"{place}/{one}": data for one, data in sets.items()}, count, "samples")
    columns = {
        one: np.asarray(data[:count], dtype=np.float64)
        for one, data in sets.items()
        if one not in (layout.PROBE_STEP, layout.PROBE_TIME)
    }
    steps = np.asarray(sets[layout.PROBE_STEP][:count], dtype=np.int64)
    if (np.diff(steps) <= 0).any():
        raise ValueError(f"{place}/{layout.PROBE_STEP} does not increase")
    units = {one: _text(sets[one].attrs["unit"]) for one in columns}
    times = np.asarray(sets[layout.PROBE_TIME][:count], dtype=np.float64)
    return ProbeSeries(name, _text(file[place].attrs["kind"]), steps, times, columns, units)


def _text(value: Any) -> str:
    return value.decode() if isinstance(value, bytes) else str(value)

"""A sweep as series: where the blocks end over the values of one key, once for each value of a second key, if any."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from blocksim.errors import InvalidInputError
from blocksim.scenario import Scenario, load_scenario
from blocksim.scenario import quantities as q
from blocksim.scenario.keys import KeyPath, field_at, follow, parse_key
from blocksim.study.many import PLAN, read_sweep
from blocksim.study.single import FINISHED

MOST_KEYS = 2
X = ".x_mm"
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Series:
    """Final centres of b blocks in n finished runs that differ in one key only, in the order of its values."""

    label: str  # key and value that all runs of this series share; empty where there is one series only
    values: Floats  # (n,) SI
    x_mm: Floats  # (n, b)


@dataclass(frozen=True)
class SweepSeries:
    """All series of a sweep; `unit` is the SI unit of the key's values, empty for plain numbers."""

    scenario: Scenario
    key: str
    unit: str
    blocks: tuple[str, ...]
    series: tuple[Series, ...]


def read_series(folder: Path) -> SweepSeries:
    """Return the series of a sweep's folder.

    Raises InputMissingError or InvalidInputError: where files are missing or damaged, nothing has finished, more than
    two keys are varied, or the values of the first are no numbers.
    """
    table = read_sweep(folder).table
    scenario = load_scenario(folder / PLAN)
    finished = table[table["status"] == FINISHED]
    blocks = tuple(str(name).removesuffix(X) for name in table.columns if str(name).endswith(X))
    if finished.empty or not blocks:
        message = f"{folder}: no case of this sweep has finished, there is nothing to draw"
        raise InvalidInputError(message)
    key, other = _axes(folder, scenario, finished)
    return SweepSeries(scenario, key, _unit(scenario, key), blocks, tuple(_series(finished, key, other, blocks)))


def _axes(folder: Path, scenario: Scenario, table: pd.DataFrame) -> tuple[str, str | None]:
    """Return the key with the most values, and the other one if there are two that go through all combinations."""
    sweep = scenario.sweep
    keys = [] if sweep is None else [key for key in sweep.vary if key in table.columns]
    if not 0 < len(keys) <= MOST_KEYS:
        message = f"{folder}: {len(keys)} keys are varied; a picture can show one or two, or a single run of the sweep"
        raise InvalidInputError(message)
    most, *others = sorted(keys, key=lambda key: -table[key].nunique())
    return (most, others[0] if others and sweep is not None and sweep.mode == "grid" else None)


def _series(table: pd.DataFrame, key: str, other: str | None, blocks: tuple[str, ...]) -> Iterator[Series]:
    parts = [("", table)] if other is None else [(f"{other} = {value}", part) for value, part in table.groupby(other)]
    for label, part in parts:
        values = np.array([_number(value, key) for value in part[key]])
        order = np.argsort(values, kind="stable")
        yield Series(label, values[order], part[[f"{block}{X}" for block in blocks]].to_numpy(dtype=float)[order])


def _number(value: object, key: str) -> float:
    """Return a value in SI; in the table of a sweep it stands as it was given."""
    try:
        return float(str(value))
    except ValueError:
        pass
    try:
        return q.parse_quantity(str(value), q.NUMBER)[0]
    except ValueError:
        message = f"the values of {key} are no numbers (one is {q.shown(value)}); they cannot be an axis"
        raise InvalidInputError(message) from None


def _unit(scenario: Scenario, key: str) -> str:
    """Return the unit that a key's values have inside, empty for plain numbers."""
    data = scenario.model_dump(by_alias=True)
    path: KeyPath = ()
    for part in parse_key(key):
        path = (*path, int(part) if isinstance(follow(data, path), list | tuple) else part)
    field = field_at(path, data)
    marks = () if field is None else field.metadata
    return next((mark.kind.unit for mark in marks if isinstance(mark, q.Quantity)), "")

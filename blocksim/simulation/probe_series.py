"""What probes have recorded: columns over time with their units, as an object, a table and CSV."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from blocksim.scenario import Scenario
from blocksim.scenario.models.probe import STEP

if TYPE_CHECKING:
    import pandas as pd

Floats = NDArray[np.float64]

FORCE, POINT, JOINT, ENERGY = "force", "point", "joint", "energy"
WRITTEN = {"m": ("_mm", 1e3), "m/s": ("_mm_s", 1e3), "rad": ("_deg", math.degrees(1.0)), "N": ("_N", 1.0),
           "J": ("_J", 1.0), "1": ("", 1.0)}  # fmt: skip
"""Ending of the name and factor of a column in tables for people, by its SI unit."""
ROWS_AT_ONCE = 50_000
CHUNK_ROWS = 1024  # of a column in run.h5
DIGITS = 20  # characters of a number in CSV


@dataclass(frozen=True)
class Column:
    """A quantity that a probe records."""

    name: str
    unit: str  # SI
    meaning: str


COLUMNS: Mapping[str, tuple[Column, ...]] = {
    FORCE: (
        Column("fx", "N", "force along x"),
        Column("fy", "N", "force along y"),
        Column("x", "m", "point of application, weighted by normal forces"),
        Column("y", "m", "point of application"),
        Column("mobilised", "1", "shear forces over normal forces times static friction"),
        Column("contacts", "1", "number of contacts"),
    ),
    POINT: (
        Column("x", "m", "place along x"),
        Column("y", "m", "place along y"),
        Column("dx", "m", "displacement from the start"),
        Column("dy", "m", "displacement from the start"),
        Column("relative_dx", "m", "displacement from the start relative to the support"),
        Column("relative_dy", "m", "displacement from the start relative to the support"),
        Column("vx", "m/s", "velocity"),
        Column("vy", "m/s", "velocity"),
        Column("relative_vx", "m/s", "velocity relative to the support"),
        Column("relative_vy", "m/s", "velocity relative to the support"),
        Column("rotation", "rad", "angle turned since the start"),
    ),
    JOINT: (
        Column("opening", "m", "gap in the middle of the joint"),
        Column("opening_first", "m", "gap at its first end"),
        Column("opening_last", "m", "gap at its last end"),
        Column("slip", "m", "displacement of the second body along the joint, towards +x where it lies on the first"),
        Column("rotation", "rad", "angle that the second body has turned relative to the first"),
    ),
}


def columns_of(kind: str, ledger: Sequence[str]) -> tuple[Column, ...]:
    """Return the columns of a kind of probe; `ledger` names the energies of a run."""
    if kind == ENERGY:
        return tuple(Column(name, "J", name.replace("_", " ")) for name in ledger)
    return COLUMNS[kind]


@dataclass(frozen=True, repr=False)
class ProbeSeries:
    """The n samples of one probe in SI."""

    name: str
    kind: str
    step: NDArray[np.int64]  # (n,) step numbers
    time: Floats  # (n,) s
    columns: dict[str, Floats] = field(repr=False)  # (n,) each
    units: dict[str, str]  # SI, by column

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(self.step)

    def __getitem__(self, column: str) -> Floats:
        """Return a column. Raises KeyError for one that this kind of probe does not have."""
        return self.columns[column]

    def __repr__(self) -> str:
        """Return a line: name, kind, samples, columns."""
        return f"<Probe {self.name}: {self.kind}, {len(self)} samples of {', '.join(self.columns)}>"

    def written(self) -> dict[str, Floats]:
        """Return the columns as tables for people have them, in mm, degrees, N and J, by names with their units."""
        return {
            f"{name}{WRITTEN[self.units[name]][0]}": WRITTEN[self.units[name]][1] * values
            for name, values in self.columns.items()
        }

    def to_frame(self) -> "pd.DataFrame":
        """Return a pandas table, one row per sample: time_s, then the columns in mm, degrees, N and J."""
        import pandas as pd

        return pd.DataFrame({"time_s": self.time, **self.written()})

    def csv_lines(self) -> Iterator[str]:
        """Yield the CSV in parts: step, time_s and the columns; numbers read back exactly, nan where there is none."""
        columns = self.written()
        yield ",".join(["step", "time_s", *columns]) + "\n"
        for first in range(0, len(self), ROWS_AT_ONCE):
            part = slice(first, first + ROWS_AT_ONCE)
            lists = [values[part].tolist() for values in (self.step, self.time, *columns.values())]
            rows = zip(*lists, strict=True)
            yield "".join(",".join(map(repr, row)) + "\n" for row in rows)


def bytes_of_series(scenario: Scenario, steps: int, step: float, energies: int) -> int:
    """Return the bytes that the probes of a run of so many steps (s) take in its folder, with so many energies."""
    total = 0.0
    for probe in scenario.probes:
        every = step if probe.every == STEP else float(probe.every or scenario.output.every)
        columns = energies if probe.kind == ENERGY else len(COLUMNS[probe.kind])
        rows = steps * step / max(every, step) + 1
        total += (2 + columns) * (8 * CHUNK_ROWS * math.ceil(rows / CHUNK_ROWS) + DIGITS * rows)
    return int(total)


def series_of(
    name: str, kind: str, columns: Sequence[Column], rows: Sequence[tuple[int, Sequence[float]]], time_step: float
) -> ProbeSeries:
    """Return samples from rows of step and values; `time_step` in s."""
    steps = np.array([step for step, _ in rows], dtype=np.int64)
    values = np.array([row for _, row in rows], dtype=np.float64).reshape(len(rows), len(columns))
    return ProbeSeries(
        name,
        kind,
        steps,
        np.multiply(steps, time_step, dtype=np.float64),
        {one.name: np.ascontiguousarray(values[:, place]) for place, one in enumerate(columns)},
        {one.name: one.unit for one in columns},
    )

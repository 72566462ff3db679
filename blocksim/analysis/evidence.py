"""The members of an ensemble beside the repeats of an experiment, and what a metric of both is."""

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.analysis import compare, experiment
from blocksim.errors import InvalidInputError

if TYPE_CHECKING:
    import pandas as pd


FINISHED = "finished"


class Failure(NamedTuple):
    """A member without a result: its row counted from 1, the name of its case, status and reason."""

    row: int
    case: str
    status: str
    reason: str


@dataclass(frozen=True, eq=False)
class Members:
    """The members of a sweep.

    `table` has the columns `case`, `status`, perhaps `reason`, and `<block>.x_mm` and so on in mm and degrees;
    `source` is where it comes from. Members that did not finish are members: they count in every total.
    """

    table: "pd.DataFrame" = field(repr=False)
    source: str

    def __post_init__(self) -> None:
        """Raise InvalidInputError for a table that is not a sweep's, or in which nothing has finished."""
        missing = [name for name in ("case", "status") if name not in self.table]
        if missing:
            raise InvalidInputError(f"{self.source}: not the table of a sweep: no column {' and '.join(missing)}")
        if not self.has_ended.any():
            raise InvalidInputError(
                f"{self.source}: none of the {len(self.table)} cases has finished; nothing to compare"
            )

    @property
    def has_ended(self) -> "NDArray[np.bool_]":
        """Whether each member has a result, shape (count,)."""
        return (self.table["status"] == FINISHED).to_numpy(dtype=bool)

    @property
    def failures(self) -> tuple[Failure, ...]:
        """The members without a result, in the order of the table."""
        rows = np.flatnonzero(~self.has_ended)
        failed = self.table.iloc[rows]
        reasons = failed["reason"].fillna("") if "reason" in failed else [""] * len(rows)
        columns = zip(rows, failed["case"].fillna(""), failed["status"].fillna("no status"), reasons, strict=True)
        return tuple(
            Failure(int(row) + 1, str(case), str(status), str(reason)) for row, case, status, reason in columns
        )

    @property
    def blocks(self) -> tuple[str, ...]:
        """The blocks with any result, in the order of the columns."""
        ends = tuple(f".{quantity.final_column}" for quantity in experiment.QUANTITIES.values())
        names = (str(name) for name in self.table.columns)
        return tuple(dict.fromkeys(name.rpartition(".")[0] for name in names if name.endswith(ends)))

    def values(self, block: str, quantity: str) -> "NDArray[np.float64]":
        """Return one quantity of one block (mm or deg), shape (count,); NaN where a member has none.

        Raises InvalidInputError where the table has no such column, or a text in it.
        """
        import pandas as pd

        name = f"{block}.{experiment.QUANTITIES[quantity].final_column}"
        if name not in self.table:
            message = (
                f"{self.source}: no column {name}, which the measured {quantity} of block '{block}' is compared with"
            )
            raise InvalidInputError(message)
        column = self.table[name]
        numbers = pd.to_numeric(column, errors="coerce")
        texts = np.flatnonzero(numbers.isna() & column.notna())
        if texts.size:
            row = int(texts[0])
            raise InvalidInputError(f"{self.source}: {name}: '{column.iloc[row]}' in row {row + 1} is not a number")
        values = np.where(self.has_ended, numbers.to_numpy(dtype=float, na_value=np.nan), np.nan)
        return np.where(np.isfinite(values), values, np.nan)


Floats = NDArray[np.float64]
Interval = tuple[float, float]
Value = str | int | float | bool | Interval | None
Row = dict[str, Value]  # by the names of the metric's columns; None where a number is missing


class Form(StrEnum):
    """Format of the values of a column."""

    TEXT = "text"
    COUNT = "count"
    NUMBER = "number"
    SHARE = "share"


@dataclass(frozen=True)
class Datum:
    """One number of a metric: its name for programs, its head in a table (none: not shown), its meaning."""

    name: str
    head: str
    form: Form
    meaning: str
    digits: int = 2


class SamplePair(NamedTuple):
    """One measured quantity of one block: m repeats, and the value of each of n members."""

    measured: experiment.Statistics
    repeats: dict[int, float]  # by replicate, ascending
    simulated: Floats  # by the members, NaN where one has none
    known: Floats  # of the members that have one
    limits: Interval  # of inside, as for a single run
    scatters: bool  # whether the repeats differ; equal ones only show that the scatter is below the reading
    name: str  # in a message
    head: Row  # first cells of its row in a table

    def between(self, ends: Interval) -> NDArray[np.bool_]:
        """Return for each member whether it lies between two ends, ends included; one without a value does not."""
        return (self.simulated >= ends[0]) & (self.simulated <= ends[1])


class Evidence(NamedTuple):
    """Input of the metrics."""

    members: Members
    u_num: float  # mm, standard uncertainty of the numerical solution
    pairs: tuple[SamplePair, ...]  # of block and quantity, in the order of the experiment's table
    lengths: tuple[SamplePair, ...]  # those of positions in mm, not of angles
    inside: NDArray[np.bool_]  # whether each member is within all measured ranges


def evidence_of(members: Members, table: experiment.ExperimentTable, u_num: float) -> Evidence:
    """Return the members of a sweep beside repeats. Raises InvalidInputError where they lack a measured quantity."""
    repeats: dict[tuple[str, str], dict[int, float]] = {}
    for one in sorted(table.measurements, key=lambda one: one.replicate):
        repeats.setdefault((one.block, one.quantity), {})[one.replicate] = one.value
    pairs = []
    for row in table.summaries():
        values = members.values(row.block, row.quantity)
        limits = compare.limits(row.quantity, row.mean, row.minimum, row.maximum)
        head: Row = {"block": row.block, "quantity": row.quantity, "unit": row.unit}
        name, known = f"{row.quantity} of block {row.block}", values[np.isfinite(values)]
        values_of, scatters = repeats[row.block, row.quantity], row.minimum < row.maximum
        pairs.append(SamplePair(row, values_of, values, known, limits, scatters, name, head))
    inside: NDArray[np.bool_] = np.all([pair.between(pair.limits) for pair in pairs], axis=0)
    return Evidence(members, u_num, tuple(pairs), tuple(one for one in pairs if one.measured.unit == "mm"), inside)


@dataclass(frozen=True)
class Findings:
    """The rows of a metric, and messages about what could not be computed."""

    rows: tuple[Row, ...]
    messages: tuple[str, ...] = ()


@dataclass(frozen=True)
class Metric:
    """One comparison of an ensemble with repeats: `meaning` is one line, `find` computes the rows."""

    name: str
    meaning: str
    columns: tuple[Datum, ...]
    find: Callable[[Evidence], Findings]


BLOCK = (
    Datum("block", "block", Form.TEXT, "name of the block"),
    Datum("quantity", "quantity", Form.TEXT, "measured quantity"),
    Datum("unit", "", Form.TEXT, "unit of the numbers: mm or deg"),
)

"""The members of an ensemble beside the repeats of an experiment, and what a metric of both is."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.analysis import compare, experiment
from blocksim.errors import InvalidInputError
from blocksim.scenario.spelling import list_names

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
            message = f"{self.source}: not the table of a sweep: no column {' and '.join(missing)}"
            raise InvalidInputError(message)
        if not self.finished.any():
            message = f"{self.source}: none of the {self.count} cases has finished; nothing to compare"
            raise InvalidInputError(message)

    @property
    def count(self) -> int:
        """The number of all members."""
        return len(self.table)

    @property
    def finished(self) -> "NDArray[np.bool_]":
        """Whether each member has a result, shape (count,)."""
        return (self.table["status"] == FINISHED).to_numpy(dtype=bool)

    @property
    def failures(self) -> tuple[Failure, ...]:
        """The members without a result, in the order of the table."""
        rows = np.flatnonzero(~self.finished)
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

    def has(self, block: str, quantity: str) -> bool:
        """Return True if the table has this quantity of this block."""
        return _column(block, quantity) in self.table

    def values(self, block: str, quantity: str) -> "NDArray[np.float64]":
        """Return one quantity of one block (mm or deg), shape (count,); NaN where a member has none.

        Raises InvalidInputError where the table has no such column, or a text in it.
        """
        import pandas as pd

        name = _column(block, quantity)
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
            message = f"{self.source}: {name}: '{column.iloc[row]}' in row {row + 1} is not a number"
            raise InvalidInputError(message)
        values = np.where(self.finished, numbers.to_numpy(dtype=float, na_value=np.nan), np.nan)
        return np.where(np.isfinite(values), values, np.nan)


def _column(block: str, quantity: str) -> str:
    return f"{block}.{experiment.QUANTITIES[quantity].final_column}"


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
class Column:
    """One number of a metric: its name for programs, its head in a table (none: not shown), its meaning."""

    name: str
    head: str
    form: Form
    meaning: str
    digits: int = 2


@dataclass(frozen=True, eq=False)
class Pair:
    """One measured quantity of one block: m repeats, and the value of each of n members (NaN: none)."""

    measured: experiment.Statistics
    repeats: dict[int, float]  # by replicate, ascending
    values: Floats = field(repr=False)

    @property
    def scatters(self) -> bool:
        """Whether the repeats differ; equal ones only show that the scatter is below the reading."""
        return self.measured.minimum < self.measured.maximum

    @property
    def known(self) -> Floats:
        """The values of the members that have one."""
        return self.values[np.isfinite(self.values)]

    @property
    def limits(self) -> Interval:
        """The limits of inside, as for a single run."""
        return compare.limits(self.measured.quantity, self.measured.mean, self.measured.minimum, self.measured.maximum)

    @property
    def inside(self) -> NDArray[np.bool_]:
        """Whether each member is inside the limits, ends included; a member without a value is not."""
        return self.between(self.limits)

    def between(self, ends: Interval) -> NDArray[np.bool_]:
        """Return for each member whether it lies between two ends, ends included."""
        return (self.values >= ends[0]) & (self.values <= ends[1])

    @property
    def name(self) -> str:
        """Its name in a message."""
        return f"{self.measured.quantity} of block {self.measured.block}"

    @property
    def head(self) -> Row:
        """The first cells of its row in a table."""
        return {"block": self.measured.block, "quantity": self.measured.quantity, "unit": self.measured.unit}


@dataclass(frozen=True, eq=False)
class Evidence:
    """Input of the metrics; `u_num` is the standard uncertainty (mm) of the numerical solution."""

    members: Members
    table: experiment.ExperimentTable
    u_num: float

    @cached_property
    def pairs(self) -> tuple[Pair, ...]:
        """All measured pairs of block and quantity, in the order of the experiment's table."""
        repeats: dict[tuple[str, str], dict[int, float]] = {}
        for one in sorted(self.table.measurements, key=lambda one: one.replicate):
            repeats.setdefault((one.block, one.quantity), {})[one.replicate] = one.value
        pairs = [(row, (row.block, row.quantity)) for row in self.table.summaries()]
        return tuple(Pair(row, repeats[pair], self.members.values(*pair)) for row, pair in pairs)

    @property
    def lengths(self) -> list[Pair]:
        """Those of positions in mm, not of angles."""
        return [pair for pair in self.pairs if pair.measured.unit == "mm"]

    @property
    def inside(self) -> NDArray[np.bool_]:
        """Whether each member is within all measured ranges."""
        inside: NDArray[np.bool_] = np.all([pair.inside for pair in self.pairs], axis=0)
        return inside


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
    columns: tuple[Column, ...]
    find: Callable[[Evidence], Findings]


BLOCK = (
    Column("block", "block", Form.TEXT, "name of the block"),
    Column("quantity", "quantity", Form.TEXT, "measured quantity"),
    Column("unit", "", Form.TEXT, "unit of the numbers: mm or deg"),
)


def complete_repeats(pairs: Sequence[Pair]) -> tuple[Floats, str]:
    """Return the replicates in which all p pairs were measured, shape (n, p), and a list of the others."""
    every = sorted({replicate for pair in pairs for replicate in pair.repeats})
    complete = [replicate for replicate in every if all(replicate in pair.repeats for pair in pairs)]
    rows = [[pair.repeats[replicate] for pair in pairs] for replicate in complete]
    others = list_names(sorted(set(every) - set(complete)), experiment.MOST_NAMES)
    return np.array(rows, dtype=float).reshape(len(rows), len(pairs)), others

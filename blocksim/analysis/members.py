"""The members of an ensemble, one a row of the table of a sweep."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from blocksim.analysis.experiment import QUANTITIES
from blocksim.errors import InvalidInputError

if TYPE_CHECKING:
    import pandas as pd
    from numpy.typing import NDArray

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
        ends = tuple(f".{quantity.final_column}" for quantity in QUANTITIES.values())
        names = (str(name) for name in self.table.columns)
        return tuple(dict.fromkeys(name.rpartition(".")[0] for name in names if name.endswith(ends)))

    def has(self, block: str, quantity: str) -> bool:
        """Return True if the table has this quantity of this block."""
        return _column(block, quantity) in self.table

    def values(self, block: str, quantity: str) -> "NDArray[np.float64]":
        """Return one quantity of one block (mm or deg), shape (count,); NaN where a member has none.

        Raises InvalidInputError where the table has no such column, or a text in it.
        """
        name = _column(block, quantity)
        if name not in self.table:
            message = (
                f"{self.source}: no column {name}, which the measured {quantity} of block '{block}' is compared with"
            )
            raise InvalidInputError(message)
        values = np.where(self.finished, self._numbers(name), np.nan)
        return np.where(np.isfinite(values), values, np.nan)

    def _numbers(self, name: str) -> "NDArray[np.float64]":
        import pandas as pd

        column = self.table[name]
        numbers = pd.to_numeric(column, errors="coerce")
        texts = np.flatnonzero(numbers.isna() & column.notna())
        if texts.size:
            row = int(texts[0])
            message = f"{self.source}: {name}: '{column.iloc[row]}' in row {row + 1} is not a number"
            raise InvalidInputError(message)
        return numbers.to_numpy(dtype=float, na_value=np.nan)


def _column(block: str, quantity: str) -> str:
    return f"{block}.{QUANTITIES[quantity].final_column}"

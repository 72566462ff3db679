"""The measured ranges that members of an ensemble are judged by, the same as those of `compare`."""

from collections.abc import Sequence
from dataclasses import dataclass

from blocksim.analysis.compare import limits
from blocksim.analysis.experiment import QUANTITIES, ExperimentTable
from blocksim.simulation.table import Columns


@dataclass(frozen=True)
class Range:
    """The limits of one measured quantity of one block (mm or degrees); `column` is its column in the final table."""

    block: str
    column: str
    lower: float
    upper: float

    def off_centre(self, value: float) -> float:
        """Return the distance from the middle in half-widths: at most 1 inside."""
        half = 0.5 * (self.upper - self.lower)
        return abs(value - 0.5 * (self.lower + self.upper)) / half

    def holds(self, value: float) -> bool:
        """Return True if a value is inside, ends included."""
        return self.lower <= value <= self.upper


def ranges_of(table: ExperimentTable) -> tuple[Range, ...]:
    """Return the limits of every measured quantity, as `compare` has them."""
    return tuple(
        Range(
            row.block, QUANTITIES[row.quantity].final_column, *limits(row.quantity, row.mean, row.minimum, row.maximum)
        )
        for row in table.summaries()
    )


def values_at(final: Columns, ranges: Sequence[Range]) -> list[float]:
    """Return the values of a final table (mm, degrees) that the ranges are about."""
    rows = {name: row for row, name in enumerate(final["block"])}
    return [float(final[one.column][rows[one.block]]) for one in ranges]


def are_inside(values: Sequence[float], ranges: Sequence[Range]) -> bool:
    """Return True if all values are inside their ranges."""
    return all(one.holds(value) for one, value in zip(ranges, values, strict=True))

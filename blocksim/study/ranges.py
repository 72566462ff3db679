"""Which cases of a sweep lie inside all measured ranges, told from its rows alone."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from blocksim.analysis.experiment import load_table
from blocksim.errors import InvalidInputError
from blocksim.study.targets import ranges_of

if TYPE_CHECKING:
    import pandas as pd

NUMBERS = "if"  # kinds of numpy


@dataclass(frozen=True)
class Ranges:
    """The limits (mm, degrees) of every measured quantity, by the name of its column in sweep.csv."""

    source: str
    limits: Mapping[str, tuple[float, float]]

    @classmethod
    def read(cls, table: Path | str) -> "Ranges":
        """Take the limits of an experiment table by the rules of `compare`. Raises what reading it raises."""
        measured = load_table(table)
        limits = {f"{one.block}.{one.column}": (one.lower, one.upper) for one in ranges_of(measured)}
        return cls(measured.source, limits)

    def hold(self, row: Mapping[str, object]) -> bool:
        """Return True if everything measured is inside; a block that a case does not have is not."""
        values = ((row.get(name), lower, upper) for name, (lower, upper) in self.limits.items())
        return all(isinstance(value, float) and lower <= value <= upper for value, lower, upper in values)

    def count(self, table: "pd.DataFrame") -> int:
        """Return how many rows of a table are inside. Raises InvalidInputError for no such block, or no numbers."""
        return sum(self.inside(table))

    def inside(self, table: "pd.DataFrame") -> list[bool]:
        """Tell of every row of a table whether it is inside. Raises as `count`."""
        missing = [name for name in self.limits if name not in table]
        if missing:
            message = f"{self.source} measures {missing[0]}, but the sweep has no such column"
            raise InvalidInputError(message)
        texts = [name for name in self.limits if table[name].dtype.kind not in NUMBERS and table[name].notna().any()]
        if texts:
            raise InvalidInputError(f"the column {texts[0]} of the sweep does not hold numbers only")
        inside = [table[name].between(lower, upper) for name, (lower, upper) in self.limits.items()]
        return [all(row) for row in zip(*inside, strict=True)]

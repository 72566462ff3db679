"""What the members at one intensity came to."""

import math
from dataclasses import dataclass

from blocksim.analysis.intervals import interval


@dataclass(frozen=True)
class Point:
    """One intensity: members with a result, those that failed, and the exact limits of the probability."""

    intensity: float
    members: int
    failures: int
    moving_on: int  # of those that have not failed: their runs end while blocks move
    no_result: int  # members whose runs did not finish; they count nowhere else

    @property
    def share(self) -> float:
        """Failures of all members with a result, NaN where there are none."""
        return self.failures / self.members if self.members else math.nan

    @property
    def limits(self) -> tuple[float, float]:
        """95 % limits after Clopper and Pearson, whatever the intensities beside this one came to."""
        return interval(self.failures, self.members)

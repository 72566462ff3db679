"""How well an ensemble agrees with the repeats: the probability of being inside all ranges, and a guide towards it.

Every quantity of a member is measured from the middle of its range in half-widths of the range: r <= 1 is inside. The
ranges are those of `compare` (the smallest and the largest repeat, 5 degrees either side for rotations, 0.5 mm for
repeats that are all equal). With M members, of which those with every r <= 1 are a share P, the score of an ensemble is

    score = P - mean(miss) / (2 M)

    miss = max(r) - 1           in [-1, 0]  for a member inside: how near it is to the nearest limit
         = mean(max(0, 1 - 1/r)) in (0, 1)   for a member outside: how far, over its quantities; saturates
         = 1                                for a member that failed

Where no member is inside, the probability is 0 all around and says nothing; there the miss leads on. Where all are
inside, it leads to the middle of the region. It never outweighs the probability: two ensembles whose P differ do so
by at least 1/M, and their mean misses by less than 2, so by less than 1/M in the score. Both parts of the miss are
0 at the limit, so that it grows steadily as a member moves outwards.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import isfinite, nan
from statistics import median

from blocksim.analysis.proportion import interval
from blocksim.study.members import Member
from blocksim.study.targets import Range, are_inside, values_at

FAILED = 1.0


@dataclass(frozen=True)
class Score:
    """What the members of one ensemble come to."""

    members: int
    inside: int
    failed: int
    miss: float  # mean over all members

    @property
    def share_inside(self) -> float:
        """Share of all members, also of failed ones, that are inside all ranges."""
        return self.inside / self.members

    @property
    def value(self) -> float:
        """The number to be maximised."""
        return self.share_inside - self.miss / (2.0 * self.members)

    @property
    def interval(self) -> tuple[float, float]:
        """95 % limits (Clopper-Pearson) of the probability behind this share, for members drawn independently."""
        return interval(self.inside, self.members)


@dataclass(frozen=True)
class Hit:
    """How one measured quantity agrees: where the members end (mm or degrees), and the share that is inside."""

    range: Range
    median: float  # of the finished members; NaN where there is none
    share_inside: float  # of all members


def hits_of(members: Sequence[Member], ranges: Sequence[Range]) -> tuple[Hit, ...]:
    """Look at each quantity by itself, for at least one member."""
    finals = [member.final for member in members if member.final is not None]
    values = [values_at(final, ranges) for final in finals]
    columns = [[row[i] for row in values if isfinite(row[i])] for i in range(len(ranges))]
    return tuple(
        Hit(one, median(column) if column else nan, sum(map(one.holds, column)) / len(members))
        for one, column in zip(ranges, columns, strict=True)
    )


def score_of(members: Iterable[Member], ranges: Sequence[Range]) -> Score:
    """Judge an ensemble of at least one member."""
    judged = [_judged(member, ranges) for member in members]
    return Score(
        members=len(judged),
        inside=sum(miss <= 0.0 for miss, _ in judged),
        failed=sum(failed for _, failed in judged),
        miss=sum(miss for miss, _ in judged) / len(judged),
    )


def _judged(member: Member, ranges: Sequence[Range]) -> tuple[float, bool]:
    """Return the miss of a member, and whether it failed."""
    if member.final is None:
        return FAILED, True
    values = values_at(member.final, ranges)
    return (miss_of(values, ranges), False) if all(map(isfinite, values)) else (FAILED, True)


def miss_of(values: Sequence[float], ranges: Sequence[Range]) -> float:
    """Return how far a member is from being inside (above 0) or from the nearest limit (at most 0)."""
    off = [one.off_centre(value) for one, value in zip(ranges, values, strict=True)]
    if are_inside(values, ranges):
        return min(max(off) - 1.0, 0.0)
    outside = [0.0 if one.holds(value) else _beyond(r) for one, value, r in zip(ranges, values, off, strict=True)]
    return sum(outside) / len(outside)


def _beyond(off: float) -> float:
    """Return how far outside, from 0 at the limit to 1; above 0 also where rounding hides by how much."""
    return max(1.0 - 1.0 / off, 1e-15)

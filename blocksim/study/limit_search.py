"""The search for the values of a key at which what a run says changes: which values to try next, from those known.

First a scan of evenly spaced values, as there may be more than one change. What rocks under a moving support may fall
in an island between two of them: so the scan is denser, down to a quarter of its spacing, beside values at which the
largest rotation is larger than at both neighbours. Narrower islands are not seen. Then every pair of neighbours with
different verdicts is divided in three, until it is as narrow as wanted. Two values a round and change, not one: they
run side by side, and four rounds narrow a bracket 81 times. What is tried depends on the answers of whole rounds alone,
so neither on the number of threads nor on when a search was stopped and resumed.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Generic, TypeVar

Kind = TypeVar("Kind")
DIGITS = 12  # of a value that is tried: what people read is what was run
PARTS = 3
HALVINGS = 2  # of the spacing of a scan, beside a peak
OUTWARD = 2.0  # widths of what is known, by which a search near a value goes on beyond it
FLOOR = 1e-6  # of the range: brackets about zero get no narrower
Number = float  # in the unit of the range


@dataclass(frozen=True)
class Span:
    """The range of a key in the unit in which it was typed, and how many values are scanned first."""

    low: float
    high: float
    count: int
    is_log: bool = False
    is_whole: bool = False

    def scanned(self) -> list[Number]:
        """Return the values of the first round, ends included; whole numbers each once."""
        return list(dict.fromkeys(self._at(i / (self.count - 1)) for i in range(self.count)))

    def between(self, low: Number, high: Number) -> list[Number]:
        """Return the values that divide a bracket, without its ends."""
        inner = Span(low, high, PARTS + 1, self.is_log, self.is_whole).scanned()
        return [value for value in inner if low < value < high]

    def middle(self, low: Number, high: Number) -> Number:
        """Return the value half way between two."""
        return Span(low, high, 3, self.is_log, self.is_whole).scanned()[1]

    def is_scanned_enough(self, low: Number, high: Number) -> bool:
        """Return True if two values are so near each other that no other is tried beside a peak."""
        if self.is_whole and high - low <= 1.0:
            return True
        share = math.log(high / low) / math.log(self.high / self.low) if self.is_log else (high - low) / self.width
        return share * (self.count - 1) < 1.5 * 0.5**HALVINGS

    @property
    def spacing(self) -> float:
        """Distance of two values of the first round."""
        return self.width / (self.count - 1)

    @property
    def width(self) -> float:
        """Length of the range."""
        return self.high - self.low

    def _at(self, share: float) -> Number:
        if share in (0.0, 1.0):
            value = self.high if share else self.low
        elif self.is_log:
            value = self.low * (self.high / self.low) ** share
        else:
            value = self.low + (self.high - self.low) * share
        return float(round(value)) if self.is_whole else float(f"{value:.{DIGITS}g}")

    def fitted(self, value: float) -> Number:
        """Return a value as it is tried, the nearest within the range."""
        return float(f"{min(max(value, self.low), self.high):.{DIGITS}g}")

    def is_narrow(self, low: Number, high: Number, tolerance: float) -> bool:
        """Return True if a bracket is as narrow as wanted, relative to its ends; of whole numbers: neighbours."""
        if self.is_whole:
            return high - low <= 1.0
        size = max(abs(low), abs(high), FLOOR * (self.high - self.low) / tolerance)
        return high - low <= tolerance * size or not self.between(low, high)


@dataclass(frozen=True)
class Change(Generic[Kind]):
    """Two neighbours among the values that were tried, with different answers."""

    low: Number
    high: Number
    below: Kind
    above: Kind


def changes_in(known: Mapping[Number, Kind]) -> list[Change[Kind]]:
    """Return all changes between neighbours, from the smallest value up."""
    return [
        Change(low, high, known[low], known[high]) for low, high in pairwise(sorted(known)) if known[low] != known[high]
    ]


def next_values(
    span: Span, known: Mapping[Number, Kind], tolerance: float, peaks: Mapping[Number, float] | None = None
) -> list[Number]:
    """Return the values to try next; none when every change is as narrow as wanted.

    `peaks` are the largest rotations at those known values at which the scan may have to be denser.
    """
    scan = [value for value in span.scanned() if value not in known]
    scan = scan or _beside_peaks(span, known, peaks or {})
    if scan:
        return scan
    wide = (one for one in changes_in(known) if not span.is_narrow(one.low, one.high, tolerance))
    return [value for one in wide for value in span.between(one.low, one.high)]


def _beside_peaks(span: Span, known: Mapping[Number, Kind], peaks: Mapping[Number, float]) -> list[Number]:
    """Return the values half way to both neighbours of those with a larger peak, and the same answer."""
    values = sorted(known)
    found: list[Number] = []
    for low, here, high in zip(values, values[1:], values[2:], strict=False):
        is_alike = known[low] == known[here] == known[high] and {low, here, high} <= peaks.keys()
        if is_alike and peaks[low] < peaks[here] > peaks[high]:
            wide = (pair for pair in ((low, here), (here, high)) if not span.is_scanned_enough(*pair))
            found += [span.middle(*pair) for pair in wide]
    return [value for value in dict.fromkeys(found) if value not in known]


def next_near(span: Span, known: Mapping[Number, Kind], near: Change[Kind], tolerance: float) -> list[Number]:
    """Return the values to try next where a change is expected near a bracket, that of `near`, and nothing is scanned.

    First its ends, then on in the direction in which the change must be until it is passed, by more every time, and
    then as `next_values`. None when the change is as narrow as wanted, and where there is no such change in the range.
    """
    if not known:
        return list(dict.fromkeys(span.fitted(value) for value in (near.low, near.high)))
    changes = changes_in(known)
    if not changes:
        return [value for value in _beyond(span, known, near, tolerance) if value not in known]
    (first, *others) = changes
    if others or (first.below, first.above) != (near.below, near.above):
        return []
    return [] if span.is_narrow(first.low, first.high, tolerance) else span.between(first.low, first.high)


def _beyond(span: Span, known: Mapping[Number, Kind], near: Change[Kind], tolerance: float) -> list[Number]:
    """Return the next value outwards of values with the same answer, on the side where the other one must be."""
    low, high = min(known), max(known)
    width = OUTWARD * ((high - low) or tolerance * abs(high))
    if known[low] == near.below:
        return [span.fitted(high + width)]
    return [span.fitted(low - width)] if known[low] == near.above else []

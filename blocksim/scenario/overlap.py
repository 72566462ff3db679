"""Overlap of placed rectangles with one another, the ground and walls, exactly (separating axes)."""

import math
from collections.abc import Callable, Iterator, Sequence
from operator import attrgetter
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from blocksim.scenario.placement import PlacedBody
from blocksim.scenario.segments import TOLERANCE, PlacedSegment

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Pairs = tuple[Integers, Integers]

MOST_AT_ONCE = 1_000_000
"""Pairs that are examined together; more only takes more memory."""
FEW = 32
"""Number of boxes up to which all pairs are examined; sorting into cells would take longer."""
ROOM = 1.01


class Rectangles(NamedTuple):
    """Centres, half extents and directions of rectangles, each (n,)."""

    x: Floats
    y: Floats
    half_x: Floats
    half_y: Floats
    cosine: Floats
    sine: Floats

    @classmethod
    def of(cls, bodies: Sequence[PlacedBody]) -> Self:
        """Take the outlines of placed bodies."""
        x, y, size_x, size_y = (_column(bodies, attrgetter(name)) for name in ("x", "y", "size_x", "size_y"))
        # math, as numpy's functions may differ in the last digit
        cosine, sine = (np.fromiter((of(body.angle) for body in bodies), np.float64) for of in (math.cos, math.sin))
        return cls(x, y, 0.5 * size_x, 0.5 * size_y, cosine, sine)

    @classmethod
    def along(cls, segments: Sequence[PlacedSegment]) -> Self:
        """Take straight pieces as rectangles without height."""
        ends = np.array([(s.x0, s.y0, s.x1, s.y1, s.length) for s in segments], dtype=np.float64).reshape(-1, 5)
        x0, y0, x1, y1, length = ends.T
        return cls(0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.5 * length, 0.0 * length, (x1 - x0) / length, (y1 - y0) / length)

    def some(self, indices: Integers) -> Self:
        """Take some of them, in this order."""
        return type(self)(*(values[indices] for values in self))

    def half_extent(self, axis_x: Floats | float, axis_y: Floats | float) -> Floats:
        """Half of the extents along unit vectors."""
        along = np.abs(axis_x * self.cosine + axis_y * self.sine)
        across = np.abs(axis_y * self.cosine - axis_x * self.sine)
        return self.half_x * along + self.half_y * across

    @property
    def bottom(self) -> Floats:
        """Heights of the lowest corners."""
        return self.y - self.half_extent(0.0, 1.0)


def _column(bodies: Sequence[PlacedBody], value: Callable[[PlacedBody], float]) -> Floats:
    return np.fromiter(map(value, bodies), np.float64, len(bodies))


def penetration(ones: Rectangles, others: Rectangles) -> Floats:
    """Return the penetration depths (m) of pairs of rectangles; zero or negative where they are apart."""
    x, y = others.x - ones.x, others.y - ones.y
    axes = [axis for r in (ones, others) for axis in ((r.cosine, r.sine), (-r.sine, r.cosine))]
    depths = [ones.half_extent(*axis) + others.half_extent(*axis) - np.abs(x * axis[0] + y * axis[1]) for axis in axes]
    least: Floats = np.min(depths, axis=0)
    return least


def overlapping_pairs(bodies: Sequence[PlacedBody]) -> Iterator[tuple[int, int, float]]:
    """Yield the indices (smaller first) of every overlapping pair and its penetration in m."""
    yield from _penetrating(Rectangles.of(bodies), len(bodies), within=True)


def crossings(bodies: Sequence[PlacedBody], segments: Sequence[PlacedSegment]) -> Iterator[tuple[int, int, float]]:
    """Yield the body, the segment and the depth (m) where a body lies across a segment."""
    if not segments:
        return
    outlines, pieces = Rectangles.of(bodies), Rectangles.along(segments)
    both = Rectangles(*(np.concatenate(values) for values in zip(outlines, pieces, strict=True)))
    for body, piece, depth in _penetrating(both, len(bodies), within=False):
        yield body, piece - len(bodies), depth


def _penetrating(rectangles: Rectangles, bodies: int, *, within: bool) -> Iterator[tuple[int, int, float]]:
    """Yield the pairs among the first `bodies` rectangles, or of one of them and one of the others, that penetrate."""
    for one, other in near_pairs(rectangles):
        first, second = np.minimum(one, other), np.maximum(one, other)
        wanted = second < bodies if within else (first < bodies) & (second >= bodies)
        first, second = first[wanted], second[wanted]
        depth = penetration(rectangles.some(first), rectangles.some(second))
        deep = depth > TOLERANCE
        yield from zip(first[deep].tolist(), second[deep].tolist(), depth[deep].tolist(), strict=True)


class _Boxes(NamedTuple):
    """Axis-parallel boxes, each (n,)."""

    low_x: Floats
    low_y: Floats
    high_x: Floats
    high_y: Floats


def near_pairs(rectangles: Rectangles) -> Iterator[Pairs]:
    """Yield the indices of all pairs whose axis-parallel boxes meet, each pair once, many at a time.

    Sorted into cells as large as the largest box, a box reaches over four cells at most. Boxes of very different sizes
    would share one cell, so every size (from one power of two to the next) has cells of its own, in which the boxes of
    that size meet one another and all smaller ones.
    """
    extent_x, extent_y = rectangles.half_extent(1.0, 0.0), rectangles.half_extent(0.0, 1.0)
    x, y = rectangles.x, rectangles.y
    boxes = _Boxes(x - extent_x, y - extent_y, x + extent_x, y + extent_y)
    if x.size <= FEW:
        one, other = np.triu_indices(x.size, 1)
        near = _intersect(boxes, one, other)
        yield one[near], other[near]
        return
    level = np.frexp(np.maximum(extent_x, extent_y))[1]
    for size in np.unique(level):
        members = np.flatnonzero(level <= size)
        is_small = level[members] < size
        cell = (_cell(extent_x[members]), _cell(extent_y[members]))
        for one, other in _in_cells(_Boxes(*(side[members] for side in boxes)), is_small, cell):
            yield members[one], members[other]


def _cell(half_extent: Floats) -> float:
    """Return the side (m) of cells of which no box touches three: a little more than the largest box."""
    return 2.0 * ROOM * float(half_extent.max()) or 1.0


def _in_cells(boxes: _Boxes, is_small: NDArray[np.bool_], cell: tuple[float, float]) -> Iterator[Pairs]:
    """Yield pairs of boxes that meet, at least one of each not small; no box is larger than a cell (m, m)."""
    with np.errstate(over="ignore"):  # places beyond the last number share a cell
        low = np.floor(boxes.low_x / cell[0]), np.floor(boxes.low_y / cell[1])
        high = np.floor(boxes.high_x / cell[0]), np.floor(boxes.high_y / cell[1])
    box, column, row = _entries(low, high)
    order = np.lexsort((is_small[box], row, column))
    box, column, row = box[order], column[order], row[order]
    is_new = (column[1:] != column[:-1]) | (row[1:] != row[:-1])
    begins = np.append(0, np.flatnonzero(is_new) + 1)
    ends = np.repeat(np.append(begins[1:], box.size), np.diff(np.append(begins, box.size)))
    partners = np.where(is_small[box], 0, ends - np.arange(box.size) - 1)
    for one, other in _expanded(partners):
        i, j = box[one], box[other]
        # a pair may meet in several cells; it counts in that of the lower left corner of what it has in common
        is_first = (np.maximum(low[0][i], low[0][j]) == column[one]) & (np.maximum(low[1][i], low[1][j]) == row[one])
        near = is_first & _intersect(boxes, i, j)
        yield i[near], j[near]


def _intersect(boxes: _Boxes, i: Integers, j: Integers) -> NDArray[np.bool_]:
    """Return for each two boxes whether they touch or overlap."""
    along = (boxes.low_x[i] <= boxes.high_x[j]) & (boxes.low_x[j] <= boxes.high_x[i])
    across = (boxes.low_y[i] <= boxes.high_y[j]) & (boxes.low_y[j] <= boxes.high_y[i])
    return along & across


def _entries(low: tuple[Floats, Floats], high: tuple[Floats, Floats]) -> tuple[Integers, Floats, Floats]:
    """Return box, column and row of every cell that a box reaches into."""
    everyone = np.arange(low[0].size)
    found = []
    for columns in (low[0], high[0]):
        for rows in (low[1], high[1]):
            is_new = ((columns is low[0]) | (high[0] != low[0])) & ((rows is low[1]) | (high[1] != low[1]))
            found.append((everyone[is_new], columns[is_new], rows[is_new]))
    box, column, row = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return box, column, row


def _expanded(partners: Integers) -> Iterator[Pairs]:
    """Yield positions one and other, other = one + 1 ... one + partners[one], in batches."""
    total = np.cumsum(partners)
    begin = 0
    while begin < partners.size:
        done = int(total[begin - 1]) if begin else 0
        end = max(begin + 1, int(np.searchsorted(total, done + MOST_AT_ONCE, side="right")))
        count = partners[begin:end]
        one = np.repeat(np.arange(begin, end), count)
        before = np.repeat(np.cumsum(count) - count, count)
        yield one, one + 1 + np.arange(one.size) - before
        begin = end

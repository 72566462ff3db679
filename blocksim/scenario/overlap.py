"""Overlap of placed blocks with one another, the ground and walls, exactly (separating axes); which rest on nothing."""

import functools
import math
from collections.abc import Iterator, Sequence
from operator import attrgetter
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from blocksim.scenario import geometry, placement
from blocksim.scenario.models.scenario import Scenario

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Pairs = tuple[Integers, Integers]

MOST_AT_ONCE = 1_000_000  # pairs that are examined together; more only takes more memory
FEW = 32  # number of boxes up to which all pairs are examined; sorting them would take longer
FARTHEST = 10**12  # strips; what is beyond shares one
RECTANGLE = -1  # number of the polygon of what is a rectangle
POLYGONS_AT_ONCE = 10_000  # pairs with a polygon that are examined together; each takes up to 2 kB


class Outlines(NamedTuple):
    """Outlines of n bodies or straight pieces: rectangles, and polygons in boxes along their own axes."""

    x: Floats  # (n,) middles, half extents and directions of the rectangles or boxes, SI
    y: Floats
    half_x: Floats
    half_y: Floats
    cosine: Floats
    sine: Floats
    kinds: Integers  # (n,) number of the polygon, RECTANGLE for none
    polygons: Floats  # (s, k, 2) corners (m) along these axes from the middle of the box, the last one repeated

    @classmethod
    def of(cls, bodies: Sequence[placement.PlacedBody]) -> Self:
        """Take those of placed bodies."""
        names = ("x", "y", "size_x", "size_y")
        x, y, size_x, size_y = (np.fromiter(map(attrgetter(one), bodies), np.float64, len(bodies)) for one in names)
        # math, as numpy's functions may differ in the last digit
        cosine, sine = (np.fromiter((of(body.angle) for body in bodies), np.float64) for of in (math.cos, math.sin))
        numbers: dict[geometry.Corners, int] = {(): RECTANGLE}
        kind_of = (numbers.setdefault(body.outline, len(numbers) - 1) for body in bodies)
        kinds = np.fromiter(kind_of, np.int64, len(bodies))
        for index in np.flatnonzero(kinds != RECTANGLE).tolist():
            middle_x, middle_y = geometry.middle_of(bodies[index].outline)
            x[index] += cosine[index] * middle_x - sine[index] * middle_y
            y[index] += sine[index] * middle_x + cosine[index] * middle_y
        return cls(x, y, 0.5 * size_x, 0.5 * size_y, cosine, sine, kinds, _table([*numbers][1:]))

    @classmethod
    def along(cls, segments: Sequence[placement.PlacedSegment]) -> Self:
        """Take straight pieces as rectangles without height."""
        ends = np.array([(s.x0, s.y0, s.x1, s.y1, s.length) for s in segments], dtype=np.float64).reshape(-1, 5)
        x0, y0, x1, y1, length = ends.T
        middles, halves = (0.5 * (x0 + x1), 0.5 * (y0 + y1)), (0.5 * length, 0.0 * length)
        return cls.rectangles(*middles, *halves, (x1 - x0) / length, (y1 - y0) / length)

    @classmethod
    def rectangles(cls, *boxes: Floats) -> Self:
        """Take rectangles alone: their middles, half extents, cosines and sines."""
        x, y, half_x, half_y, cosine, sine = boxes
        return cls(x, y, half_x, half_y, cosine, sine, np.full(x.size, RECTANGLE), _table([]))

    def half_extent(self, axis_x: Floats | float, axis_y: Floats | float) -> Floats:
        """Half of the extents of the boxes along unit vectors."""
        along = np.abs(axis_x * self.cosine + axis_y * self.sine)
        across = np.abs(axis_y * self.cosine - axis_x * self.sine)
        return self.half_x * along + self.half_y * across

    def and_pieces(self, pieces: "Outlines") -> "Outlines":
        """Return these and rectangles after them."""
        both = {name: np.concatenate([getattr(self, name), getattr(pieces, name)]) for name in self._fields[:-1]}
        return self._replace(**both)

    def some(self, indices: Integers) -> "Outlines":
        """Take some of them, in this order."""
        return self._replace(**{name: getattr(self, name)[indices] for name in self._fields[:-1]})

    def corners(self) -> Floats:
        """Return all corners (m), counter-clockwise, the last one repeated, (n, k, 2) with k of at least 4."""
        count = max(4, self.polygons.shape[1])
        signs = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), *[(-1.0, 1.0)] * (count - 3)])
        local = signs * np.stack([self.half_x, self.half_y], axis=-1)[:, None]
        polygon = self.kinds != RECTANGLE
        local[polygon] = self.polygons[self.kinds[polygon]]
        cosine, sine = self.cosine[:, None], self.sine[:, None]
        x = self.x[:, None] + cosine * local[..., 0] - sine * local[..., 1]
        y = self.y[:, None] + sine * local[..., 0] + cosine * local[..., 1]
        return np.stack([x, y], axis=-1)

    @property
    def bottom(self) -> Floats:
        """Heights of the lowest corners."""
        lowest = self.y - self.half_extent(0.0, 1.0)
        polygon = np.flatnonzero(self.kinds != RECTANGLE)
        for begin in range(0, polygon.size, POLYGONS_AT_ONCE):
            some = polygon[begin : begin + POLYGONS_AT_ONCE]
            lowest[some] = self.some(some).corners()[..., 1].min(axis=1)
        return lowest


def _table(polygons: Sequence[geometry.Corners]) -> Floats:
    """Return corners (m) from the middles of their boxes, (s, k, 2), the last ones repeated up to a common number."""
    if not polygons:
        return np.zeros((0, 4, 2))
    most = max(4, *map(len, polygons))
    full = [(*corners, *corners[-1:] * (most - len(corners))) for corners in polygons]
    middles = [geometry.middle_of(corners) for corners in polygons]
    table: Floats = np.array(full) - np.array(middles)[:, None]
    return table


def penetration(ones: Outlines, others: Outlines) -> Floats:
    """Return the penetration depths (m) of pairs of outlines; zero or negative where they are apart."""
    x, y = others.x - ones.x, others.y - ones.y
    axes = [axis for r in (ones, others) for axis in ((r.cosine, r.sine), (-r.sine, r.cosine))]
    reaches = (ones.half_extent(*axis) + others.half_extent(*axis) - np.abs(x * axis[0] + y * axis[1]) for axis in axes)
    depth: Floats = np.min([*reaches], axis=0)
    polygon = np.flatnonzero(((ones.kinds != RECTANGLE) | (others.kinds != RECTANGLE)) & (depth > 0.0))
    for begin in range(0, polygon.size, POLYGONS_AT_ONCE):
        some = polygon[begin : begin + POLYGONS_AT_ONCE]
        corners, behind = ones.some(some).corners(), others.some(some).corners()
        depth[some] = np.minimum(_least_reach(corners, behind), _least_reach(behind, corners))
    return depth


def _least_reach(ones: Floats, others: Floats) -> Floats:
    """Return how far (m) other corners (m, k, 2) reach behind the edge of ones behind which they reach least."""
    normals, is_edge = geometry.outward_normals(ones)
    offsets = np.einsum("mec,mec->me", normals, ones - ones[:, :1])
    farthest = np.einsum("mec,mkc->mek", normals, others - ones[:, :1]).min(axis=2)
    least: Floats = np.where(is_edge, offsets - farthest, np.inf).min(axis=1)
    return least


def pairs_within(outlines: Outlines, reach: float) -> tuple[Integers, Integers, Floats]:
    """Return the indices of all pairs of outlines that are no farther apart than a reach (m), and their distances."""
    wider = outlines._replace(half_x=outlines.half_x + 0.5 * reach, half_y=outlines.half_y + 0.5 * reach)
    found: list[tuple[Integers, Integers, Floats]] = [(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0))]
    for first, second in near_pairs(wider):
        depth = penetration(outlines.some(first), outlines.some(second))  # apart no more than the distance
        are_boxes = (outlines.kinds[first] == RECTANGLE) & (outlines.kinds[second] == RECTANGLE)
        gaps = np.where((depth > 0.0) | (are_boxes & (depth > -placement.TOLERANCE)), 0.0, -depth)
        apart = np.flatnonzero(((gaps > 0.0) | ~are_boxes & (depth == 0.0)) & (gaps <= reach))
        for begin in range(0, apart.size, POLYGONS_AT_ONCE):
            some = apart[begin : begin + POLYGONS_AT_ONCE]
            corners, behind = outlines.some(first[some]).corners(), outlines.some(second[some]).corners()
            gaps[some] = np.minimum(_least_distance(corners, behind), _least_distance(behind, corners))
        found.append((first[gaps <= reach], second[gaps <= reach], gaps[gaps <= reach]))
    one, other, gaps = (np.concatenate(part) for part in zip(*found, strict=True))
    return one, other, gaps


def _least_distance(ones: Floats, others: Floats) -> Floats:
    """Return the least distances (m) of the edges of ones from the corners (m, k, 2) of others."""
    along = np.roll(ones, -1, axis=1) - ones
    beyond = others[:, None] - ones[:, :, None]
    square = np.maximum(np.sum(along * along, axis=-1), np.finfo(np.float64).tiny)
    share = np.clip(np.einsum("mec,mekc->mek", along, beyond) / square[..., None], 0.0, 1.0)
    least: Floats = np.linalg.norm(beyond - share[..., None] * along[:, :, None], axis=-1).min(axis=(1, 2))
    return least


def overlapping_pairs(
    bodies: Sequence[placement.PlacedBody], segments: Sequence[placement.PlacedSegment] | None = None
) -> Iterator[tuple[int, int, float]]:
    """Yield the indices (smaller first) and the penetration (m) of every two bodies that overlap.

    With segments those of bodies and of the segments that they lie across, and nothing else.
    """
    if segments is not None and not segments:
        return
    outlines = Outlines.of(bodies)
    if segments is not None:
        outlines = outlines.and_pieces(Outlines.along(segments))
    for one, other in near_pairs(outlines):
        first, second = np.minimum(one, other), np.maximum(one, other)
        if segments is not None:
            wanted = (first < len(bodies)) & (second >= len(bodies))
            first, second = first[wanted], second[wanted]
        depth = penetration(outlines.some(first), outlines.some(second))
        deep = depth > placement.TOLERANCE
        begin = 0 if segments is None else len(bodies)
        yield from zip(first[deep].tolist(), (second[deep] - begin).tolist(), depth[deep].tolist(), strict=True)


def level_strips(low: Floats, high: Floats) -> tuple[Integers, Integers, Integers, float]:
    """Return boxes once for every level strip that they reach into, it, all lowest ones, and how high strips are (m).

    That is as high as boxes are in the mean, so that all sizes together reach into three a box at most.
    """
    height = float((high - low).mean()) if (high > low).any() else 1.0
    with np.errstate(over="ignore"):
        first, last = (np.clip(np.floor(end / height), -FARTHEST, FARTHEST).astype(int) for end in (low, high))
    counts = last - first + 1
    box = np.repeat(np.arange(counts.size), counts)
    return box, first[box] + np.arange(box.size) - np.repeat(np.cumsum(counts) - counts, counts), first, height


def near_pairs(outlines: Outlines) -> Iterator[Pairs]:
    """Yield the indices of all pairs whose axis-parallel boxes meet, each pair once, many at a time.

    In a level strip, sorted by their left ends, those that follow a box up to its right end meet it along x.
    """
    half_x, half_y = outlines.half_extent(1.0, 0.0), outlines.half_extent(0.0, 1.0)
    left, right, low, high = outlines.x - half_x, outlines.x + half_x, outlines.y - half_y, outlines.y + half_y
    if left.size <= FEW:
        i, j = _all_pairs(left.size)
        is_near = (left[i] <= right[j]) & (left[j] <= right[i]) & (low[i] <= high[j]) & (low[j] <= high[i])
        yield i[is_near], j[is_near]
        return
    box, strip, first, _ = level_strips(low, high)
    ends = np.concatenate([left[box], right[box]])
    order = np.lexsort((np.repeat([0, 1], box.size), ends, np.tile(strip, 2)))
    is_left = order < box.size
    begun = np.cumsum(is_left)  # boxes whose left end comes no later than an end, in all strips up to that
    followed = np.empty(box.size, int)
    followed[order[~is_left] - box.size] = begun[~is_left]
    order = order[is_left]
    box, strip, partners = box[order], strip[order], followed[order] - np.arange(box.size) - 1
    for one, other in _expanded(partners):
        i, j = box[one], box[other]  # they may share several strips; they count in the lowest one
        is_near = (strip[one] == np.maximum(first[i], first[j])) & (low[i] <= high[j]) & (low[j] <= high[i])
        yield i[is_near], j[is_near]


@functools.cache
def _all_pairs(count: int) -> Pairs:
    """Return the indices of all pairs among so many; kept, as numpy takes longer for them than for all the rest."""
    one, other = np.triu_indices(count, 1)
    return one, other


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


TOUCHING = 1e-3
"""Of the least width of all blocks: a wider gap is no joint; a block that falls through it lands at some cm/s."""
CARRIED = -1
MOST_NAMED = 5


def unsupported(scenario: Scenario, placed: Sequence[placement.PlacedBody], near: float) -> tuple[list[int], float]:
    """Return the numbers of free blocks that rest on nothing, directly or over others, and the least gap (m) below it.

    Blocks touch within a distance `near` (m). Those that move at the start are thrown, and need no support; what soil
    surrounds has it.
    """
    segments = placement.place_segments(scenario)
    pieces = [Outlines.along(segments)] if segments else []
    for soil in placement.soil_tables(scenario):
        low, high = np.array(geometry.box_of(soil.corners.tolist()))
        middle, half = 0.5 * (low + high)[:, None], 0.5 * (high - low)[:, None]
        pieces.append(Outlines.rectangles(*middle, *half, np.ones(1), np.zeros(1)))
    outlines = Outlines.of(placed)
    for piece in pieces:
        outlines = outlines.and_pieces(piece)
    labels = np.arange(outlines.x.size)
    labels[len(placed) :] = CARRIED
    labels[: len(placed)][[body.fixed or bool(body.vx or body.vy or body.spin) for body in placed]] = CARRIED
    is_level = scenario.ground.profile is None
    heights = outlines.bottom if is_level else np.full(labels.size, np.inf)
    labels[heights <= near] = CARRIED
    one, other, _ = pairs_within(outlines, near)
    labels = spread(labels, one, other)
    loose = np.flatnonzero(labels != CARRIED)
    if not loose.size:
        return [], 0.0
    least, reach = float(heights[loose].min()), placement.smallest_width(placed)
    extent = float(max(np.ptp(outlines.x), np.ptp(outlines.y))) + float(outlines.half_extent(1.0, 1.0).max())
    while True:
        one, other, gaps = pairs_within(outlines, reach)
        least = min(least, float(gaps[labels[one] != labels[other]].min(initial=np.inf)))
        if least <= reach or reach > extent:
            return loose.tolist(), least
        reach *= 4.0  # times the reach, from one search for the nearest neighbour to the next


def spread(labels: Integers, one: Integers, other: Integers) -> Integers:
    """Return one label for all that touch, directly or over others: the least number among them, or CARRIED."""
    roots = np.append(0, labels - CARRIED)  # the first is what carries
    while True:
        ends = roots[one + 1], roots[other + 1]
        low, high = np.minimum(*ends), np.maximum(*ends)
        if (low == high).all():
            return roots[1:] + CARRIED
        np.minimum.at(roots, high, low)
        while (roots[roots] != roots).any():
            roots = roots[roots]


def support_warning(scenario: Scenario, placed: Sequence[placement.PlacedBody]) -> str:
    """Return a warning of blocks that fall at the start as they touch nothing below them; empty if there are none."""
    if not scenario.gravity.size or not placed:
        return ""
    loose, gap = unsupported(scenario, placed, TOUCHING * placement.smallest_width(placed))
    if not loose:
        return ""
    free, names = sum(not body.fixed for body in placed), [placed[number].name for number in loose[:MOST_NAMED]]
    more = f" and {len(loose) - MOST_NAMED} more" if len(loose) > MOST_NAMED else ""
    which = f"{len(loose)} of {free} free blocks: {', '.join(names)}{more}"
    size = f"{gap:.4g} m" if gap >= 1.0 else f"{1e3 * gap:.4g} mm"
    return f"nothing supports {which}; nearest gap {size}, through which they fall at the start"

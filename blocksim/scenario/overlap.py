"""Which placed rectangles overlap, and which reach into the ground or a wall, exactly (separating axes)."""

import math
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from blocksim.scenario.placement import PlacedBody
from blocksim.scenario.segments import TOLERANCE, PlacedSegment


@dataclass(frozen=True, slots=True)
class Rectangle:
    """Centre, half extents and directions of a rectangle."""

    x: float
    y: float
    half_x: float
    half_y: float
    cosine: float
    sine: float

    @classmethod
    def of(cls, body: PlacedBody) -> "Rectangle":
        """Take the outline of a placed body."""
        cosine, sine = math.cos(body.angle), math.sin(body.angle)
        return cls(body.x, body.y, body.size_x / 2, body.size_y / 2, cosine, sine)

    @classmethod
    def between(cls, x0: float, y0: float, x1: float, y1: float) -> "Rectangle":
        """Take a straight piece as a rectangle without height."""
        length = math.hypot(x1 - x0, y1 - y0)
        middle_x, middle_y = 0.5 * (x0 + x1), 0.5 * (y0 + y1)
        return cls(middle_x, middle_y, 0.5 * length, 0.0, (x1 - x0) / length, (y1 - y0) / length)

    @property
    def axes(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """The unit normals of its sides."""
        return (self.cosine, self.sine), (-self.sine, self.cosine)

    def reach(self, axis: tuple[float, float]) -> float:
        """Half of its extent along a unit vector."""
        along, across = (abs(axis[0] * own[0] + axis[1] * own[1]) for own in self.axes)
        return self.half_x * along + self.half_y * across

    @property
    def bottom(self) -> float:
        """Height of its lowest corner."""
        return self.y - self.reach((0.0, 1.0))


def penetration(one: Rectangle, other: Rectangle) -> float:
    """Return the shortest way (m) that parts two rectangles; zero or negative where they are apart."""
    x, y = other.x - one.x, other.y - one.y
    return min(
        one.reach(axis) + other.reach(axis) - abs(x * axis[0] + y * axis[1]) for axis in (*one.axes, *other.axes)
    )


def overlapping_pairs(bodies: Sequence[PlacedBody]) -> Iterator[tuple[int, int, float]]:
    """Yield the indices (smaller first) of every overlapping pair and its penetration in m."""
    rectangles = [Rectangle.of(body) for body in bodies]
    for i, j in _near_pairs(rectangles):
        depth = penetration(rectangles[i], rectangles[j])
        if depth > TOLERANCE:
            yield min(i, j), max(i, j), depth


def crossings(bodies: Sequence[PlacedBody], segments: Sequence[PlacedSegment]) -> Iterator[tuple[int, int, float]]:
    """Yield the body, the segment and the depth (m) where a body lies across a segment."""
    outlines = [Rectangle.of(body) for body in bodies]
    pieces = [Rectangle.between(piece.x0, piece.y0, piece.x1, piece.y1) for piece in segments]
    for i, j in _near_pairs([*outlines, *pieces]):
        body, piece = min(i, j), max(i, j) - len(bodies)
        if body < len(bodies) and piece >= 0:
            depth = penetration(outlines[body], pieces[piece])
            if depth > TOLERANCE:
                yield body, piece, depth


def _near_pairs(rectangles: Sequence[Rectangle]) -> Iterator[tuple[int, int]]:
    """Yield pairs whose axis-parallel boxes overlap, by a sweep along the axis that meets fewer pairs."""
    x = [(r.x - r.reach((1.0, 0.0)), r.x + r.reach((1.0, 0.0))) for r in rectangles]
    y = [(r.bottom, 2 * r.y - r.bottom) for r in rectangles]
    along, across = (x, y) if _pair_count(x) <= _pair_count(y) else (y, x)
    order = sorted(range(len(rectangles)), key=lambda index: along[index])
    for position, i in enumerate(order):
        for later in range(position + 1, len(order)):
            j = order[later]
            if along[j][0] > along[i][1]:
                break
            if across[i][0] < across[j][1] and across[j][0] < across[i][1]:
                yield i, j


def _pair_count(spans: Sequence[tuple[float, float]]) -> int:
    """Count the pairs of spans that a sweep along this axis meets."""
    ordered = sorted(spans)
    starts = [low for low, _ in ordered]
    return sum(bisect_right(starts, high) - index - 1 for index, (_, high) in enumerate(ordered))

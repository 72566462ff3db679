"""Outlines of blocks: convex polygons of few corners, their area, centroid and moments, and what is wrong with one."""

import itertools
import math
from collections.abc import Iterator, Sequence
from functools import lru_cache

from blocksim.scenario.polygons import corners_of, self_crossings

Corner = tuple[float, float]
Corners = tuple[Corner, ...]
"""Corners (m) counter-clockwise."""

FEWEST, MOST = 3, 16
RECTANGLE = 4
SHORTEST = 1e-3
"""Least length of an edge, and least thickness, in shares of the diagonal of the bounding box: below, contact would
have to tell corners apart that lie closer to one another than the accuracy of a step."""
STRAIGHT = math.radians(0.1)
"""Least turn of the outline at a corner."""
LEAST = 1e-6  # m; a thousand times the distance at which things touch


def area_of(corners: Sequence[Corner]) -> float:
    """Return the area (m²), positive where corners run counter-clockwise."""
    x0, y0 = corners[0]
    local = [(x - x0, y - y0) for x, y in corners]  # no digits are lost far from the origin
    return 0.5 * math.fsum(_cross(a, b) for a, b in _edges(local))


def centred(points: Sequence[Corner]) -> Corners:
    """Return corners counter-clockwise about their centroid; the first point stays the first."""
    x0, y0 = points[0]
    local = [(x - x0, y - y0) for x, y in points]
    if area_of(local) < 0.0:
        local = [local[0], *local[:0:-1]]
    if is_upright(tuple(local)):
        cx, cy = middle_of(local)
        return tuple((x - cx, y - cy) for x, y in local)
    for _ in range(2):  # the second time removes the round-off of the first
        cx, cy = centroid(local)
        local = [(x - cx, y - cy) for x, y in local]
    return tuple(local)


def centroid(corners: Sequence[Corner]) -> Corner:
    """Return the centroid (m) of a polygon that has an area."""
    x0, y0 = corners[0]
    local = [(x - x0, y - y0) for x, y in corners]
    parts = [(_cross(a, b), a, b) for a, b in _edges(local)]
    six = 3.0 * math.fsum(cross for cross, _, _ in parts)
    x = math.fsum(cross * (a[0] + b[0]) for cross, a, b in parts) / six
    y = math.fsum(cross * (a[1] + b[1]) for cross, a, b in parts) / six
    return x0 + x, y0 + y


@lru_cache(maxsize=256)
def section_of(corners: Corners) -> tuple[float, float]:
    """Return the area (m²) of corners about their centroid, and its polar second moment about it (m⁴).

    The moment is the sum over triangles from the centroid: 1/12 Σ (a × b) (a·a + a·b + b·b).
    """
    polar = math.fsum(_cross(a, b) * (_dot(a, a) + _dot(a, b) + _dot(b, b)) for a, b in _edges(corners)) / 12.0
    return area_of(corners), polar


def box_of(corners: Sequence[Corner]) -> tuple[Corner, Corner]:
    """Return the lower left and the upper right corner (m) of the bounding box."""
    xs, ys = zip(*corners, strict=True)
    return (min(xs), min(ys)), (max(xs), max(ys))


@lru_cache(maxsize=256)
def is_upright(corners: Corners) -> bool:
    """Return True if the corners are those of a rectangle with sides along the axes.

    It is treated as a rectangle wherever another order of rounding would give another last digit.
    """
    low, high = box_of(corners)
    return len(corners) == RECTANGLE and set(corners) == set(itertools.product(*zip(low, high, strict=True)))


def middle_of(corners: Sequence[Corner]) -> Corner:
    """Return the middle (m) of the bounding box."""
    (left, bottom), (right, top) = box_of(corners)
    return 0.5 * (left + right), 0.5 * (bottom + top)


@lru_cache(maxsize=256)
def least_width(corners: Corners) -> float:
    """Return the least distance (m) of two parallel lines with all corners between them; one is along an edge."""
    reaches = []
    for a, b in _edges(corners):
        along, length = _minus(b, a), math.dist(a, b)
        reaches.append(max(abs(_cross(along, _minus(corner, a))) for corner in corners) / length if length else 0.0)
    return min(reaches)


def holds(corners: Sequence[Corner], point: Corner, margin: float) -> bool:
    """Return whether a point is inside, or outside by no more than a margin (all m)."""
    return all(_cross(_minus(b, a), _minus(point, a)) >= -margin * math.dist(a, b) for a, b in _edges(corners))


def edges_of(corners: Sequence[Corner]) -> Iterator[tuple[Corner, Corner, Corner]]:
    """Yield the ends (m) of every edge, counter-clockwise, and its outward unit normal."""
    for a, b in _edges(corners):
        length = math.dist(a, b)
        yield a, b, ((b[1] - a[1]) / length, (a[0] - b[0]) / length)


def shrunk(points: Sequence[Corner], way: float) -> list[Corner]:
    """Return a convex outline whose edges are all moved inwards by a way (m), in the order of the file.

    A corner moves along (n + m) / (1 + n·m), n and m the inward normals of its edges: to where the moved edges meet.
    """
    sense = math.copysign(1.0, area_of(points))
    ways = [(b[0] - a[0], b[1] - a[1], math.dist(a, b)) for a, b in _edges(points)]
    normals = [(-sense * y / length, sense * x / length) for x, y, length in ways]
    moved = []
    for (x, y), n, m in zip(points, (normals[-1], *normals), normals, strict=False):
        share = way / (1.0 + _dot(n, m))
        moved.append((x + share * (n[0] + m[0]), y + share * (n[1] + m[1])))
    return moved


def regular(sides: int, radius: float) -> Corners:
    """Return a regular polygon about its centroid, corners at a radius (m), its lowest side level."""
    first = -0.5 * math.pi - math.pi / sides
    angles = (first + 2.0 * math.pi * number / sides for number in range(sides))
    return tuple((radius * math.cos(angle), radius * math.sin(angle)) for angle in angles)


def faults(points: Sequence[Corner]) -> Iterator[tuple[int | None, str]]:
    """Yield what is wrong with an outline, worst first, and the number (from 0) of the corner, None for all of it."""
    if not FEWEST <= len(points) <= MOST:
        yield None, f"{len(points)} corners; an outline has {FEWEST} to {MOST} corners [x, y]"
        return
    low, high = box_of(points)
    extent = math.dist(low, high)
    if extent < LEAST:
        yield None, f"all corners are within {1e6 * LEAST:g} µm"
        return
    local = [((x - points[0][0]) / extent, (y - points[0][1]) / extent) for x, y in points]
    for number, corner in enumerate(local):
        edge = math.dist(corner, local[number - 1])
        if edge == 0.0 and number == 0:
            yield len(local) - 1, "the first corner again; an outline closes by itself"
        elif edge == 0.0:
            yield number, "the same corner as the one before"
        elif edge < SHORTEST:
            yield number, f"this corner is only {1e3 * edge * extent:.3g} mm from the one before; leave one of them out"
    sense = math.copysign(1.0, area_of(local))
    ways = [_minus(b, a) for a, b in _edges(local)]
    turns = [sense * math.atan2(_cross(a, b), _dot(a, b)) for a, b in zip((ways[-1], *ways), ways, strict=False)]
    if min(turns) <= 0.0 or sum(turns) > 1.5 * 2.0 * math.pi:  # slow, and cannot happen to others
        for edges in self_crossings(corners_of(local)):  # of the counter-clockwise outline, here in the file's order
            first, second = sorted(one if sense > 0.0 else (len(local) - 2 - one) % len(local) for one in edges)
            meets = f"the edge from corner {second + 1} meets that from corner {first + 1}"
            yield second, f"{meets}: the outline crosses itself"
    thickness = least_width(tuple(local))
    if thickness < SHORTEST:
        size = f"{1e3 * thickness * extent:.3g} mm thick and {1e3 * extent:.3g} mm long"
        yield None, f"a sliver: {size}; at least {SHORTEST:g} of the length is needed"
        return
    for number, turn in enumerate(turns):
        if turn <= -STRAIGHT:
            yield number, "the outline is not convex at this corner; divide the block into convex ones"
        elif turn < STRAIGHT:
            yield number, f"the outline is nearly straight here ({180.0 - math.degrees(turn):.6g} deg); leave it out"


def _edges(corners: Sequence[Corner]) -> Iterator[tuple[Corner, Corner]]:
    return zip(corners, (*corners[1:], corners[0]), strict=True)


def _minus(a: Corner, b: Corner) -> Corner:
    return a[0] - b[0], a[1] - b[1]


def _cross(a: Corner, b: Corner) -> float:
    return a[0] * b[1] - a[1] * b[0]


def _dot(a: Corner, b: Corner) -> float:
    return a[0] * b[0] + a[1] * b[1]

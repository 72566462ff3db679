"""Outlines of soils: polygons, what lies in them, what they meet, and the particles that fill them."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
ROUND_OFF = 1e-9
"""m; polygons that overlap by less touch."""
DISC_SHARE = 0.5 * (1.0 - 1e-6)
"""Radius of a particle in spacings, less what round-off may take."""


def corners_of(points: Sequence[tuple[float, float]]) -> Floats:
    """Return corners (m) as an array (k, 2), counter-clockwise."""
    corners = np.array(points, dtype=np.float64).reshape(-1, 2)
    return corners if signed_area(corners) >= 0.0 else corners[::-1]


def signed_area(corners: Floats) -> float:
    """Return the area (m2) of a polygon (k, 2), positive where it is counter-clockwise."""
    x, y = corners.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def edge_ends(corners: Floats) -> tuple[Floats, Floats]:
    """Return where the edges of a polygon begin and end, (k, 2) each."""
    return corners, np.roll(corners, -1, axis=0)


def inside(points: Floats, corners: Floats) -> Flags:
    """Return for points (n, 2) whether they lie in a polygon; on an edge either."""
    found = np.zeros(len(points), dtype=bool)
    x, y = points.T
    for (x0, y0), (x1, y1) in zip(*edge_ends(corners), strict=True):
        if y0 != y1:
            crosses = (y0 > y) != (y1 > y)
            found ^= crosses & (x < x0 + (y - y0) * (x1 - x0) / (y1 - y0))
    return found


def edge_distance(points: Floats, corners: Floats) -> Floats:
    """Return the distances (m) of points (n, 2) from the nearest edge."""
    nearest = np.full(len(points), np.inf)
    for begin, end in zip(*edge_ends(corners), strict=True):
        along, beyond = end - begin, points - begin
        share = np.clip(beyond @ along / float(along @ along), 0.0, 1.0)
        nearest = np.minimum(nearest, np.hypot(*(beyond - np.outer(share, along)).T))
    return nearest


def deep_inside(points: Floats, corners: Floats) -> Flags:
    """Return for points (n, 2) whether they lie in a polygon and not on its edge."""
    return inside(points, corners) & (edge_distance(points, corners) > ROUND_OFF)


def cuts(begin: Floats, end: Floats, corners: Floats) -> bool:
    """Return True if a straight line (m) has a part inside a polygon."""
    along = end - begin
    shares = [0.0, 1.0]
    for e0, e1 in zip(*edge_ends(corners), strict=True):
        edge, beyond = e1 - e0, e0 - begin
        across = along[0] * edge[1] - along[1] * edge[0]
        if across != 0.0:
            shares.append(float((beyond[0] * edge[1] - beyond[1] * edge[0]) / across))
    ordered = np.unique(np.clip(shares, 0.0, 1.0))
    middles = 0.5 * (ordered[1:] + ordered[:-1])
    return bool(deep_inside(begin + np.outer(middles, along), corners).any())


def overlap(one: Floats, other: Floats) -> bool:
    """Return True if two polygons have more than edges in common."""
    lows, highs = [corners.min(axis=0) for corners in (one, other)], [corners.max(axis=0) for corners in (one, other)]
    if np.any(np.maximum(*lows) >= np.minimum(*highs) - ROUND_OFF):
        return False
    for a, b in ((one, other), (other, one)):
        if any(cuts(begin, end, b) for begin, end in zip(*edge_ends(a), strict=True)):
            return True
    heights = np.unique(one[:, 1])  # neither cuts the other: a point in one of them tells whether one is in the other
    y = 0.5 * (heights[0] + heights[1])
    low, high = crossings_below(one, np.array([y]), axis=1)[0][:2]
    return bool(deep_inside(np.array([[0.5 * (low + high), y]]), other).any())


def crossings_below(corners: Floats, places: Floats, axis: int) -> list[Floats]:
    """Return where lines at these places (m) along an axis cross the edges of a polygon, sorted, for each place."""
    other = 1 - axis
    begins, ends = edge_ends(corners)
    found = []
    for place in places:
        is_crossed = (begins[:, axis] > place) != (ends[:, axis] > place)
        b, e = begins[is_crossed], ends[is_crossed]
        share = (place - b[:, axis]) / (e[:, axis] - b[:, axis])
        found.append(np.sort(b[:, other] + share * (e[:, other] - b[:, other])))
    return found


def height_above(corners: Floats, points: Floats) -> Floats:
    """Return how much (m) of a polygon is straight above each of the points (n, 2)."""
    columns, which = np.unique(points[:, 0], return_inverse=True)
    levels = crossings_below(corners, columns, axis=0)
    above = np.zeros(len(points))
    for k, line in enumerate(levels):
        mine = which == k
        y = points[mine, 1]
        for low, high in zip(line[::2], line[1::2], strict=True):
            above[mine] += np.maximum(high - np.maximum(low, y), 0.0)
    return above


def self_crossings(corners: Floats) -> Iterator[tuple[int, int]]:
    """Yield pairs of edges of a polygon that cross or touch although they are no neighbours."""

    def side(p: Floats, q: Floats, r: Floats) -> float:
        return float((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]))

    edges = list(zip(*edge_ends(corners), strict=True))
    for i, (a0, a1) in enumerate(edges):
        for j, (b0, b1) in enumerate(edges[i + 2 :], start=i + 2):
            low, high = (
                np.maximum(np.minimum(a0, a1), np.minimum(b0, b1)),
                np.minimum(np.maximum(a0, a1), np.maximum(b0, b1)),
            )
            crosses = side(a0, a1, b0) * side(a0, a1, b1) <= 0.0 and side(b0, b1, a0) * side(b0, b1, a1) <= 0.0
            if (j + 1) % len(edges) != i and crosses and bool((low <= high).all()):
                yield i, j


def count_across(corners: Floats, spacing: float) -> tuple[int, int]:
    """Return how many particles a lattice of this spacing (m) has along x and y of a polygon."""
    columns, rows = np.floor((corners.max(axis=0) - corners.min(axis=0)) / spacing + 1e-6).astype(int)
    return int(columns), int(rows)


def filled(corners: Floats, spacing: float) -> Floats:
    """Return the places (m, (n, 2)) of a square lattice whose discs of that diameter (m) lie in a polygon, by rows."""
    columns, rows = count_across(corners, spacing)
    x, y = corners.min(axis=0)[:, np.newaxis] + spacing * (np.arange(max(columns, rows)) + 0.5)
    places = np.stack(np.meshgrid(x[:columns], y[:rows]), axis=-1).reshape(-1, 2)
    kept = inside(places, corners) & (edge_distance(places, corners) >= DISC_SHARE * spacing)
    return places[kept]

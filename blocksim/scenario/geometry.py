"""Geometry of polygons: area, centroid, moments, what lies inside, crossings, overlap, Voronoi cells."""

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Corner = tuple[float, float]
Corners = tuple[Corner, ...]  # corners (m) counter-clockwise
Edge = tuple[Corner, Corner, Corner]  # its ends (m) and its outward unit normal
ROUND_OFF = 1e-9  # m; polygons that overlap by less touch
LEAST_BAND = 2.0  # spacings: rows do not begin anew at level edges that are nearer to one another
DISC_SHARE = 0.5 * (1.0 - 1e-6)  # radius of a particle in spacings, less what round-off may take


def outward_normals(corners: Floats) -> tuple[Floats, Flags]:
    """Return the unit normals (b, k, 2) of the edges that begin at corners (m, (b, k, 2)), and which have a length."""
    edges = np.roll(corners, -1, axis=1) - corners
    lengths = np.hypot(edges[..., 0], edges[..., 1])
    is_edge = lengths > 0.0
    return np.stack([edges[..., 1], -edges[..., 0]], axis=-1) / np.where(is_edge, lengths, 1.0)[..., None], is_edge


def corners_of(points: Sequence[Corner]) -> Floats:
    """Return corners (m) as an array (k, 2), counter-clockwise."""
    corners = np.array(points, dtype=np.float64).reshape(-1, 2)
    return corners if area_of(points) >= 0.0 else corners[::-1]


def is_inside(points: Floats, corners: Floats) -> Flags:
    """Return for points (n, 2) whether they lie in a polygon; on an edge either."""
    found = np.zeros(len(points), dtype=bool)
    x, y = points.T
    for (x0, y0), (x1, y1) in _edges(corners):
        if y0 != y1:
            crosses = (y0 > y) != (y1 > y)
            found ^= crosses & (x < x0 + (y - y0) * (x1 - x0) / (y1 - y0))
    return found


def edge_distance(points: Floats, corners: Floats) -> Floats:
    """Return the distances (m) of points (n, 2) from the nearest edge."""
    nearest = np.full(len(points), np.inf)
    for begin, end in _edges(corners):
        along, beyond = end - begin, points - begin
        share = np.clip(beyond @ along / float(along @ along), 0.0, 1.0)
        nearest = np.minimum(nearest, np.hypot(*(beyond - np.outer(share, along)).T))
    return nearest


def cuts(begin: Floats, end: Floats, corners: Floats) -> bool:
    """Return True if a straight line (m) has a part inside a polygon."""
    along = end - begin
    shares = [0.0, 1.0]
    for e0, e1 in _edges(corners):
        edge, beyond = e1 - e0, e0 - begin
        across = along[0] * edge[1] - along[1] * edge[0]
        if across != 0.0:
            shares.append(float((beyond[0] * edge[1] - beyond[1] * edge[0]) / across))
    ordered = np.unique(np.clip(shares, 0.0, 1.0))
    middles = 0.5 * (ordered[1:] + ordered[:-1])
    points = begin + np.outer(middles, along)
    return bool(np.any(is_inside(points, corners) & (edge_distance(points, corners) > ROUND_OFF)))


def overlap(one: Floats, other: Floats) -> bool:
    """Return True if two polygons have more than edges in common."""
    lows, highs = [corners.min(axis=0) for corners in (one, other)], [corners.max(axis=0) for corners in (one, other)]
    if np.any(np.maximum(*lows) >= np.minimum(*highs) - ROUND_OFF):
        return False
    for a, b in ((one, other), (other, one)):
        if any(cuts(begin, end, b) for begin, end in _edges(a)):
            return True
    heights = np.unique(one[:, 1])  # neither cuts the other: a point in one of them tells whether one is in the other
    y = 0.5 * (heights[0] + heights[1])
    low, high = crossings_below(one, np.array([y]), axis=1)[0][:2]
    point = np.array([[0.5 * (low + high), y]])
    return bool(is_inside(point, other)[0] and edge_distance(point, other)[0] > ROUND_OFF)


def crossings_below(corners: Floats, places: Floats, axis: int) -> list[Floats]:
    """Return where lines at these places (m) along an axis cross the edges of a polygon, sorted, for each place."""
    other = 1 - axis
    begins, ends = corners, np.roll(corners, -1, axis=0)
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
    """Yield pairs of edges of a polygon that cross or touch although they are no neighbours, in their order."""
    begins, ends = corners, np.roll(corners, -1, axis=0)
    low, high, count = np.minimum(begins, ends), np.maximum(begins, ends), len(corners)
    order = np.argsort(low[:, 0], kind="stable")
    reaches = np.searchsorted(low[order, 0], high[:, 0], side="right")  # those that begin before an edge ends, along x

    def sides(origin: Floats, way: Floats, *points: Floats) -> Floats:
        one, other = (way[..., 0] * (at - origin)[..., 1] - way[..., 1] * (at - origin)[..., 0] for at in points)
        return one * other

    found: list[tuple[int, int]] = []
    for rank, i in enumerate(order.tolist()):
        j = order[rank + 1 : reaches[i]]
        meets = (low[j, 1] <= high[i, 1]) & (low[i, 1] <= high[j, 1]) & ~np.isin((j - i) % count, (1, count - 1))
        meets &= sides(begins[i], ends[i] - begins[i], begins[j], ends[j]) <= 0.0
        meets &= sides(begins[j], ends[j] - begins[j], begins[i], ends[i]) <= 0.0
        found += [(min(i, one), max(i, one)) for one in j[meets].tolist()]
    yield from sorted(found)


def count_across(corners: Floats, spacing: float) -> tuple[int, int]:
    """Return how many particles of this spacing (m), stretched to fill it, lie along x and y of a polygon."""
    columns, rows = np.rint((corners.max(axis=0) - corners.min(axis=0)) / spacing).astype(int)
    return int(columns), int(rows)


def stretched(begin: float, end: float, spacing: float) -> Floats:
    """Return places (m) from one to the other, both included, at equal distances next to a spacing (m)."""
    return np.linspace(begin, end, round((end - begin) / spacing) + 1)


def fill_rows(corners: Floats, spacing: float, obstacles: Sequence[Floats] = ()) -> tuple[Floats, float]:
    """Return places (m, (n, 2)) of discs of a spacing (m) that fill a polygon by rows, and the area (m2) of the rows.

    Rows begin and end at level edges, discs of a row at the edges beside it; between them distances are stretched.
    There are none in obstacles and below them.
    """
    radius, half, places, area = DISC_SHARE * spacing, 0.5 * spacing, [np.zeros((0, 2))], 0.0
    slack = half - radius
    for low, high in pairwise(_levels(corners, spacing, obstacles)):
        heights = stretched(low + half, max(high - half, low + half), spacing)
        for y, crossings in zip(heights, crossings_below(corners, heights, axis=1), strict=True):
            taken = np.concatenate([_reaches(one, y, radius) for one in (corners, *obstacles)])
            shadows = [_shadow(one, y) for one in obstacles]
            for begin, end in _free_parts(crossings, [*taken.tolist(), *shadows]):
                x = stretched(begin + slack, max(end - slack, begin + slack), spacing)
                places.append(np.stack([x, np.full_like(x, y)], axis=-1))
                area += (end - begin + spacing) * (high - low) / len(heights)
    return np.concatenate(places), area


def _levels(corners: Floats, spacing: float, obstacles: Sequence[Floats]) -> list[float]:
    """Return heights (m) of the bottom, of level edges beside the soil, and of the top, some spacings apart."""
    levels = [float(begin[1]) for begin, end in _edges(corners) if begin[1] == end[1]]
    for one in obstacles:
        for begin, end in _edges(one):
            above = begin + np.outer((0.1, 0.5, 0.9), end - begin) + (0.0, 0.25 * spacing)
            if begin[1] == end[1] and any(~np.any([is_inside(above, other) for other in obstacles], axis=0)):
                levels.append(float(begin[1]))
    bottom, top = float(corners[:, 1].min()), float(corners[:, 1].max())
    found = [bottom]
    for level in sorted(levels):
        if found[-1] + LEAST_BAND * spacing < level < top - LEAST_BAND * spacing:
            found.append(level)
    return [*found, top]


def _reaches(corners: Floats, y: float, radius: float) -> Floats:
    """Return from where to where (m, (n, 2)) places at height y are nearer than a radius (m) to the edges near it."""
    begins, ends = corners, np.roll(corners, -1, axis=0)
    is_near = (np.minimum(begins[:, 1], ends[:, 1]) < y + radius) & (np.maximum(begins[:, 1], ends[:, 1]) > y - radius)
    begins, ends = begins[is_near], ends[is_near]
    along = ends - begins
    across = radius * np.stack([-along[:, 1], along[:, 0]], axis=-1) / np.hypot(*along.T)[:, np.newaxis]
    found = []
    with np.errstate(invalid="ignore", divide="ignore"):  # what is no number is not there
        for corner in (begins, ends):
            half = np.sqrt(radius**2 - (y - corner[:, 1]) ** 2)
            found += [corner[:, 0] - half, corner[:, 0] + half]
        for side in (begins + across, begins - across):
            share = (y - side[:, 1]) / along[:, 1]
            found.append(np.where((share >= 0.0) & (share <= 1.0), side[:, 0] + share * along[:, 0], np.nan))
    return np.stack([np.fmin.reduce(found), np.fmax.reduce(found)], axis=-1)


def _shadow(corners: Floats, y: float) -> list[float]:
    """Return from where to where (m) some of a polygon is at height y or straight above; inf, -inf for none."""
    (crossings,) = crossings_below(corners, np.array([y]), axis=1)
    found = [*crossings, *corners[corners[:, 1] > y, 0]]
    return [min(found, default=math.inf), max(found, default=-math.inf)]


def _free_parts(crossings: Floats, taken: list[list[float]]) -> Iterator[tuple[float, float]]:
    """Yield the parts (m) of a line inside a polygon, between pairs of crossings, that nothing takes."""
    for begin, end in zip(crossings[::2].tolist(), crossings[1::2].tolist(), strict=True):
        free = begin
        for first, last in sorted(taken):
            if free <= first < end:
                yield free, first
            free = max(free, last) if first < end else free
        if free <= end:
            yield free, end


FEWEST, MOST = 3, 16
RECTANGLE = 4
SHORTEST = 1e-3
"""Least length of an edge, and least thickness, in shares of the diagonal of the bounding box: below, contact would
have to tell corners apart that lie closer to one another than the accuracy of a step."""
STRAIGHT = math.radians(0.1)  # least turn of the outline at a corner
LEAST = 1e-6  # m; a thousand times the distance at which things touch


def area_of(corners: Sequence[Corner] | Floats) -> float:
    """Return the area (m²), positive where corners run counter-clockwise."""
    x0, y0 = corners[0]
    local = [(x - x0, y - y0) for x, y in corners]  # no digits are lost far from the origin
    return 0.5 * math.fsum(_cross(a, b) for a, b in _edges(local))


def centre_outline(points: Sequence[Corner]) -> Corners:
    """Return corners counter-clockwise about their centroid; the first point stays the first."""
    if len(points) == 0:
        return ()
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
    polar = math.fsum(_cross(a, b) * (dot(a, a) + dot(a, b) + dot(b, b)) for a, b in _edges(corners)) / 12.0
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


def edges_of(corners: Sequence[Corner]) -> Iterator[Edge]:
    """Yield the ends (m) of every edge, counter-clockwise, and its outward unit normal."""
    for a, b in _edges(corners):
        length = math.dist(a, b)
        yield a, b, ((b[1] - a[1]) / length, (a[0] - b[0]) / length)


def shrink_outline(points: Sequence[Corner], way: float) -> list[Corner]:
    """Return a convex outline whose edges are all moved inwards by a way (m), in the order of the file.

    A corner moves along (n + m) / (1 + n·m), n and m the inward normals of its edges: to where the moved edges meet.
    """
    sense = math.copysign(1.0, area_of(points))
    ways = [(_minus(b, a), math.dist(a, b)) for a, b in _edges(points)]
    normals = [(-sense * y / length, sense * x / length) for (x, y), length in ways]
    moved = []
    for (x, y), n, m in zip(points, (normals[-1], *normals), normals, strict=False):
        share = way / (1.0 + dot(n, m))
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
    turns = [sense * math.atan2(_cross(a, b), dot(a, b)) for a, b in zip((ways[-1], *ways), ways, strict=False)]
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


def _edges(corners: Iterable[Any]) -> Iterator[tuple[Any, Any]]:
    """Yield both ends of every edge, of corners as tuples or as an array (k, 2)."""
    begins = [*corners]
    return zip(begins, begins[1:] + begins[:1], strict=True)


def _minus(a: Corner, b: Corner) -> Corner:
    return a[0] - b[0], a[1] - b[1]


def _cross(a: Corner, b: Corner) -> float:
    return a[0] * b[1] - a[1] * b[0]


def dot(a: Corner, b: Corner) -> float:
    """Return the scalar product."""
    return a[0] * b[0] + a[1] * b[1]


NEAREST = 48  # neighbours that are tried first; they decide nearly all cells


def voronoi(points: Sequence[Corner], region: Sequence[Corner]) -> list[list[Corner]]:
    """Return the cell (m) of each point, counter-clockwise; so are the corners of the convex region."""
    places = np.array(points)
    cells = []
    for number, (x, y) in enumerate(places.tolist()):
        cell = [(u - x, v - y) for u, v in region]
        for dx, dy in _around(number, places):
            reach = max(u * u + v * v for u, v in cell)
            if dx * dx + dy * dy >= 4.0 * reach:
                break
            cell = _cut(cell, dx, dy)
        cells.append([(x + u, y + v) for u, v in cell])
    return cells


def _around(number: int, places: Floats) -> Iterator[Corner]:
    """Yield the other points as seen from one, the nearest first."""
    ways = places - places[number]
    distances = np.einsum("ij,ij->i", ways, ways)
    distances[number] = math.inf
    others = len(places) - 1
    near = np.argpartition(distances, min(NEAREST, others))[: min(NEAREST, others)]
    near = near[np.lexsort((near, distances[near]))]
    yield from ways[near].tolist()
    if others > NEAREST:
        order = np.lexsort((np.arange(len(places)), distances))[NEAREST:-1]
        yield from ways[order].tolist()


def _cut(cell: Sequence[Corner], dx: float, dy: float) -> list[Corner]:
    """Return the part of a polygon that is nearer to the origin than to a point."""
    half = 0.5 * (dx * dx + dy * dy)
    beyond = [dx * u + dy * v - half for u, v in cell]
    kept: list[Corner] = []
    for index, (corner, after) in enumerate(zip(cell, beyond, strict=True)):
        before = beyond[index - 1]
        if (before > 0.0) != (after > 0.0):
            share = before / (before - after)
            (x0, y0), (x1, y1) = cell[index - 1], corner
            kept.append((x0 + share * (x1 - x0), y0 + share * (y1 - y0)))
        if after <= 0.0:
            kept.append(corner)
    return kept


def clean_cell(cell: Sequence[Corner], least: float) -> list[Corner]:
    """Return a convex polygon without corners that are too near (m) to another, nearly straight, or too many.

    What goes is a corner at a time, that whose triangle with its neighbours is smallest: what is left lies within.
    """
    corners = [*cell]
    extent = max((math.dist(a, b) for a in corners for b in corners), default=0.0)
    shortest = max(least, 2.0 * SHORTEST * extent)
    while len(corners) > 3:
        needless, losses = [], []
        for number, here in enumerate(corners):
            before, after = corners[number - 1], corners[(number + 1) % len(corners)]
            one, other = _minus(here, before), _minus(after, here)
            turn = math.atan2(_cross(one, other), dot(one, other))
            is_short = min(math.dist(before, here), math.dist(here, after)) < shortest
            needless += [number] if is_short or turn < 2.0 * STRAIGHT else []
            losses.append(_cross(one, _minus(after, before)))
        if not needless and len(corners) <= MOST:
            break
        corners.pop(min(needless or range(len(corners)), key=losses.__getitem__))
    return corners

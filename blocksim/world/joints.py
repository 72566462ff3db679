"""Joints of bodies as they are placed, found from their corners: where blocks touch one another and their supports.

Outlines are convex, so that two bodies touch along one interval or at one point. The ends of an interval are corners
of one of the two that lie on an edge of the other, whatever the shape: rectangles, outlines, drawn polygons,
voussoirs, pieces of ground and walls, and the half-plane.
"""

import math
from collections import defaultdict
from collections.abc import Collection, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from blocksim.scenario import PlacedBody, PlacedSegment
from blocksim.scenario.outlines import box_of

Point = tuple[float, float]


class Joint(NamedTuple):
    """Where two bodies touch; pieces of ground and walls are numbered after the blocks, the half-plane comes last."""

    one: int
    other: int
    normal: Point  # from one to the other
    points: tuple[Point, ...]  # m: one, or the two ends

    @property
    def width(self) -> float:
        """Length in m, zero of a point."""
        return math.dist(self.points[0], self.points[-1])


class _Side(NamedTuple):
    """What a body shows to others: faces from corner to corner, with the solid on the left."""

    body: int
    faces: Sequence[tuple[Point, Point]]
    corners: Sequence[Point]


class _Hit(NamedTuple):
    """A corner of one body on a face of another."""

    point: Point
    owner: int  # of the face
    normal: Point  # out of the owner
    is_inside: bool  # not at an end of the face


def joints_of(
    placed: Sequence[PlacedBody], segments: Sequence[PlacedSegment], free: Collection[int], near: float, *, level: bool
) -> list[Joint]:
    """Return the joints of free blocks with each other and with supports; faces up to `near` (m) apart touch.

    `level` says whether the half-plane y < 0 is one of the supports.
    """
    blocks = [_side_of(i, body) for i, body in enumerate(placed)]
    low, high = box_of([corner for side in blocks if side.body in free for corner in side.corners])
    (left, bottom), (right, top) = (low[0] - near, low[1] - near), (high[0] + near, high[1] + near)
    sides = [*blocks, *(_side_of_piece(len(placed) + k, one) for k, one in enumerate(segments))]
    if level:
        sides.append(_Side(len(sides), [((right, 0.0), (left, 0.0))], []))
    within = [
        side
        for side in sides
        for (x0, y0), (x1, y1) in [box_of([corner for face in side.faces for corner in face])]
        if x0 <= right and x1 >= left and y0 <= top and y1 >= bottom
    ]
    hits = defaultdict(list)
    for pair, hit in _hits(within, free, near):
        hits[pair].append(hit)
    found = (_joint(pair, some, near) for pair, some in hits.items())
    return [joint for joint in found if joint is not None]


def _side_of(number: int, body: PlacedBody) -> _Side:
    c, s = math.cos(body.angle), math.sin(body.angle)
    corners = [(body.x + c * x - s * y, body.y + s * x + c * y) for x, y in body.corners]
    return _Side(number, list(zip(corners, [*corners[1:], corners[0]], strict=True)), corners)


def _side_of_piece(number: int, one: PlacedSegment) -> _Side:
    """Return the face of a piece, which has its solid on the right, and those of its ends that are edges."""
    start, end = (one.x0, one.y0), (one.x1, one.y1)
    return _Side(number, [(end, start)], [*([start] if one.touches_start else []), *([end] if one.touches_end else [])])


def _hits(sides: Sequence[_Side], free: Collection[int], near: float) -> Iterator[tuple[tuple[int, int], _Hit]]:
    """Yield all corners on faces of other bodies, where one of the two is free."""
    corners = np.array([corner for side in sides for corner in side.corners])
    owners = np.array([side.body for side in sides for _ in side.corners])
    faces = np.array([face for side in sides for face in side.faces])
    bodies = np.array([side.body for side in sides for _ in side.faces])
    way = faces[:, 1] - faces[:, 0]
    length = np.hypot(way[:, 0], way[:, 1])
    way /= length[:, None]
    x, y = (corners[:, None, axis] - faces[None, :, 0, axis] for axis in (0, 1))
    along = way[:, 0] * x + way[:, 1] * y
    away = np.abs(way[:, 0] * y - way[:, 1] * x)
    touches = (away <= near) & (np.abs(along - 0.5 * length) <= 0.5 * length + near) & (owners[:, None] != bodies)
    for corner, face in np.argwhere(touches).tolist():
        i, j = int(owners[corner]), int(bodies[face])
        if i in free or j in free:
            x0, y0 = corners[corner].tolist()
            dx, dy = way[face].tolist()
            is_inside = near < along[corner, face] < length[face] - near
            yield (min(i, j), max(i, j)), _Hit((x0, y0), j, (dy, -dx), bool(is_inside))


def _joint(pair: tuple[int, int], hits: Sequence[_Hit], near: float) -> Joint | None:
    """Return the joint of two bodies; None where only corners touch."""
    first = hits[0].point
    one = max((hit.point for hit in hits), key=lambda point: math.dist(point, first))
    other = max((hit.point for hit in hits), key=lambda point: math.dist(point, one))
    width = math.dist(one, other)
    if width > 2.0 * near:
        across = (other[1] - one[1]) / width, (one[0] - other[0]) / width
        best = max(hits, key=lambda hit: abs(_dot(hit.normal, across)))
        way = math.copysign(1.0, _dot(best.normal, across)) * (1.0 if best.owner == pair[0] else -1.0)
        return Joint(*pair, (way * across[0], way * across[1]), (one, other))
    inside = next((hit for hit in hits if hit.is_inside), None)
    if inside is None:
        return None
    way = 1.0 if inside.owner == pair[0] else -1.0
    return Joint(*pair, (way * inside.normal[0], way * inside.normal[1]), (inside.point,))


def _dot(a: Point, b: Point) -> float:
    return a[0] * b[0] + a[1] * b[1]

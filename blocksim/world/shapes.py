"""The corners of all bodies of a scene, each shape once, where any block is a polygon and no rectangle.

Contact of a corner with a face lasts as long as no other face is nearer. At the distance e from the end of a face and
so deep behind it, all others of a convex body are at least `clear` e minus the depth away: along the face the least
distance to the others is a concave function, zero at both ends, and `clear` is its value in the middle over half of the
length. Near an end only the face beside it can be nearer, as those beyond are `far` from all of the face.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

from blocksim.kernels.common.arrays import CORNER, Records, zeros
from blocksim.kernels.explicit.outlines import WIDEST_CONE
from blocksim.scenario import PlacedBody

NO_FACE = (0.0, 0.0, 0.0, 0.0, math.inf, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)  # nothing is beyond it, or looks against it
FIELDS = ("x", "y", "nx", "ny", "distance", "half", "middle", "clear", "far", "sharp", "cone")
Corners = tuple[tuple[float, float], ...]  # m, counter-clockwise about the centroid
HalfSides = tuple[float, float]  # m


class Shapes(NamedTuple):
    """The shapes of a scene, and where each of its bodies has its corners."""

    table: Records  # (q,) CORNER
    firsts: tuple[int, ...]  # (n + 1,) of blocks, pieces of ground and the half-plane
    sizes: tuple[int, ...]  # (n + 1,) numbers of corners
    inner: Mapping[Corners, float]  # m: from the centroid of a block to the nearest face


def shapes_of(placed: Sequence[PlacedBody], slabs: Iterable[HalfSides]) -> Shapes | None:
    """Return the corners of all bodies, of rectangles too; None where all blocks are rectangles.

    `slabs` (m) are the half sides of the pieces of ground. The half-plane, the last of all bodies, is a rectangle that
    is infinitely wide and has its upper face in its centre. After the corners of a block come as many others as a block
    may have here, so that four blocks are gone through together.
    """
    if not any(body.outline for body in placed):
        return None
    places: dict[Corners, int] = {}
    rows: list[tuple[float, ...]] = []
    blocks = [body.corners for body in placed]
    most = max(len(corners) for corners in blocks)
    ground = [_rectangle(*half_sides) for half_sides in (*slabs, (math.inf, 0.0))]
    for corners in blocks:
        if corners not in places:
            places[corners] = len(rows)
            rows += [*corner_rows(corners), *[NO_FACE] * (most - len(corners))]
    firsts = [places[corners] for corners in blocks]
    for corners in ground:
        firsts.append(len(rows))
        rows += _ground_rows(corners)
    table = zeros(len(rows), CORNER)
    for name, column in zip(FIELDS, zip(*rows, strict=True), strict=True):
        table[name] = column
    sizes = tuple(len(corners) for corners in (*blocks, *ground))
    inner = {corners: float(table["distance"][place : place + len(corners)].min()) for corners, place in places.items()}
    return Shapes(table, tuple(firsts), sizes, inner)


def corner_rows(corners: Corners) -> list[tuple[float, ...]]:
    """Return the fields of CORNER, in the order of FIELDS, of the corners of one shape."""
    rows: list[tuple[float, ...]] = []
    cone = cone_of(corners)
    for (x, y), (next_x, next_y) in zip(corners, (*corners[1:], corners[0]), strict=True):
        length = math.hypot(next_x - x, next_y - y)
        nx, ny = (next_y - y) / length, (x - next_x) / length
        half = 0.5 * length
        rows.append((x, y, nx, ny, nx * x + ny * y, half, half - (ny * x - nx * y), cone))
    return [
        (
            *row[:-1],
            _clearance(number, rows),
            _distance_of_others(number, rows),
            _is_sharp(row, rows[number - 1], rows[(number + 1) % len(rows)]),
            cone,
        )
        for number, row in enumerate(rows)
    ]


def _is_sharp(face: Sequence[float], *beside: Sequence[float]) -> bool:
    """Return True if a face beside one meets it at less than a right angle."""
    return any(face[2] * other[2] + face[3] * other[3] < 0.0 for other in beside)


def _clearance(number: int, rows: Sequence[tuple[float, ...]]) -> float:
    """Return how far all other faces are from the middle of one, over half of its length."""
    x, y, nx, ny, _, half, *_ = rows[number]
    x, y = x - half * ny, y + half * nx
    return min(row[4] - row[2] * x - row[3] * y for k, row in enumerate(rows) if k != number) / half


def _distance_of_others(number: int, rows: Sequence[tuple[float, ...]]) -> float:
    """Return the distance (m) of a face from all others but those beside it: the lesser one of its two ends."""
    before, after = (number - 1) % len(rows), (number + 1) % len(rows)
    others = [row for k, row in enumerate(rows) if k not in {before, number, after}]
    ends = [rows[number][:2], rows[after][:2]]
    return min((row[4] - row[2] * x - row[3] * y for row in others for x, y in ends), default=math.inf)


def _rectangle(half_x: float, half_y: float) -> Corners:
    """Return the corners of a rectangle from the lower left one."""
    return ((-half_x, -half_y), (half_x, -half_y), (half_x, half_y), (-half_x, half_y))


def _ground_rows(corners: Corners) -> list[tuple[float, ...]]:
    """Return the fields of CORNER of a piece of ground or the half-plane, of which no face is beside another."""
    half_x, half_y = corners[2]
    faces = ((0.0, -1.0, half_y, half_x), (1.0, 0.0, half_x, half_y), (0.0, 1.0, half_y, half_x))
    sides = (*faces, (-1.0, 0.0, half_x, half_y))
    return [(*corner, *side, 0.0, 1.0, 0.0, 0.0, WIDEST_CONE) for corner, side in zip(corners, sides, strict=True)]


def cone_of(corners: Corners) -> float:
    """Return the sine of the angle up to which a face of a shape is parallel to one of another body.

    At most half of the least angle by which the outline turns at a corner: a body that rolls over it from one face to
    the next is on neither of them half way. And at most half of the sharpest corner: beyond that the sides of one
    corner would be parallel.
    """
    edges = [math.atan2(y - last_y, x - last_x) for (last_x, last_y), (x, y) in pairwise((*corners, corners[0]))]
    turns = [(after - before) % (2.0 * math.pi) for before, after in zip((edges[-1], *edges), edges, strict=False)]
    return min(WIDEST_CONE, math.sin(0.5 * min(turns)), math.sin(0.5 * (math.pi - max(turns))))

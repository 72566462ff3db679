"""The corners of all blocks of a scene, each shape once, where any block is a polygon and no rectangle."""

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

from blocksim.kernels.common.arrays import CORNER, Records, zeros
from blocksim.kernels.explicit.outlines import WIDEST_CONE
from blocksim.scenario import PlacedBody

Corners = tuple[tuple[float, float], ...]  # m, counter-clockwise about the centroid


class Shapes(NamedTuple):
    """The shapes of a scene, and where each of its blocks has its corners."""

    table: Records  # (q,) CORNER
    firsts: tuple[int, ...]  # (b,)
    sizes: tuple[int, ...]  # (b,) numbers of corners
    inner: Mapping[Corners, float]  # m: from the centroid to the nearest face


def shapes_of(placed: Sequence[PlacedBody]) -> Shapes | None:
    """Return the corners of all blocks, of rectangles too; None where there are only these."""
    if not any(body.outline for body in placed):
        return None
    places: dict[Corners, int] = {}
    rows: list[tuple[float, ...]] = []
    for body in placed:
        if body.corners not in places:
            places[body.corners] = len(rows)
            rows += corner_rows(body.corners)
    table = zeros(len(rows), CORNER)
    for name, column in zip(CORNER.names or (), zip(*rows, strict=True), strict=True):
        table[name] = column
    firsts, sizes = ([of(body.corners) for body in placed] for of in (places.__getitem__, len))
    inner = {corners: float(table["distance"][place : place + len(corners)].min()) for corners, place in places.items()}
    return Shapes(table, tuple(firsts), tuple(sizes), inner)


def corner_rows(corners: Corners) -> list[tuple[float, ...]]:
    """Return the fields of CORNER of the corners of one shape."""
    rows: list[tuple[float, ...]] = []
    cone = cone_of(corners)
    for (x, y), (next_x, next_y) in zip(corners, (*corners[1:], corners[0]), strict=True):
        length = math.hypot(next_x - x, next_y - y)
        nx, ny = (next_y - y) / length, (x - next_x) / length
        rows.append((x, y, nx, ny, nx * x + ny * y, 0.5 * length, cone))
    return rows


def cone_of(corners: Corners) -> float:
    """Return the sine of the angle up to which a face of a shape is parallel to one of another body.

    At most half of the least angle by which the outline turns at a corner: a body that rolls over it from one face to
    the next is on neither of them half way. And at most half of the sharpest corner: beyond that the sides of one
    corner would be parallel.
    """
    edges = [math.atan2(y - last_y, x - last_x) for (last_x, last_y), (x, y) in pairwise((*corners, corners[0]))]
    turns = [(after - before) % (2.0 * math.pi) for before, after in zip((edges[-1], *edges), edges, strict=False)]
    return min(WIDEST_CONE, math.sin(0.5 * min(turns)), math.sin(0.5 * (math.pi - max(turns))))


def half_sides(body: PlacedBody) -> tuple[float, float]:
    """Return how far (m) a block reaches along its own axes, to either side of its centroid."""
    if not body.outline:
        return 0.5 * body.size_x, 0.5 * body.size_y
    return max(abs(x) for x, _ in body.outline), max(abs(y) for _, y in body.outline)

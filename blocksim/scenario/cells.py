"""Voronoi cells of points in a convex region: each is the region cut by the bisectors with the points around."""

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from blocksim.scenario.outlines import MOST, SHORTEST, STRAIGHT, Corner, centroid

Floats = NDArray[np.float64]
NEAREST = 48
"""Neighbours that are tried first; they decide nearly all cells."""


def voronoi(points: Sequence[Corner], region: Sequence[Corner]) -> list[list[Corner]]:
    """Return the cell (m) of each point, counter-clockwise; so are the corners of the convex region."""
    places = np.array(points)
    cells = []
    for number in range(len(points)):
        x, y = (float(one) for one in places[number])
        cell = [(u - x, v - y) for u, v in region]
        for dx, dy in _around(number, places):
            reach = max(u * u + v * v for u, v in cell)
            if dx * dx + dy * dy >= 4.0 * reach:
                break
            cell = _cut(cell, dx, dy)
        cells.append([(x + u, y + v) for u, v in cell])
    return cells


def relaxed(points: Sequence[Corner], region: Sequence[Corner], times: int) -> list[Corner]:
    """Return points moved to the centroids of their cells, so many times (Lloyd): cells become more alike."""
    for _ in range(times):
        points = [centroid(cell) for cell in voronoi(points, region)]
    return [*points]


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


def cleaned(cell: Sequence[Corner], least: float) -> list[Corner]:
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
            one, other = (here[0] - before[0], here[1] - before[1]), (after[0] - here[0], after[1] - here[1])
            turn = math.atan2(one[0] * other[1] - one[1] * other[0], one[0] * other[0] + one[1] * other[1])
            is_short = min(math.dist(before, here), math.dist(here, after)) < shortest
            needless += [number] if is_short or turn < 2.0 * STRAIGHT else []
            wide, far = (after[0] - before[0], after[1] - before[1])
            losses.append(one[0] * far - one[1] * wide)
        if not needless and len(corners) <= MOST:
            break
        corners.pop(min(needless or range(len(corners)), key=losses.__getitem__))
    return corners

"""Neighbour search: for every point the particles within a radius, found by the cells of common/neighbours.py.

A pair counts if dx^2 + dy^2 < radius^2 as computed; then |x_b - x| < radius, also exactly.
"""

import math
from typing import NamedTuple

import numpy as np

from blocksim.kernels.common import arrays, jit, neighbours

PLACE = arrays.record_type("x y")  # m


class Neighbours(NamedTuple):
    """Neighbours by point: those of point i are indices[offsets[i]:offsets[i + 1]], cell by cell."""

    offsets: arrays.Integers  # (m + 1,)
    indices: arrays.Integers  # (offsets[m],)


@jit.entry_kernel
def list_neighbours(
    places: arrays.Records,
    points: arrays.Floats,
    radius: float,
    starts: arrays.Integers,
    order: arrays.Integers,
    offsets: arrays.Integers,
    indices: arrays.Integers,
) -> None:
    """Write the neighbours of all points, as far as there is room, and the offsets that they need."""
    grid = neighbours.lay_cells(places, radius, places.size, False)
    neighbours.sort_into_cells(places, grid, starts, order)
    count = 0
    for i in range(points.shape[0]):
        offsets[i] = count
        x, y = points[i, 0], points[i, 1]
        first, last = neighbours.column_of(grid, x - radius), neighbours.column_of(grid, x + radius)
        for row in range(neighbours.row_of(grid, y - radius), neighbours.row_of(grid, y + radius) + 1):
            for k in range(starts[row * grid.columns + first], starts[row * grid.columns + last + 1]):
                dx = places[order[k]].x - x
                dy = places[order[k]].y - y
                if dx * dx + dy * dy < radius * radius:
                    if count < indices.size:
                        indices[count] = order[k]
                    count += 1
    offsets[points.shape[0]] = count


def find_neighbours(positions: arrays.Floats, points: arrays.Floats, radius: float) -> Neighbours:
    """Return, for each of the points (m, 2), the particles (n, 2) nearer than `radius`; all in metres and finite.

    A particle that is a point itself is listed as its own neighbour. Raises ValueError for a coordinate that is not
    finite, for no particles and for a radius that is not positive.
    """
    if not (np.isfinite(positions).all() and np.isfinite(points).all()):
        raise ValueError("positions and points must be finite")
    if positions.shape[0] == 0 or not 0.0 < radius < math.inf:
        raise ValueError("a neighbour search needs at least one particle and a radius above zero")
    n = positions.shape[0]
    places = np.ascontiguousarray(positions, np.float64).view(PLACE)[:, 0].view(np.recarray)
    starts, order, offsets = (np.empty(size, np.int64) for size in (3 * n + 3, n, points.shape[0] + 1))
    found = Neighbours(offsets, np.empty(0, np.int64))
    list_neighbours(places, points, radius, starts, order, *found)
    found = Neighbours(offsets, np.empty(offsets[-1], np.int64))
    list_neighbours(places, points, radius, starts, order, *found)
    return found

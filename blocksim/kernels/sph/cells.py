"""Neighbour search: particles sorted into square cells, and for every point the particles within a radius.

No neighbour is missed to round-off. A pair counts if dx^2 + dy^2 < radius^2 as computed; then |x_b - x| < radius, also
exactly, because rounding keeps order, and for the same reason the cell of x_b lies between the cells of x - radius and
x + radius. So the lists equal those of a search over all pairs, on cell edges too.
"""

import math
from typing import NamedTuple

import numpy as np

from blocksim.kernels.common.arrays import Floats, Integers
from blocksim.kernels.common.jit import entry_kernel, kernel, rare_kernel

NOTHING: Integers = np.empty(0, np.int64)


class CellGrid(NamedTuple):
    """Square cells over the bounding box of all particles, numbered row by row from the lower left one."""

    left: float  # m
    bottom: float  # m
    size: float  # m, side of a cell
    columns: int
    rows: int


class CellList(NamedTuple):
    """Particles by cell: those of cell c are order[starts[c]:starts[c + 1]], in rising order."""

    grid: CellGrid
    starts: Integers  # (columns * rows + 2,); the last entry is used while sorting only
    order: Integers  # (n,)


class Neighbours(NamedTuple):
    """Neighbours by point: those of point i are indices[offsets[i]:offsets[i + 1]], cell by cell."""

    offsets: Integers  # (m + 1,)
    indices: Integers  # (offsets[m],)


@kernel
def clipped_cell(distance: float, size: float, count: int) -> int:
    """Return the number (0 to count - 1) of the cell in a row; points outside count to the nearest one."""
    return int(min(max(distance / size, 0.0), count - 1.0))


@entry_kernel
def sort_into_cells(positions: Floats, cells: CellList) -> None:
    """Fill `order` and `starts` (zero before) by counting; the order within a cell is that of the particles.

    Counts are kept two entries late, so that summed up they are the cells' beginnings one entry late; every particle
    that is written moves its entry on, up to the beginning of the next cell.
    """
    starts = cells.starts
    for i in range(positions.shape[0]):
        starts[cell_number(cells.grid, positions[i, 0], positions[i, 1]) + 2] += 1
    for c in range(starts.size - 1):
        starts[c + 1] += starts[c]
    for i in range(positions.shape[0]):
        c = cell_number(cells.grid, positions[i, 0], positions[i, 1])
        cells.order[starts[c + 1]] = i
        starts[c + 1] += 1


@kernel
def cell_number(grid: CellGrid, x: float, y: float) -> int:
    """Return the number of the cell that a place (m) lies in."""
    column = clipped_cell(x - grid.left, grid.size, grid.columns)
    row = clipped_cell(y - grid.bottom, grid.size, grid.rows)
    return row * grid.columns + column


@rare_kernel
def add_neighbours(
    positions: Floats, cells: CellList, x: float, y: float, radius: float, indices: Integers, count: int
) -> int:
    """Append the particles nearer to (x, y) than `radius`, as far as there is room; return the count needed."""
    grid = cells.grid
    first = clipped_cell(x - radius - grid.left, grid.size, grid.columns)
    last = clipped_cell(x + radius - grid.left, grid.size, grid.columns)
    low = clipped_cell(y - radius - grid.bottom, grid.size, grid.rows)
    high = clipped_cell(y + radius - grid.bottom, grid.size, grid.rows)
    for row in range(low, high + 1):
        begin = cells.starts[row * grid.columns + first]
        end = cells.starts[row * grid.columns + last + 1]
        for k in range(begin, end):
            b = cells.order[k]
            dx = positions[b, 0] - x
            dy = positions[b, 1] - y
            if dx * dx + dy * dy < radius * radius:
                if count < indices.size:
                    indices[count] = b
                count += 1
    return count


@entry_kernel
def list_neighbours(
    positions: Floats, cells: CellList, points: Floats, radius: float, offsets: Integers, indices: Integers
) -> None:
    """Write the neighbours of all points, as far as there is room, and the offsets that they need."""
    offsets[0] = 0
    for i in range(points.shape[0]):
        offsets[i + 1] = add_neighbours(positions, cells, points[i, 0], points[i, 1], radius, indices, offsets[i])


def lay_grid(positions: Floats, radius: float) -> CellGrid:
    """Return cells of the size of the radius, or larger ones where there would be more than three a particle.

    With w and h the sides of the bounding box and s at least w/n, h/n and sqrt(w h / n), there are no more than
    (w/s + 1)(h/s + 1) <= 3 n + 1 cells, however thin or wide the particles are spread.
    """
    n = positions.shape[0]
    left, bottom = map(float, positions.min(axis=0))
    right, top = map(float, positions.max(axis=0))
    width, height = right - left, top - bottom
    size = max(radius, width / n, height / n, math.sqrt(width / n) * math.sqrt(height))
    return CellGrid(left, bottom, size, int(width / size) + 1, int(height / size) + 1)


def make_cells(positions: Floats, radius: float) -> CellList:
    """Sort particles (n, 2), at least one and all finite, into cells that suit a search radius (m)."""
    grid = lay_grid(positions, radius)
    starts = np.zeros(grid.columns * grid.rows + 2, np.int64)
    cells = CellList(grid, starts, np.empty(positions.shape[0], np.int64))
    sort_into_cells(positions, cells)
    return cells


def find_neighbours(positions: Floats, points: Floats, radius: float) -> Neighbours:
    """Return, for each of the points (m, 2), the particles (n, 2) nearer than `radius`; all in metres and finite.

    A particle that is a point itself is listed as its own neighbour. Raises ValueError for a coordinate that is not
    finite, for no particles and for a radius that is not positive.
    """
    if not (np.isfinite(positions).all() and np.isfinite(points).all()):
        raise ValueError("positions and points must be finite")
    if positions.shape[0] == 0 or not 0.0 < radius < math.inf:
        raise ValueError("a neighbour search needs at least one particle and a radius above zero")
    cells = make_cells(positions, radius)
    offsets = np.empty(points.shape[0] + 1, np.int64)
    list_neighbours(positions, cells, points, radius, offsets, NOTHING)
    indices = np.empty(offsets[-1], np.int64)
    list_neighbours(positions, cells, points, radius, offsets, indices)
    return Neighbours(offsets, indices)

"""Who is near whom: square cells over bodies or particles, and the pairs of bodies whose reaches meet.

Cells of particles lie over their bounding box, so that neighbouring ones of a row are one stretch of the sorted places.
Where a few have flown so far that there would be too many cells, they lie over the bulk: what is beyond counts to the
outermost. Those of bodies are parts of an endless grid, so that what is elsewhere does not change the order of pairs.

No neighbour is missed to round-off. If |x_b - x| <= radius as computed, the cell of x_b lies between the cells of
x - radius and x + radius, because rounding keeps order. So lists equal those of a search over all pairs, on cell edges
too.

Lists reach farther than contacts, and stay good until something has moved by what they reach farther (L. Verlet, Phys.
Rev. 159 (1967) 98). How far that is, and what is done with a pair, is a matter of each scheme.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from blocksim.kernels.common import arrays, jit, shapes, tolerances


class CellGrid(NamedTuple):
    """Square cells, numbered row by row from the lower left one."""

    x: float  # m: where the lower left corner of the first cell is
    y: float  # m
    size: float  # m, side of a cell
    columns: int
    rows: int
    is_endless: bool  # whether columns and rows, powers of two then, follow one another over and over again


@jit.kernel
def cell_along(place: float, begin: float, size: float) -> int:
    """Return how many cells of a size (m) lie between a beginning and a place."""
    return int(min(max(np.floor((place - begin) / size), -tolerances.FARTHEST_CELL), tolerances.FARTHEST_CELL))


@jit.kernel
def column_of(grid: CellGrid, x: float) -> int:
    """Return the column that a place (m) is in; places outside count to the nearest one."""
    return min(max(cell_along(x, grid.x, grid.size), 0), grid.columns - 1)


@jit.kernel
def row_of(grid: CellGrid, y: float) -> int:
    """Return the row that a place (m) is in; places outside count to the nearest one."""
    return min(max(cell_along(y, grid.y, grid.size), 0), grid.rows - 1)


@jit.kernel
def endless_number(grid: CellGrid, column: int, row: int) -> int:
    """Return the number of a cell of an endless grid."""
    return (row & (grid.rows - 1)) * grid.columns + (column & (grid.columns - 1))


@jit.kernel
def cell_number(grid: CellGrid, x: float, y: float) -> int:
    """Return the number of the cell of a place (m); one that is no number is in the first cell."""
    if not math.isfinite(x + y):
        return 0
    if grid.is_endless:
        return endless_number(grid, cell_along(x, grid.x, grid.size), cell_along(y, grid.y, grid.size))
    return row_of(grid, y) * grid.columns + column_of(grid, x)


@jit.rare_kernel
def ends_along(places: arrays.Records, is_x: bool, most: float) -> tuple[float, float]:
    """Return from where to where (m) all lie along an axis, those farther than `most` from its origin taken there."""
    low, high = math.inf, -math.inf
    for i in range(places.size):
        place = places[i].x if is_x else places[i].y
        if math.isfinite(place):
            place = min(max(place, -most), most)
            low, high = min(low, place), max(high, place)
    return (low, high) if low <= high else (0.0, 0.0)


@jit.rare_kernel
def bulk_along(places: arrays.Records, is_x: bool, low: float, high: float) -> tuple[float, float]:
    """Return the part of an extent (m) that holds all but a few, those beyond it taken to be at its ends."""
    middle, away = 0.0, 0.0
    for i in range(places.size):
        place = places[i].x if is_x else places[i].y
        if math.isfinite(place):
            middle += min(max(place, low), high) / places.size
    for i in range(places.size):
        place = places[i].x if is_x else places[i].y
        if math.isfinite(place):
            away += tolerances.FAR_OUT * abs(min(max(place, low), high) - middle) / places.size
    return max(low, middle - away), max(low, min(high, middle + away))


@jit.rare_kernel
def lay_cells(places: arrays.Records, size: float, count: float, is_endless: bool) -> CellGrid:
    """Return cells of a size (m) over all places, at most 3 count + 1.

    An endless grid is the same whatever lies in it: cells far apart may share a number. Else, where there would be too
    many, they lie over the bulk or are larger. With w and h the sides and s at least w/n, h/n and (w h/n)^(1/2) there
    are no more than (w/s + 1)(h/s + 1), at most 3 n + 1, cells, however thin or wide the box is.
    """
    left, right = ends_along(places, True, tolerances.FARTHEST_CELL * size)
    bottom, top = ends_along(places, False, tolerances.FARTHEST_CELL * size)
    if is_endless:
        columns = rows = 1
        while columns * size < right - left + size and 2.0 * columns <= 3.0 * count:
            columns *= 2
        while rows * size < top - bottom + size and 2.0 * rows * columns <= 3.0 * count:
            rows *= 2
        return CellGrid(0.0, 0.0, size, columns, rows, True)
    before = math.inf
    while True:
        width, height = right - left, top - bottom
        fitting = max(size, width / count, height / count, math.sqrt(width / count) * math.sqrt(height))
        if fitting <= size or not fitting < 0.5 * before:
            return CellGrid(left, bottom, fitting, int(width / fitting) + 1, int(height / fitting) + 1, False)
        before = fitting
        left, right = bulk_along(places, True, left, right)
        bottom, top = bulk_along(places, False, bottom, top)


@jit.rare_kernel
def sort_into_cells(places: arrays.Records, grid: CellGrid, starts: arrays.Integers, order: arrays.Integers) -> None:
    """Sort by counting: places of cell c are order[starts[c]:starts[c + 1]], in rising order.

    Counts are kept two entries late, so that summed up they are the cells' beginnings one entry late; every place that
    is written moves its entry on, up to the beginning of the next cell. So `starts` has two entries more than cells.
    """
    cells = grid.columns * grid.rows
    for c in range(cells + 2):
        starts[c] = 0
    for i in range(places.size):
        starts[cell_number(grid, places[i].x, places[i].y) + 2] += 1
    for c in range(cells + 1):
        starts[c + 1] += starts[c]
    for i in range(places.size):
        c = cell_number(grid, places[i].x, places[i].y)
        order[starts[c + 1]] = i
        starts[c + 1] += 1


@jit.kernel
def top_speed(body: arrays.Record, vx: float, vy: float) -> float:
    """Return an upper bound (m/s) of the speed of a body's points in a frame of some velocity (m/s)."""
    return math.sqrt((body.vx - vx) ** 2 + (body.vy - vy) ** 2) + body.radius * abs(body.spin)


@jit.kernel
def travel(body: arrays.Record, x: float, y: float) -> float:
    """Return how far (m) a corner of a body may have come since the list was made, in a frame that has come (x, y)."""
    dx = body.x - body.list_x - x
    dy = body.y - body.list_y - y
    return math.sqrt(dx * dx + dy * dy) + body.radius * abs(body.angle - body.list_angle)


@jit.rare_kernel
def note_places(bodies: arrays.Records) -> None:
    """Note where all bodies are when a list is made."""
    for body in bodies:
        body.list_x = body.x
        body.list_y = body.y
        body.list_angle = body.angle


class Stale(NamedTuple):
    """Which pairs are listed where not all are: those with a marked body, and how far each body reaches (m)."""

    marks: arrays.Integers  # (n + 1,)
    reaches: arrays.Floats  # (n + 1,) m


@jit.rare_kernel
def add_if_near(world: arrays.World, pairs: Any, stale: Stale | None, reach: float, i: int, j: int, count: int) -> int:
    """List two bodies, at least one of them free, if they are near and there is room; return the count needed.

    Near means a gap (m) of no more than `reach`, or than what the reaches of both add up to.
    """
    body, other = world.bodies[i], world.bodies[j]
    if stale is not None:
        reach = stale.reaches[i] + stale.reaches[j]
    if j == world.bodies.size - 1:
        is_near = body.inverse_mass > 0.0 and shapes.ground_gap(body) <= other.y + reach
    else:
        dx, dy = body.x - other.x, body.y - other.y
        limit = body.radius + other.radius + reach
        is_near = dx * dx + dy * dy <= limit * limit and body.inverse_mass + other.inverse_mass > 0.0
        is_near = is_near and shapes.separation(body, other) <= reach
    if is_near and count < pairs.size:
        pairs[count].a = min(i, j)
        pairs[count].b = max(i, j)
    return count + 1 if is_near else count


@jit.rare_kernel
def add_from_cell(
    world: arrays.World,
    pairs: Any,
    stale: Stale | None,
    reach: float,
    i: int,
    grid: CellGrid,
    cell: tuple[int, int],
    is_whole: bool,
    count: int,
) -> int:
    """List body i with what is near it in a cell (column, row), the whole of it or not; return the count needed."""
    column, row = cell
    number = endless_number(grid, column, row)
    for k in range(world.starts[number], world.starts[number + 1]):
        j = world.order[k]
        other = world.bodies[j]
        is_listed = is_whole or is_listed_from(stale, i, j)
        if is_listed and other.radius <= world.controls[0].cell_radius:
            more = add_if_near(world, pairs, stale, reach, i, j, count)
            # the cell may share its number with others
            if more > count and cell_along(other.x, grid.x, grid.size) == column:
                count += int(cell_along(other.y, grid.y, grid.size) == row)
    return count


@jit.kernel
def is_asked(stale: Stale | None, i: int) -> bool:
    """Return True if pairs of a body are sought."""
    if stale is None:
        return True
    return stale.marks[i] > 0


@jit.kernel
def is_listed_from(stale: Stale | None, i: int, j: int) -> bool:
    """Return True if a pair is sought from body i, not from body j."""
    return j > i or (j != i and not is_asked(stale, j))


@jit.rare_kernel
def list_pairs(world: arrays.World, pairs: Any, stale: Stale | None, reach: float, is_half: bool) -> int:
    """List all pairs of bodies that are near one another; return how many there are, fitting or not.

    Each pair is found from one body, in the cells all around it: from the first, or from the only one that is marked.
    Pairs found from one body are sorted. Where all bodies are asked for, `is_half` visits each two neighbouring cells
    from one of them only: from the left one, or the lower one. Bodies too large for the cells, and the ground, are
    tested one by one.
    """
    controls, bodies, starts = world.controls[0], world.bodies, world.starts
    ground = bodies.size - 1
    blocks: Any = bodies[:ground]
    grid = lay_cells(blocks, controls.cell_width, (starts.size - 3) / 3.0, True)
    sort_into_cells(blocks, grid, starts, world.order)
    count = 0
    for i in range(ground):
        if not is_asked(stale, i):
            continue
        body = bodies[i]
        first_pair = count
        is_large = body.radius > controls.cell_radius
        if is_large and not is_half:
            for j in range(ground):
                if is_listed_from(stale, i, j):
                    count = add_if_near(world, pairs, stale, reach, i, j, count)
        if not is_large:
            own_column, own_row = cell_along(body.x, 0.0, grid.size), cell_along(body.y, 0.0, grid.size)
            for row in range(own_row if is_half else own_row - 1, own_row + 2):
                for column in range(own_column if is_half and row == own_row else own_column - 1, own_column + 2):
                    is_whole = is_half and (row > own_row or column > own_column)
                    count = add_from_cell(world, pairs, stale, reach, i, grid, (column, row), is_whole, count)
        if is_half or not is_large:
            for j in world.large:
                if is_listed_from(stale, i, j) or (is_half and not is_large):
                    count = add_if_near(world, pairs, stale, reach, i, j, count)
        if not is_half:
            sort_pairs(pairs, first_pair, min(count, pairs.size))
        count = add_if_near(world, pairs, stale, reach, i, ground, count)
    return count


@jit.rare_kernel
def sort_pairs(pairs: Any, begin: int, end: int) -> None:
    """Sort a few pairs by both bodies."""
    for m in range(begin + 1, end):
        a, b = pairs[m].a, pairs[m].b
        k = m
        while k > begin and (pairs[k - 1].a > a or (pairs[k - 1].a == a and pairs[k - 1].b > b)):
            pairs[k].a = pairs[k - 1].a
            pairs[k].b = pairs[k - 1].b
            k -= 1
        pairs[k].a = a
        pairs[k].b = b

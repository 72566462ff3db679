"""Particles in the order of their cells, and a list of neighbours for every four of them.

Four particles in a row, a cluster, share one list: all that are near to any of them, they themselves included. A
processor then deals with four particles at a time, one a lane, and reads every neighbour once; as cells are of twice
the spacing, the four lie close together, and their list is but half as long again as that of one (50 and 34).

Lists reach farther than the kernel by a skin. They are made again before any two particles, or a particle and a body,
can have come nearer by the skin: travel is summed up from the highest speed of every drift. That decides no physics
but the order of sums, and follows from the state alone, so that it is the same for any number of threads.
"""

import math

from blocksim.kernels.common import arrays, jit
from blocksim.kernels.common.simd import Lanes, fields_0, is_all, spread
from blocksim.kernels.soil.arrays import CLUSTER, GROUP, Soils
from blocksim.kernels.sph.cells import CellGrid, cell_number, clipped_cell

CELL = 2.0  # side of a cell, in spacings
FAR = 4.0  # mean distances from the middle, beyond which particles count to the outermost cells
PASSES = 16  # at most, to find these


@jit.rare_kernel
def fastest_body(world: arrays.World) -> float:
    """Return an upper bound (m/s) of the speed of any point of any body, those of the supports included."""
    fastest = 0.0
    for i in range(world.bodies.size):
        body = world.bodies[i]
        speed = math.sqrt(body.vx**2 + body.vy**2)
        if body.spin != 0.0:
            speed += body.radius * abs(body.spin)
        fastest = max(fastest, speed)
    return fastest


@jit.rare_kernel
def travelled(soils: Soils, world: arrays.World, step: float) -> float:
    """Return how far (m) anything may have moved since the lists were made, the current drift included."""
    fastest = fastest_body(world)
    for tally in soils.tallies:
        fastest = max(fastest, tally.fastest)
    return soils.controls[0].travel + step * fastest


@jit.kernel
def are_lists_due(soils: Soils, travel: float) -> bool:
    """Return True if lists no longer hold all neighbours; of two that approach each may have moved by the travel."""
    controls = soils.controls[0]
    return controls.is_listed == 0 or not 2.0 * travel <= controls.skin


@jit.kernel
def grid_of(soils: Soils) -> CellGrid:
    """Return the cells."""
    controls = soils.controls[0]
    return CellGrid(controls.left, controls.bottom, controls.cell, controls.columns, controls.rows)


@jit.kernel
def cell_of(grid: CellGrid, x: float, y: float) -> int:
    """Return the cell of a place (m); one that is no number is in the first cell."""
    return cell_number(grid, x, y) if math.isfinite(x + y) else 0


@jit.rare_kernel
def bulk_along(points: arrays.Records, is_x: bool, least: float, most: float) -> tuple[float, float]:
    """Return from where to where (m) the particles from `least` to `most` lie, but for those far from the others."""
    low, high, total, away, count = math.inf, -math.inf, 0.0, 0.0, 0
    for i in range(points.size):
        place = points[i].x if is_x else points[i].y
        if math.isfinite(place) and least <= place <= most:
            low, high = min(low, place), max(high, place)
            total += place
            count += 1
    if count == 0:
        return 0.0, 0.0
    middle = total / count
    for i in range(points.size):
        place = points[i].x if is_x else points[i].y
        if math.isfinite(place) and least <= place <= most:
            away += abs(place - middle)
    away *= FAR / count
    return max(low, middle - away), max(low, min(high, middle + away))


@jit.rare_kernel
def extent_along(points: arrays.Records, is_x: bool) -> tuple[float, float]:
    """Return from where to where (m) cells are of use along an axis.

    Over the whole way to a few particles that have flown off, they would be so large that nothing is sorted.
    """
    low, high = bulk_along(points, is_x, -math.inf, math.inf)
    for _ in range(PASSES):
        before = high - low
        low, high = bulk_along(points, is_x, low, high)
        if not high - low < 0.5 * before:
            break
    return low, high


@jit.rare_kernel
def ends_along(points: arrays.Records, is_x: bool) -> tuple[float, float]:
    """Return from where to where (m) all particles lie along an axis, those that have flown off included."""
    low, high = math.inf, -math.inf
    for i in range(points.size):
        place = points[i].x if is_x else points[i].y
        if math.isfinite(place):
            low, high = min(low, place), max(high, place)
    return low, high


@jit.rare_kernel
def lay_cells(soils: Soils) -> None:
    """Lay cells over the particles: as large as clusters ought to be, or larger where there would be too many.

    With w and h the sides and s at least 2 w/n, 2 h/n and (2 w h/n)^(1/2) there are no more than
    (w/s + 1)(h/s + 1) <= 3 n/2 + 1 cells.
    """
    controls = soils.controls[0]
    half = 0.5 * soils.points.size
    left, right = extent_along(soils.points, True)
    bottom, top = extent_along(soils.points, False)
    width, height = right - left, top - bottom
    size = max(CELL * math.sqrt(controls.area), width / half, height / half)
    size = max(size, math.sqrt(width / half) * math.sqrt(height))
    controls.left, controls.bottom, controls.cell = left, bottom, size
    controls.columns = int(width / size) + 1
    controls.rows = int(height / size) + 1
    controls.least_x, controls.most_x = ends_along(soils.points, True)
    controls.least_y, controls.most_y = ends_along(soils.points, False)


@jit.rare_kernel
def sort_particles(soils: Soils) -> None:
    """Find the order of the particles by their cells; within a cell it stays as it is.

    Counting, as `sph.cells.sort_into_cells`.
    """
    grid = grid_of(soils)
    starts, points = soils.starts, soils.points
    cells = grid.columns * grid.rows
    for c in range(cells + 2):
        starts[c] = 0
    for i in range(points.size):
        starts[cell_of(grid, points[i].x, points[i].y) + 2] += 1
    for c in range(cells + 1):
        starts[c + 1] += starts[c]
    for i in range(points.size):
        c = cell_of(grid, points[i].x, points[i].y)
        soils.order[starts[c + 1]] = i
        starts[c + 1] += 1


@jit.rare_kernel
def move_particles(soils: Soils) -> None:
    """Bring all particles into the order found, cycle by cycle in place."""
    points, states, order = soils.points, soils.states, soils.order
    for begin in range(points.size):
        if order[begin] != begin:
            soils.spare_point[0] = points[begin]
            soils.spare_state[0] = states[begin]
            i = begin
            while order[i] != begin:
                j = int(order[i])
                points[i] = points[j]
                states[i] = states[j]
                order[i] = i
                i = j
            points[i] = soils.spare_point[0]
            states[i] = soils.spare_state[0]
            order[i] = i


@jit.kernel
def clusters_of_group(soils: Soils, g: int) -> range:
    """Return the clusters of a group."""
    return range(GROUP // CLUSTER * g, (min(GROUP * (g + 1), soils.points.size) + CLUSTER - 1) // CLUSTER)


@jit.kernel
def places_of(soils: Soils, c: int) -> tuple[int, int, int, int]:
    """Return which particles are in the lanes of a cluster; the last particle of all fills up the last cluster."""
    last = soils.points.size - 1
    i = CLUSTER * c
    return i, min(i + 1, last), min(i + 2, last), min(i + 3, last)


@jit.kernel
def is_near_any(x: Lanes, y: Lanes, other_x: float, other_y: float, radius: float) -> bool:
    """Return True if a place (m) is nearer than the radius to any of four; one that is no number is near to none."""
    dx, dy = other_x - x, other_y - y
    everywhere = spread(0.0) <= 0.0
    return not is_all((dx * dx + dy * dy < radius * radius) ^ everywhere)


@jit.rare_kernel
def list_of(soils: Soils, grid: CellGrid, c: int, near: arrays.Integers, begin: int) -> int:
    """Write the list of cluster c from `begin` on, as far as there is room; return where it ends."""
    controls, points = soils.controls[0], soils.points
    radius = controls.reach + controls.skin
    left = bottom = math.inf
    right = top = -math.inf
    for i in range(CLUSTER * c, min(CLUSTER * (c + 1), points.size)):
        if math.isfinite(points[i].x + points[i].y):
            left, right = min(left, points[i].x), max(right, points[i].x)
            bottom, top = min(bottom, points[i].y), max(top, points[i].y)
    if left > right:
        return begin
    x, y, _, _ = fields_0(None, points, places_of(soils, c))
    first = clipped_cell(left - radius - grid.left, grid.size, grid.columns)
    last = clipped_cell(right + radius - grid.left, grid.size, grid.columns)
    low = clipped_cell(bottom - radius - grid.bottom, grid.size, grid.rows)
    high = clipped_cell(top + radius - grid.bottom, grid.size, grid.rows)
    end = begin
    for row in range(low, high + 1):
        start = soils.starts[row * grid.columns + first]
        stop = soils.starts[row * grid.columns + last + 1]
        for j in range(start, stop):
            if is_near_any(x, y, points[j].x, points[j].y, radius):
                if end < near.size:
                    near[end] = j
                end += 1
    return end


@jit.rare_kernel
def list_neighbours(soils: Soils, first: int, last: int) -> None:
    """Write the lists of the groups from `first` to before `last`.

    A group with more neighbours than there is room for ends the run, see energy.survey.
    """
    grid = grid_of(soils)
    for g in range(first, last):
        near = soils.lists[g]
        begin = 0
        for c in clusters_of_group(soils, g):
            end = list_of(soils, grid, c, near, begin)
            if end > near.size:
                soils.controls[0].is_full = 1
                end = near.size
            soils.lengths[c] = end - begin
            begin = end

"""Particles in the order of their cells, and a list of neighbours for each of them.

Lists reach farther than the kernel by a skin. They are made again before any two particles, or a particle and a body,
can have come nearer by the skin: travel is summed up from the highest speed of every drift. That decides no physics
but the order of sums, and follows from the state alone, so that it is the same for any number of threads.
"""

import math

from blocksim.kernels.common.arrays import World
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.soil.arrays import Soils
from blocksim.kernels.sph.cells import CellGrid, cell_number, clipped_cell


@rare_kernel
def fastest_body(world: World) -> float:
    """Return an upper bound (m/s) of the speed of any point of any body, those of the supports included."""
    fastest = 0.0
    for i in range(world.bodies.size):
        body = world.bodies[i]
        speed = math.sqrt(body.vx**2 + body.vy**2)
        if body.spin != 0.0:
            speed += body.radius * abs(body.spin)
        fastest = max(fastest, speed)
    return fastest


@rare_kernel
def travelled(soils: Soils, world: World, step: float) -> float:
    """Return how far (m) anything may have moved since the lists were made, the current drift included."""
    fastest = fastest_body(world)
    for tally in soils.tallies:
        fastest = max(fastest, tally.fastest)
    return soils.controls[0].travel + step * fastest


@kernel
def are_lists_due(soils: Soils, travel: float) -> bool:
    """Return True if lists no longer hold all neighbours; of two that approach each may have moved by the travel."""
    controls = soils.controls[0]
    return controls.is_listed == 0 or not 2.0 * travel <= controls.skin


@kernel
def grid_of(soils: Soils) -> CellGrid:
    """Return the cells."""
    controls = soils.controls[0]
    return CellGrid(controls.left, controls.bottom, controls.cell, controls.columns, controls.rows)


@kernel
def cell_of(grid: CellGrid, x: float, y: float) -> int:
    """Return the cell of a place (m); one that is no number is in the first cell."""
    return cell_number(grid, x, y) if math.isfinite(x + y) else 0


@rare_kernel
def lay_cells(soils: Soils) -> None:
    """Lay cells over all particles: as large as the lists reach, or larger where there would be too many.

    As `sph.cells.lay_grid`, whose docstring shows that there are at most 3 n + 1.
    """
    controls = soils.controls[0]
    n = soils.points.size
    left = bottom = math.inf
    right = top = -math.inf
    for i in range(n):
        point = soils.points[i]
        if math.isfinite(point.x + point.y):
            left, right = min(left, point.x), max(right, point.x)
            bottom, top = min(bottom, point.y), max(top, point.y)
    if left > right:
        left = bottom = right = top = 0.0
    width, height = right - left, top - bottom
    size = max(controls.reach + controls.skin, width / n, height / n, math.sqrt(width / n) * math.sqrt(height))
    controls.left, controls.bottom, controls.cell = left, bottom, size
    controls.columns = int(width / size) + 1
    controls.rows = int(height / size) + 1


@rare_kernel
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


@rare_kernel
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


@rare_kernel
def list_of(soils: Soils, grid: CellGrid, i: int) -> None:
    """Write the list of particle i. One with more neighbours than there is room for ends the run, see energy.survey."""
    points = soils.points
    one = points[i]
    controls = soils.controls[0]
    radius = controls.reach + controls.skin
    column = clipped_cell(one.x - grid.left, grid.size, grid.columns)
    row = clipped_cell(one.y - grid.bottom, grid.size, grid.rows)
    room = soils.lists.shape[1]
    count = 0
    for r in range(max(row - 1, 0), min(row + 2, grid.rows)):
        begin = soils.starts[r * grid.columns + max(column - 1, 0)]
        end = soils.starts[r * grid.columns + min(column + 1, grid.columns - 1) + 1]
        for j in range(begin, end):
            dx = points[j].x - one.x
            dy = points[j].y - one.y
            if dx * dx + dy * dy < radius * radius and j != i:
                if count < room:
                    soils.lists[i, count] = j
                count += 1
    if count > room:
        controls.is_full = 1
    soils.lengths[i] = min(count, room)


@rare_kernel
def list_neighbours(soils: Soils, first: int, last: int) -> None:
    """Write the lists of the particles from `first` to before `last`."""
    grid = grid_of(soils)
    for i in range(first, last):
        if math.isfinite(soils.points[i].x + soils.points[i].y):
            list_of(soils, grid, i)
        else:
            soils.lengths[i] = 0

"""Particles in the order of their cells, and a list of neighbours for every four of them.

Four particles in a row, a cluster, share one list: all that are near to any of them, they themselves included. A
processor then deals with four particles at a time, one a lane, and reads every neighbour once; as cells are of twice
the spacing, the four lie close together, and their list is but half as long again as that of one (50 and 34).

Lists reach farther than the kernel by a skin. They are made again before any two particles, or a particle and a body,
can have come nearer by the skin: travel is summed up from the highest speed of every drift. That decides no physics
but the order of sums, and follows from the state alone, so that it is the same for any number of threads.
"""

import math

from blocksim.kernels.common import arrays, jit, neighbours, tolerances
from blocksim.kernels.common.simd import fields_0, is_all, spread
from blocksim.kernels.soil.arrays import CLUSTER, GROUP, Soils


@jit.rare_kernel
def travelled(soils: Soils, world: arrays.World, step: float) -> float:
    """Return how far (m) anything may have moved since the lists were made, the current drift included."""
    fastest = 0.0
    for i in range(world.bodies.size):
        fastest = max(fastest, neighbours.top_speed(world.bodies[i], 0.0, 0.0))
    for tally in soils.tallies:
        fastest = max(fastest, tally.fastest)
    return soils.controls[0].travel + step * fastest


@jit.kernel
def grid_of(soils: Soils) -> neighbours.CellGrid:
    """Return the cells."""
    controls = soils.controls[0]
    return neighbours.CellGrid(controls.left, controls.bottom, controls.cell, controls.columns, controls.rows, False)


@jit.rare_kernel
def sort_particles(soils: Soils) -> None:
    """Lay cells as large as clusters ought to be over the particles, and bring these into their order."""
    controls, points = soils.controls[0], soils.points
    grid = neighbours.lay_cells(points, tolerances.CLUSTER_CELL * math.sqrt(controls.area), 0.5 * points.size, False)
    controls.left, controls.bottom, controls.cell = grid.x, grid.y, grid.size
    controls.columns, controls.rows = grid.columns, grid.rows
    controls.least_x, controls.most_x = neighbours.ends_along(points, True, math.inf)
    controls.least_y, controls.most_y = neighbours.ends_along(points, False, math.inf)
    neighbours.sort_into_cells(points, grid, soils.starts, soils.order)
    move_particles(soils)


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


@jit.rare_kernel
def list_of(soils: Soils, grid: neighbours.CellGrid, c: int, near: arrays.Integers, begin: int) -> int:
    """Write the list of cluster c from `begin` on, as far as there is room; return where it ends.

    What is nearer than the radius to any of its particles is in it; one whose place is no number is near to none.
    """
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
    first, last = neighbours.column_of(grid, left - radius), neighbours.column_of(grid, right + radius)
    everywhere = spread(0.0) <= 0.0
    end = begin
    for row in range(neighbours.row_of(grid, bottom - radius), neighbours.row_of(grid, top + radius) + 1):
        for j in range(soils.starts[row * grid.columns + first], soils.starts[row * grid.columns + last + 1]):
            dx, dy = points[j].x - x, points[j].y - y
            if not is_all((dx * dx + dy * dy < radius * radius) ^ everywhere):
                if end < near.size:
                    near[end] = j
                end += 1
    return end


@jit.rare_kernel
def list_neighbours(soils: Soils, first: int, last: int) -> None:
    """Write the lists of the groups from `first` to before `last`.

    A group with more neighbours than there is room for ends the run, see step.survey.
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

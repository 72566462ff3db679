"""A linked-cell grid of bodies, hashed, so that it does not matter how far they fly."""

import math

from blocksim.kernels.common import arrays, jit

FARTHEST_CELL = 1e9  # bodies beyond it share cells


PRIME_COLUMN, PRIME_ROW = 73856093, 19349663  # M. Teschner et al., Proc. VMV (2003) 47-54


@jit.rare_kernel
def cell_of(place: float, width: float) -> int:
    """Return the number of the cell along one axis."""
    return math.floor(min(max(place / width, -FARTHEST_CELL), FARTHEST_CELL))


@jit.rare_kernel
def bucket(column: int, row: int, size: int) -> int:
    """Return the bucket of a cell in a table whose size is a power of two."""
    return (column * PRIME_COLUMN ^ row * PRIME_ROW) & (size - 1)


@jit.rare_kernel
def fill_grid(world: arrays.World) -> None:
    """Link the bodies of every bucket, in the order of their numbers; the largest ones and the ground stay out."""
    controls = world.controls[0]
    world.heads[:] = 0
    for i in range(world.bodies.size - 2, -1, -1):
        body = world.bodies[i]
        if body.radius <= controls.cell_radius:
            k = bucket(cell_of(body.x, controls.cell_width), cell_of(body.y, controls.cell_width), world.heads.size)
            world.links[i] = world.heads[k]
            world.heads[k] = i + 1

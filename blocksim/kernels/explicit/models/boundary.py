"""What the two models with boundary particles share.

Particles of a body lie in four rows, counter-clockwise: the lower face from its left end, then right, upper, left face.
"""

import math

from blocksim.kernels.common.arrays import Integers, Record, World
from blocksim.kernels.common.geometry import relative_pose
from blocksim.kernels.common.jit import kernel, rare_kernel

ROWS = 4
FACE = 2.0  # stiffness of a face contact over that of a corner contact


@kernel
def row_direction(row: int) -> tuple[float, float]:
    """Return the direction of a row of particles in the body frame; its outward normal is (dy, -dx)."""
    if row == 0:
        return 1.0, 0.0
    if row == 1:
        return 0.0, 1.0
    if row == 2:
        return -1.0, 0.0
    return 0.0, -1.0


@kernel
def row_intervals(body: Record, row: int) -> int:
    """Return the number of intervals between the particles of a row, from corner to corner."""
    return body.row_x if row % 2 == 0 else body.row_y


@kernel
def seen_from_row(body: Record, inset: float, row: int, px: float, py: float) -> tuple[float, float, float]:
    """Return where a point of the body frame lies as a row sees it: along from its start, above (outside); spacing (m).

    `inset` (m) is how far the row lies inside the face.
    """
    dx, dy = row_direction(row)
    half_x = body.half_x - inset
    half_y = body.half_y - inset
    # rows start at the lower left, lower right, upper right and upper left corner
    x = px - (half_x if row == 1 or row == 2 else -half_x)
    y = py - (half_y if row >= 2 else -half_y)
    side = 2.0 * (half_x if row % 2 == 0 else half_y)
    return dx * x + dy * y, dy * x - dx * y, side / row_intervals(body, row)


@kernel
def first_within(along: float, width: float, spacing: float) -> int:
    """Return the first particle of a row that is nearer than `width` (m) to a place along it."""
    return max(0, math.ceil((along - width) / spacing))


@kernel
def last_within(along: float, width: float, spacing: float, last: int) -> int:
    """Return the last particle of a row that is nearer than `width` (m) to a place along it, at most `last`."""
    return min(last, math.floor((along + width) / spacing))


@rare_kernel
def is_particle_near(owner: Record, particle: Record, touched: Record, reach: float) -> bool:
    """Return True if a particle of `owner` lies inside the rectangle `touched` grown by `reach` (m) on every side."""
    x0, y0, c, s = relative_pose(owner, touched)
    px = x0 + c * particle.x - s * particle.y
    py = y0 + s * particle.x + c * particle.y
    return abs(px) <= touched.half_x + reach and abs(py) <= touched.half_y + reach


@rare_kernel
def particle_height(body: Record, particle: Record) -> float:
    """Return the height (m) of a particle over y = 0."""
    return body.y + body.sin * particle.x + body.cos * particle.y


@rare_kernel
def near_particles(world: World, a: int, b: int, reach: float, out: Integers) -> int:
    """Write the particles of body a that are within reach (m) of body b into `out` and return how many there are."""
    one = world.bodies[a]
    two = world.bodies[b]
    is_ground = b == world.bodies.size - 1
    count = 0
    for k in range(one.particle_count):
        particle = world.particles[one.first_particle + k]
        if is_ground:
            near = particle_height(one, particle) <= two.y + reach
        else:
            near = is_particle_near(one, particle, two, reach)
        if near:
            out[count] = k
            count += 1
    return count

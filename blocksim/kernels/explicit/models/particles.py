"""What the two models with boundary particles share.

Particles of a body lie in four rows, counter-clockwise: the lower face from its left end, then right, upper, left face.

Narrow phase of the `particles` model: particle against particle, Eqs 8 and 9 of Huyen & Cuong 2020.

Every body is a row of discs of diameter h (the particle spacing) along its boundary, their centres inset by h/2, so
that corners are rounded by h/2. Two discs touch while the distance d of their centres is below (h_a + h_i)/2 = h;
overlap h - d, normal along the line of centres. (The paper prints the condition as h_ai > 2 d_ai and leaves h_ai open;
read as h_a + h_i it is this one.) The ground is an endless row of the same discs, centres at x = 0, +-h, +-2h, ... and
h/2 deep; pieces of ground and walls are straight lines.

Such a surface is bumpy: two rows of equal spacing interlock, and the slope between two discs is up to 30 degrees.
Nothing here smooths that, it is what the equations say.

A contact has the stiffness of a face, two corner contacts, times the mean of the tributary over face lengths of both.
"""

import math

from blocksim.kernels.common import arrays, jit, shapes

ROWS = 4
FACE = 2  # stiffness of a face contact over that of a corner contact


@jit.kernel
def row_direction(row: int) -> tuple[float, float]:
    """Return the direction of a row of particles in the body frame; its outward normal is (dy, -dx)."""
    if row == 0:
        return 1.0, 0.0
    if row == 1:
        return 0.0, 1.0
    if row == 2:
        return -1.0, 0.0
    return 0.0, -1.0


@jit.kernel
def row_intervals(body: arrays.Record, row: int) -> int:
    """Return the number of intervals between the particles of a row, from corner to corner."""
    return body.row_x if row % 2 == 0 else body.row_y


@jit.kernel
def seen_from_row(body: arrays.Record, inset: float, row: int, px: float, py: float) -> tuple[float, float, float]:
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


@jit.kernel
def first_within(along: float, width: float, spacing: float) -> int:
    """Return the first particle of a row that is nearer than `width` (m) to a place along it."""
    return max(0, math.ceil((along - width) / spacing))


@jit.kernel
def last_within(along: float, width: float, spacing: float, last: int) -> int:
    """Return the last particle of a row that is nearer than `width` (m) to a place along it, at most `last`."""
    return min(last, math.floor((along + width) / spacing))


@jit.rare_kernel
def is_particle_near(owner: arrays.Record, particle: arrays.Record, touched: arrays.Record, reach: float) -> bool:
    """Return True if a particle of `owner` lies inside the rectangle `touched` grown by `reach` (m) on every side."""
    x0, y0, c, s = shapes.relative_pose(owner, touched)
    px = x0 + c * particle.x - s * particle.y
    py = y0 + s * particle.x + c * particle.y
    return abs(px) <= touched.half_x + reach and abs(py) <= touched.half_y + reach


@jit.rare_kernel
def near_particles(world: arrays.World, a: int, b: int, reach: float, out: arrays.Integers) -> int:
    """Write the particles of body a that are within reach (m) of body b into `out` and return how many there are."""
    one = world.bodies[a]
    two = world.bodies[b]
    is_ground = b == world.bodies.size - 1
    count = 0
    for k in range(one.particle_count):
        particle = world.particles[one.first_particle + k]
        if is_ground:
            near = shapes.to_world(one, particle.x, particle.y)[1] <= two.y + reach
        else:
            near = is_particle_near(one, particle, two, reach)
        if near:
            out[count] = k
            count += 1
    return count


PER_PARTICLE = 4  # slots of a particle; it touches neighbours in a row, which differ modulo four


@jit.rare_kernel
def add_touch(world: arrays.World, count: int, k: int, j: int, dx: float, dy: float, reach: float) -> bool:
    """Fill a point for the particle of slot group k at `point.x, y`, seen from the centre of disc j at (dx, dy).

    `reach` (m) is the distance of centres at which they touch. Returns True if they do.
    """
    square = dx * dx + dy * dy
    if square >= reach * reach or square == 0.0 or count >= world.points.size - 1:
        return False
    distance = math.sqrt(square)
    point = world.points[count]
    point.slot = PER_PARTICLE * k + j % PER_PARTICLE
    point.face = j
    point.nx = dx / distance
    point.ny = dy / distance
    point.depth = reach - distance
    point.beside = math.inf
    return True


@jit.rare_kernel
def touch_ground(world: arrays.World, p: int, k: int, count: int) -> int:
    """Add the contacts of particle k of a block with the discs of the ground; return the new count."""
    pair = world.pairs[p]
    a = world.bodies[pair.a]
    ground = world.bodies[pair.b]
    size = world.controls[0].particle_size
    particle = world.particles[a.first_particle + k]
    x, y = shapes.to_world(a, particle.x, particle.y)
    height = y - ground.y + 0.5 * size
    nearest = math.floor((x - ground.x) / size)
    for j in range(nearest, nearest + 2):
        offset = x - ground.x - j * size
        if add_touch(world, count, k, int(j) & 0xFFFF, offset, height, size):
            point = world.points[count]
            point.x = x - 0.5 * offset
            point.y = y - 0.5 * height
            point.share = FACE * particle.share
            count += 1
    return count


@jit.rare_kernel
def touch_row(world: arrays.World, p: int, k: int, row: int, first: int, count: int) -> int:
    """Add the contacts of particle k of body a with one row of body b, whose first particle is number `first`.

    The last corner of a row is the first particle of the next one. Return the new count.
    """
    pair = world.pairs[p]
    a = world.bodies[pair.a]
    b = world.bodies[pair.b]
    size = world.controls[0].particle_size
    particle = world.particles[a.first_particle + k]
    x, y = shapes.to_world(a, particle.x, particle.y)
    px = b.cos * (x - b.x) + b.sin * (y - b.y)
    py = b.cos * (y - b.y) - b.sin * (x - b.x)
    along, above, spacing = seen_from_row(b, 0.5 * size, row, px, py)
    if abs(above) >= size:
        return count
    dx, dy = row_direction(row)
    last = row_intervals(b, row) - 1
    for j in range(first_within(along, size, spacing), last_within(along, size, spacing, last) + 1):
        offset = along - j * spacing
        ox = offset * dx + above * dy
        oy = offset * dy - above * dx
        if add_touch(world, count, k, first + j, b.cos * ox - b.sin * oy, b.sin * ox + b.cos * oy, size):
            point = world.points[count]
            point.x = x - 0.5 * (b.cos * ox - b.sin * oy)
            point.y = y - 0.5 * (b.sin * ox + b.cos * oy)
            point.share = 0.5 * FACE * (particle.share + world.particles[b.first_particle + first + j].share)
            count += 1
    return count


@jit.rare_kernel
def touch_block(world: arrays.World, p: int, k: int, count: int) -> int:
    """Add the contacts of particle k of body a with the particles of body b; return the new count."""
    b = world.bodies[world.pairs[p].b]
    first = 0
    for row in range(ROWS):
        count = touch_row(world, p, k, row, first, count)
        first += row_intervals(b, row)
    return count


@jit.rare_kernel
def touch_slab(world: arrays.World, p: int, k: int, count: int) -> int:
    """Add the contact of particle k of a block with a piece of ground, which is straight; return the new count."""
    pair = world.pairs[p]
    a = world.bodies[pair.a]
    slab = world.bodies[pair.b]
    particle = world.particles[a.first_particle + k]
    x, y = shapes.to_world(a, particle.x, particle.y)
    dx = x - slab.x
    dy = y - slab.y
    along = slab.cos * dx + slab.sin * dy
    above = slab.cos * dy - slab.sin * dx - slab.half_y
    half = 0.5 * world.controls[0].particle_size
    if (
        abs(along) <= slab.half_x
        and above > 0.0
        and add_touch(world, count, k, 0, -slab.sin * above, slab.cos * above, half)
    ):
        point = world.points[count]
        point.x = x + slab.sin * above
        point.y = y - slab.cos * above
        point.share = FACE * particle.share
        count += 1
    return count


@jit.rare_kernel
def find_points(world: arrays.World, p: int) -> int:
    """Find the contact points of pair p and return how many there are."""
    pair = world.pairs[p]
    is_ground = pair.b == world.bodies.size - 1
    is_slab = world.bodies[pair.b].faces != arrays.ALL
    count = 0
    for m in range(pair.near):
        k = world.candidates[p, m]
        if is_ground:
            count = touch_ground(world, p, k, count)
        elif is_slab:
            count = touch_slab(world, p, k, count)
        else:
            count = touch_block(world, p, k, count)
    return count


@jit.rare_kernel
def near_slots(world: arrays.World, a: int, b: int, reach: float, out: arrays.Integers) -> int:
    """Write the particles of a that are within reach (m) of b into `out` and return how many there are."""
    return near_particles(world, a, b, reach + world.controls[0].particle_size, out)

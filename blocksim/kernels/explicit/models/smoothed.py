"""Narrow phase of the `kernel` model: one force a particle and opposing body, normal and distance from SPH sums.

The particles lie on the true edge, one row a face, with half a tributary length at both ends of a row. A particle i of
one body sees the particles j of the other with the weights

    w_ij = l_j W(|x_i - x_j|, h) max(0, -n_i . n_j)

(tributary length times SPH kernel times how much the two outward normals oppose one another); then

    n = sum w_ij n_j / |sum w_ij n_j|,      d = n . sum w_ij (x_i - x_j) / sum w_ij,     overlap = -d.

On a straight face all n_j agree and n . (x_i - x_j) is the distance from the face whichever j it is: the bumps of the
`particles` model are gone, exactly. Near corners, where two faces are about equally near, the normal turns smoothly.

After the idea of S. Mohseni-Mofidi et al. (2022), kernel-weighted normal and projected distance for rigid bodies of
particles. What is different here: the factor with both normals, and that a face much deeper below the particle than the
nearest one does not count: both keep side faces out of the contact of two aligned blocks. And a particle counts only
while it lies inside the other rectangle: the kernel sums alone would carry a block up to one support radius beyond the
edge that it hangs over. The ground and its pieces are the limit of ever finer particles: exact planes.

A contact has the stiffness of a face, two corner contacts, times tributary over face length times -n_i . n. Where two
blocks touch both rows act, each with half of that.
"""

import math

from blocksim.kernels.common.arrays import ALL, Integers, Record, World
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.common.shapes import slab_depth, to_world
from blocksim.kernels.common.tolerances import LEAST_FACING, NEAR_RATIO
from blocksim.kernels.explicit.models import particles
from blocksim.kernels.sph.functions import kernel_value


@rare_kernel
def add_row(px: float, py: float, facing: float, body: Record, row: int, controls: Record, sums: Record) -> None:
    """Add the particles of one row of `body`, seen from (px, py) in its frame, to the sums of weighted_sums."""
    along, above, spacing = particles.seen_from_row(body, 0.0, row, px, py)
    if abs(above) >= controls.support:
        return
    dx, dy = particles.row_direction(row)
    width = math.sqrt(controls.support * controls.support - above * above)
    last = particles.row_intervals(body, row)
    total = 0.0
    shift = 0.0
    for j in range(
        particles.first_within(along, width, spacing), particles.last_within(along, width, spacing, last) + 1
    ):
        offset = along - j * spacing
        r = math.sqrt(offset * offset + above * above)
        end = 0.5 if j == 0 or j == last else 1.0
        weight = end * spacing * facing * kernel_value(controls.sph_kernel, r, controls.smoothing_length)
        total += weight
        shift += weight * offset
    sums.weight += total
    sums.nx += total * dy
    sums.ny -= total * dx
    sums.x += shift * dx + total * above * dy
    sums.y += shift * dy - total * above * dx


@kernel
def depth_below_row(px: float, py: float, body: Record, row: int) -> float:
    """Return how far (m) a point of the body frame lies inside the face of a row."""
    dx, dy = particles.row_direction(row)
    half = body.half_y if row % 2 == 0 else body.half_x
    return half - (dy * px - dx * py)


@kernel
def least_depth(px: float, py: float, nx: float, ny: float, mx: float, my: float, touched: Record) -> float:
    """Return the depth (m) below the nearest face that a particle at (px, py) can touch.

    For a corner these are the faces that oppose one of its two normals; otherwise all, and where the nearest of them
    does not oppose the particle, it is the neighbour's to touch that one, and this particle touches none.
    """
    is_corner = nx != mx or ny != my
    least = math.inf
    for row in range(particles.ROWS):
        dx, dy = particles.row_direction(row)
        opposes = ny * dx - nx * dy > LEAST_FACING or my * dx - mx * dy > LEAST_FACING
        if opposes or not is_corner:
            least = min(least, depth_below_row(px, py, touched, row))
    return least


@rare_kernel
def weighted_sums(
    px: float, py: float, nx: float, ny: float, deepest: float, body: Record, controls: Record, sums: Record
) -> None:
    """Sum weights, weighted normals and weighted distance vectors of a particle over those of `body`, in its frame.

    Rows that it lies more than `deepest` (m) below do not count. The sums are left in the fields `weight`, `nx`, `ny`,
    `x`, `y` of a contact point.
    """
    sums.x = 0.0
    sums.y = 0.0
    sums.nx = 0.0
    sums.ny = 0.0
    sums.weight = 0.0
    for row in range(particles.ROWS):
        dx, dy = particles.row_direction(row)
        facing = ny * dx - nx * dy
        if facing > LEAST_FACING and depth_below_row(px, py, body, row) <= deepest:
            add_row(px, py, facing, body, row, controls, sums)


@rare_kernel
def smoothed_overlap(sums: Record) -> float:
    """Normalise the sums: unit normal in `nx`, `ny`; return the overlap (m)."""
    length = math.sqrt(sums.nx * sums.nx + sums.ny * sums.ny)
    if length <= 0.0:
        return 0.0
    sums.nx /= length
    sums.ny /= length
    return -(sums.nx * sums.x + sums.ny * sums.y) / sums.weight


@rare_kernel
def resolve_particle(owner: Record, particle: Record, touched: Record, world: World, point: Record) -> bool:
    """Fill place, normal (out of `touched`), overlap and share of one particle; return whether it is in contact."""
    point.x, point.y = to_world(owner, particle.x, particle.y)
    dx = point.x - touched.x
    dy = point.y - touched.y
    px = touched.cos * dx + touched.sin * dy
    py = touched.cos * dy - touched.sin * dx
    if abs(px) > touched.half_x or abs(py) > touched.half_y:
        return False
    c = owner.cos * touched.cos + owner.sin * touched.sin
    s = owner.sin * touched.cos - owner.cos * touched.sin
    nx = c * particle.nx - s * particle.ny
    ny = s * particle.nx + c * particle.ny
    if touched.faces == ALL:
        mx = c * particle.mx - s * particle.my
        my = s * particle.mx + c * particle.my
        deepest = NEAR_RATIO * least_depth(px, py, nx, ny, mx, my, touched)
        weighted_sums(px, py, nx, ny, deepest, touched, world.controls[0], point)
        depth = smoothed_overlap(point)
        mx, my = point.nx, point.ny
    else:
        depth, mx, my = slab_depth(px, py, touched), 0.0, 1.0
    point.x, point.y = to_world(owner, particle.x, particle.y)
    point.nx = touched.cos * mx - touched.sin * my
    point.ny = touched.sin * mx + touched.cos * my
    point.depth = depth
    facing = -(nx * mx + ny * my)
    point.share = particles.FACE * facing * particle.share
    return depth > 0.0 and facing > LEAST_FACING


@rare_kernel
def ground_points(world: World, p: int) -> int:
    """Collect the candidate particles of a block below the ground; return how many there are."""
    pair = world.pairs[p]
    owner = world.bodies[pair.a]
    level = world.bodies[pair.b].y
    count = 0
    for m in range(pair.near):
        k = world.candidates[p, m]
        particle = world.particles[owner.first_particle + k]
        x, y = to_world(owner, particle.x, particle.y)
        facing = -(owner.sin * particle.nx + owner.cos * particle.ny)
        if y < level and facing > LEAST_FACING:
            point = world.points[count]
            point.slot = k
            point.x = x
            point.y = y
            point.nx = 0.0
            point.ny = 1.0
            point.depth = level - y
            point.share = particles.FACE * facing * particle.share
            count += 1
    return count


@rare_kernel
def block_points(world: World, p: int) -> int:
    """Collect the particles of either block that lie in the other one; return how many there are."""
    pair = world.pairs[p]
    a = world.bodies[pair.a]
    b = world.bodies[pair.b]
    of_b = a.particle_count
    both = 0.5 if a.faces == ALL and b.faces == ALL else 1.0
    count = 0
    for m in range(pair.near):
        k = world.candidates[p, m]
        point = world.points[count]
        if k < of_b:
            touches = resolve_particle(a, world.particles[a.first_particle + k], b, world, point)
        else:
            touches = resolve_particle(b, world.particles[b.first_particle + k - of_b], a, world, point)
            point.nx = -point.nx
            point.ny = -point.ny
        if touches:
            point.slot = k
            point.share *= both
            count += 1
    return count


@rare_kernel
def find_points(world: World, p: int) -> int:
    """Find the contact points of pair p and return how many there are."""
    if world.pairs[p].b == world.bodies.size - 1:
        count = ground_points(world, p)
    else:
        count = block_points(world, p)
    for i in range(count):
        world.points[i].face = 0
        world.points[i].beside = math.inf
    return count


@rare_kernel
def near_slots(world: World, a: int, b: int, reach: float, out: Integers) -> int:
    """Write the slots of a pair whose particles are within reach (m) into `out` and return how many there are."""
    of_b = world.bodies[a].particle_count
    count = particles.near_particles(world, a, b, reach, out)
    if b == world.bodies.size - 1:
        return count
    more = particles.near_particles(world, b, a, reach, out[count:])
    for m in range(count, count + more):
        out[m] += of_b
    return count + more

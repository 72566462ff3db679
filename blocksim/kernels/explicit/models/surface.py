"""Narrow phase of the `surface` model: corners of one body against the exact rectangle of another, or the ground.

Two rectangles have at most two points of contact. While they overlap by less than half of any side, at most two corners
of each lie in the other; if that is so for more than two in all, one end of a face of one body lies at the end of a
face of the other, and of these duplicates one counts. (In 12 random heaps of three shapes, 20 blocks each and up to 700
000 steps, there never was a third.) Should there be one after all, the shallowest does not count.

Corners of the `surface` model, and which of two corners that meet counts.
"""

import math

from blocksim.kernels.common.arrays import ALL, CONTACTS, HALF, NO_FACE, Integers, Record, Records, World
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.common.shapes import corner_offset, relative_pose, slab_depth, to_world
from blocksim.kernels.common.tolerances import BESIDE_SHARE, CONE_TOLERANCE, ONE_PLACE, SAME_FACE


@kernel
def corner_signs(corner: int) -> tuple[float, float]:
    """Return +-1 for the side of a body that a corner lies on, along its own x and y."""
    return 1.0 if corner == 1 or corner == 2 else -1.0, 1.0 if corner >= 2 else -1.0


@rare_kernel
def outward_along(body: Record, corner: int, tx: float, ty: float) -> float:
    """Return the component along (tx, ty) of the vector (m) from the centre of a body to one of its corners."""
    sx, sy = corner_signs(corner)
    x, y = to_world(body, sx * body.half_x, sy * body.half_y)
    return tx * (x - body.x) + ty * (y - body.y)


@rare_kernel
def same_end(of_a: Record, of_b: Record, a: Record, b: Record) -> bool:
    """Return True if a corner of a and a corner of b (both points) mark the same end of one face contact."""
    if of_a.nx * of_b.nx + of_a.ny * of_b.ny < SAME_FACE:
        return False
    end_a = outward_along(a, of_a.slot, -of_a.ny, of_a.nx)
    end_b = outward_along(b, of_b.slot - HALF, -of_a.ny, of_a.nx)
    return end_a * end_b > 0.0


@rare_kernel
def is_oblique(a: Record, b: Record) -> bool:
    """Return True if no face of a is nearly parallel to a face of b, so that they touch in one point at most."""
    c = abs(a.cos * b.cos + a.sin * b.sin)
    s = abs(a.sin * b.cos - a.cos * b.sin)
    return min(c, s) > CONE_TOLERANCE


@rare_kernel
def coincide(one: Record, two: Record) -> bool:
    """Return True if two corners meet: they are about as near to one another as they are deep."""
    dx = one.x - two.x
    dy = one.y - two.y
    reach = ONE_PLACE * max(one.depth, two.depth)
    return dx * dx + dy * dy < reach * reach


@rare_kernel
def was_touching(slot: int, contacts: Records, count: int) -> bool:
    """Return True if a corner is among the first `count` contacts."""
    for j in range(count):
        if contacts[j].slot == slot:
            return True
    return False


@rare_kernel
def keeps_first(one: Record, two: Record, pair: Record, contacts: Records, oblique: bool) -> bool:
    """Choose between two coinciding corners.

    Oblique: the shallower one, which is the nearest edge of the Minkowski difference, so that the overlap changes
    continuously when the corners pass one another. Parallel: the one already in contact, otherwise the deeper one,
    otherwise that of a.
    """
    if oblique:
        return one.depth <= two.depth
    was_one = was_touching(one.slot, contacts, pair.active)
    was_two = was_touching(two.slot, contacts, pair.active)
    return was_one if was_one != was_two else one.depth >= two.depth


@rare_kernel
def drop_point(points: Records, gone: int, count: int) -> int:
    """Remove one point, keep the order of the others, return the new count."""
    for i in range(gone, count - 1):
        points[i] = points[i + 1]
    return count - 1


@rare_kernel
def drop_duplicates(a: Record, b: Record, pair: Record, contacts: Records, points: Records, count: int) -> int:
    """Keep one of two coinciding corners: they are one contact, and a face contact has the stiffness of two points.

    Where two blocks are exactly aligned, or meet corner on corner, a corner of each lies in the other. `contacts` are
    those of this pair so far; the corners that do not count are marked in its `duplicates`.
    """
    oblique = is_oblique(a, b)
    i = 0
    while i < count and points[i].slot < HALF:
        for j in range(i + 1, count):
            if points[j].slot >= HALF and (
                coincide(points[i], points[j]) if oblique else same_end(points[i], points[j], a, b)
            ):
                keep_i = keeps_first(points[i], points[j], pair, contacts, oblique)
                gone = j if keep_i else i
                pair.duplicates |= 1 << points[gone].slot
                count = drop_point(points, gone, count)
                i -= 0 if keep_i else 1
                break
        i += 1
    return count


UPPER_FACE = 1  # of a piece of ground, the only one that counts


@kernel
def opens(face: int, sx: float, sy: float, c: float, s: float) -> bool:
    """Return True if a corner (sx, sy = +-1) of a body turned by (c, s) against another can touch that one's face."""
    if face == 0:
        return -sx * c >= -CONE_TOLERANCE and sy * s >= -CONE_TOLERANCE
    if face == 1:
        return -sx * s >= -CONE_TOLERANCE and -sy * c >= -CONE_TOLERANCE
    if face == 2:
        return sx * c >= -CONE_TOLERANCE and -sy * s >= -CONE_TOLERANCE
    return sx * s >= -CONE_TOLERANCE and sy * c >= -CONE_TOLERANCE


@kernel
def face_below_corner(
    px: float, py: float, touched: Record, sx: float, sy: float, c: float, s: float
) -> tuple[int, float, float]:
    """Return the face (or NO_FACE) that a corner touches, its overlap (m), and the overlap with the other face (m).

    (px, py) is the corner in the frame of the touched rectangle, (sx, sy) = +-1 says which corner of its owner it
    is, (c, s) the rotation of the owner against the touched rectangle. Of the admissible faces the nearest counts; the
    third value is infinite where the other one is not admissible or far away.
    """
    depth_x = touched.half_x - abs(px)
    depth_y = touched.half_y - abs(py)
    face_x = 0 if px >= 0.0 else 2
    face_y = 1 if py >= 0.0 else 3
    if depth_x <= depth_y:
        near, near_depth, far, far_depth = face_x, depth_x, face_y, depth_y
    else:
        near, near_depth, far, far_depth = face_y, depth_y, face_x, depth_x
    if opens(near, sx, sy, c, s):
        is_beside = far_depth < BESIDE_SHARE * touched.radius and opens(far, sx, sy, c, s)
        return near, near_depth, far_depth if is_beside else math.inf
    if opens(far, sx, sy, c, s):
        return far, far_depth, math.inf
    return NO_FACE, 0.0, math.inf


@kernel
def face_normal(face: int, body: Record) -> tuple[float, float]:
    """Return the outward normal of a face of a body, in world axes."""
    if face == 0:
        return body.cos, body.sin
    if face == 1:
        return -body.sin, body.cos
    if face == 2:
        return -body.cos, -body.sin
    return body.sin, -body.cos


@rare_kernel
def add_corner(
    owner: Record, touched: Record, corner: int, x0: float, y0: float, c: float, s: float, points: Records, count: int
) -> int:
    """Append a corner of `owner` if it lies inside `touched`; return the new point count.

    (x0, y0, c, s) is the pose of the owner in the frame of the touched body. The normal points out of `touched`.
    """
    sx, sy = corner_signs(corner)
    px = x0 + sx * c * owner.half_x - sy * s * owner.half_y
    py = y0 + sx * s * owner.half_x + sy * c * owner.half_y
    if abs(px) > touched.half_x or abs(py) > touched.half_y:
        return count
    if touched.faces == ALL:
        face, depth, beside = face_below_corner(px, py, touched, sx, sy, c, s)
    else:
        face, beside = UPPER_FACE, math.inf
        depth = slab_depth(px, py, touched) if opens(UPPER_FACE, sx, sy, c, s) else 0.0
    if depth <= 0.0:
        return count
    point = points[count]
    point.slot = corner
    point.face = face
    point.x, point.y = to_world(touched, px, py)
    point.nx, point.ny = face_normal(face, touched)
    point.depth = depth
    point.beside = beside
    return count + 1


@rare_kernel
def ground_points(owner: Record, near: int, candidates: Integers, level: float, points: Records) -> int:
    """Collect the candidate corners of `owner` below the ground, y < level (m). Return how many there are."""
    count = 0
    for m in range(near):
        sx, sy = corner_signs(candidates[m])
        x, y = to_world(owner, sx * owner.half_x, sy * owner.half_y)
        if y < level:
            point = points[count]
            point.slot = candidates[m]
            point.face = 1
            point.x = x
            point.y = y
            point.nx = 0.0
            point.ny = 1.0
            point.depth = level - y
            point.beside = math.inf
            count += 1
    return count


@rare_kernel
def block_points(a: Record, b: Record, pair: Record, candidates: Integers, contacts: Records, points: Records) -> int:
    """Fill `points` with the contact points of two blocks and return how many there are; marks duplicates in `pair`."""
    x0, y0, c, s = relative_pose(a, b)
    count = 0
    of_a = 0
    for m in range(pair.near):
        if candidates[m] < HALF:
            count = add_corner(a, b, candidates[m], x0, y0, c, s, points, count)
            of_a = count
        else:
            before = count
            xb = -c * x0 - s * y0
            yb = s * x0 - c * y0
            count = add_corner(b, a, candidates[m] - HALF, xb, yb, c, -s, points, count)
            if count > before:
                point = points[before]
                point.slot = candidates[m]
                point.nx = -point.nx
                point.ny = -point.ny
    pair.duplicates = 0
    if of_a > 0 and count > of_a:
        count = drop_duplicates(a, b, pair, contacts, points, count)
    return count


@rare_kernel
def keep_deepest(points: Records, count: int) -> int:
    """Drop the points of least overlap beyond those that there is room for; return how many are left."""
    while count > CONTACTS:
        least = 0
        for i in range(1, count):
            if points[i].depth < points[least].depth:
                least = i
        count = drop_point(points, least, count)
    return count


@rare_kernel
def find_points(world: World, p: int) -> int:
    """Find the contact points of pair p and return how many there are."""
    pair = world.pairs[p]
    a = world.bodies[pair.a]
    b = world.bodies[pair.b]
    if pair.b == world.bodies.size - 1:
        count = ground_points(a, pair.near, world.candidates[p], b.y, world.points)
    else:
        count = block_points(a, b, pair, world.candidates[p], world.contacts[p], world.points)
    return keep_deepest(world.points, count)


@rare_kernel
def corner_height(body: Record, corner: int) -> float:
    """Return the height (m) of one corner over y = 0."""
    sx, sy = corner_signs(corner)
    return body.y + body.sin * sx * body.half_x + body.cos * sy * body.half_y


@rare_kernel
def corners_near_ground(body: Record, level: float, out: Integers) -> int:
    """Write the corners of a body that are below a height (m) into `out` and return how many there are."""
    count = 0
    for corner in range(HALF):
        if corner_height(body, corner) <= level:
            out[count] = corner
            count += 1
    return count


@rare_kernel
def corners_near(owner: Record, touched: Record, reach: float, first: int, out: Integers, count: int) -> int:
    """Append the corners of `owner` inside `touched` grown by `reach` (m), as slots from `first`; return the count."""
    x0, y0, c, s = relative_pose(owner, touched)
    for corner in range(HALF):
        sx, sy = corner_signs(corner)
        px = x0 + sx * c * owner.half_x - sy * s * owner.half_y
        py = y0 + sx * s * owner.half_x + sy * c * owner.half_y
        is_inside = abs(px) <= touched.half_x + reach and abs(py) <= touched.half_y + reach
        if is_inside and (owner.corners >> corner) & 1 == 1:
            out[count] = first + corner
            count += 1
    return count


@rare_kernel
def near_slots(world: World, a: int, b: int, reach: float, out: Integers) -> int:
    """Write the slots of a pair whose corners are within `reach` (m) into `out` and return how many there are."""
    one = world.bodies[a]
    two = world.bodies[b]
    if b == world.bodies.size - 1:
        return corners_near_ground(one, two.y + reach, out)
    count = corners_near(one, two, reach, 0, out, 0)
    return corners_near(two, one, reach, HALF, out, count)


@rare_kernel
def slot_normal(world: World, pair: Record, slot: int, face: int) -> tuple[float, float]:
    """Return the normal, from b to a, of the contact of a corner with a face of the other body."""
    if pair.b == world.bodies.size - 1:
        return 0.0, 1.0
    if slot < HALF:
        return face_normal(face, world.bodies[pair.b])
    nx, ny = face_normal(face, world.bodies[pair.a])
    return -nx, -ny


@rare_kernel
def slot_place(world: World, pair: Record, slot: int) -> tuple[float, float]:
    """Return the place (m) of the corner of a slot."""
    owner = world.bodies[pair.a] if slot < HALF else world.bodies[pair.b]
    ox, oy = corner_offset(owner, slot % HALF)
    return owner.x + ox, owner.y + oy

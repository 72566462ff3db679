"""Narrow phase of the `surface` model: corners of one body in another, of any convex outline.

* A corner lies in a body where it is behind all its faces. It touches the face of least overlap among those on its side
  of the centroid that it can touch.
* It can touch a face where it is the corner of its own body that is lowest along the normal of that face: both faces
  that meet in it rise from there. The sine of the angle by which one may fall is the cone (sides.py): both ends of a
  nearly parallel face count.
* Under the sharp end of a face it still lies where it is out of the body there, if a face of its own leads from it
  along that face into the body: between two sharp corners, as at the back of an arch, no end of an interval is lost.
* Of a corner of each that mark the same end of two nearly parallel faces one counts, and of two that meet where no
  faces are parallel the shallower one: the nearest edge of the Minkowski difference.

Two bodies have at most two points of contact. While two rectangles overlap by less than half of any side, at most two
corners of each lie in the other; if that is so for more than two in all, one end of a face of one body lies at the end
of a face of the other, and of these duplicates one counts. (In 12 random heaps of three shapes, 20 blocks each and up
to 700 000 steps, there never was a third.) Should there be one after all, the shallowest does not count.

Slots from 0 are corners of body a, slots from MOST_CORNERS those of b; on the ground a contact has the face UPPER.

Ends of the interval of two faces of polygons: which of two corners that mark the same one is its contact.

Where a corner of a and a corner of b mark one end, that nearer to the other end is the inner one. Both may lie in the
other body: behind a blunt end the outer one does until it is as far out as the overlap over the tangent of the angle
there, 2.4 times the overlap of 16-gons. Its depth below the face drawn out beyond that end differs by the tilt times
that way from the depth of the inner one, and the stiffness, which is measured from contact to contact (bearing.py),
would grow while the interval shrinks. So the inner one takes over as soon as the corners have passed one another,
where both are equally deep: later the energy would change by a step, up to 5 % of it. Corners that are flush would
change places at every step by the last digits; so the one in contact stays for HAND_OVER of its overlap.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from blocksim.kernels.common import tolerances
from blocksim.kernels.common.arrays import CONTACTS, NO_FACE, Corners, Integers, Record, Records, World
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.common.shapes import relative_pose, slab_depth, to_world
from blocksim.kernels.explicit import sides


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


@kernel
def from_middle(body: Record, number: int, table: Corners, nx: float, ny: float) -> float:
    """Return the place (m) of a corner along the tangent (-ny, nx), from the middle of the face that looks along n."""
    side = sides.corner_of(body, table, sides.side_along(body, table, nx, ny))
    corner = sides.corner_of(body, table, number)
    tx, ty = sides.into_frame(body, -ny, nx)
    x = corner.x - side.x + side.half * side.ny
    y = corner.y - side.y - side.half * side.nx
    return tx * x + ty * y


@rare_kernel
def is_same_end(of_a: Record, of_b: Record, a: Record, b: Record, table: Corners) -> bool:
    """Return True if a corner of a and a corner of b (both points) mark the same end of one face contact."""
    nx = of_a.nx
    ny = of_a.ny
    if nx * of_b.nx + ny * of_b.ny < tolerances.SAME_FACE:
        return False
    end_a = -from_middle(a, of_a.slot, table, -nx, -ny)
    return end_a * from_middle(b, of_b.slot - sides.MOST_CORNERS, table, nx, ny) > 0.0


@rare_kernel
def way_beyond(point: Record, a: Record, b: Record, table: Corners) -> float:
    """Return how far (m) the corner of a point is beyond the end of its face, less what it may be."""
    touched = b if point.slot < sides.MOST_CORNERS else a
    face: Any = np.int64(point.face)
    side = sides.corner_of(touched, table, face)
    x, y = sides.into_frame(touched, point.x - touched.x, point.y - touched.y)
    return abs(side.nx * y - side.ny * x - side.middle) - side.half - tolerances.HAND_OVER * point.depth


@rare_kernel
def keeps_inner(
    one: Record, two: Record, a: Record, b: Record, pair: Record, contacts: Records, oblique: bool, table: Corners
) -> bool:
    """Return True if of two corners at the same place, of a and of b, that of a counts; see the top.

    On a piece of ground the end of a face is none.
    """
    first = keeps_first(one, two, pair, contacts, oblique)
    if oblique or sides.is_piece(a) or sides.is_piece(b):
        return first
    beyond_one = way_beyond(one, a, b, table)
    beyond_two = way_beyond(two, a, b, table)
    if first:
        return beyond_one <= max(beyond_two, 0.0)
    return beyond_two > max(beyond_one, 0.0)


@kernel
def has_inner(
    duplicates: int, of_b: bool, touched: Record, face: int, along: float, beyond: float, table: Corners
) -> bool:
    """Return True if a contact is beyond the end of its face by more than it may be, and the corner there a duplicate.

    `touched` is body b, or a; `along` (m) and `beyond` (m, less what it may be) are of the place on its face.
    """
    if beyond <= 0.0:
        return False
    end = sides.next_number(touched, table, face) if along > 0.0 else face
    return (duplicates >> (end + sides.MOST_CORNERS if of_b else end)) & 1 == 1


class Corner(NamedTuple):
    """A corner of a body, seen from the frame of another, and the directions of its faces away from it."""

    x: float  # m
    y: float
    ahead_x: float
    ahead_y: float
    back_x: float
    back_y: float
    ahead: float  # m, lengths of these faces
    back: float


@kernel
def corner_seen(owner: Record, number: int, touched: Record, table: Corners) -> Corner:
    """Return a corner of a body as the frame of the touched one has it."""
    x0, y0, c, s = relative_pose(owner, touched)
    ahead = sides.corner_of(owner, table, number)
    back = sides.corner_of(owner, table, sides.number_before(owner, table, number))
    return Corner(
        x0 + c * ahead.x - s * ahead.y,
        y0 + s * ahead.x + c * ahead.y,
        -c * ahead.ny - s * ahead.nx,
        -s * ahead.ny + c * ahead.nx,
        c * back.ny + s * back.nx,
        s * back.ny - c * back.nx,
        2.0 * ahead.half,
        2.0 * back.half,
    )


@kernel
def can_touch(corner: Corner, nx: float, ny: float, cone: float) -> bool:
    """Return True if a corner can touch a face of this outward normal; see the top."""
    return nx * corner.ahead_x + ny * corner.ahead_y >= -cone and nx * corner.back_x + ny * corner.back_y >= -cone


@kernel
def side_below(corner: Corner, touched: Record, table: Corners, cone: float) -> tuple[int, float, float]:
    """Return the face (or NO_FACE) that a corner touches, its overlap (m), and the next least one (m).

    The third value is infinite where there is no other face that it can touch, or that is far away.
    """
    face = NO_FACE
    depth = math.inf
    beside = math.inf
    for k in range(sides.number_of_corners(touched, table)):
        side = sides.corner_of(touched, table, k)
        over = side.distance - (side.nx * corner.x + side.ny * corner.y)
        if over < 0.0:
            return side_over_end(corner, k, over, touched, table, cone)
        if over <= side.distance and can_touch(corner, side.nx, side.ny, cone):
            if over < depth:
                beside = depth
                depth = over
                face = k
            else:
                beside = min(beside, over)
    if beside >= tolerances.BESIDE_SHARE * touched.radius:
        beside = math.inf
    return face, depth, beside


@kernel
def leads_in(corner: Corner, level: Record, passed: Record, beyond: float, depth: float, cone: float) -> bool:
    """Return True if a face of a corner leads nearly along `level`, and farther behind `passed` than it is deep.

    `beyond` (m, negative) is the overlap of the corner with the face `passed`, `depth` (m) that with `level`.
    """
    ahead = beyond - corner.ahead * (passed.nx * corner.ahead_x + passed.ny * corner.ahead_y)
    back = beyond - corner.back * (passed.nx * corner.back_x + passed.ny * corner.back_y)
    is_ahead = level.nx * corner.ahead_x + level.ny * corner.ahead_y <= cone
    is_back = level.nx * corner.back_x + level.ny * corner.back_y <= cone
    return (is_ahead and ahead > depth) or (is_back and back > depth)


@rare_kernel
def side_over_end(
    corner: Corner, passed: int, beyond: float, touched: Record, table: Corners, cone: float
) -> tuple[int, float, float]:
    """Return as side_below the face under whose sharp end a corner lies that is in front of the face `passed`.

    `beyond` (m, negative) is the overlap with that face. Deep under the end of another it is no end of an interval.
    """
    count = sides.number_of_corners(touched, table)
    side = sides.corner_of(touched, table, passed)
    for step in (1, count - 1):
        k = (passed + step) % count
        level = sides.corner_of(touched, table, k)
        over = level.distance - (level.nx * corner.x + level.ny * corner.y)
        cosine = level.nx * side.nx + level.ny * side.ny
        is_under = 0.0 < over < tolerances.DEEPEST_END * touched.radius and beyond >= over * cosine
        if (
            is_under
            and can_touch(corner, level.nx, level.ny, cone)
            and leads_in(corner, level, side, beyond, over, cone)
            and is_behind_others(corner, k, passed, touched, table)
        ):
            return k, over, math.inf
    return NO_FACE, 0.0, math.inf


@rare_kernel
def is_behind_others(corner: Corner, one: int, two: int, touched: Record, table: Corners) -> bool:
    """Return True if a corner is behind all faces of a body but two, whichever side of those it is on."""
    for k in range(sides.number_of_corners(touched, table)):
        side = sides.corner_of(touched, table, k)
        if k != one and k != two and side.nx * corner.x + side.ny * corner.y > side.distance:
            return False
    return True


@kernel
def face_met(corner: Corner, touched: Record, table: Corners, cone: float) -> tuple[int, float, float]:
    """Return as side_below the face that a corner touches, of a piece of ground the upper one."""
    if not sides.is_piece(touched):
        return side_below(corner, touched, table, cone)
    face = sides.UPPER if can_touch(corner, 0.0, 1.0, cone) else NO_FACE
    return face, slab_depth(corner.x, corner.y, touched), math.inf


@rare_kernel
def add_corner(
    owner: Record, number: int, touched: Record, table: Corners, cone: float, points: Records, count: int
) -> int:
    """Append a corner of `owner` if it lies inside `touched`; return the new point count.

    The normal points out of `touched`.
    """
    corner = corner_seen(owner, number, touched, table)
    face, depth, beside = face_met(corner, touched, table, cone)
    if face == NO_FACE or depth <= 0.0:
        return count
    point = points[count]
    point.slot = number
    point.face = face
    point.x, point.y = to_world(touched, corner.x, corner.y)
    point.nx, point.ny = sides.side_normal(touched, table, face)
    point.depth = depth
    point.beside = beside
    return count + 1


@kernel
def add_slot(a: Record, b: Record, slot: int, table: Corners, cone: float, points: Records, count: int) -> int:
    """Append the corner of a slot of two bodies if it touches; return the new point count."""
    if slot < sides.MOST_CORNERS:
        return add_corner(a, slot, b, table, cone, points, count)
    end = add_corner(b, slot - sides.MOST_CORNERS, a, table, cone, points, count)
    if end > count:
        point = points[count]
        point.slot = slot
        point.nx = -point.nx
        point.ny = -point.ny
    return end


@rare_kernel
def ground_points(owner: Record, near: int, candidates: Integers, level: float, points: Records, table: Corners) -> int:
    """Collect the candidate corners of `owner` below the ground, y < level (m). Return how many there are."""
    count = 0
    for m in range(near):
        ox, oy = sides.corner_vector(owner, table, candidates[m])
        if owner.y + oy < level:
            point = points[count]
            point.slot = candidates[m]
            point.face = sides.UPPER
            point.x = owner.x + ox
            point.y = owner.y + oy
            point.nx = 0.0
            point.ny = 1.0
            point.depth = level - point.y
            point.beside = math.inf
            count += 1
    return count


@rare_kernel
def are_oblique(a: Record, b: Record, nx: float, ny: float, table: Corners, cone: float) -> bool:
    """Return True if the faces of two bodies that look at each other along a normal are not nearly parallel."""
    ax, ay = sides.side_normal(a, table, sides.side_along(a, table, -nx, -ny))
    bx, by = sides.side_normal(b, table, sides.side_along(b, table, nx, ny))
    return abs(ax * by - ay * bx) > cone or ax * bx + ay * by > 0.0


@rare_kernel
def do_meet(one: Record, two: Record, cone: float) -> bool:
    """Return True if two corners meet: they are as near to one another as two faces outside the cone can have them."""
    dx = one.x - two.x
    dy = one.y - two.y
    reach = tolerances.ONE_PLACE * tolerances.CONE_TOLERANCE / cone * max(one.depth, two.depth)
    return dx * dx + dy * dy < reach * reach


@rare_kernel
def drop_duplicates(
    a: Record, b: Record, pair: Record, contacts: Records, points: Records, count: int, table: Corners, cone: float
) -> int:
    """Keep one of two corners that are one contact, mark the other in `pair`; return how many points are left."""
    i = 0
    while i < count and points[i].slot < sides.MOST_CORNERS:
        for j in range(i + 1, count):
            one = points[i]
            two = points[j]
            if two.slot >= sides.MOST_CORNERS:
                near = one if one.depth <= two.depth else two
                oblique = are_oblique(a, b, near.nx, near.ny, table, cone)
                if do_meet(one, two, cone) if oblique else is_same_end(one, two, a, b, table):
                    keep_i = keeps_inner(one, two, a, b, pair, contacts, oblique, table)
                    gone = j if keep_i else i
                    pair.duplicates |= 1 << points[gone].slot
                    count = drop_point(points, gone, count)
                    i -= 0 if keep_i else 1
                    break
        i += 1
    return count


@rare_kernel
def block_points(
    a: Record, b: Record, pair: Record, candidates: Integers, contacts: Records, points: Records, table: Corners
) -> int:
    """Fill `points` with the contact points of two bodies and return how many there are."""
    cone = sides.cone_of(a, b, table)
    count = 0
    of_a = 0
    for m in range(pair.near):
        count = add_slot(a, b, candidates[m], table, cone, points, count)
        if candidates[m] < sides.MOST_CORNERS:
            of_a = count
    pair.duplicates = 0
    if of_a > 0 and count > of_a:
        count = drop_duplicates(a, b, pair, contacts, points, count, table, cone)
    return count


@rare_kernel
def find_points(world: World, p: int) -> int:
    """Find the contact points of pair p and return how many there are; beyond CONTACTS the shallowest do not count."""
    table = world.corners
    pair = world.pairs[p]
    a = world.bodies[pair.a]
    b = world.bodies[pair.b]
    points = world.points
    if pair.b == world.bodies.size - 1:
        count = ground_points(a, pair.near, world.candidates[p], b.y, points, table)
    else:
        count = block_points(a, b, pair, world.candidates[p], world.contacts[p], points, table)
    while count > CONTACTS:
        least = 0
        for i in range(1, count):
            if points[i].depth < points[least].depth:
                least = i
        count = drop_point(points, least, count)
    return count


@rare_kernel
def is_within(corner: Corner, touched: Record, reach: float, table: Corners) -> bool:
    """Return True if a corner lies inside a body grown by `reach` (m)."""
    for k in range(sides.number_of_corners(touched, table)):
        side = sides.corner_of(touched, table, k)
        if side.nx * corner.x + side.ny * corner.y > side.distance + reach:
            return False
    return True


@rare_kernel
def corners_near(
    owner: Record, touched: Record, reach: float, first: int, out: Integers, count: int, table: Corners
) -> int:
    """Append the corners of `owner` inside `touched` grown by `reach` (m), as slots from `first`; return the count."""
    for number in range(sides.number_of_corners(owner, table)):
        is_there = not sides.is_piece(owner) or (owner.corners >> number) & 1 == 1
        if is_there and is_within(corner_seen(owner, number, touched, table), touched, reach, table):
            out[count] = first + number
            count += 1
    return count


@rare_kernel
def near_slots(world: World, a: int, b: int, reach: float, out: Integers) -> int:
    """Write the slots of a pair whose corners are within `reach` (m) into `out` and return how many there are."""
    table = world.corners
    one = world.bodies[a]
    two = world.bodies[b]
    count = 0
    if b == world.bodies.size - 1:
        for number in range(sides.number_of_corners(one, table)):
            if one.y + sides.corner_vector(one, table, number)[1] <= two.y + reach:
                out[count] = number
                count += 1
        return count
    count = corners_near(one, two, reach, 0, out, 0, table)
    return corners_near(two, one, reach, sides.MOST_CORNERS, out, count, table)


@rare_kernel
def slot_normal(world: World, pair: Record, slot: int, face: int) -> tuple[float, float]:
    """Return the normal, from b to a, of the contact of a corner with a face of the other body."""
    table = world.corners
    if pair.b == world.bodies.size - 1:
        return 0.0, 1.0
    if slot < sides.MOST_CORNERS:
        return sides.side_normal(world.bodies[pair.b], table, face)
    nx, ny = sides.side_normal(world.bodies[pair.a], table, face)
    return -nx, -ny


@rare_kernel
def slot_place(world: World, pair: Record, slot: int) -> tuple[float, float]:
    """Return the place (m) of the corner of a slot."""
    table = world.corners
    is_own = slot < sides.MOST_CORNERS
    owner = world.bodies[pair.a] if is_own else world.bodies[pair.b]
    ox, oy = sides.corner_vector(owner, table, slot if is_own else slot - sides.MOST_CORNERS)
    return owner.x + ox, owner.y + oy

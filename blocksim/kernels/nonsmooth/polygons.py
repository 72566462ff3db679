"""Faces of convex polygons, of one body or of four at a time: which looks against a direction, and where it is.

As in groups.py one source serves four pairs and a single one: `lane` is None for four. Of four bodies with different
numbers of faces the table has faces after those of each that are never found (world/bodies.py).

Where convex polygons touch or will: faces by separating axes, points by clipping, as of rectangles (manifold.py).

Of all faces of both the reference is the one beyond which the other body reaches least. The face of the other body that
looks most against it is clipped to its length: that gives at most two points. Each of them is a corner of one of the
bodies, and impulses go with these corners from step to step: where a polygon rolls over a corner, what carried its one
face at the right carries the next one at the left.

Four pairs at a time, or a single one, by the same sums. Where faces hardly face one another a pair is looked at alone.

Polygons whose faces hardly face one another, or meet beside the reference face: one pair at a time.

Where two faces face each other over a sliver only, the bodies meet at other faces, if these are nearly parallel: a
block that slides over the flush joint of two others would else be stopped by the side of the second, as it sinks in by
a little. And a face of b on which no point lies gives way to that of a.
"""

from typing import NamedTuple

from blocksim.kernels.common import jit, shapes
from blocksim.kernels.common.arrays import Record, Records
from blocksim.kernels.common.simd import Lane, Lanes, Mask, fields_0, fields_4, greater, is_all, lesser, select, split
from blocksim.kernels.nonsmooth import arrays, faces


class Hulls(NamedTuple):
    """The corners of four bodies, as of Hull; of a single one what is an integer here stands four times."""

    table: Records
    places: tuple[int, int, int, int]  # of the first corner in the table
    size: int  # number of faces of that which has most
    first: Lanes  # as `places`
    count: Lanes  # number of faces
    inner: Lanes  # m, from the centroid to the nearest face


class Side(NamedTuple):
    """A face in the frame of its body, fields as in CORNER."""

    nx: Lanes
    ny: Lanes
    distance: Lanes
    middle: Lanes
    half: Lanes


@jit.kernel
def hulls_of_one(hull: shapes.Hull) -> Hulls:
    """Return the corners of a single body."""
    first, size = hull.first, hull.size
    places = (first, first, first, first)
    return Hulls(hull.table, places, size, 1.0 * first, 1.0 * size, 1.0 * hull.inner)


@jit.kernel
def normal_at(hulls: Hulls, k: int, lane: Lane) -> tuple[Lanes, Lanes, Lanes, Lanes]:
    """Return normal, distance and middle (m) of face k of bodies."""
    one, two, three, four = hulls.places
    return fields_0(lane, hulls.table, (one + k, two + k, three + k, four + k))


@jit.kernel
def side_at(table: Records, place: Lanes, lane: Lane) -> Side:
    """Return the faces at places of the table."""
    one, two, three, four = split(place)
    places = (int(one), int(two), int(three), int(four))
    nx, ny, distance, middle = fields_0(lane, table, places)
    half, _, _, _ = fields_4(lane, table, places)
    return Side(nx, ny, distance, middle, half)


@jit.kernel
def number_against(hulls: Hulls, mx: Lanes, my: Lanes, lane: Lane) -> Lanes:
    """Return the numbers of the faces that look most against unit vectors given in the frames of the bodies."""
    nx, ny, _, _ = normal_at(hulls, 0, lane)
    least = nx * mx + ny * my
    number = 0.0 * least
    for k in range(1, hulls.size):
        nx, ny, _, _ = normal_at(hulls, k, lane)
        cosine = nx * mx + ny * my
        is_less = cosine < least
        least = select(is_less, cosine, least)
        number = select(is_less, 1.0 * k, number)
    return number


@jit.kernel
def least_along(side: Side, mx: Lanes, my: Lanes) -> Lanes:
    """Return how far (m) a body reaches along a unit vector in its frame at least, given the face most against it.

    One of the two ends of that face is the corner that reaches least.
    """
    along = side.nx * mx + side.ny * my
    across = side.nx * my - side.ny * mx
    return side.distance * along + side.middle * across - side.half * abs(across)


@jit.kernel
def side_face(body: faces.Block, side: Side) -> faces.Face:
    """Return a face as reference: of a rectangle what face_of returns, bit by bit."""
    return faces.Face(
        body.cos * side.nx - body.sin * side.ny,
        body.sin * side.nx + body.cos * side.ny,
        body.x,
        body.y,
        side.distance,
        -side.half - side.middle,
        side.half - side.middle,
    )


@jit.kernel
def side_edge(face: faces.Face, body: faces.Block, side: Side) -> faces.Edge:
    """Return a face that looks towards a reference face: it begins at the left.

    Of a rectangle that is what opposite_edge returns, bit by bit: from the centre to the middle of the face, and from
    there to both ends.
    """
    x, y = faces.in_frame(face, body.x, body.y)
    # the body's own x axis in the frame of the reference face
    c = body.cos * face.ny - body.sin * face.nx
    s = body.cos * face.nx + body.sin * face.ny
    # normal and direction of the body's face there
    mx = side.nx * c - side.ny * s
    my = side.nx * s + side.ny * c
    tx = -side.ny * c - side.nx * s
    ty = side.nx * c - side.ny * s
    x = x + side.distance * mx + side.middle * tx
    y = y + side.distance * my + side.middle * ty
    ex = side.half * tx
    ey = side.half * ty
    are_all = abs(ex) >= 0.0
    return faces.Edge(x - ex, y - ey, x + ex, y + ey, are_all, are_all)


TIE = 1e-7  # m: by so much a face of body a has to be better than one of body b
EDGE = 0.01  # of the smaller inner radius: two faces that face each other over less are passed by
ROUND_OFF = 0.5 * TIE
OF_B = 32  # added to the number of a corner of body b, which counts from 1
RECTANGLE = 4


class Pose(NamedTuple):
    """A body in the frame of another: its centroid (m), and the turn of the first's frame against the other's."""

    x: Lanes
    y: Lanes
    c: Lanes
    s: Lanes


class Farthest(NamedTuple):
    """The face of a body from which the centroid of another is farthest: how far (m), which, and its normal.

    `second` (m) is how far it is from the next face.
    """

    away: Lanes
    number: Lanes
    nx: Lanes
    ny: Lanes
    second: Lanes


class Best(NamedTuple):
    """The face of a body beyond which another reaches least, -1 for none, and the gap (m) there.

    `against` is the number of the face of the other body that it meets.
    """

    gap: Lanes
    number: Lanes
    against: Lanes


class Found(NamedTuple):
    """Manifolds of polygons, and the corners that their points are, one of body b from OF_B on.

    `is_near` tells whether there is one, `is_odd` that faces hardly face one another or have no point.
    """

    points: faces.Points
    is_near: Mask
    is_odd: Mask
    one: Lanes
    two: Lanes


@jit.kernel
def face_count(hull: shapes.AnyHull) -> int:
    """Return the number of faces of a body; a rectangle has no hull."""
    if hull is None:
        return RECTANGLE
    return hull.size


@jit.kernel
def side_numbered(hull: shapes.Hull, number: int) -> Side:
    """Return a face of a polygon."""
    return side_at(hull.table, 1.0 * (hull.first + number), 0)


@jit.kernel
def face_numbered(body: faces.Block, hull: shapes.AnyHull, number: int) -> faces.Face:
    """Return one of the faces of a body."""
    if hull is None:
        sign = 1.0 if number < 2 else -1.0
        along_x = number % 2 == 0
        mx = sign * (body.cos if along_x else -body.sin)
        my = sign * (body.sin if along_x else body.cos)
        return faces.face_of(body, mx, my, along_x)
    return side_face(body, side_numbered(hull, number))


@jit.kernel
def edge_opposite(face: faces.Face, body: faces.Block, hull: shapes.AnyHull) -> faces.Edge:
    """Return the face of a body that looks most towards a reference face."""
    if hull is None:
        return faces.opposite_edge(face, body)
    return side_edge(face, body, side_numbered(hull, number_opposite(face.nx, face.ny, body, hull)))


@jit.kernel
def number_opposite(nx: float, ny: float, body: faces.Block, hull: shapes.Hull) -> int:
    """Return the number of the face of a body that looks most against a direction."""
    return shapes.face_towards(hull, -(body.cos * nx + body.sin * ny), body.sin * nx - body.cos * ny)


@jit.kernel
def pose_of(other: faces.Block, body: faces.Block) -> Pose:
    """Return another body in the frame of a body; (c, s) turns directions of this frame into the frame of the other."""
    dx = other.x - body.x
    dy = other.y - body.y
    return Pose(
        body.cos * dx + body.sin * dy,
        body.cos * dy - body.sin * dx,
        body.cos * other.cos + body.sin * other.sin,
        body.sin * other.cos - body.cos * other.sin,
    )


@jit.kernel
def gap_beyond(away: Lanes, nx: Lanes, ny: Lanes, pose: Pose, other: Hulls, lane: Lane) -> tuple[Lanes, Lanes]:
    """Return the gap (m) beyond a face with a normal, and the number of the face of the other body that it meets.

    `away` (m) is the distance of the other's centroid from the face.
    """
    mx = pose.c * nx - pose.s * ny
    my = pose.s * nx + pose.c * ny
    against = number_against(other, mx, my, lane)
    return away + least_along(side_at(other.table, other.first + against, lane), mx, my), against


@jit.kernel
def farthest_face(hulls: Hulls, pose: Pose, lane: Lane) -> Farthest:
    """Return the face of a body from which the centroid of another one is farthest; of equal ones the first."""
    fx, fy, distance, _ = normal_at(hulls, 0, lane)
    most = fx * pose.x + fy * pose.y - distance
    number = 0.0 * most
    second = number - arrays.FAR
    for k in range(1, hulls.size):
        nx, ny, distance, _ = normal_at(hulls, k, lane)
        away = nx * pose.x + ny * pose.y - distance
        is_more = away > most
        second = select(is_more, most, greater(away, second))
        most = select(is_more, away, most)
        number = select(is_more, 1.0 * k, number)
        fx = select(is_more, nx, fx)
        fy = select(is_more, ny, fy)
    return Farthest(most, number, fx, fy, second)


@jit.kernel
def best_from(found: Farthest, hulls: Hulls, pose: Pose, other: Hulls, lane: Lane) -> Best:
    """Return the face of a body beyond which another one reaches least.

    It is mostly that from which the other's centroid is farthest. The other body reaches beyond a face by its inner
    radius at least, from its centroid: others are out with that.
    """
    gap, against = gap_beyond(found.away, found.nx, found.ny, pose, other, lane)
    best = Best(gap, found.number, against)
    if is_all(found.second - other.inner < gap):
        return best
    return best_of_others(best, hulls, pose, other, lane)


@jit.kernel
def best_of_others(best: Best, hulls: Hulls, pose: Pose, other: Hulls, lane: Lane) -> Best:
    """Return the best face of a body, or one that is better; of equal ones the first."""
    gap, number, against = best
    for k in range(hulls.size):
        nx, ny, distance, _ = normal_at(hulls, k, lane)
        away = nx * pose.x + ny * pose.y - distance
        can_be = (away - other.inner >= gap) & (abs(number - 1.0 * k) > 0.0)
        if not is_all((away - other.inner < gap) | (abs(number - 1.0 * k) <= 0.0)):
            its_gap, its_against = gap_beyond(away, nx, ny, pose, other, lane)
            is_better = can_be & ((its_gap > gap) | ((its_gap >= gap) & (number > 1.0 * k)))
            gap = select(is_better, its_gap, gap)
            number = select(is_better, 1.0 * k, number)
            against = select(is_better, its_against, against)
    return Best(gap, number, against)


@jit.kernel
def best_face(hulls: Hulls, pose: Pose, other: Hulls, lane: Lane) -> Best:
    """Return the face of a body beyond which another one reaches least."""
    return best_from(farthest_face(hulls, pose, lane), hulls, pose, other, lane)


@jit.kernel
def best_if_above(least: Lanes, hulls: Hulls, pose: Pose, other: Hulls, lane: Lane) -> Best:
    """Return the face of a body beyond which another one reaches least, if the gap there is above `least` (m).

    Near centroids exclude that: regular polygons that meet face to face are done then.
    """
    none = 0.0 * least - 1.0
    near = greater(least - ROUND_OFF + hulls.inner + other.inner, 0.0)
    if is_all(pose.x * pose.x + pose.y * pose.y < near * near):
        return Best(least, none, none)
    found = farthest_face(hulls, pose, lane)
    if is_all(found.away - other.inner <= least):
        return Best(least, none, none)
    best = best_from(found, hulls, pose, other, lane)
    is_above = best.gap > least
    return Best(select(is_above, best.gap, least), select(is_above, best.number, none), best.against)


@jit.kernel
def one_of(is_one: Mask, one: faces.Block, two: faces.Block) -> faces.Block:
    """Return the place of one body or the other."""
    return faces.Block(
        select(is_one, one.x, two.x),
        select(is_one, one.y, two.y),
        select(is_one, one.cos, two.cos),
        select(is_one, one.sin, two.sin),
        one.half_x,
        one.half_y,
    )


@jit.kernel
def after(number: Lanes, count: Lanes) -> Lanes:
    """Return the number of the next corner."""
    return select(number + 1.0 < count, number + 1.0, 0.0 * number)


@jit.kernel
def of_other(corner: Lanes) -> Lanes:
    """Return a corner as one of the other body of a pair."""
    return select(corner > 1.0 * OF_B, corner - 1.0 * OF_B, corner + 1.0 * OF_B)


@jit.kernel
def found_on(
    is_of_b: Mask, best: Best, a: faces.Block, hulls_a: Hulls, b: faces.Block, hulls_b: Hulls, margin: float, lane: Lane
) -> Found:
    """Return manifolds on faces of bodies b or a. Point one is the right one of a face of b, the left one of one of a.

    Corners count from 1, those of the body with the face from OF_B + 1.
    """
    other = one_of(is_of_b, a, b)
    place = select(is_of_b, hulls_b.first, hulls_a.first) + best.number
    face = side_face(one_of(is_of_b, b, a), side_at(hulls_a.table, place, lane))
    place = select(is_of_b, hulls_a.first, hulls_b.first) + best.against
    whole = side_edge(face, other, side_at(hulls_a.table, place, lane))
    edge = faces.clip(whole, face)
    points = faces.points_of(face, edge, a, b, is_of_b, margin)
    next_number = after(best.number, select(is_of_b, hulls_b.count, hulls_a.count))
    next_against = after(best.against, select(is_of_b, hulls_a.count, hulls_b.count))
    left = select(whole.left >= face.left, 1.0 + best.against, (OF_B + 1.0) + next_number)
    right = select(whole.right <= face.right, 1.0 + next_against, (OF_B + 1.0) + best.number)
    is_sliver = edge.right - edge.left < EDGE * lesser(hulls_a.inner, hulls_b.inner)
    return Found(
        points,
        (edge.right > edge.left) & faces.has_point(points),
        is_sliver | (is_of_b & (lesser(points.gap_one, points.gap_two) >= arrays.FAR)),
        select(is_of_b, right, of_other(left)),
        select(is_of_b, left, of_other(right)),
    )


@jit.kernel
def points_of_polygons(
    a: faces.Block, hulls_a: Hulls, b: faces.Block, hulls_b: Hulls, margin: float, lane: Lane
) -> tuple[Found, Best, Best]:
    """Return the contact manifolds of convex polygons within the margin (m), and the best faces of b and a.

    That of a has number -1 where that of b is the reference. All of it is inlined: a call that hands over two bodies
    with their corners takes as long as what it does.
    """
    best_b = best_face(hulls_b, pose_of(a, b), hulls_a, lane)
    best_a = best_if_above(lesser(best_b.gap + TIE, margin), hulls_a, pose_of(b, a), hulls_b, lane)
    is_of_b = best_a.number < 0.0
    best = Best(
        select(is_of_b, best_b.gap, best_a.gap),
        select(is_of_b, best_b.number, best_a.number),
        select(is_of_b, best_b.against, best_a.against),
    )
    found = found_on(is_of_b, best, a, hulls_a, b, hulls_b, margin, lane)
    is_near = greater(best_b.gap, best.gap) <= margin
    return (
        Found(found.points, is_near & found.is_near, is_near & found.is_odd, found.one, found.two),
        best_b,
        best_a,
    )


@jit.kernel
def corners_on_ground(points: faces.Points, block: faces.Block, hull: shapes.Hull, is_first: bool) -> tuple[int, int]:
    """Return the corners of a polygon at the points of a manifold with the ground, which `is_first` has as body a."""
    if is_first:
        number = number_opposite(points.constraint.nx, points.constraint.ny, block, hull)
        return 1 + shapes.next_corner(hull, number), 1 + number
    number = number_opposite(-points.constraint.nx, -points.constraint.ny, block, hull)
    return OF_B + 1 + number, OF_B + 1 + shapes.next_corner(hull, number)


@jit.kernel
def follow_corners(constraint: Record, one: int, two: int) -> None:
    """Have impulses of the last step go with their corners; where a corner has not changed places they stay."""
    normal_one = constraint.normal_one
    normal_two = constraint.normal_two
    total = normal_one + normal_two
    if total > 0.0 and (one == constraint.corner_two or two == constraint.corner_one):
        constraint.normal_one = normal_two if one == constraint.corner_two else 0.0
        constraint.normal_two = normal_one if two == constraint.corner_one else 0.0
        constraint.shear *= (constraint.normal_one + constraint.normal_two) / total
    constraint.corner_one = one
    constraint.corner_two = two


LEVEL = -0.99498743710662  # cosine: two faces within 0.1 rad of each other can meet as faces


@jit.kernel
def points_of_two(a: faces.Block, hulls_a: Hulls, b: faces.Block, hulls_b: Hulls, margin: float) -> Found:
    """Return the contact manifold of two convex polygons within the margin (m)."""
    found, best_b, best_a = points_of_polygons(a, hulls_a, b, hulls_b, margin, 0)
    if found.is_odd:
        return points_where_odd(best_b, best_a, a, hulls_a, b, hulls_b, margin)
    return found


@jit.rare_kernel
def points_where_odd(
    best_b: Best, best_a: Best, a: faces.Block, hulls_a: Hulls, b: faces.Block, hulls_b: Hulls, margin: float
) -> Found:
    """Return the same for polygons whose best faces face one another over a sliver, or have no point."""
    if best_a.number < 0.0:
        found = found_beside(True, best_b, a, hulls_a, b, hulls_b, margin)
        if found.is_near:
            return found
        best_a = best_face(hulls_a, pose_of(b, a), hulls_b, 0)
        if best_b.gap > best_a.gap:
            return found
    return found_beside(False, best_a, a, hulls_a, b, hulls_b, margin)


@jit.rare_kernel
def found_beside(
    is_of_b: bool, best: Best, a: faces.Block, hulls_a: Hulls, b: faces.Block, hulls_b: Hulls, margin: float
) -> Found:
    """Return the manifold on the best face of a body, or on the next best where it faces the other over a sliver."""
    found = found_on(is_of_b, best, a, hulls_a, b, hulls_b, margin, 0)
    least = EDGE * min(hulls_a.inner, hulls_b.inner)
    if found.points.constraint.width < least:
        body, hulls, other, others = (b, hulls_b, a, hulls_a) if is_of_b else (a, hulls_a, b, hulls_b)
        next_best = next_above(-least, best.number, hulls, body, others, other)
        if next_best.number >= 0.0 and can_meet(next_best, body, hulls, other, others):
            return found_on(is_of_b, next_best, a, hulls_a, b, hulls_b, margin, 0)
    return found


@jit.kernel
def next_above(least: float, but: float, hulls: Hulls, body: faces.Block, others: Hulls, other: faces.Block) -> Best:
    """Return the best face of a body but one of those with a gap above `least` (m)."""
    pose = pose_of(other, body)
    best = Best(least, -1.0, -1.0)
    for k in range(hulls.size):
        nx, ny, distance, _ = normal_at(hulls, k, 0)
        gap, against = gap_beyond(nx * pose.x + ny * pose.y - distance, nx, ny, pose, others, 0)
        if gap > best.gap and but != 1.0 * k:
            best = Best(gap, 1.0 * k, against)
    return best


@jit.kernel
def can_meet(best: Best, body: faces.Block, hulls: Hulls, other: faces.Block, others: Hulls) -> bool:
    """Return True if two faces are nearly parallel."""
    pose = pose_of(other, body)
    one = side_at(hulls.table, hulls.first + best.number, 0)
    two = side_at(others.table, others.first + best.against, 0)
    mx = pose.c * one.nx - pose.s * one.ny
    my = pose.s * one.nx + pose.c * one.ny
    return mx * two.nx + my * two.ny < LEVEL

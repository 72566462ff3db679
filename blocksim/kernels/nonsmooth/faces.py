"""Faces of rectangles and convex polygons, of one body or of four at a time.

A face is the side of a body in world axes. One face is the reference: its line carries both points of a manifold, and
its normal is theirs. The face of the other body that looks most against it is clipped to its length.

What is known of a shape is in few functions: its number of faces, a face by its number, and the face that looks most
against a direction. Rectangles among themselves have their half sides in registers and no hulls (None),
which the compiler knows; all bodies of a scene with polygons have their corners in one table. As in packs.py one
source serves four bodies and a single one: `lane` is None for four. Of four bodies with different numbers of faces the
table has faces after those of each that are never found (world/bodies.py).
"""

from typing import Any, NamedTuple

from blocksim.kernels.common import arrays, jit, shapes
from blocksim.kernels.common.simd import Lane, Lanes, Mask, fields_0, fields_4, four, lesser, select, split

RECTANGLE = 4  # faces


class Block(NamedTuple):
    """What of bodies decides where they touch; fields as in BODY."""

    x: Lanes
    y: Lanes
    cos: Lanes
    sin: Lanes
    half_x: Lanes
    half_y: Lanes


class Hulls(NamedTuple):
    """The corners of four bodies, as of shapes.Hull; of a single one what is an integer here stands four times."""

    table: arrays.Records
    places: tuple[int, int, int, int]  # of the first corner in the table
    size: int  # number of faces of that which has most
    first: Lanes  # as `places`
    count: Lanes  # number of faces
    inner: Lanes  # m, from the centroid to the nearest face


AnyHulls = Any  # None, a type of its own, for rectangles among themselves


class Side(NamedTuple):
    """A face in the frame of its body, fields as in CORNER."""

    nx: Lanes
    ny: Lanes
    distance: Lanes
    middle: Lanes
    half: Lanes


class Face(NamedTuple):
    """A reference face: unit normal, centre of its body, distance of the face from there, and where it ends (m).

    `left` and `right` lie along the face, to the right, from the foot of the centre.
    """

    nx: Lanes
    ny: Lanes
    x: Lanes
    y: Lanes
    distance: Lanes
    left: Lanes
    right: Lanes


class Edge(NamedTuple):
    """The two ends of the other body's face in the frame of a reference face: along it to the right, and above it (m).

    The first is the left one. `is_left`, `is_right` return whether the ends themselves can touch.
    """

    left: Lanes
    left_gap: Lanes
    right: Lanes
    right_gap: Lanes
    is_left: Mask
    is_right: Mask


@jit.kernel
def hulls_at(bodies: arrays.Records, places: tuple[int, int, int, int], corners: Any, lane: Lane) -> AnyHulls:
    """Return the corners of the bodies at four places, or of the first of them; None where there is no table."""
    if corners is None:
        return None
    one = shapes.hull_of(bodies[places[0]], corners)
    two = shapes.hull_of(bodies[places[1]], corners)
    three = shapes.hull_of(bodies[places[2]], corners)
    last = shapes.hull_of(bodies[places[3]], corners)
    return Hulls(
        corners,
        (one.first, two.first, three.first, last.first),
        max(one.size, two.size, three.size, last.size),
        four(lane, 1.0 * one.first, 1.0 * two.first, 1.0 * three.first, 1.0 * last.first),
        four(lane, 1.0 * one.size, 1.0 * two.size, 1.0 * three.size, 1.0 * last.size),
        four(lane, one.inner, two.inner, three.inner, last.inner),
    )


@jit.kernel
def either(is_one: Mask, one: Block, two: Block) -> Block:
    """Return one body or the other."""
    return Block(
        select(is_one, one.x, two.x),
        select(is_one, one.y, two.y),
        select(is_one, one.cos, two.cos),
        select(is_one, one.sin, two.sin),
        select(is_one, one.half_x, two.half_x),
        select(is_one, one.half_y, two.half_y),
    )


@jit.kernel
def block_ahead(body: Block, vx: Lanes, vy: Lanes, spin: Lanes, ahead: Lanes) -> Block:
    """Return a body as it will be a short time `ahead` (s); its turn to second order."""
    turn = ahead * spin
    lost = 0.5 * turn * turn
    cos = body.cos - turn * body.sin - lost * body.cos
    sin = body.sin + turn * body.cos - lost * body.sin
    return Block(body.x + ahead * vx, body.y + ahead * vy, cos, sin, body.half_x, body.half_y)


@jit.kernel
def least_half(a: Block, b: Block) -> Lanes:
    """Return the least half side (m) of two bodies, or of the boxes around them."""
    return lesser(lesser(a.half_x, a.half_y), lesser(b.half_x, b.half_y))


@jit.kernel
def least_inner(a: Block, hulls_a: AnyHulls, b: Block, hulls_b: AnyHulls) -> Lanes:
    """Return the smaller inner radius (m) of two bodies."""
    if hulls_a is None:
        return least_half(a, b)
    return lesser(hulls_a.inner, hulls_b.inner)


@jit.kernel
def face_count(hulls: AnyHulls) -> int:
    """Return the number of faces of a single body."""
    return RECTANGLE if hulls is None else hulls.size


@jit.kernel
def normal_at(hulls: Hulls, k: int, lane: Lane) -> tuple[Lanes, Lanes, Lanes, Lanes]:
    """Return normal, distance and middle (m) of face k of bodies."""
    one, two, three, last = hulls.places
    return fields_0(lane, hulls.table, (one + k, two + k, three + k, last + k))


@jit.kernel
def side_at(table: arrays.Records, place: Lanes, lane: Lane) -> Side:
    """Return the faces at places of the table."""
    one, two, three, last = split(place)
    places = (int(one), int(two), int(three), int(last))
    nx, ny, distance, middle = fields_0(lane, table, places)
    half, _, _, _ = fields_4(lane, table, places)
    return Side(nx, ny, distance, middle, half)


@jit.kernel
def side_of_rectangle(body: Block, along_x: Mask, sign: Lanes) -> Side:
    """Return the face of a rectangle on its own x axis or y axis, on the positive side or on the negative one."""
    distance = select(along_x, body.half_x, body.half_y)
    half = select(along_x, body.half_y, body.half_x)
    return Side(select(along_x, sign, 0.0), select(along_x, 0.0, sign), distance, 0.0 * sign, half)


@jit.kernel
def side_numbered(body: Block, hulls: AnyHulls, number: int) -> Side:
    """Return one of the faces of a single body; of a rectangle those at +x, +y, -x, -y."""
    if hulls is None:
        return side_of_rectangle(body, number % 2 == 0, 1.0 if number < RECTANGLE // 2 else -1.0)
    return side_at(hulls.table, hulls.first + number, 0)


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
def side_opposite(nx: Lanes, ny: Lanes, body: Block, hulls: AnyHulls, lane: Lane) -> tuple[Side, Lanes]:
    """Return the face of a body that looks most against a direction, and its number if the body is a polygon."""
    mx = body.cos * nx + body.sin * ny
    my = body.cos * ny - body.sin * nx
    if hulls is None:
        along_x = abs(mx) > abs(my)
        return side_of_rectangle(body, along_x, select(select(along_x, mx, my) > 0.0, -1.0, 1.0)), mx
    number = number_against(hulls, mx, my, lane)
    return side_at(hulls.table, hulls.first + number, lane), number


@jit.kernel
def face_on(body: Block, side: Side) -> Face:
    """Return a face as reference."""
    nx = body.cos * side.nx - body.sin * side.ny
    ny = body.sin * side.nx + body.cos * side.ny
    return Face(nx, ny, body.x, body.y, side.distance, -side.half - side.middle, side.half - side.middle)


@jit.kernel
def in_frame(face: Face, x: Lanes, y: Lanes) -> tuple[Lanes, Lanes]:
    """Return a place (m) in the frame of a face: to the right along it, and above it."""
    dx = x - face.x
    dy = y - face.y
    return dx * face.ny - dy * face.nx, dx * face.nx + dy * face.ny - face.distance


@jit.kernel
def edge_on(face: Face, body: Block, side: Side) -> Edge:
    """Return a face that looks towards a reference face: from the centre to its middle, and from there to both ends."""
    x, y = in_frame(face, body.x, body.y)
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
    return Edge(x - ex, y - ey, x + ex, y + ey, are_all, are_all)


@jit.kernel
def clip(edge: Edge, face: Face) -> Edge:
    """Cut an edge at both ends of the reference face; empty (left > right) where it lies beyond."""
    left, left_gap, right, right_gap, is_left, is_right = edge
    slope = select(right > left, (right_gap - left_gap) / (right - left), 0.0)
    is_cut_left = left < face.left
    is_cut_right = right > face.right
    return Edge(
        select(is_cut_left, face.left, left),
        select(is_cut_left, left_gap + slope * (face.left - left), left_gap),
        select(is_cut_right, face.right, right),
        select(is_cut_right, right_gap - slope * (right - face.right), right_gap),
        is_left | is_cut_left,
        is_right | is_cut_right,
    )

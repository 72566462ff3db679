"""Faces of convex polygons, of one body or of four at a time: which looks against a direction, and where it is.

As in groups.py one source serves four pairs and a single one: `lane` is None for four. Of four bodies with different
numbers of faces the table has faces after those of each that are never found (world/shapes.py).
"""

from typing import NamedTuple

from blocksim.kernels.common.arrays import Records
from blocksim.kernels.common.jit import kernel
from blocksim.kernels.common.outlines import Hull
from blocksim.kernels.common.simd import Lane, Lanes, fields_0, fields_4, select, split
from blocksim.kernels.nonsmooth.faces import Block, Edge, Face, in_frame


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


@kernel
def hulls_of_one(hull: Hull) -> Hulls:
    """Return the corners of a single body."""
    first, size = hull.first, hull.size
    places = (first, first, first, first)
    return Hulls(hull.table, places, size, 1.0 * first, 1.0 * size, 1.0 * hull.inner)


@kernel
def normal_at(hulls: Hulls, k: int, lane: Lane) -> tuple[Lanes, Lanes, Lanes, Lanes]:
    """Return normal, distance and middle (m) of face k of bodies."""
    one, two, three, four = hulls.places
    return fields_0(lane, hulls.table, (one + k, two + k, three + k, four + k))


@kernel
def side_at(table: Records, place: Lanes, lane: Lane) -> Side:
    """Return the faces at places of the table."""
    one, two, three, four = split(place)
    places = (int(one), int(two), int(three), int(four))
    nx, ny, distance, middle = fields_0(lane, table, places)
    half, _, _, _ = fields_4(lane, table, places)
    return Side(nx, ny, distance, middle, half)


@kernel
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


@kernel
def least_along(side: Side, mx: Lanes, my: Lanes) -> Lanes:
    """Return how far (m) a body reaches along a unit vector in its frame at least, given the face most against it.

    One of the two ends of that face is the corner that reaches least.
    """
    along = side.nx * mx + side.ny * my
    across = side.nx * my - side.ny * mx
    return side.distance * along + side.middle * across - side.half * abs(across)


@kernel
def side_face(body: Block, side: Side) -> Face:
    """Return a face as reference: of a rectangle what face_of returns, bit by bit."""
    return Face(
        body.cos * side.nx - body.sin * side.ny,
        body.sin * side.nx + body.cos * side.ny,
        body.x,
        body.y,
        side.distance,
        -side.half - side.middle,
        side.half - side.middle,
    )


@kernel
def side_edge(face: Face, body: Block, side: Side) -> Edge:
    """Return a face that looks towards a reference face: it begins at the left.

    Of a rectangle that is what opposite_edge returns, bit by bit: from the centre to the middle of the face, and from
    there to both ends.
    """
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

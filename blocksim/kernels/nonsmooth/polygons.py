"""Where convex polygons touch or will: faces by separating axes, points by clipping, as of rectangles (manifold.py).

Of all faces of both the reference is the one beyond which the other body reaches least. The face of the other body that
looks most against it is clipped to its length: that gives at most two points. Each of them is a corner of one of the
bodies, and impulses go with these corners from step to step: where a polygon rolls over a corner, what carried its one
face at the right carries the next one at the left.
"""

import math
from typing import NamedTuple

from blocksim.kernels.common.arrays import Record
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.common.outlines import AnyHull, Hull, corner_at, face_towards, least_along, next_corner
from blocksim.kernels.nonsmooth.arrays import FAR
from blocksim.kernels.nonsmooth.faces import (
    Block,
    Edge,
    Face,
    Points,
    clip_one,
    face_of,
    has_point,
    in_frame,
    opposite_edge,
)
from blocksim.kernels.nonsmooth.faces import points_of as points_on
from blocksim.kernels.nonsmooth.slip import Constraints

TIE = 1e-7  # m: by so much a face of body a has to be better than one of body b
EDGE = 0.01  # of the smaller inner radius: two faces that face each other over less are passed by
LEVEL = -0.99498743710662  # cosine: two faces within 0.1 rad of each other can meet as faces
ROUND_OFF = 0.5 * TIE
OF_B = 32  # added to the number of a corner of body b, which counts from 1
RECTANGLE = 4


class Best(NamedTuple):
    """The face of a body beyond which another reaches least, -1 for none, and the gap (m) there."""

    gap: float
    face: int


class Clipped(NamedTuple):
    """A reference face, what of the other body's face lies over it, and the corners that its ends are."""

    face: Face
    edge: Edge
    left: int
    right: int


class Found(NamedTuple):
    """A manifold of polygons, whether there is one, and the corners that its points are."""

    points: Points
    is_near: bool
    one: int
    two: int


@kernel
def face_count(hull: AnyHull) -> int:
    """Return the number of faces of a body; a rectangle has no hull."""
    if hull is None:
        return RECTANGLE
    return hull.size


@kernel
def face_numbered(body: Block, hull: AnyHull, number: int) -> Face:
    """Return one of the faces of a body."""
    if hull is None:
        sign = 1.0 if number < 2 else -1.0
        along_x = number % 2 == 0
        mx = sign * (body.cos if along_x else -body.sin)
        my = sign * (body.sin if along_x else body.cos)
        return face_of(body, mx, my, along_x)
    return outline_face(body, hull, number)


@kernel
def outline_face(body: Block, hull: Hull, number: int) -> Face:
    """Return one of the faces of a polygon: of a rectangle what face_of returns, bit by bit."""
    corner = corner_at(hull, number)
    return Face(
        body.cos * corner.nx - body.sin * corner.ny,
        body.sin * corner.nx + body.cos * corner.ny,
        body.x,
        body.y,
        1.0 * corner.distance,
        -corner.half - corner.middle,
        corner.half - corner.middle,
    )


@kernel
def edge_opposite(face: Face, body: Block, hull: AnyHull) -> Edge:
    """Return the face of a body that looks most towards a reference face."""
    if hull is None:
        return opposite_edge(face, body)
    return outline_edge(face, body, hull, number_opposite(face.nx, face.ny, body, hull))


@kernel
def number_opposite(nx: float, ny: float, body: Block, hull: Hull) -> int:
    """Return the number of the face of a body that looks most against a direction."""
    return face_towards(hull, -(body.cos * nx + body.sin * ny), body.sin * nx - body.cos * ny)


@kernel
def outline_edge(face: Face, body: Block, hull: Hull, number: int) -> Edge:
    """Return a face of a polygon that looks towards a reference face: it begins at the left.

    Of a rectangle that is what opposite_edge returns, bit by bit: from the centre to the middle of the face, and from
    there to both ends.
    """
    corner = corner_at(hull, number)
    x, y = in_frame(face, body.x, body.y)
    # the body's own x axis in the frame of the reference face
    c = body.cos * face.ny - body.sin * face.nx
    s = body.cos * face.nx + body.sin * face.ny
    # normal and direction of the body's face there
    mx = corner.nx * c - corner.ny * s
    my = corner.nx * s + corner.ny * c
    tx = -corner.ny * c - corner.nx * s
    ty = corner.nx * c - corner.ny * s
    x = x + corner.distance * mx + corner.middle * tx
    y = y + corner.distance * my + corner.middle * ty
    ex = corner.half * tx
    ey = corner.half * ty
    are_all = abs(ex) >= 0.0
    return Edge(x - ex, y - ey, x + ex, y + ey, are_all, are_all)


@kernel
def best_above(least: float, body: Block, hull: Hull, other: Block, other_hull: Hull, but: int) -> Best:
    """Return the face of a body beyond which another one reaches least, of those with a gap above `least` (m).

    The face number `but` is left out. The other body reaches beyond a face at least by its inner radius, from its
    centroid: most faces are out with that.
    """
    dx = other.x - body.x
    dy = other.y - body.y
    px = body.cos * dx + body.sin * dy
    py = body.cos * dy - body.sin * dx
    # a direction in the frame of the body, in that of the other
    c = body.cos * other.cos + body.sin * other.sin
    s = body.sin * other.cos - body.cos * other.sin
    best = least
    number = -1
    for k in range(hull.size):
        one = hull.table[hull.first + k]
        away = one.nx * px + one.ny * py - one.distance
        if away - other_hull.inner > best and k != but:
            gap = away + least_along(other_hull, c * one.nx - s * one.ny, s * one.nx + c * one.ny)
            if gap > best:
                best, number = gap, k
    return Best(best, number)


@kernel
def best_face(body: Block, hull: Hull, other: Block, other_hull: Hull, thin: float) -> Best:
    """Return the face of a body beyond which another one reaches least."""
    best = best_above(-EDGE * thin, body, hull, other, other_hull, -1)
    if best.face < 0:
        return best_of_all(body, hull, other, other_hull)
    return best


@rare_kernel
def best_of_all(body: Block, hull: Hull, other: Block, other_hull: Hull) -> Best:
    """Return the same where bodies lie deep in one another."""
    return best_above(-math.inf, body, hull, other, other_hull, -1)


@kernel
def best_if_above(least: float, body: Block, hull: Hull, other: Block, other_hull: Hull) -> Best:
    """Return the face of a body beyond which another one reaches least, if the gap there is above `least` (m).

    Near centroids exclude that: regular polygons that meet face to face are done then.
    """
    dx = other.x - body.x
    dy = other.y - body.y
    near = least - ROUND_OFF + hull.inner + other_hull.inner
    if near > 0.0 and dx * dx + dy * dy <= near * near:
        return Best(least, -1)
    return best_above(least, body, hull, other, other_hull, -1)


@rare_kernel
def best_face_after_all(body: Block, hull: Hull, other: Block, other_hull: Hull, thin: float) -> Best:
    """Return the best face of a body where that of the other one, though no worse, has no point."""
    return best_face(body, hull, other, other_hull, thin)


@kernel
def clipped_on(body: Block, hull: Hull, number: int, other: Block, other_hull: Hull) -> Clipped:
    """Return what of another body lies over a face; its corners count from 1, those of the body from OF_B + 1."""
    face = outline_face(body, hull, number)
    against = number_opposite(face.nx, face.ny, other, other_hull)
    whole = outline_edge(face, other, other_hull, against)
    left = 1 + against if whole.left >= face.left else OF_B + 1 + next_corner(hull, number)
    right = 1 + next_corner(other_hull, against) if whole.right <= face.right else OF_B + 1 + number
    return Clipped(face, clip_one(whole, face), left, right)


@kernel
def can_meet(body: Block, hull: Hull, number: int, other: Block, other_hull: Hull) -> bool:
    """Return True if another body has a face that is nearly parallel to one."""
    corner = corner_at(hull, number)
    nx = body.cos * corner.nx - body.sin * corner.ny
    ny = body.sin * corner.nx + body.cos * corner.ny
    against = corner_at(other_hull, number_opposite(nx, ny, other, other_hull))
    mx = other.cos * against.nx - other.sin * against.ny
    my = other.sin * against.nx + other.cos * against.ny
    return nx * mx + ny * my < LEVEL


@kernel
def met_on(best: Best, body: Block, hull: Hull, other: Block, other_hull: Hull, thin: float) -> Clipped:
    """Return how another body lies over the best face of a body, or over the next best.

    Where two faces face each other over a sliver only, the bodies meet at other faces, if these are nearly parallel: a
    block that slides over the flush joint of two others would else be stopped by the side of the second, as it sinks in
    by a little. `thin` is the smaller inner radius of both (m).
    """
    found = clipped_on(body, hull, best.face, other, other_hull)
    if found.edge.right - found.edge.left < EDGE * thin:
        return met_beside(found, best.face, body, hull, other, other_hull, thin)
    return found


@rare_kernel
def met_beside(
    found: Clipped, number: int, body: Block, hull: Hull, other: Block, other_hull: Hull, thin: float
) -> Clipped:
    """Return how another body lies over the next best face after one, if it has one that is nearly parallel.

    Else return `found`, what lies over the one.
    """
    next_best = best_above(-EDGE * thin, body, hull, other, other_hull, number)
    if next_best.face >= 0 and can_meet(body, hull, next_best.face, other, other_hull):
        return clipped_on(body, hull, next_best.face, other, other_hull)
    return found


@kernel
def nothing() -> Found:
    """Return that there is no manifold."""
    return Found(Points(Constraints(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), FAR, FAR, True), False, 0, 0)


@kernel
def points_of_polygons(a: Block, hull_a: Hull, b: Block, hull_b: Hull, margin: float) -> Found:
    """Return the contact manifold of two convex polygons within the margin (m).

    All of it is inlined: a call that hands over two bodies with their corners takes as long as what it does.
    """
    thin = min(hull_a.inner, hull_b.inner)
    best_b = best_face(b, hull_b, a, hull_a, thin)
    if best_b.gap > margin:
        return nothing()
    best_a = best_if_above(min(best_b.gap + TIE, margin), a, hull_a, b, hull_b)
    if best_a.gap > margin:
        return nothing()
    if best_a.face < 0:
        found = found_on(met_on(best_b, b, hull_b, a, hull_a, thin), a, b, True, margin)
        if found.is_near:
            return found
        best_a = best_face_after_all(a, hull_a, b, hull_b, thin)
        if best_b.gap > best_a.gap:
            return found
    return found_on(met_on(best_a, a, hull_a, b, hull_b, thin), a, b, False, margin)


@kernel
def found_on(met: Clipped, a: Block, b: Block, is_of_b: bool, margin: float) -> Found:
    """Return a manifold on a reference face. Point one is the right one of a face of b, the left one of a face of a."""
    points = points_on(met.face, met.edge, a, b, is_of_b, margin)
    is_near = met.edge.right > met.edge.left and has_point(points)
    if is_of_b:
        return Found(points, is_near, met.right, met.left)
    return Found(points, is_near, OF_B ^ met.left, OF_B ^ met.right)


@kernel
def corners_on_ground(points: Points, block: Block, hull: Hull, is_first: bool) -> tuple[int, int]:
    """Return the corners of a polygon at the points of a manifold with the ground, which `is_first` has as body a."""
    if is_first:
        number = number_opposite(points.constraint.nx, points.constraint.ny, block, hull)
        return 1 + next_corner(hull, number), 1 + number
    number = number_opposite(-points.constraint.nx, -points.constraint.ny, block, hull)
    return OF_B + 1 + number, OF_B + 1 + next_corner(hull, number)


@kernel
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

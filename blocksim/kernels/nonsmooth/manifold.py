"""Where two bodies touch or will: the ends of the overlap of two faces, with their gaps.

Both ends lie on the reference face (references.py), to which the face of the other body that looks most against it is
clipped: that gives at most two points. Each of them is a corner of one of the bodies, and impulses of polygons go with
these corners from step to step.

Polygons whose faces hardly face one another, or meet beside the reference face, are looked at one pair at a time: they
meet at the next best face, if it is nearly parallel to one of the other body, and a face of b on which no point lies
gives way to that of a.
"""

from typing import NamedTuple

from blocksim.kernels.common import jit
from blocksim.kernels.common.simd import Lanes, Mask, is_all, lesser, select
from blocksim.kernels.common.tolerances import EDGE, ONE_POINT
from blocksim.kernels.nonsmooth import arrays, faces, references, slip


class Points(NamedTuple):
    """A manifold: its constraint, and its gaps (m), FAR where there is no such point."""

    constraint: slip.Constraints
    gap_one: Lanes
    gap_two: Lanes
    is_of_b: Mask  # the reference face is one of body b


class Manifold(NamedTuple):
    """Points, and of which corners they are.

    The points are the ends of face `best.against` where `is_left`, `is_right`, else those of the reference face. Of
    ground, on which all are corners of the block, `is_of_b` here is that of the ground.
    """

    points: Points
    is_near: Mask  # there is a point
    is_of_b: Mask
    best: references.Best
    is_left: Mask
    is_right: Mask


@jit.kernel
def points_of(
    face: faces.Face, edge: faces.Edge, a: faces.Block, b: faces.Block, is_of_b: Mask, margin: float
) -> tuple[Points, Mask]:
    """Return normal, arms and gaps of a manifold, and whether it has a point within the margin (m).

    Seen along the tangent, point one is the first: the right one of a face of b, the left one of a face of a.
    """
    sign = select(is_of_b, 1.0, -1.0)
    nx = sign * face.nx
    ny = sign * face.ny
    width = edge.right - edge.left
    left_gap = select(edge.is_left, edge.left_gap, arrays.FAR)
    right_gap = select(edge.is_right, edge.right_gap, arrays.FAR)
    left_gap = select(left_gap <= margin, left_gap, arrays.FAR)
    right_gap = select(right_gap <= margin, right_gap, arrays.FAR)
    is_sliver = width < ONE_POINT * lesser(a.half_x + a.half_y, b.half_x + b.half_y)
    is_left_less = left_gap <= right_gap
    right_gap = select(is_sliver & is_left_less, arrays.FAR, right_gap)
    left_gap = select(is_sliver & (is_left_less ^ is_sliver), arrays.FAR, left_gap)
    one = select(is_of_b, edge.right, edge.left)
    # point one in world axes, on the face
    x = face.x + face.nx * face.distance + face.ny * one
    y = face.y + face.ny * face.distance - face.nx * one
    constraint = slip.Constraints(
        nx,
        ny,
        (x - a.x) * ny - (y - a.y) * nx,
        (x - b.x) * ny - (y - b.y) * nx,
        width,
        (x - a.x) * nx + (y - a.y) * ny,
        (x - b.x) * nx + (y - b.y) * ny,
    )
    gap_one = select(is_of_b, right_gap, left_gap)
    gap_two = select(is_of_b, left_gap, right_gap)
    return Points(constraint, gap_one, gap_two, is_of_b), lesser(gap_one, gap_two) < arrays.FAR


@jit.kernel
def manifold_on(reference: references.Reference, a: faces.Block, b: faces.Block, margin: float) -> Manifold:
    """Return the manifolds on reference faces."""
    is_of_b, best = reference.is_of_b, reference.best
    face = faces.face_on(faces.either(is_of_b, b, a), reference.side)
    whole = faces.edge_on(face, faces.either(is_of_b, a, b), reference.facing)
    edge = faces.clip(whole, face)
    points, has_point = points_of(face, edge, a, b, is_of_b, margin)
    is_near = (best.gap <= margin) & (edge.right > edge.left) & has_point
    return Manifold(points, is_near, is_of_b, best, whole.left >= face.left, whole.right <= face.right)


@jit.kernel
def is_any_odd(found: Manifold, hulls_a: faces.AnyHulls, hulls_b: faces.AnyHulls, margin: float) -> bool:
    """Return True if faces of any pair of polygons hardly face one another or have no point."""
    if hulls_a is None:
        return False
    points = found.points
    is_sliver = points.constraint.width < EDGE * lesser(hulls_a.inner, hulls_b.inner)
    is_empty = found.is_of_b & (lesser(points.gap_one, points.gap_two) >= arrays.FAR)
    return not is_all(select((found.best.gap <= margin) & (is_sliver | is_empty), 1.0, 0.0) <= 0.0)


@jit.rare_kernel
def manifold_beside(
    is_of_b: bool,
    best: references.Best,
    a: faces.Block,
    hulls_a: faces.Hulls,
    b: faces.Block,
    hulls_b: faces.Hulls,
    margin: float,
) -> Manifold:
    """Return the manifold on the best face of a body, or on the next best where it faces the other over a sliver."""
    found = manifold_on(references.reference_on(is_of_b, best, best, hulls_a, hulls_b, 0), a, b, margin)
    least = EDGE * min(hulls_a.inner, hulls_b.inner)
    if found.points.constraint.width < least:
        body, hulls, other, others = (b, hulls_b, a, hulls_a) if is_of_b else (a, hulls_a, b, hulls_b)
        beside = references.next_above(-least, best.number, body, hulls, other, others)
        if beside.number >= 0.0:
            return manifold_on(references.reference_on(is_of_b, beside, beside, hulls_a, hulls_b, 0), a, b, margin)
    return found


@jit.kernel
def manifold_of_one(
    reference: references.Reference,
    a: faces.Block,
    hulls_a: faces.AnyHulls,
    b: faces.Block,
    hulls_b: faces.AnyHulls,
    margin: float,
) -> Manifold:
    """Return the manifold of one pair, whose faces may face one another over a sliver, or have no point."""
    found = manifold_on(reference, a, b, margin)
    if hulls_a is None:
        return found
    if not is_any_odd(found, hulls_a, hulls_b, margin):
        return found
    of_b, of_a = reference.of_b, reference.of_a
    if of_a.number < 0.0:
        found = manifold_beside(True, of_b, a, hulls_a, b, hulls_b, margin)
        if found.is_near:
            return found
        pose = references.pose_of(b, a)
        of_a = references.best_from(references.farthest_face(hulls_a, pose, 0), hulls_a, pose, hulls_b, 0)
        if of_b.gap > of_a.gap:
            return found
    return manifold_beside(False, of_a, a, hulls_a, b, hulls_b, margin)

"""Where two bodies touch or will: the ends of the overlap of two faces, with their gaps.

Both ends lie on the reference face (references.py), to which the face of the other body that looks most against it is
clipped: that gives at most two points. Each of them is a corner of one of the bodies, and impulses of polygons go with
these corners from step to step.

Pairs whose corners meet are decided one at a time, as other faces may be right (flush_joints.py). Polygons that meet
beside the reference face are looked at one at a time too: a face of b on which no point lies gives way to that of a.

A segment of ground is a line with the solid below, of which only the upper face counts. Of its face and those of the
block, the one beyond which the other reaches least shows how the two meet, and all of the block count, whichever way
they look: a block beside a step reaches far below the upper face of that step, but it is its side that is in touch, and
a block on a step reaches as far behind the riser as it is long, but it is its lower face. Where it is a face of the
block, an end of the segment is what it touches, or nothing: ends at which the ground continues belong to one of the two
segments or are no edges.
"""

from typing import NamedTuple

from blocksim.kernels.common import jit
from blocksim.kernels.common.simd import Lanes, Mask, is_all, lesser, select
from blocksim.kernels.common.tolerances import FACING, NEAR_CORNER, ONE_POINT, PARALLEL_COSINE, TIE, UNEVEN
from blocksim.kernels.nonsmooth import arrays, faces, references, slip

UPPER_RIGHT, UPPER_LEFT, SHARP_RIGHT, SHARP_LEFT = 2, 3, 4, 5  # bits of corners of a segment


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
    are_corners: Mask  # they meet near a corner of both bodies, and other faces may be right


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
def meet_with_corners(whole: faces.Edge, edge: faces.Edge, face: faces.Face, inner: Lanes) -> Mask:
    """Return True where what is nearest to a face is near corners of both bodies; `inner` (m) is their inner radius.

    Given are the other face, whole and clipped. Of two points the nearer counts, unless both are as near.
    """
    near, uneven = NEAR_CORNER * inner, UNEVEN * inner
    apart = edge.right_gap - edge.left_gap
    at_left = (abs(whole.left - face.left) < near) & (apart > uneven)
    at_right = (abs(whole.right - face.right) < near) & (apart < -uneven)
    return (edge.right - edge.left < near) | at_left | at_right


@jit.kernel
def manifold_on(
    reference: references.Reference, a: faces.Block, b: faces.Block, margin: float, inner: Lanes
) -> Manifold:
    """Return the manifolds on reference faces; `inner` (m) is the smaller inner radius."""
    is_of_b, best = reference.is_of_b, reference.best
    face = faces.face_on(faces.either(is_of_b, b, a), reference.side)
    whole = faces.edge_on(face, faces.either(is_of_b, a, b), reference.facing)
    edge = faces.clip(whole, face)
    points, has_point = points_of(face, edge, a, b, is_of_b, margin)
    is_near = (best.gap <= margin) & (edge.right > edge.left) & has_point
    are_corners = meet_with_corners(whole, edge, face, inner) & (reference.next_gap > -NEAR_CORNER * inner) & is_near
    return Manifold(points, is_near, is_of_b, best, whole.left >= face.left, whole.right <= face.right, are_corners)


@jit.kernel
def is_without_point(found: Manifold, margin: float) -> Mask:
    """Return True where no point lies on the best face, one of body b."""
    points = found.points
    return (found.best.gap <= margin) & found.is_of_b & (lesser(points.gap_one, points.gap_two) >= arrays.FAR)


@jit.kernel
def is_any_without_point(found: Manifold, hulls_a: faces.AnyHulls, margin: float) -> bool:
    """Return True if any pair of polygons has to be looked at alone."""
    if hulls_a is None:
        return False
    return not is_all(select(is_without_point(found, margin), 1.0, 0.0) <= 0.0)


@jit.kernel
def manifold_of_one(
    reference: references.Reference,
    a: faces.Block,
    hulls_a: faces.AnyHulls,
    b: faces.Block,
    hulls_b: faces.AnyHulls,
    margin: float,
) -> Manifold:
    """Return the manifold of one pair; on a face of polygon a where there is none on the best one of b."""
    inner = faces.least_inner(a, hulls_a, b, hulls_b)
    found = manifold_on(reference, a, b, margin, inner)
    if hulls_a is None:
        return found
    if not is_without_point(found, margin):
        return found
    pose = references.pose_of(b, a)
    of_a = references.best_from(references.farthest_face(hulls_a, pose, 0), hulls_a, pose, hulls_b, 0)
    if reference.of_b.gap > of_a.gap:
        return found
    return manifold_on(references.reference_on(False, reference.of_b, of_a, hulls_a, hulls_b, 0), a, b, margin, inner)


class Meeting(NamedTuple):
    """A face of a block, how a segment lies before it, the least gap (m), and how the two faces look."""

    face: faces.Face
    edge: faces.Edge
    gap: float
    cosine: float  # between the outward normals of the two faces


@jit.kernel
def manifold_on_level(block: faces.Block, hulls: faces.AnyHulls, ground: faces.Block, margin: float) -> Manifold:
    """Return the contact manifold of a block and the half-plane within the margin (m)."""
    face = faces.Face(0.0, 1.0, block.x, ground.y, 0.0, -arrays.FAR, arrays.FAR)
    side, against = faces.side_opposite(0.0, 1.0, block, hulls, 0)
    edge = faces.edge_on(face, block, side)
    points, has_point = points_of(face, edge, block, ground, True, margin)
    return Manifold(points, has_point, True, references.Best(0.0, against, against), True, True, False)


@jit.kernel
def meeting_on(block: faces.Block, hulls: faces.AnyHulls, segment: faces.Block, corners: int, number: int) -> Meeting:
    """Return how a segment lies before one of the faces of a block: its upper face, seen from there."""
    face = faces.face_on(block, faces.side_numbered(block, hulls, number))
    x, y = faces.in_frame(face, segment.x - segment.sin * segment.half_y, segment.y + segment.cos * segment.half_y)
    c = (segment.cos * face.ny - segment.sin * face.nx) * segment.half_x
    s = (segment.cos * face.nx + segment.sin * face.ny) * segment.half_x
    is_right_end = (corners >> UPPER_RIGHT) & 1 == 1
    is_left_end = (corners >> UPPER_LEFT) & 1 == 1
    if c > 0.0:  # seen from behind
        edge = faces.Edge(x - c, y - s, x + c, y + s, is_left_end, is_right_end)
    else:
        edge = faces.Edge(x + c, y + s, x - c, y - s, is_right_end, is_left_end)
    return Meeting(face, edge, min(edge.left_gap, edge.right_gap), face.ny * segment.cos - face.nx * segment.sin)


@jit.kernel
def is_edge(meeting: Meeting) -> bool:
    """Return True if the end of a segment that is nearest to the face of a block is an edge that can touch."""
    edge = meeting.edge
    return bool(edge.is_left) if edge.left_gap < edge.right_gap else bool(edge.is_right)


@jit.kernel
def touches_edge(meeting: Meeting, corners: int) -> bool:
    """Return True if a face of a block examines the edge at which a segment ends, not at the segment beyond it.

    The upper faces of two segments that join at a right angle look at right angles; at a sharper edge, and at the end
    of a wall, blocks come from farther round.
    """
    is_left = meeting.edge.left_gap < meeting.edge.right_gap
    is_right_end = is_left == (meeting.cosine <= 0.0)
    is_sharp = (corners >> (SHARP_RIGHT if is_right_end else SHARP_LEFT)) & 1 == 1
    return is_edge(meeting) and (is_sharp or meeting.cosine < FACING)


@jit.rare_kernel
def manifold_on_segment(
    block: faces.Block, hulls: faces.AnyHulls, segment: faces.Block, corners: int, is_first: bool, margin: float
) -> Manifold:
    """Return the contact manifold of a block and a segment of ground within the margin (m).

    `is_first` tells whether the block is body a. Where an end of the segment is an edge that blocks can touch, as the
    bits `corners` tell, a face of the block that looks down on it may be the reference.
    """
    face = faces.face_on(segment, faces.Side(0.0, 1.0, segment.half_y, 0.0, segment.half_x))
    side, against = faces.side_opposite(face.nx, face.ny, block, hulls, 0)
    edge = faces.edge_on(face, block, side)
    gap = min(edge.left_gap, edge.right_gap)
    edge = faces.clip(edge, face)
    is_near = min(edge.left_gap, edge.right_gap) >= -2.0 * segment.half_y
    meeting = meeting_on(block, hulls, segment, corners, 0)
    for k in range(1, faces.face_count(hulls)):
        other = meeting_on(block, hulls, segment, corners, k)
        if other.gap > meeting.gap:
            meeting = other
    tie = TIE * min(block.half_x, block.half_y)
    is_of_block = meeting.gap > gap + tie and (is_edge(meeting) or meeting.cosine > PARALLEL_COSINE)
    if is_of_block:
        face = meeting.face
        _, against = faces.side_opposite(-face.nx, -face.ny, block, hulls, 0)
        edge = faces.clip(meeting.edge, face)
        is_near = touches_edge(meeting, corners) and edge.right >= edge.left
    else:
        is_near = is_near and edge.right > edge.left
    a, b = (block, segment) if is_first else (segment, block)
    points, has_point = points_of(face, edge, a, b, is_of_block != is_first, margin)
    is_near = is_near and max(gap, meeting.gap) <= margin and has_point
    return Manifold(points, is_near, is_first, references.Best(gap, against, against), True, True, False)

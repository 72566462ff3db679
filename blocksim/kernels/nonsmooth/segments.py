"""Where a block touches a segment of ground: a line with the solid below, of which only the upper face counts.

Of its face and those of the block, the one beyond which the other reaches least shows how the two meet, and all of the
block count, whichever way they look: a block beside a step reaches far below the upper face of that step, but it is its
side that is in touch, and a block on a step reaches as far behind the riser as it is long, but it is its lower face.
Where it is a face of the block, an end of the segment is what it touches, or nothing: ends at which the ground
continues belong to one of the two segments or are no edges.
"""

from typing import NamedTuple

from blocksim.kernels.common import jit
from blocksim.kernels.common.tolerances import FACING, PARALLEL_COSINE, TIE
from blocksim.kernels.nonsmooth import arrays, faces, references
from blocksim.kernels.nonsmooth.manifold import Manifold, points_of

UPPER_RIGHT, UPPER_LEFT, SHARP_RIGHT, SHARP_LEFT = 2, 3, 4, 5  # bits of corners


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
    return Manifold(points, has_point, True, references.Best(0.0, against, against), True, True)


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
    return Manifold(points, is_near, is_first, references.Best(gap, against, against), True, True)

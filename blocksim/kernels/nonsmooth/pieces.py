"""Where a block touches the ground: the half-plane, or a piece of it, of which only the upper face counts.

A piece is a line with the solid below. Of its face and those of the block, the one beyond which the other reaches
least shows how the two meet (separating axes: S. Gottschalk, TR96-024, UNC Chapel Hill (1996)), and all four count,
whichever way they look: a block beside a step reaches far below the upper face of that step, but it is its side that is
in touch, and a block on a step reaches as far behind the riser as it is long, but it is its lower face. Where it is a
face of the block, an end of the piece is what it touches, or nothing: ends at which the ground continues belong to one
of the two pieces or are no edges.
"""

from typing import NamedTuple

from blocksim.kernels.common import jit, shapes
from blocksim.kernels.nonsmooth import arrays, faces, polygons, slip

TIE = 1e-7  # m: by so much a face of the block has to be better than that of the piece
FACING = -0.01  # cosine: faces of a block that look more away than that from a piece of ground do not touch its edge
PARALLEL = -0.99995  # cosine: faces within 0.01 rad of each other meet as faces, if the end of the piece is no edge

UPPER_RIGHT, UPPER_LEFT, SHARP_RIGHT, SHARP_LEFT = 2, 3, 4, 5  # bits of corners


class Meeting(NamedTuple):
    """A face of a block, how a piece of ground lies before it, the least gap (m), and how the two faces look."""

    face: faces.Face
    edge: faces.Edge
    gap: float
    cosine: float  # between the outward normals of the two faces


@jit.kernel
def points_on_level(block: faces.Block, ground: faces.Block, margin: float) -> tuple[faces.Points, bool]:
    """Return the contact manifold of a rectangle and the half-plane, and whether there is one within the margin (m).

    That of points_on_ground, bit by bit, without what a normal along y multiplies by zero.
    """
    is_side = abs(block.sin) > abs(block.cos)
    sign = -1.0 if (block.sin if is_side else block.cos) > 0.0 else 1.0
    away = sign * (block.half_x if is_side else block.half_y)
    along = block.half_y if is_side else block.half_x
    x = away * (block.cos if is_side else -block.sin)
    y = block.y - ground.y + away * (block.sin if is_side else block.cos)
    ex = along * (-block.sin if is_side else block.cos)
    ey = along * (block.cos if is_side else block.sin)
    turned = -1.0 if ex < 0.0 else 1.0
    left = x - turned * ex
    right = x + turned * ex
    left_gap = y - turned * ey
    right_gap = y + turned * ey
    is_near = min(left_gap, right_gap) <= margin
    left_gap, right_gap = faces.counted(left_gap, right_gap, right - left, block, ground, margin)
    foot = block.x + right
    constraint = slip.Constraints(
        0.0, 1.0, foot - block.x, foot - ground.x, right - left, ground.y - block.y, ground.y - ground.y
    )
    return faces.Points(constraint, right_gap, left_gap, True), is_near


@jit.rare_kernel
def points_on_ground(
    block: faces.Block, hull: shapes.AnyHull, ground: faces.Block, margin: float
) -> tuple[faces.Points, bool]:
    """Return the contact manifold of a block and the half-plane, and whether there is one within the margin (m)."""
    face = faces.Face(0.0, 1.0, block.x, ground.y, 0.0, -arrays.FAR, arrays.FAR)
    edge = polygons.edge_opposite(face, block, hull)
    points = faces.points_of(face, edge, block, ground, True, margin)
    return points, min(edge.left_gap, edge.right_gap) <= margin


@jit.kernel
def upper_edge(face: faces.Face, piece: faces.Block, corners: int) -> faces.Edge:
    """Return the upper face of a piece of ground in the frame of a reference face of a block."""
    x, y = faces.in_frame(face, piece.x - piece.sin * piece.half_y, piece.y + piece.cos * piece.half_y)
    c = (piece.cos * face.ny - piece.sin * face.nx) * piece.half_x
    s = (piece.cos * face.nx + piece.sin * face.ny) * piece.half_x
    is_right_end = (corners >> UPPER_RIGHT) & 1 == 1
    is_left_end = (corners >> UPPER_LEFT) & 1 == 1
    if c > 0.0:  # seen from behind
        return faces.Edge(x - c, y - s, x + c, y + s, is_left_end, is_right_end)
    return faces.Edge(x + c, y + s, x - c, y - s, is_right_end, is_left_end)


@jit.kernel
def meeting_on(block: faces.Block, hull: shapes.AnyHull, piece: faces.Block, corners: int, number: int) -> Meeting:
    """Return how a piece of ground lies before one of the faces of a block."""
    face = polygons.face_numbered(block, hull, number)
    edge = upper_edge(face, piece, corners)
    return Meeting(face, edge, min(edge.left_gap, edge.right_gap), face.ny * piece.cos - face.nx * piece.sin)


@jit.kernel
def best_meeting(block: faces.Block, hull: shapes.AnyHull, piece: faces.Block, corners: int) -> Meeting:
    """Return how a piece of ground meets the face of a block that it reaches beyond least."""
    best = meeting_on(block, hull, piece, corners, 0)
    for number in range(1, polygons.face_count(hull)):
        other = meeting_on(block, hull, piece, corners, number)
        if other.gap > best.gap:
            best = other
    return best


@jit.kernel
def is_edge(meeting: Meeting) -> bool:
    """Return True if the end of a piece of ground that is nearest to the face of a block is an edge that can touch."""
    edge = meeting.edge
    return bool(edge.is_left) if edge.left_gap < edge.right_gap else bool(edge.is_right)


@jit.kernel
def touches_edge(meeting: Meeting, corners: int) -> bool:
    """Return True if a face of a block examines the edge at which a piece of ground ends, not at the piece beyond it.

    The upper faces of two pieces that join at a right angle look at right angles; at a sharper edge, and at the end of
    a wall, blocks come from farther round.
    """
    is_left = meeting.edge.left_gap < meeting.edge.right_gap
    is_right_end = is_left == (meeting.cosine <= 0.0)
    is_sharp = (corners >> (SHARP_RIGHT if is_right_end else SHARP_LEFT)) & 1 == 1
    return is_edge(meeting) and (is_sharp or meeting.cosine < FACING)


@jit.rare_kernel
def points_on_piece(
    block: faces.Block, hull: shapes.AnyHull, piece: faces.Block, corners: int, is_first: bool, margin: float
) -> tuple[faces.Points, bool]:
    """Return the contact manifold of a block and a piece of ground, and whether there is one within the margin (m).

    `is_first` tells whether the block is body a. Where an end of the piece is an edge that blocks can touch, as the
    bits `corners` tell, a face of the block that looks down on it may be the reference.
    """
    face = faces.face_of(piece, -piece.sin, piece.cos, False)
    edge = polygons.edge_opposite(face, block, hull)
    gap = min(edge.left_gap, edge.right_gap)
    edge = faces.clip(edge, face)
    is_near = min(edge.left_gap, edge.right_gap) >= -2.0 * piece.half_y
    meeting = best_meeting(block, hull, piece, corners)
    is_of_block = meeting.gap > gap + TIE and (is_edge(meeting) or meeting.cosine > PARALLEL)
    if is_of_block:
        face = meeting.face
        edge = faces.clip(meeting.edge, face)
        is_near = touches_edge(meeting, corners) and edge.right >= edge.left
    else:
        is_near = is_near and edge.right > edge.left
    a, b = (block, piece) if is_first else (piece, block)
    points = faces.points_of(face, edge, a, b, is_of_block != is_first, margin)
    return points, is_near and max(gap, meeting.gap) <= margin and faces.has_point(points)

"""Where a block touches the ground: the half-plane, or a piece of it, of which only the upper face counts."""

from blocksim.kernels.jit import kernel, rare_kernel
from blocksim.kernels.nonsmooth.arrays import FAR
from blocksim.kernels.nonsmooth.faces import (
    Block,
    Edge,
    Face,
    Points,
    clip,
    face_of,
    in_frame,
    opposite_edge,
    points_of,
)

TIE = 1e-7  # m: by so much a face of the block has to be better than that of the piece
FACING = -0.01  # cosine: faces of a block that look more away than that from a piece of ground do not touch its edge

UPPER_RIGHT, UPPER_LEFT = 2, 3  # corners


@rare_kernel
def points_on_ground(block: Block, ground: Block, margin: float) -> tuple[Points, bool]:
    """Return the contact manifold of a block and the half-plane, and whether there is one within the margin (m)."""
    face = Face(0.0, 1.0, block.x, ground.y, 0.0, FAR)
    edge = opposite_edge(face, block)
    points = points_of(face, edge, block, ground, True, margin)
    return points, min(edge.left_gap, edge.right_gap) <= margin


@kernel
def upper_edge(face: Face, piece: Block, corners: int) -> Edge:
    """Return the upper face of a piece of ground in the frame of a reference face that looks down on it."""
    x, y = in_frame(face, piece.x - piece.sin * piece.half_y, piece.y + piece.cos * piece.half_y)
    c = (piece.cos * face.ny - piece.sin * face.nx) * piece.half_x
    s = (piece.cos * face.nx + piece.sin * face.ny) * piece.half_x
    is_left = (corners >> UPPER_RIGHT) & 1 == 1  # seen from above a piece, right is left in its own frame
    is_right = (corners >> UPPER_LEFT) & 1 == 1
    return Edge(x + c, y + s, x - c, y - s, is_left, is_right)


@rare_kernel
def points_on_piece(block: Block, piece: Block, corners: int, is_first: bool, margin: float) -> tuple[Points, bool]:
    """Return the contact manifold of a block and a piece of ground, and whether there is one within the margin (m).

    `is_first` tells whether the block is body a. Where an end of the piece is an edge that blocks can touch, as the
    bits `corners` tell, a face of the block that looks down on it may be the reference.
    """
    face = face_of(piece, -piece.sin, piece.cos, False)
    edge = opposite_edge(face, block)
    best = min(edge.left_gap, edge.right_gap)
    is_near = best <= margin
    edge = clip(edge, face.half)
    is_above = edge.right > edge.left and min(edge.left_gap, edge.right_gap) >= -2.0 * piece.half_y
    is_of_block = False
    if is_near and corners != 0:
        for k in range(4):
            sign = 1.0 if k < 2 else -1.0
            along_x = k % 2 == 0
            mx = sign * (block.cos if along_x else -block.sin)
            my = sign * (block.sin if along_x else block.cos)
            if my * piece.cos - mx * piece.sin < FACING:
                other = face_of(block, mx, my, along_x)
                up = upper_edge(other, piece, corners)
                if min(up.left_gap, up.right_gap) > best + TIE:
                    best = min(up.left_gap, up.right_gap)
                    face = other
                    edge = clip(up, other.half)
                    is_of_block = True
    a, b = (block, piece) if is_first else (piece, block)
    points = points_of(face, edge, a, b, is_of_block != is_first, margin)
    return points, is_near and best <= margin and edge.right > edge.left and (is_above or is_of_block)

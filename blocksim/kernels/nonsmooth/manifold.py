"""Where two bodies touch or will: the ends of the overlap of two faces, with their gaps.

One face is the reference: its line carries both points, and its normal is theirs. Of all faces it is the one beyond
which the other body reaches least (separating axes). The opposite face of the other body is clipped to its length.
"""

from typing import NamedTuple

from blocksim.kernels.arrays import ALL, Record, Records
from blocksim.kernels.jit import kernel, rare_kernel
from blocksim.kernels.lanes import (
    WIDTH,
    Lanes,
    Mask,
    fields_0,
    fields_4,
    fields_8,
    fields_16,
    greater,
    lesser,
    select,
    split,
    write_fields_0,
    write_fields_4,
    write_fields_8,
)
from blocksim.kernels.nonsmooth.arrays import AWAY, FAR, OPEN, TOUCHING

TIE = 1e-7  # m: by so much a face of body a has to be better than one of body b
EDGE = 0.01  # of the smaller half side: two faces that face each other over less are passed by
LEVEL = 0.1  # sine of the angle between two blocks up to which that is so
TURNED = 0.906307787036650  # cosine of 25 degrees
SLIVER = 1e-5  # of the smaller half side: with less between them two points are one
FACING = -0.01  # cosine: faces of a block that look more away than that from a piece of ground do not touch its edge

UPPER_RIGHT, UPPER_LEFT = 2, 3  # corners


class Face(NamedTuple):
    """A reference face: unit normal, centre of its body, distance of the face from there and half of its length (m)."""

    nx: Lanes
    ny: Lanes
    x: Lanes
    y: Lanes
    distance: Lanes
    half: Lanes


class Edge(NamedTuple):
    """The two ends of the other body's face in the frame of a reference face: along it to the right, and above it (m).

    The first is the left one. `is_left`, `is_right` tell whether the ends themselves can touch.
    """

    left: Lanes
    left_gap: Lanes
    right: Lanes
    right_gap: Lanes
    is_left: Mask
    is_right: Mask


class Block(NamedTuple):
    """What of bodies decides where they touch; fields as in BODY."""

    x: Lanes
    y: Lanes
    cos: Lanes
    sin: Lanes
    half_x: Lanes
    half_y: Lanes


class Points(NamedTuple):
    """A manifold, fields as in ROW."""

    nx: Lanes
    ny: Lanes
    arm_a: Lanes
    arm_b: Lanes
    width: Lanes
    shear_arm_a: Lanes
    shear_arm_b: Lanes
    gap_one: Lanes
    gap_two: Lanes


@kernel
def block_of(body: Record) -> Block:
    """Return what of a body decides where it touches."""
    return Block(body.x, body.y, body.cos, body.sin, body.half_x, body.half_y)


@kernel
def face_of(body: Block, mx: Lanes, my: Lanes, along_x: Mask) -> Face:
    """Return the face of a body with the outward normal (mx, my), on its own x axis or y axis."""
    distance = select(along_x, body.half_x, body.half_y)
    half = select(along_x, body.half_y, body.half_x)
    return Face(mx, my, body.x, body.y, distance, half)


@kernel
def face_towards(body: Block, x: Lanes, y: Lanes, along_x: Mask) -> Face:
    """Return the face on one of a body's axes that is on the side of a place (m), given in the body's own frame."""
    sign = select(select(along_x, x, y) >= 0.0, 1.0, -1.0)
    mx = sign * select(along_x, body.cos, -body.sin)
    my = sign * select(along_x, body.sin, body.cos)
    return face_of(body, mx, my, along_x)


@kernel
def in_frame(face: Face, x: Lanes, y: Lanes) -> tuple[Lanes, Lanes]:
    """Return a place (m) in the frame of a face: to the right along it, and above it."""
    dx = x - face.x
    dy = y - face.y
    return dx * face.ny - dy * face.nx, dx * face.nx + dy * face.ny - face.distance


@kernel
def opposite_edge(face: Face, body: Block) -> Edge:
    """Return the face of a body that looks most towards a reference face."""
    x, y = in_frame(face, body.x, body.y)
    # the body's own x axis in the frame of the face; its y axis is (-s, c)
    c = body.cos * face.ny - body.sin * face.nx
    s = body.cos * face.nx + body.sin * face.ny
    is_side = abs(s) > abs(c)
    sign = select(select(is_side, s, c) > 0.0, -1.0, 1.0)
    away = sign * select(is_side, body.half_x, body.half_y)
    along = select(is_side, body.half_y, body.half_x)
    x = x + away * select(is_side, c, -s)
    y = y + away * select(is_side, s, c)
    ex = along * select(is_side, -s, c)
    ey = along * select(is_side, c, s)
    turned = select(ex < 0.0, -1.0, 1.0)
    ex = turned * ex
    ey = turned * ey
    are_all = abs(ex) >= 0.0
    return Edge(x - ex, y - ey, x + ex, y + ey, are_all, are_all)


@kernel
def clip(edge: Edge, half: Lanes) -> Edge:
    """Cut an edge at both ends of the reference face; empty (left > right) where it lies beyond."""
    left, left_gap, right, right_gap, is_left, is_right = edge
    slope = select(right > left, (right_gap - left_gap) / (right - left), 0.0)
    is_cut_left = left < -half
    is_cut_right = right > half
    return Edge(
        select(is_cut_left, -half, left),
        select(is_cut_left, left_gap + slope * (-half - left), left_gap),
        select(is_cut_right, half, right),
        select(is_cut_right, right_gap - slope * (right - half), right_gap),
        is_left | is_cut_left,
        is_right | is_cut_right,
    )


@kernel
def points_of(face: Face, edge: Edge, a: Block, b: Block, is_of_b: Mask, margin: float) -> Points:
    """Return normal, arms and gaps of a manifold.

    Seen along the tangent, point one is the first: the right one of a face of b, the left one of a face of a.
    """
    sign = select(is_of_b, 1.0, -1.0)
    nx = sign * face.nx
    ny = sign * face.ny
    left_gap = select(edge.is_left & (edge.left_gap <= margin), edge.left_gap, FAR)
    right_gap = select(edge.is_right & (edge.right_gap <= margin), edge.right_gap, FAR)
    width = edge.right - edge.left
    is_sliver = width < SLIVER * lesser(a.half_x + a.half_y, b.half_x + b.half_y)
    is_left_less = left_gap <= right_gap
    right_gap = select(is_sliver & is_left_less, FAR, right_gap)
    left_gap = select(is_sliver & (is_left_less ^ is_sliver), FAR, left_gap)
    one = select(is_of_b, edge.right, edge.left)
    # point one in world axes, on the face
    x = face.x + face.nx * face.distance + face.ny * one
    y = face.y + face.ny * face.distance - face.nx * one
    return Points(
        nx,
        ny,
        (x - a.x) * ny - (y - a.y) * nx,
        (x - b.x) * ny - (y - b.y) * nx,
        width,
        (x - a.x) * nx + (y - a.y) * ny,
        (x - b.x) * nx + (y - b.y) * ny,
        select(is_of_b, right_gap, left_gap),
        select(is_of_b, left_gap, right_gap),
    )


@kernel
def has_point(points: Points) -> Mask:
    """Tell whether a manifold has a point."""
    return lesser(points.gap_one, points.gap_two) < FAR


@kernel
def write_points(row: Record, points: Points) -> bool:
    """Write a manifold into a row; tell whether it has a point. Impulses along another normal are forgotten."""
    if points.nx * row.nx + points.ny * row.ny < TURNED:
        row.normal_one = row.normal_two = row.shear = 0.0
    row.nx = points.nx
    row.ny = points.ny
    row.arm_a = points.arm_a
    row.arm_b = points.arm_b
    row.width = points.width
    row.shear_arm_a = points.shear_arm_a
    row.shear_arm_b = points.shear_arm_b
    row.gap_one = points.gap_one
    row.gap_two = points.gap_two
    return has_point(points)


@kernel
def passes_edge(best: Lanes, other: Lanes, a: Block, b: Block) -> Mask:
    """Tell whether two faces at a distance `best` (m) overlap so little that the blocks meet at other faces.

    `other` is the distance (m) along the other axis, which is negative by what they overlap. A block that slides over
    the flush joint of two others would else be stopped by the side of the second, as it sinks in by a little.
    """
    least = lesser(lesser(a.half_x, a.half_y), lesser(b.half_x, b.half_y))
    return (-EDGE * least < other) & (other < best)


@kernel
def chosen(is_one: Mask, one: Block, two: Block) -> Block:
    """Return one block or the other."""
    return Block(
        select(is_one, one.x, two.x),
        select(is_one, one.y, two.y),
        select(is_one, one.cos, two.cos),
        select(is_one, one.sin, two.sin),
        select(is_one, one.half_x, two.half_x),
        select(is_one, one.half_y, two.half_y),
    )


@kernel
def points_of_blocks(a: Block, b: Block, margin: float) -> tuple[Points, Mask]:
    """Return the contact manifold of two blocks within the margin (m), and whether there is one.

    Which faces meet no processor can guess, so that nothing branches.
    """
    dx = a.x - b.x
    dy = a.y - b.y
    c_abs = abs(a.cos * b.cos + a.sin * b.sin)
    s_abs = abs(a.sin * b.cos - a.cos * b.sin)
    bx = b.cos * dx + b.sin * dy
    by = b.cos * dy - b.sin * dx
    ax = a.cos * dx + a.sin * dy
    ay = a.cos * dy - a.sin * dx
    gap_bx = abs(bx) - b.half_x - c_abs * a.half_x - s_abs * a.half_y
    gap_by = abs(by) - b.half_y - s_abs * a.half_x - c_abs * a.half_y
    gap_ax = abs(ax) - a.half_x - c_abs * b.half_x - s_abs * b.half_y
    gap_ay = abs(ay) - a.half_y - s_abs * b.half_x - c_abs * b.half_y
    best_b = greater(gap_bx, gap_by)
    best_a = greater(gap_ax, gap_ay)
    is_of_b = best_b + TIE >= best_a
    of_x = select(is_of_b, gap_bx, gap_ax)
    of_y = select(is_of_b, gap_by, gap_ay)
    is_level = lesser(c_abs, s_abs) < LEVEL
    along_x = (of_x > of_y) ^ (is_level & passes_edge(greater(of_x, of_y), lesser(of_x, of_y), a, b))
    face = face_towards(chosen(is_of_b, b, a), select(is_of_b, bx, -ax), select(is_of_b, by, -ay), along_x)
    edge = clip(opposite_edge(face, chosen(is_of_b, a, b)), face.half)
    points = points_of(face, edge, a, b, is_of_b, margin)
    is_near = (greater(best_a, best_b) <= margin) & (edge.right > edge.left)
    return points, is_near & has_point(points)


@rare_kernel
def collide_blocks(row: Record, a: Record, b: Record, margin: float) -> bool:
    """Find the contact manifold of two blocks; tell whether there is one within the margin (m)."""
    points, is_on = points_of_blocks(block_of(a), block_of(b), margin)
    write_points(row, points)
    return is_on


@kernel
def reach_of(row: Record) -> int:
    """Tell whether a row within the margin has a point that touches or pressed in the last substep."""
    is_touching = min(row.gap_one, row.gap_two) <= 0.0 or row.normal_one > 0.0 or row.normal_two > 0.0
    return TOUCHING if is_touching else OPEN


@kernel
def blocks_at(bodies: Records, places: tuple[int, int, int, int]) -> Block:
    """Return four blocks."""
    x, y, _, cos = fields_0(None, bodies, places)
    sin, _, _, _ = fields_4(None, bodies, places)
    _, _, half_x, half_y = fields_16(None, bodies, places)
    return Block(x, y, cos, sin, half_x, half_y)


@kernel
def collide_four(rows: Records, first: int, bodies: Records, margin: float) -> None:
    """Find the contact manifolds of four pairs of blocks, from row `first` on, within the margin (m)."""
    places = (first, first + 1, first + 2, first + 3)
    one, two, three, four = rows[first], rows[first + 1], rows[first + 2], rows[first + 3]
    a = blocks_at(bodies, (one.a, two.a, three.a, four.a))
    b = blocks_at(bodies, (one.b, two.b, three.b, four.b))
    points, is_on = points_of_blocks(a, b, margin)
    nx, ny, _, _ = fields_0(None, rows, places)
    _, normal_one, normal_two, shear = fields_8(None, rows, places)
    are_kept = is_on & (points.nx * nx + points.ny * ny >= TURNED)
    normal_one = select(are_kept, normal_one, 0.0)
    normal_two = select(are_kept, normal_two, 0.0)
    shear = select(are_kept, shear, 0.0)
    are_all = points.width <= FAR
    write_fields_0(None, rows, places, are_all, (points.nx, points.ny, points.arm_a, points.arm_b))
    columns = (points.width, points.shear_arm_a, points.shear_arm_b, points.gap_one)
    write_fields_4(None, rows, places, are_all, columns)
    write_fields_8(None, rows, places, are_all, (points.gap_two, normal_one, normal_two, shear))
    is_near_one, is_near_two, is_near_three, is_near_four = split(select(is_on, 1.0, 0.0))
    one.reach = reach_of(one) if is_near_one > 0.0 else AWAY
    two.reach = reach_of(two) if is_near_two > 0.0 else AWAY
    three.reach = reach_of(three) if is_near_three > 0.0 else AWAY
    four.reach = reach_of(four) if is_near_four > 0.0 else AWAY


@rare_kernel
def collide_ground(row: Record, a: Record, b: Record, margin: float) -> bool:
    """Find the contact manifold of a block and the half-plane."""
    face = Face(0.0, 1.0, a.x, b.y, 0.0, FAR)
    edge = opposite_edge(face, block_of(a))
    if min(edge.left_gap, edge.right_gap) > margin:
        return False
    return write_points(row, points_of(face, edge, block_of(a), block_of(b), True, margin))


@kernel
def upper_edge(face: Face, slab: Record) -> Edge:
    """Return the upper face of a piece of ground in the frame of a reference face that looks down on it."""
    x, y = in_frame(face, slab.x - slab.sin * slab.half_y, slab.y + slab.cos * slab.half_y)
    c = (slab.cos * face.ny - slab.sin * face.nx) * slab.half_x
    s = (slab.cos * face.nx + slab.sin * face.ny) * slab.half_x
    is_left = (slab.corners >> UPPER_RIGHT) & 1 == 1  # seen from above a piece, right is left in its own frame
    is_right = (slab.corners >> UPPER_LEFT) & 1 == 1
    return Edge(x + c, y + s, x - c, y - s, is_left, is_right)


@rare_kernel
def collide_slab(row: Record, block: Record, slab: Record, is_first: bool, margin: float) -> bool:
    """Find the contact manifold of a block and a piece of ground, of which only the upper face counts.

    `is_first` tells whether the block is body a. Where an end of the piece is an edge that blocks can touch, a face of
    the block that looks down on it may be the reference.
    """
    face = face_of(block_of(slab), -slab.sin, slab.cos, False)
    edge = opposite_edge(face, block_of(block))
    best = min(edge.left_gap, edge.right_gap)
    if best > margin:
        return False
    edge = clip(edge, face.half)
    is_above = edge.right > edge.left and min(edge.left_gap, edge.right_gap) >= -2.0 * slab.half_y
    is_of_block = False
    if slab.corners != 0:
        for k in range(4):
            sign = 1.0 if k < 2 else -1.0
            along_x = k % 2 == 0
            mx = sign * (block.cos if along_x else -block.sin)
            my = sign * (block.sin if along_x else block.cos)
            if my * slab.cos - mx * slab.sin < FACING:
                other = face_of(block_of(block), mx, my, along_x)
                up = upper_edge(other, slab)
                if min(up.left_gap, up.right_gap) > best + TIE:
                    best = min(up.left_gap, up.right_gap)
                    face = other
                    edge = clip(up, other.half)
                    is_of_block = True
    if best > margin or edge.right <= edge.left or not (is_above or is_of_block):
        return False
    a, b = (block, slab) if is_first else (slab, block)
    return write_points(row, points_of(face, edge, block_of(a), block_of(b), is_of_block != is_first, margin))


@kernel
def are_four_of_blocks(rows: Records, first: int, bodies: Records) -> bool:
    """Tell whether four pairs, from row `first` on, are of blocks only, not of pieces of ground or the ground."""
    for r in range(first, first + WIDTH):
        row = rows[r]
        if row.b == bodies.size - 1 or bodies[row.a].faces != ALL or bodies[row.b].faces != ALL:
            return False
    return True


@rare_kernel
def collide(row: Record, a: Record, b: Record, is_ground: bool, margin: float) -> bool:
    """Find the contact manifold of a pair; without one its impulses are forgotten."""
    if is_ground:
        is_on = collide_ground(row, a, b, margin)
    elif a.faces != ALL:
        is_on = collide_slab(row, b, a, False, margin)
    elif b.faces != ALL:
        is_on = collide_slab(row, a, b, True, margin)
    else:
        is_on = collide_blocks(row, a, b, margin)
    if not is_on:
        row.normal_one = row.normal_two = row.shear = 0.0
    return is_on

"""Where two bodies touch or will: the ends of the overlap of two faces, with their gaps.

One face is the reference: its line carries both points, and its normal is theirs. Of all faces it is the one beyond
which the other body reaches least (separating axes). The opposite face of the other body is clipped to its length.
"""

from typing import NamedTuple

from blocksim.kernels.arrays import ALL, Record
from blocksim.kernels.jit import kernel, rare_kernel
from blocksim.kernels.nonsmooth.arrays import FAR

TIE = 1e-7  # m: by so much a face of body a has to be better than one of body b
EDGE = 0.01  # of the smaller half side: two faces that face each other over less are passed by
LEVEL = 0.1  # sine of the angle between two blocks up to which that is so
TURNED = 0.906307787036650  # cosine of 25 degrees
SLIVER = 1e-5  # of the smaller half side: with less between them two points are one
FACING = -0.01  # cosine: faces of a block that look more away than that from a piece of ground do not touch its edge

UPPER_RIGHT, UPPER_LEFT = 2, 3  # corners


class Face(NamedTuple):
    """A reference face: unit normal, centre of its body, distance of the face from there and half of its length (m)."""

    nx: float
    ny: float
    x: float
    y: float
    distance: float
    half: float


class Edge(NamedTuple):
    """The two ends of the other body's face in the frame of a reference face: along it to the right, and above it (m).

    The first is the left one. `is_left`, `is_right` tell whether the ends themselves can touch.
    """

    left: float
    left_gap: float
    right: float
    right_gap: float
    is_left: bool
    is_right: bool


@kernel
def face_of(body: Record, mx: float, my: float, along_x: bool) -> Face:
    """Return the face of a body with the outward normal (mx, my), on its own x axis or y axis."""
    distance = body.half_x if along_x else body.half_y
    half = body.half_y if along_x else body.half_x
    return Face(mx, my, body.x, body.y, distance, half)


@kernel
def face_towards(body: Record, x: float, y: float, along_x: bool) -> Face:
    """Return the face on one of a body's axes that is on the side of a place (m), given in the body's own frame."""
    sign = 1.0 if (x if along_x else y) >= 0.0 else -1.0
    return face_of(
        body, sign * (body.cos if along_x else -body.sin), sign * (body.sin if along_x else body.cos), along_x
    )


@kernel
def in_frame(face: Face, x: float, y: float) -> tuple[float, float]:
    """Return a place (m) in the frame of a face: to the right along it, and above it."""
    dx = x - face.x
    dy = y - face.y
    return dx * face.ny - dy * face.nx, dx * face.nx + dy * face.ny - face.distance


@kernel
def opposite_edge(face: Face, body: Record) -> Edge:
    """Return the face of a body that looks most towards a reference face."""
    x, y = in_frame(face, body.x, body.y)
    # the body's own x axis in the frame of the face; its y axis is (-s, c)
    c = body.cos * face.ny - body.sin * face.nx
    s = body.cos * face.nx + body.sin * face.ny
    if abs(s) > abs(c):
        sign = -1.0 if s > 0.0 else 1.0
        x += sign * c * body.half_x
        y += sign * s * body.half_x
        ex = -s * body.half_y
        ey = c * body.half_y
    else:
        sign = -1.0 if c > 0.0 else 1.0
        x -= sign * s * body.half_y
        y += sign * c * body.half_y
        ex = c * body.half_x
        ey = s * body.half_x
    if ex < 0.0:
        ex = -ex
        ey = -ey
    return Edge(x - ex, y - ey, x + ex, y + ey, True, True)


@kernel
def clip(edge: Edge, half: float) -> Edge:
    """Cut an edge at both ends of the reference face; empty (left > right) where it lies beyond."""
    left, left_gap, right, right_gap, is_left, is_right = edge
    slope = (right_gap - left_gap) / (right - left) if right > left else 0.0
    if left < -half:
        left_gap += slope * (-half - left)
        left = -half
        is_left = True
    if right > half:
        right_gap -= slope * (right - half)
        right = half
        is_right = True
    return Edge(left, left_gap, right, right_gap, is_left, is_right)


@kernel
def write_points(row: Record, face: Face, edge: Edge, a: Record, b: Record, is_of_b: bool, margin: float) -> bool:
    """Write normal, arms and gaps of a manifold into a row; tell whether it has a point.

    Seen along the tangent, point one is the first: the right one of a face of b, the left one of a face of a.
    """
    sign = 1.0 if is_of_b else -1.0
    nx = sign * face.nx
    ny = sign * face.ny
    if nx * row.nx + ny * row.ny < TURNED:
        row.normal_one = row.normal_two = row.shear = 0.0
    row.nx = nx
    row.ny = ny
    left_gap = edge.left_gap if edge.is_left and edge.left_gap <= margin else FAR
    right_gap = edge.right_gap if edge.is_right and edge.right_gap <= margin else FAR
    width = edge.right - edge.left
    if width < SLIVER * min(a.half_x + a.half_y, b.half_x + b.half_y):
        left_gap, right_gap = (left_gap, FAR) if left_gap <= right_gap else (FAR, right_gap)
    one = edge.right if is_of_b else edge.left
    # point one in world axes, on the face
    x = face.x + face.nx * face.distance + face.ny * one
    y = face.y + face.ny * face.distance - face.nx * one
    row.arm_a = (x - a.x) * ny - (y - a.y) * nx
    row.arm_b = (x - b.x) * ny - (y - b.y) * nx
    row.shear_arm_a = (x - a.x) * nx + (y - a.y) * ny
    row.shear_arm_b = (x - b.x) * nx + (y - b.y) * ny
    row.width = width
    row.gap_one = right_gap if is_of_b else left_gap
    row.gap_two = left_gap if is_of_b else right_gap
    return row.gap_one < FAR or row.gap_two < FAR


@kernel
def passes_edge(best: float, other: float, a: Record, b: Record) -> bool:
    """Tell whether two faces at a distance `best` (m) overlap so little that the blocks meet at other faces.

    `other` is the distance (m) along the other axis, which is negative by what they overlap. A block that slides over
    the flush joint of two others would else be stopped by the side of the second, as it sinks in by a little.
    """
    least = min(a.half_x, a.half_y, b.half_x, b.half_y)
    return -EDGE * least < other < best


@rare_kernel
def collide_blocks(row: Record, a: Record, b: Record, margin: float) -> bool:
    """Find the contact manifold of two blocks; tell whether there is one within the margin (m)."""
    dx = a.x - b.x
    dy = a.y - b.y
    c = a.cos * b.cos + a.sin * b.sin
    s = a.sin * b.cos - a.cos * b.sin
    c_abs = abs(c)
    s_abs = abs(s)
    bx = b.cos * dx + b.sin * dy
    by = b.cos * dy - b.sin * dx
    ax = a.cos * dx + a.sin * dy
    ay = a.cos * dy - a.sin * dx
    gap_bx = abs(bx) - b.half_x - c_abs * a.half_x - s_abs * a.half_y
    gap_by = abs(by) - b.half_y - s_abs * a.half_x - c_abs * a.half_y
    gap_ax = abs(ax) - a.half_x - c_abs * b.half_x - s_abs * b.half_y
    gap_ay = abs(ay) - a.half_y - s_abs * b.half_x - c_abs * b.half_y
    best_b = max(gap_bx, gap_by)
    best_a = max(gap_ax, gap_ay)
    if max(best_a, best_b) > margin:
        return False
    is_of_b = best_b + TIE >= best_a
    of_x, of_y = (gap_bx, gap_by) if is_of_b else (gap_ax, gap_ay)
    along_x = of_x > of_y
    if min(c_abs, s_abs) < LEVEL and passes_edge(max(of_x, of_y), min(of_x, of_y), a, b):
        along_x = not along_x
    if is_of_b:
        face = face_towards(b, bx, by, along_x)
        edge = clip(opposite_edge(face, a), face.half)
    else:
        face = face_towards(a, -ax, -ay, along_x)
        edge = clip(opposite_edge(face, b), face.half)
    return edge.right > edge.left and write_points(row, face, edge, a, b, is_of_b, margin)


@rare_kernel
def collide_ground(row: Record, a: Record, b: Record, margin: float) -> bool:
    """Find the contact manifold of a block and the half-plane."""
    face = Face(0.0, 1.0, a.x, b.y, 0.0, FAR)
    edge = opposite_edge(face, a)
    return min(edge.left_gap, edge.right_gap) <= margin and write_points(row, face, edge, a, b, True, margin)


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
    face = face_of(slab, -slab.sin, slab.cos, False)
    edge = opposite_edge(face, block)
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
                other = face_of(block, mx, my, along_x)
                up = upper_edge(other, slab)
                if min(up.left_gap, up.right_gap) > best + TIE:
                    best = min(up.left_gap, up.right_gap)
                    face = other
                    edge = clip(up, other.half)
                    is_of_block = True
    if best > margin or edge.right <= edge.left or not (is_above or is_of_block):
        return False
    a, b = (block, slab) if is_first else (slab, block)
    return write_points(row, face, edge, a, b, is_of_block != is_first, margin)


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

"""Faces of rectangles: which one examines a body, what of the other body's face lies over it, and the points there.

One face is the reference: its line carries both points, and its normal is theirs. The opposite face of the other body
is clipped to its length.

How contacts bend away from the straight lines that a step takes them for, as bodies turn.

Manifolds are found a time T = (dt - h) / 2 into the step and kept, so that a gap is linear in the ways of the bodies
since the step began. With the velocities at T its second derivative is c, and to second order it is

    g(t) = g_linear(t) + c (t - T)^2 / 2.

Within substep k, from t = k h to (k + 1) h, it changes by h (J v + c (t_middle - T)) with t_middle = (k + 1/2) h. What
constraints keep is the bend c h / 2, and with that velocities gain (2 k - n + 2) bends in substep k of n, while gaps at
time t = m h are off by (2 m - n + 1)^2 h / 4 bends.
"""

from typing import NamedTuple

from blocksim.kernels.common import arrays, jit
from blocksim.kernels.common.simd import Lanes, Mask, lesser, select
from blocksim.kernels.nonsmooth.arrays import FAR
from blocksim.kernels.nonsmooth.slip import Constraints, Motion, slip_of

SLIVER = 1e-5  # of the smaller half side: with less between them two points are one


class Face(NamedTuple):
    """A reference face: unit normal, centre of its body, distance of the face from there, and where it ends (m).

    `left` and `right` lie along the face, to the right, from the foot of the centre: of a rectangle half of its length
    to either side.
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


class Block(NamedTuple):
    """What of bodies decides where they touch; fields as in BODY."""

    x: Lanes
    y: Lanes
    cos: Lanes
    sin: Lanes
    half_x: Lanes
    half_y: Lanes


class Points(NamedTuple):
    """A manifold: its constraint, and its gaps (m), FAR where there is no such point."""

    constraint: Constraints
    gap_one: Lanes
    gap_two: Lanes
    is_of_b: Mask  # the reference face is one of body b


@jit.kernel
def block_of(body: arrays.Record) -> Block:
    """Return what of a body decides where it touches."""
    return Block(body.x, body.y, body.cos, body.sin, body.half_x, body.half_y)


@jit.kernel
def face_of(body: Block, mx: Lanes, my: Lanes, along_x: Mask) -> Face:
    """Return the face of a body with the outward normal (mx, my), on its own x axis or y axis."""
    distance = select(along_x, body.half_x, body.half_y)
    half = select(along_x, body.half_y, body.half_x)
    return Face(mx, my, body.x, body.y, distance, -half, half)


@jit.kernel
def face_towards(body: Block, x: Lanes, y: Lanes, along_x: Mask) -> Face:
    """Return the face on one of a body's axes that is on the side of a place (m), given in the body's own frame."""
    sign = select(select(along_x, x, y) >= 0.0, 1.0, -1.0)
    mx = sign * select(along_x, body.cos, -body.sin)
    my = sign * select(along_x, body.sin, body.cos)
    return face_of(body, mx, my, along_x)


@jit.kernel
def in_frame(face: Face, x: Lanes, y: Lanes) -> tuple[Lanes, Lanes]:
    """Return a place (m) in the frame of a face: to the right along it, and above it."""
    dx = x - face.x
    dy = y - face.y
    return dx * face.ny - dy * face.nx, dx * face.nx + dy * face.ny - face.distance


@jit.kernel
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


@jit.kernel
def clip_one(edge: Edge, face: Face) -> Edge:
    """Return the same for a single edge, bit by bit, without the division where nothing is cut."""
    if edge.left >= face.left and edge.right <= face.right:
        return edge
    return clip(edge, face)


@jit.kernel
def counted(left_gap: Lanes, right_gap: Lanes, width: Lanes, a: Block, b: Block, margin: float) -> tuple[Lanes, Lanes]:
    """Return the gaps (m) of two points with a width (m) between them, FAR where one does not count."""
    left_gap = select(left_gap <= margin, left_gap, FAR)
    right_gap = select(right_gap <= margin, right_gap, FAR)
    is_sliver = width < SLIVER * lesser(a.half_x + a.half_y, b.half_x + b.half_y)
    is_left_less = left_gap <= right_gap
    right_gap = select(is_sliver & is_left_less, FAR, right_gap)
    left_gap = select(is_sliver & (is_left_less ^ is_sliver), FAR, left_gap)
    return left_gap, right_gap


@jit.kernel
def points_of(face: Face, edge: Edge, a: Block, b: Block, is_of_b: Mask, margin: float) -> Points:
    """Return normal, arms and gaps of a manifold.

    Seen along the tangent, point one is the first: the right one of a face of b, the left one of a face of a.
    """
    sign = select(is_of_b, 1.0, -1.0)
    nx = sign * face.nx
    ny = sign * face.ny
    width = edge.right - edge.left
    left_gap = select(edge.is_left, edge.left_gap, FAR)
    right_gap = select(edge.is_right, edge.right_gap, FAR)
    left_gap, right_gap = counted(left_gap, right_gap, width, a, b, margin)
    one = select(is_of_b, edge.right, edge.left)
    # point one in world axes, on the face
    x = face.x + face.nx * face.distance + face.ny * one
    y = face.y + face.ny * face.distance - face.nx * one
    constraint = Constraints(
        nx,
        ny,
        (x - a.x) * ny - (y - a.y) * nx,
        (x - b.x) * ny - (y - b.y) * nx,
        width,
        (x - a.x) * nx + (y - a.y) * ny,
        (x - b.x) * nx + (y - b.y) * ny,
    )
    return Points(constraint, select(is_of_b, right_gap, left_gap), select(is_of_b, left_gap, right_gap), is_of_b)


@jit.kernel
def has_point(points: Points) -> Mask:
    """Return True if a manifold has a point."""
    return lesser(points.gap_one, points.gap_two) < FAR


@jit.kernel
def block_ahead(body: Block, vx: Lanes, vy: Lanes, spin: Lanes, ahead: Lanes) -> Block:
    """Return a body as it will be a short time `ahead` (s); its turn to second order."""
    turn = ahead * spin
    lost = 0.5 * turn * turn
    cos = body.cos - turn * body.sin - lost * body.cos
    sin = body.sin + turn * body.cos - lost * body.sin
    return Block(body.x + ahead * vx, body.y + ahead * vy, cos, sin, body.half_x, body.half_y)


@jit.kernel
def at_start(points: Points, motion: Motion) -> Points:
    """Return a manifold found ahead of time with the gaps it has now, along its own normal and arms."""
    slip = slip_of(points.constraint, motion.vx, motion.vy, motion.spin_a, motion.spin_b)
    gap_one = points.gap_one - motion.ahead * slip.one
    return Points(points.constraint, gap_one, points.gap_two - motion.ahead * slip.two, points.is_of_b)


class Bend(NamedTuple):
    """What velocities at the points gain within half a substep as the bodies turn: along normal and tangent (m/s)."""

    normal: Lanes
    shear: Lanes


@jit.kernel
def bend_of(constraint: Constraints, motion: Motion, is_of_b: Mask, is_two: Mask) -> Bend:
    """Return what the velocities at a contact gain within half a substep, as bodies turn on with the speed they have.

    Along the normal that is the second derivative of the gap g = n (p - q), where the face with n turns with body b
    (or a) and p is a corner of the other body. With S = r n (`shear_arm`), u the velocity of centre a against centre b
    along the tangent and spins w:

        face of b:  g'' = -w_b^2 S_b + 2 w_b (u + w_a S_a) - w_a^2 S_a
        face of a:  g'' =  w_a^2 S_a + 2 w_a (u - w_b S_b) + w_b^2 S_b

    Along the tangent it is the change of the velocity at the point that sticks, t (w_b^2 r_b - w_a^2 r_a), that is
    point two where `is_two`.
    """
    w_a = motion.spin_a
    w_b = motion.spin_b
    along = constraint.nx * motion.vy - constraint.ny * motion.vx
    part_a = w_a * constraint.shear_arm_a
    part_b = w_b * constraint.shear_arm_b
    of_b = 2.0 * w_b * (along + part_a) - w_b * part_b - w_a * part_a
    of_a = 2.0 * w_a * (along - part_b) + w_a * part_a + w_b * part_b
    width = select(is_two, constraint.width, 0.0)
    sticking = w_a * w_a * (constraint.arm_a - width) - w_b * w_b * (constraint.arm_b - width)
    return Bend(motion.half * select(is_of_b, of_b, of_a), motion.half * sticking)


@jit.kernel
def bend_time(stepping: arrays.Record, number: int) -> float:
    """Return by how much gaps at the start of substep `number` are off, over the bend of their constraint (s)."""
    off = 2 * number - stepping.substeps + 1
    return 0.25 * stepping.substep * off * off


@jit.kernel
def follow_curvature(stepping: arrays.Record, number: int) -> None:
    """Set the bends in substep `number`."""
    stepping.bend_share = 2 * number - stepping.substeps + 2
    stepping.bend_time = bend_time(stepping, number)
    stepping.next_bend_time = bend_time(stepping, number + 1)

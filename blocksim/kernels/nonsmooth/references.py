"""Which faces of two bodies meet: the reference face, and the face of the other body that looks at it.

Of all faces of both the reference is the one beyond which the other body reaches least (separating axes: S. Gottschalk,
TR96-024, UNC Chapel Hill (1996)). Of rectangles that is one of four axes, and no processor can predict which, so there
is no branch. Of polygons it is searched, face by face. Where bodies meet with corners, other faces may be right:
flush_joints.py.
"""

from typing import NamedTuple

from blocksim.kernels.common import jit, shapes
from blocksim.kernels.common.simd import Lane, Lanes, Mask, greater, is_all, lesser, select
from blocksim.kernels.common.tolerances import PARALLEL_COSINE, TIE
from blocksim.kernels.nonsmooth import arrays, faces


class Pose(NamedTuple):
    """A body in the frame of another: its centroid (m), and the turn of the first's frame against the other's."""

    x: Lanes
    y: Lanes
    c: Lanes
    s: Lanes


class Farthest(NamedTuple):
    """The face of a body from which the centroid of another is farthest: how far (m), which, and its normal.

    `second` (m) is how far it is from the next face.
    """

    away: Lanes
    number: Lanes
    nx: Lanes
    ny: Lanes
    second: Lanes


class Best(NamedTuple):
    """The face of a body beyond which another reaches least, -1 for none, and the gap (m) there.

    `against` is the number of the face of the other body that it meets.
    """

    gap: Lanes
    number: Lanes
    against: Lanes


@jit.kernel
def pose_of(other: faces.Block, body: faces.Block) -> Pose:
    """Return another body in the frame of a body; (c, s) turns directions of this frame into the frame of the other."""
    x, y, c, s = shapes.relative_pose(other, body)
    return Pose(x, y, c, -s)


class Reference(NamedTuple):
    """The reference face of a pair, the face of the other body that it meets, and which body has the first.

    Of polygons with their numbers, and with the best faces of b and a: that of a has number -1 where it is not better.
    """

    side: faces.Side
    facing: faces.Side
    is_of_b: Mask
    best: Best
    of_b: Best
    of_a: Best
    next_gap: Lanes  # m: beyond the best face that is not parallel to it; of polygons a bound


@jit.kernel
def reference_of_rectangles(a: faces.Block, b: faces.Block) -> Reference:
    """Return the reference faces of rectangles."""
    bx, by, c, s = shapes.relative_pose(a, b)
    ax, ay, _, _ = shapes.relative_pose(b, a)
    c_abs, s_abs = abs(c), abs(s)
    gap_bx = abs(bx) - b.half_x - c_abs * a.half_x - s_abs * a.half_y
    gap_by = abs(by) - b.half_y - s_abs * a.half_x - c_abs * a.half_y
    gap_ax = abs(ax) - a.half_x - c_abs * b.half_x - s_abs * b.half_y
    gap_ay = abs(ay) - a.half_y - s_abs * b.half_x - c_abs * b.half_y
    best_b = greater(gap_bx, gap_by)
    best_a = greater(gap_ax, gap_ay)
    is_of_b = best_b + TIE * faces.least_half(a, b) >= best_a
    of_x = select(is_of_b, gap_bx, gap_ax)
    of_y = select(is_of_b, gap_by, gap_ay)
    along_x = of_x > of_y
    towards = select(along_x, select(is_of_b, bx, ax), select(is_of_b, by, ay))
    sign = select(towards >= 0.0, 1.0, -1.0)
    # the face of the other body is on its other axis where it is turned by more than 45 degrees
    is_turned = (c_abs < s_abs) | (along_x & (c_abs <= s_abs))
    away = sign * select(is_turned, select(along_x ^ is_of_b, s, -s), c)
    side = faces.side_of_rectangle(faces.either(is_of_b, b, a), along_x, sign)
    facing_x = along_x ^ is_turned
    facing = faces.side_of_rectangle(faces.either(is_of_b, a, b), facing_x, select(away > 0.0, -1.0, 1.0))
    best = Best(greater(best_a, best_b), sign, sign)
    across = select(facing_x, select(is_of_b, gap_ay, gap_by), select(is_of_b, gap_ax, gap_bx))
    are_parallel = greater(c_abs, s_abs) > -PARALLEL_COSINE
    next_gap = greater(lesser(of_x, of_y), select(are_parallel, across, select(is_of_b, best_a, best_b)))
    return Reference(side, facing, is_of_b, best, best, best, next_gap)


@jit.kernel
def gap_beyond(away: Lanes, nx: Lanes, ny: Lanes, pose: Pose, other: faces.Hulls, lane: Lane) -> tuple[Lanes, Lanes]:
    """Return the gap (m) beyond a face with a normal, and the number of the face of the other body that it meets.

    `away` (m) is the distance of the other's centroid from the face. The corner that reaches least along the normal is
    one of the two ends of the face that is most against it.
    """
    mx = pose.c * nx - pose.s * ny
    my = pose.s * nx + pose.c * ny
    against = faces.number_against(other, mx, my, lane)
    side = faces.side_at(other.table, other.first + against, lane)
    along = side.nx * mx + side.ny * my
    across = side.nx * my - side.ny * mx
    return away + (side.distance * along + side.middle * across - side.half * abs(across)), against


@jit.kernel
def farthest_face(hulls: faces.Hulls, pose: Pose, lane: Lane) -> Farthest:
    """Return the face of a body from which the centroid of another one is farthest; of equal ones the first."""
    fx, fy, distance, _ = faces.normal_at(hulls, 0, lane)
    most = fx * pose.x + fy * pose.y - distance
    number = 0.0 * most
    second = number - arrays.FAR
    for k in range(1, hulls.size):
        nx, ny, distance, _ = faces.normal_at(hulls, k, lane)
        away = nx * pose.x + ny * pose.y - distance
        is_more = away > most
        second = select(is_more, most, greater(away, second))
        most = select(is_more, away, most)
        number = select(is_more, 1.0 * k, number)
        fx = select(is_more, nx, fx)
        fy = select(is_more, ny, fy)
    return Farthest(most, number, fx, fy, second)


@jit.kernel
def best_from(farthest: Farthest, hulls: faces.Hulls, pose: Pose, other: faces.Hulls, lane: Lane) -> Best:
    """Return the face of a body beyond which another one reaches least; of equal ones the first.

    It is mostly that from which the other's centroid is farthest. The other body reaches beyond a face by its inner
    radius at least, from its centroid: others are out with that.
    """
    number = farthest.number
    gap, against = gap_beyond(farthest.away, farthest.nx, farthest.ny, pose, other, lane)
    if is_all(farthest.second - other.inner < gap):
        return Best(gap, number, against)
    for k in range(hulls.size):
        nx, ny, distance, _ = faces.normal_at(hulls, k, lane)
        away = nx * pose.x + ny * pose.y - distance
        can_be = (away - other.inner >= gap) & (abs(number - 1.0 * k) > 0.0)
        if not is_all((away - other.inner < gap) | (abs(number - 1.0 * k) <= 0.0)):
            its_gap, its_against = gap_beyond(away, nx, ny, pose, other, lane)
            is_better = can_be & ((its_gap > gap) | ((its_gap >= gap) & (number > 1.0 * k)))
            gap = select(is_better, its_gap, gap)
            number = select(is_better, 1.0 * k, number)
            against = select(is_better, its_against, against)
    return Best(gap, number, against)


@jit.kernel
def best_if_above(least: Lanes, tie: Lanes, hulls: faces.Hulls, pose: Pose, other: faces.Hulls, lane: Lane) -> Best:
    """Return the face of a body beyond which another one reaches least, if the gap there is above `least` (m).

    Near centroids exclude that: regular polygons that meet face to face are done then. A part of the `tie` (m) in
    `least` is kept for round-off.
    """
    none = 0.0 * least - 1.0
    near = greater(least - 0.5 * tie + hulls.inner + other.inner, 0.0)
    if is_all(pose.x * pose.x + pose.y * pose.y < near * near):
        return Best(least, none, none)
    farthest = farthest_face(hulls, pose, lane)
    if is_all(farthest.away - other.inner <= least):
        return Best(least, none, none)
    best = best_from(farthest, hulls, pose, other, lane)
    is_above = best.gap > least
    return Best(select(is_above, best.gap, least), select(is_above, best.number, none), best.against)


@jit.kernel
def reference_on(
    is_of_b: Mask, of_b: Best, of_a: Best, hulls_a: faces.Hulls, hulls_b: faces.Hulls, lane: Lane
) -> Reference:
    """Return the reference faces of polygons, the best ones of b or those of a."""
    best = Best(
        select(is_of_b, of_b.gap, of_a.gap),
        select(is_of_b, of_b.number, of_a.number),
        select(is_of_b, of_b.against, of_a.against),
    )
    side = faces.side_at(hulls_a.table, select(is_of_b, hulls_b.first, hulls_a.first) + best.number, lane)
    facing = faces.side_at(hulls_a.table, select(is_of_b, hulls_a.first, hulls_b.first) + best.against, lane)
    return Reference(side, facing, is_of_b, best, of_b, of_a, best.gap)


@jit.kernel
def reference_of(
    a: faces.Block, hulls_a: faces.AnyHulls, b: faces.Block, hulls_b: faces.AnyHulls, margin: float, lane: Lane
) -> Reference:
    """Return the reference faces of bodies, of those within the margin (m) of one another."""
    if hulls_a is None:
        return reference_of_rectangles(a, b)
    pose_a, pose_b = pose_of(a, b), pose_of(b, a)
    of_b = best_from(farthest_face(hulls_b, pose_a, lane), hulls_b, pose_a, hulls_a, lane)
    tie = TIE * faces.least_half(a, b)
    of_a = best_if_above(lesser(of_b.gap + tie, margin), tie, hulls_a, pose_b, hulls_b, lane)
    return reference_on(of_a.number < 0.0, of_b, of_a, hulls_a, hulls_b, lane)

"""Polygons whose faces hardly face one another, or meet beside the reference face: one pair at a time.

Where two faces face each other over a sliver only, the bodies meet at other faces, if these are nearly parallel: a
block that slides over the flush joint of two others would else be stopped by the side of the second, as it sinks in by
a little. And a face of b on which no point lies gives way to that of a.
"""

from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.nonsmooth.faces import Block
from blocksim.kernels.nonsmooth.polygons import (
    EDGE,
    Best,
    Found,
    best_face,
    found_on,
    gap_beyond,
    points_of_polygons,
    pose_of,
)
from blocksim.kernels.nonsmooth.sides import Hulls, normal_at, side_at

LEVEL = -0.99498743710662  # cosine: two faces within 0.1 rad of each other can meet as faces


@kernel
def points_of_two(a: Block, hulls_a: Hulls, b: Block, hulls_b: Hulls, margin: float) -> Found:
    """Return the contact manifold of two convex polygons within the margin (m)."""
    found, best_b, best_a = points_of_polygons(a, hulls_a, b, hulls_b, margin, 0)
    if found.is_odd:
        return points_where_odd(best_b, best_a, a, hulls_a, b, hulls_b, margin)
    return found


@rare_kernel
def points_where_odd(
    best_b: Best, best_a: Best, a: Block, hulls_a: Hulls, b: Block, hulls_b: Hulls, margin: float
) -> Found:
    """Return the same for polygons whose best faces face one another over a sliver, or have no point."""
    if best_a.number < 0.0:
        found = found_beside(True, best_b, a, hulls_a, b, hulls_b, margin)
        if found.is_near:
            return found
        best_a = best_face(hulls_a, pose_of(b, a), hulls_b, 0)
        if best_b.gap > best_a.gap:
            return found
    return found_beside(False, best_a, a, hulls_a, b, hulls_b, margin)


@rare_kernel
def found_beside(is_of_b: bool, best: Best, a: Block, hulls_a: Hulls, b: Block, hulls_b: Hulls, margin: float) -> Found:
    """Return the manifold on the best face of a body, or on the next best where it faces the other over a sliver."""
    found = found_on(is_of_b, best, a, hulls_a, b, hulls_b, margin, 0)
    least = EDGE * min(hulls_a.inner, hulls_b.inner)
    if found.points.constraint.width < least:
        body, hulls, other, others = (b, hulls_b, a, hulls_a) if is_of_b else (a, hulls_a, b, hulls_b)
        next_best = next_above(-least, best.number, hulls, body, others, other)
        if next_best.number >= 0.0 and can_meet(next_best, body, hulls, other, others):
            return found_on(is_of_b, next_best, a, hulls_a, b, hulls_b, margin, 0)
    return found


@kernel
def next_above(least: float, but: float, hulls: Hulls, body: Block, others: Hulls, other: Block) -> Best:
    """Return the best face of a body but one of those with a gap above `least` (m)."""
    pose = pose_of(other, body)
    best = Best(least, -1.0, -1.0)
    for k in range(hulls.size):
        nx, ny, distance, _ = normal_at(hulls, k, 0)
        gap, against = gap_beyond(nx * pose.x + ny * pose.y - distance, nx, ny, pose, others, 0)
        if gap > best.gap and but != 1.0 * k:
            best = Best(gap, 1.0 * k, against)
    return best


@kernel
def can_meet(best: Best, body: Block, hulls: Hulls, other: Block, others: Hulls) -> bool:
    """Return True if two faces are nearly parallel."""
    pose = pose_of(other, body)
    one = side_at(hulls.table, hulls.first + best.number, 0)
    two = side_at(others.table, others.first + best.against, 0)
    mx = pose.c * one.nx - pose.s * one.ny
    my = pose.s * one.nx + pose.c * one.ny
    return mx * two.nx + my * two.ny < LEVEL

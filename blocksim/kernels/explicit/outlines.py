"""Corners and faces of the bodies of a scene with polygons, rectangles and pieces of ground among them.

All blocks have their corners in one table (CORNER), counter-clockwise; face k leads from corner k to the next one. A
piece of ground has none there: it is a rectangle of the same order, which begins at its lower left corner, so that its
upper face has the number 2.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from blocksim.kernels.common.arrays import Record, Records
from blocksim.kernels.common.jit import kernel, rare_kernel

MOST_CORNERS = 16  # of a block
SIDES = 4  # of a piece of ground
UPPER = 2  # the face of a piece of ground that counts
WIDEST_CONE = 0.2  # as between rectangles; see models/duplicate_corners.py


class Side(NamedTuple):
    """One face of a body, in its frame."""

    nx: float
    ny: float
    distance: float  # m, from the centre of the body
    middle_x: float  # m
    middle_y: float
    half: float  # m, of its length


@kernel
def number_of_corners(body: Record) -> int:
    """Return how many corners, and faces, a body has."""
    count: Any = np.int64(body.corner_count)  # compiled code makes floats of signed and unsigned ones together
    return count if count > 0 else SIDES


@kernel
def corner_place(body: Record, table: Records, number: int) -> tuple[float, float]:
    """Return where (m) a corner lies in the frame of its body."""
    if body.corner_count == 0:
        x = body.half_x if number == 1 or number == 2 else -body.half_x
        return x, body.half_y if number >= SIDES // 2 else -body.half_y
    first: Any = np.int64(body.first_corner)
    corner = table[first + number]
    return 1.0 * corner.x, 1.0 * corner.y


@kernel
def side_of(body: Record, table: Records, number: int) -> Side:
    """Return one of the faces of a body."""
    if body.corner_count == 0:
        is_level = number == 0 or number == UPPER
        sign = -1.0 if number == 0 or number == SIDES - 1 else 1.0
        nx = 0.0 if is_level else sign
        ny = sign if is_level else 0.0
        distance = body.half_y if is_level else body.half_x
        return Side(nx, ny, distance, nx * distance, ny * distance, body.half_x if is_level else body.half_y)
    first: Any = np.int64(body.first_corner)
    corner = table[first + number]
    nx = 1.0 * corner.nx
    ny = 1.0 * corner.ny
    half = 1.0 * corner.half
    return Side(nx, ny, 1.0 * corner.distance, corner.x - half * ny, corner.y + half * nx, half)


@kernel
def cone_of(a: Record, b: Record, table: Records) -> float:
    """Return the sine of the angle up to which faces of two bodies count as parallel.

    At most that of rectangles. A polygon that rolls from one face over a corner to the next one is half way on neither
    of them: half of the least turn at its corners bounds it.
    """
    cone = WIDEST_CONE
    if a.corner_count > 0:
        cone = min(cone, table[np.int64(a.first_corner)].cone)
    if b.corner_count > 0:
        cone = min(cone, table[np.int64(b.first_corner)].cone)
    return cone


@kernel
def into_world(body: Record, x: float, y: float) -> tuple[float, float]:
    """Return a vector given in the frame of a body in world axes."""
    return body.cos * x - body.sin * y, body.sin * x + body.cos * y


@kernel
def into_frame(body: Record, x: float, y: float) -> tuple[float, float]:
    """Return a vector given in world axes in the frame of a body."""
    return body.cos * x + body.sin * y, body.cos * y - body.sin * x


@rare_kernel
def corner_vector(body: Record, table: Records, number: int) -> tuple[float, float]:
    """Return the vector (m) from the centre of a body to one of its corners, in world axes."""
    x, y = corner_place(body, table, number)
    return into_world(body, x, y)


@rare_kernel
def side_normal(body: Record, table: Records, number: int) -> tuple[float, float]:
    """Return the outward normal of a face of a body, in world axes."""
    side = side_of(body, table, number)
    return into_world(body, side.nx, side.ny)


@kernel
def least_reach(body: Record, table: Records, nx: float, ny: float) -> float:
    """Return how far (m) a body reaches from its centre along a unit vector in world axes, at least."""
    mx, my = into_frame(body, nx, ny)
    least = math.inf
    for k in range(number_of_corners(body)):
        x, y = corner_place(body, table, k)
        least = min(least, mx * x + my * y)
    return least


@rare_kernel
def side_along(body: Record, table: Records, nx: float, ny: float) -> int:
    """Return the face of a body whose outward normal is nearest to a unit vector in world axes."""
    mx, my = into_frame(body, nx, ny)
    best = -math.inf
    number = 0
    for k in range(number_of_corners(body)):
        side = side_of(body, table, k)
        cosine = mx * side.nx + my * side.ny
        if cosine > best:
            best = cosine
            number = k
    return number


@rare_kernel
def lowest_corner(body: Record, table: Records) -> float:
    """Return the height (m) of the lowest corner of a body over the ground."""
    return body.y + least_reach(body, table, 0.0, 1.0)


@kernel
def gap_over(number: int, body: Record, other: Record, table: Records) -> float:
    """Return the gap (m) between a face of a body and another body; from zero on they do not touch."""
    side = side_of(body, table, number)
    nx, ny = into_world(body, side.nx, side.ny)
    away = nx * (other.x - body.x) + ny * (other.y - body.y) - side.distance
    return away + least_reach(other, table, nx, ny)


@kernel
def gap_on(axis: int, a: Record, b: Record, is_ground: bool, table: Records) -> float:
    """Return the gap (m) between two bodies along one of their axes: the faces of b, then from MOST_CORNERS those of a.

    The ground has but its vertical one.
    """
    if is_ground:
        return lowest_corner(a, table) - b.y
    if axis < MOST_CORNERS:
        return gap_over(axis, b, a, table)
    return gap_over(axis - MOST_CORNERS, a, b, table)


@rare_kernel
def widest_gap(pair: Record, a: Record, b: Record, is_ground: bool, table: Records) -> float:
    """Note along which of their axes two bodies are farthest apart; return the gap (m) along it."""
    best = gap_on(0, a, b, is_ground, table)
    axis = 0
    if not is_ground:
        for k in range(1, number_of_corners(b)):
            gap = gap_over(k, b, a, table)
            if gap > best:
                best = gap
                axis = k
        for k in range(number_of_corners(a)):
            gap = gap_over(k, a, b, table)
            if gap > best:
                best = gap
                axis = MOST_CORNERS + k
    pair.axis = axis
    return best


@rare_kernel
def way_over(pair: Record, a: Record, b: Record, is_ground: bool, table: Records) -> tuple[float, float]:
    """Return the normal, from b to a, along which two bodies were found apart."""
    if is_ground:
        return 0.0, 1.0
    axis: Any = np.int64(pair.axis)
    if axis < MOST_CORNERS:
        return side_normal(b, table, axis)
    nx, ny = side_normal(a, table, axis - MOST_CORNERS)
    return -nx, -ny


@rare_kernel
def deepest_overlap(a: Record, b: Record, is_ground: bool, table: Records) -> float:
    """Return how deep (m) two bodies overlap, at most zero where they do not."""
    if is_ground:
        return b.y - lowest_corner(a, table)
    best = -math.inf
    for k in range(number_of_corners(b)):
        best = max(best, gap_over(k, b, a, table))
    for k in range(number_of_corners(a)):
        best = max(best, gap_over(k, a, b, table))
    return -best

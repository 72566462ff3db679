"""Faces and corners of the bodies of a scene with polygons, seen in world axes, and gaps between them.

All bodies have their corners in one table (kernels/common/shapes.py), rectangles, pieces of ground and the half-plane
as well. Those of the last two count from the lower left one, so that their upper face has the number 2.
"""

import math
from typing import Any

import numpy as np

from blocksim.kernels.common.arrays import ALL, Record, Records
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.common.shapes import face_towards, hull_of, least_along

MOST_CORNERS = 16  # of a block: slots from there on are corners of the second body of a pair
UPPER = 2  # the face of the ground that counts


@kernel
def is_piece(body: Record) -> bool:
    """Return True for a piece of ground, or a wall: but its upper face counts, and its ends that are free."""
    return bool(body.faces < ALL)


@kernel
def number_of_corners(body: Record) -> int:
    """Return how many corners, and faces, a body has."""
    count: Any = np.int64(body.corner_count)  # compiled code makes floats of signed and unsigned ones together
    return count


@kernel
def next_number(body: Record, number: int) -> int:
    """Return the number of the corner, or face, after one."""
    return number + 1 if number + 1 < number_of_corners(body) else 0


@kernel
def number_before(body: Record, number: int) -> int:
    """Return the number of the corner, or face, before one."""
    return number - 1 if number > 0 else number_of_corners(body) - 1


@kernel
def corner_of(body: Record, table: Records, number: int) -> Record:
    """Return a corner of a body, with the face that begins there, in the frame of the body."""
    first: Any = np.int64(body.first_corner)  # compiled code makes floats of signed and unsigned ones together
    return table[first + number]


@kernel
def cone_of(a: Record, b: Record, table: Records) -> float:
    """Return the sine of the angle up to which faces of two bodies count as parallel; see world/bodies.py."""
    cone: float = min(corner_of(a, table, 0).cone, corner_of(b, table, 0).cone)
    return cone


@kernel
def into_world(body: Record, x: float, y: float) -> tuple[float, float]:
    """Return a vector given in the frame of a body in world axes."""
    return body.cos * x - body.sin * y, body.sin * x + body.cos * y


@kernel
def into_frame(body: Record, x: float, y: float) -> tuple[float, float]:
    """Return a vector given in world axes in the frame of a body."""
    return body.cos * x + body.sin * y, body.cos * y - body.sin * x


@kernel
def corner_vector(body: Record, table: Records, number: int) -> tuple[float, float]:
    """Return the vector (m) from the centre of a body to one of its corners, in world axes."""
    corner = corner_of(body, table, number)
    return into_world(body, corner.x, corner.y)


@kernel
def side_normal(body: Record, table: Records, number: int) -> tuple[float, float]:
    """Return the outward normal of a face of a body, in world axes."""
    side = corner_of(body, table, number)
    return into_world(body, side.nx, side.ny)


@kernel
def reach_along(body: Record, table: Records, nx: float, ny: float) -> float:
    """Return how far (m) a body reaches from its centre along a unit vector in world axes, at least."""
    mx, my = into_frame(body, nx, ny)
    return least_along(hull_of(body, table), mx, my)


@rare_kernel
def side_along(body: Record, table: Records, nx: float, ny: float) -> int:
    """Return the face of a body whose outward normal is nearest to a unit vector in world axes."""
    mx, my = into_frame(body, nx, ny)
    return face_towards(hull_of(body, table), mx, my)


@rare_kernel
def lowest_corner(body: Record, table: Records) -> float:
    """Return the height (m) of the lowest corner of a body over the ground."""
    return body.y + reach_along(body, table, 0.0, 1.0)


@kernel
def gap_over(number: int, body: Record, other: Record, table: Records) -> float:
    """Return the gap (m) between a face of a body and another body; from zero on they do not touch."""
    side = corner_of(body, table, number)
    nx, ny = into_world(body, side.nx, side.ny)
    away = nx * (other.x - body.x) + ny * (other.y - body.y) - side.distance
    return away + reach_along(other, table, nx, ny)


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

"""Corners and faces of bodies, seen in world axes, and gaps between them: all that contacts know about shapes.

A body is a convex polygon. Its corners go counter-clockwise; face k leads from corner k to the next one. Where there
are polygons, those of all bodies lie in a table (CORNER): of rectangles, pieces of ground and the half-plane as well.
Where all blocks are rectangles there is no table (None, a type of its own): a rectangle follows from its half sides,
which stay in registers, and a step takes two thirds of the time. Only functions of this file ask which it is.

Rectangles, pieces and the half-plane count from the lower left corner, so that their upper face has the number 2. The
half-plane is infinitely wide, and its upper face goes through its centre.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from blocksim.kernels.common.arrays import ALL, NO_FACE, Corners, Record
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.common.shapes import corner_offset, face_towards, hull_of, least_along
from blocksim.kernels.common.tolerances import CONE_TOLERANCE

MOST_CORNERS = 16  # of a block: slots from there on are corners of the second body of a pair
CORNERS_OF_RECTANGLE = 4
UPPER = 2  # the face of the ground that counts


class Side(NamedTuple):
    """A corner and the face that begins there, in the frame of the body; fields as in CORNER."""

    nx: float
    ny: float
    distance: float  # m
    middle: float
    half: float
    x: float
    y: float
    clear: float
    far: float
    sharp: float
    cone: float


@kernel
def is_piece(body: Record) -> bool:
    """Return True for a piece of ground, or a wall: but its upper face counts, and its ends that are free."""
    return bool(body.faces < ALL)


@kernel
def number_of_corners(body: Record, table: Corners) -> int:
    """Return how many corners, and faces, a body has."""
    if table is None:
        return CORNERS_OF_RECTANGLE
    count: Any = np.int64(body.corner_count)  # compiled code makes floats of signed and unsigned ones together
    return count


@kernel
def next_number(body: Record, table: Corners, number: int) -> int:
    """Return the number of the corner, or face, after one."""
    return number + 1 if number + 1 < number_of_corners(body, table) else 0


@kernel
def number_before(body: Record, table: Corners, number: int) -> int:
    """Return the number of the corner, or face, before one."""
    return number - 1 if number > 0 else number_of_corners(body, table) - 1


@kernel
def side_of_rectangle(body: Record, number: int) -> Side:
    """Return a corner of a rectangle and the face that begins there."""
    is_level = number & 1 == 0
    out = 1.0 if number == 1 or number == UPPER else -1.0
    distance, half = (body.half_y, body.half_x) if is_level else (body.half_x, body.half_y)
    nx, ny = (0.0, out) if is_level else (out, 0.0)
    x, y = out * body.half_x, body.half_y if number >= UPPER else -body.half_y
    clear = min(1.0, 2.0 * distance / half)
    return Side(nx, ny, distance, 0.0, half, x, y, clear, 2.0 * distance, 0.0, CONE_TOLERANCE)


@kernel
def corner_of(body: Record, table: Corners, number: int) -> Side:
    """Return a corner of a body, with the face that begins there, in the frame of the body."""
    if table is None:
        return side_of_rectangle(body, number)
    first: Any = np.int64(body.first_corner)  # compiled code makes floats of signed and unsigned ones together
    one = table[first + number]
    return Side(
        one.nx, one.ny, one.distance, one.middle, one.half, one.x, one.y, one.clear, one.far, one.sharp, one.cone
    )


@kernel
def cone_of(a: Record, b: Record, table: Corners) -> float:
    """Return the sine of the angle up to which faces of two bodies count as parallel; see world/bodies.py."""
    cone: float = min(corner_of(a, table, 0).cone, corner_of(b, table, 0).cone)
    return cone


@kernel
def has_polygons(table: Corners) -> bool:
    """Return True if there are polygons: else slivers and stiffness that changes fast cost too much; see README.md."""
    return table is not None


@kernel
def into_world(body: Record, x: float, y: float) -> tuple[float, float]:
    """Return a vector given in the frame of a body in world axes."""
    return body.cos * x - body.sin * y, body.sin * x + body.cos * y


@kernel
def into_frame(body: Record, x: float, y: float) -> tuple[float, float]:
    """Return a vector given in world axes in the frame of a body."""
    return body.cos * x + body.sin * y, body.cos * y - body.sin * x


@kernel
def corner_vector(body: Record, table: Corners, number: int) -> tuple[float, float]:
    """Return the vector (m) from the centre of a body to one of its corners, in world axes."""
    if table is None:
        return corner_offset(body, number)
    corner = corner_of(body, table, number)
    return into_world(body, corner.x, corner.y)


@kernel
def side_normal(body: Record, table: Corners, number: int) -> tuple[float, float]:
    """Return the outward normal of a face of a body, in world axes."""
    if table is None:
        sign = 1.0 if number == 1 or number == UPPER else -1.0
        return (-sign * body.sin, sign * body.cos) if number & 1 == 0 else (sign * body.cos, sign * body.sin)
    side = corner_of(body, table, number)
    return into_world(body, side.nx, side.ny)


@kernel
def reach_along(body: Record, table: Corners, nx: float, ny: float) -> float:
    """Return how far (m) a body reaches from its centre along a unit vector in world axes, at least."""
    if table is None:
        return -max(abs(nx * body.upper_x + ny * body.upper_y), abs(nx * body.lower_x + ny * body.lower_y))
    mx, my = into_frame(body, nx, ny)
    return least_along(hull_of(body, table), mx, my)


@rare_kernel
def side_along(body: Record, table: Corners, nx: float, ny: float) -> int:
    """Return the face of a body whose outward normal is nearest to a unit vector in world axes."""
    mx, my = into_frame(body, nx, ny)
    if table is None:
        if abs(mx) > abs(my):
            return 1 if mx > 0.0 else 3
        return UPPER if my > 0.0 else 0
    return face_towards(hull_of(body, table), mx, my)


@kernel
def face_before(body: Record, table: Corners, x: float, y: float, last: int, room: float) -> int:
    """Return a face of a body that a place (m, in its frame) is in front of, or NO_FACE.

    Under the sharp end of a face it is in front of another by more than `room` (m). `last` is the face of the last
    time, which it mostly still is: that is asked first. Of a rectangle, which has no sharp ends, it stands for all.
    """
    if table is None:
        return NO_FACE if (abs(x) <= body.half_x) & (abs(y) <= body.half_y) else last  # no branch is foreseen well
    count = number_of_corners(body, table)
    k = last if last < count else 0
    for _ in range(count):
        side = corner_of(body, table, k)
        if side.nx * x + side.ny * y - side.distance > side.sharp * room:
            return k
        k = k + 1 if k + 1 < count else 0
    return NO_FACE


@kernel
def is_within(body: Record, table: Corners, x: float, y: float, reach: float) -> bool:
    """Return True if a place (m, in its frame) is within reach (m) of a body, or inside; at sharp ends also farther."""
    if table is None:
        along, across = max(abs(x) - body.half_x, 0.0), max(abs(y) - body.half_y, 0.0)
        return along * along + across * across < reach * reach
    for k in range(number_of_corners(body, table)):
        side = corner_of(body, table, k)
        if side.nx * x + side.ny * y - side.distance >= reach:
            return False
    return True


@kernel
def distance_from(body: Record, table: Corners, x: float, y: float) -> tuple[float, float, float]:
    """Return the distance (m, negative inside) of a place (m) from a body and its outward normal, all in its frame."""
    if table is None:
        along, across = abs(x) - body.half_x, abs(y) - body.half_y
        if along > 0.0 and across > 0.0:
            distance = math.sqrt(along * along + across * across)
            return distance, math.copysign(along / distance, x), math.copysign(across / distance, y)
        is_beside = along > across
        return (along, math.copysign(1.0, x), 0.0) if is_beside else (across, 0.0, math.copysign(1.0, y))
    face, best = 0, -math.inf
    for k in range(number_of_corners(body, table)):
        side = corner_of(body, table, k)
        gap = side.nx * x + side.ny * y - side.distance
        if gap > best:
            face, best = k, gap
    side = corner_of(body, table, face)
    if best <= 0.0 or abs(side.nx * y - side.ny * x - side.middle) <= side.half:
        return best, side.nx, side.ny
    best, nx, ny = math.inf, 0.0, 1.0  # beyond an end: nearest is a corner, or beside a sharp one another face
    for k in range(number_of_corners(body, table)):
        side = corner_of(body, table, k)
        gap = side.nx * x + side.ny * y - side.distance
        if gap > 0.0 and abs(side.nx * y - side.ny * x - side.middle) <= side.half:
            return gap, side.nx, side.ny
        dx, dy = x - side.x, y - side.y
        away = math.sqrt(dx * dx + dy * dy)
        if not away > 0.0:
            return 0.0, side.nx, side.ny
        if away < best:
            best, nx, ny = away, dx / away, dy / away
    return best, nx, ny


@kernel
def gap_over(number: int, body: Record, other: Record, table: Corners) -> float:
    """Return the gap (m) between a face of a body and another body; from zero on they do not touch."""
    nx, ny = side_normal(body, table, number)
    away = nx * (other.x - body.x) + ny * (other.y - body.y) - corner_of(body, table, number).distance
    return away + reach_along(other, table, nx, ny)


@kernel
def gap_on(axis: int, a: Record, b: Record, is_ground: bool, table: Corners) -> float:
    """Return the gap (m) between two bodies along one of their axes: the faces of b, then from MOST_CORNERS those of a.

    The ground has but its vertical one.
    """
    if is_ground:
        return a.y + reach_along(a, table, 0.0, 1.0) - b.y
    if axis < MOST_CORNERS:
        return gap_over(axis, b, a, table)
    return gap_over(axis - MOST_CORNERS, a, b, table)


@rare_kernel
def widest_gap(a: Record, b: Record, is_ground: bool, table: Corners) -> tuple[int, float]:
    """Return along which of their axes two bodies are farthest apart, and the gap (m) along it; see gap_on."""
    axis = 0
    best = gap_on(0, a, b, is_ground, table)
    if not is_ground:
        for k in range(1, number_of_corners(b, table)):
            gap = gap_over(k, b, a, table)
            if gap > best:
                best = gap
                axis = k
        for k in range(number_of_corners(a, table)):
            gap = gap_over(k, a, b, table)
            if gap > best:
                best = gap
                axis = MOST_CORNERS + k
    return axis, best


@rare_kernel
def way_over(pair: Record, a: Record, b: Record, is_ground: bool, table: Corners) -> tuple[float, float]:
    """Return the normal, from b to a, along which two bodies were found apart."""
    if is_ground:
        return 0.0, 1.0
    axis: Any = np.int64(pair.axis)
    if axis < MOST_CORNERS:
        return side_normal(b, table, axis)
    nx, ny = side_normal(a, table, axis - MOST_CORNERS)
    return -nx, -ny

"""Rectangles seen from one another: rotation, separation, corners.

Convex polygons: their corners and faces in the table that all bodies of a shape share.

Nothing of it turns: what is asked of a body is turned into its own frame instead, a face normal at a time.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from blocksim.kernels.common import arrays, jit, tolerances


@jit.kernel
def turn(cos: float, sin: float, angle: float) -> tuple[float, float]:
    """Return (cos, sin) rotated by `angle` (rad).

    Small angles, as in all but a few steps, use power series to the fifth order (remainder below 2e-15 at 0.01 rad), a
    fraction of the cost of the library functions. Length and angle drift by round-off only; both are renewed at the
    checks.
    """
    if abs(angle) < tolerances.SMALL_TURN:
        square = angle * angle
        cos_turn = 1.0 - square * (0.5 - square * (1.0 / 24.0))
        sin_turn = angle * (1.0 - square * (1.0 / 6.0 - square * (1.0 / 120.0)))
    else:
        cos_turn = math.cos(angle)
        sin_turn = math.sin(angle)
    return cos * cos_turn - sin * sin_turn, sin * cos_turn + cos * sin_turn


@jit.kernel
def relative_pose(body: arrays.Record, other: arrays.Record) -> tuple[float, float, float, float]:
    """Return the centre of `body` and the cosine and sine of its rotation, all in the frame of `other`.

    Both are records, or anything else with a place and a rotation: one body, or four in vector registers.
    """
    dx = body.x - other.x
    dy = body.y - other.y
    return (
        other.cos * dx + other.sin * dy,
        other.cos * dy - other.sin * dx,
        body.cos * other.cos + body.sin * other.sin,
        body.sin * other.cos - body.cos * other.sin,
    )


@jit.kernel
def separation(body: arrays.Record, other: arrays.Record) -> float:
    """Return the largest gap (m) between two rectangles along their four face normals; negative when they overlap.

    Separating axis theorem: never more than the distance between the rectangles.
    """
    px, py, c, s = relative_pose(body, other)
    c_abs = abs(c)
    s_abs = abs(s)
    gap_x = abs(px) - other.half_x - c_abs * body.half_x - s_abs * body.half_y
    gap_y = abs(py) - other.half_y - s_abs * body.half_x - c_abs * body.half_y
    gap_u = abs(c * px + s * py) - body.half_x - c_abs * other.half_x - s_abs * other.half_y
    gap_v = abs(c * py - s * px) - body.half_y - s_abs * other.half_x - c_abs * other.half_y
    return max(gap_x, gap_y, gap_u, gap_v)


@jit.kernel
def ground_gap(body: arrays.Record) -> float:
    """Return the height (m) of the lowest corner of a body over the ground."""
    return body.y - abs(body.sin) * body.half_x - abs(body.cos) * body.half_y


@jit.kernel
def to_world(body: arrays.Record, px: float, py: float) -> tuple[float, float]:
    """Return the world position of a point given in the frame of a body."""
    return body.x + body.cos * px - body.sin * py, body.y + body.sin * px + body.cos * py


@jit.kernel
def slab_depth(px: float, py: float, slab: arrays.Record) -> float:
    """Return how deep (m) a point, given in the frame of a slab of ground, lies below its upper face; zero outside."""
    depth = slab.half_y - py
    return depth if 0.0 < depth <= tolerances.END_RATIO * (slab.half_x - abs(px)) else 0.0


@jit.kernel
def corner_offset(body: arrays.Record, corner: int) -> tuple[float, float]:
    """Return the vector (m) from the centre of a body to one of its corners, in world axes."""
    is_upper = corner == 0 or corner == 2  # or its opposite
    x = body.upper_x if is_upper else body.lower_x
    y = body.upper_y if is_upper else body.lower_y
    return (x, y) if corner == 1 or corner == 2 else (-x, -y)


@jit.kernel
def place_corners(body: arrays.Record) -> None:
    """Update the vectors to the corners of a body after its rotation changed."""
    ux = body.cos * body.half_x
    uy = body.sin * body.half_x
    vx = -body.sin * body.half_y
    vy = body.cos * body.half_y
    body.upper_x = ux + vx
    body.upper_y = uy + vy
    body.lower_x = ux - vx
    body.lower_y = uy - vy


class Hull(NamedTuple):
    """The corners of a body: those from `first` on of a table (CORNER). Face k leads from corner k to the next one."""

    table: arrays.Records
    first: int
    size: int  # number of corners
    inner: float  # m, from the centroid to the nearest face


@jit.kernel
def hull_of(body: arrays.Record, table: arrays.Records) -> Hull:
    """Return the corners of a body, of a polygon or a rectangle."""
    first: Any = np.int64(body.first_corner)  # compiled code makes floats of signed and unsigned ones together
    size: Any = np.int64(body.corner_count)
    return Hull(table, first, size, body.inner_radius)


@jit.kernel
def least_along(hull: Hull, nx: float, ny: float) -> float:
    """Return how far (m) a body reaches from its centre along a unit vector given in its own frame, at least."""
    least = math.inf
    for k in range(hull.first, hull.first + hull.size):
        corner = hull.table[k]
        least = min(least, nx * corner.x + ny * corner.y)
    return least


@jit.kernel
def face_towards(hull: Hull, nx: float, ny: float) -> int:
    """Return the face whose outward normal is nearest to a unit vector given in the frame of the body.

    The corner that is farthest along it is one of its ends: the normals of both faces there are on either side of it.
    """
    number = 0
    best = -math.inf
    for k in range(hull.size):
        corner = hull.table[hull.first + k]
        cosine = nx * corner.nx + ny * corner.ny
        if cosine > best:
            best = cosine
            number = k
    return number

"""Rectangles seen from one another: rotation, separation, corners."""

import math

from blocksim.kernels.common.arrays import Record
from blocksim.kernels.common.jit import kernel

SMALL_TURN = 1e-2

# A piece of ground is a slab of which only the upper face counts. Near a convex joint a point may lie in the end of a
# slab, where the next one bears it; at most this many times deeper below the face than behind the end it still touches.
END_RATIO = 3.0


@kernel
def turn(cos: float, sin: float, angle: float) -> tuple[float, float]:
    """Return (cos, sin) rotated by `angle` (rad).

    Small angles, as in all but a few steps, use power series to the fifth order (remainder below 2e-15 at 0.01 rad), a
    fraction of the cost of the library functions. Length and angle drift by round-off only; both are renewed at the
    checks.
    """
    if abs(angle) < SMALL_TURN:
        square = angle * angle
        cos_turn = 1.0 - square * (0.5 - square * (1.0 / 24.0))
        sin_turn = angle * (1.0 - square * (1.0 / 6.0 - square * (1.0 / 120.0)))
    else:
        cos_turn = math.cos(angle)
        sin_turn = math.sin(angle)
    return cos * cos_turn - sin * sin_turn, sin * cos_turn + cos * sin_turn


@kernel
def relative_pose(body: Record, other: Record) -> tuple[float, float, float, float]:
    """Return the centre of `body` and the cosine and sine of its rotation, all in the frame of `other`."""
    dx = body.x - other.x
    dy = body.y - other.y
    return (
        other.cos * dx + other.sin * dy,
        other.cos * dy - other.sin * dx,
        body.cos * other.cos + body.sin * other.sin,
        body.sin * other.cos - body.cos * other.sin,
    )


@kernel
def separation(body: Record, other: Record) -> float:
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


@kernel
def ground_gap(body: Record) -> float:
    """Return the height (m) of the lowest corner of a body over the ground."""
    return body.y - abs(body.sin) * body.half_x - abs(body.cos) * body.half_y


@kernel
def to_world(body: Record, px: float, py: float) -> tuple[float, float]:
    """Return the world position of a point given in the frame of a body."""
    return body.x + body.cos * px - body.sin * py, body.y + body.sin * px + body.cos * py


@kernel
def slab_depth(px: float, py: float, slab: Record) -> float:
    """Return how deep (m) a point, given in the frame of a slab of ground, lies below its upper face; zero outside."""
    depth = slab.half_y - py
    return depth if 0.0 < depth <= END_RATIO * (slab.half_x - abs(px)) else 0.0


@kernel
def corner_offset(body: Record, corner: int) -> tuple[float, float]:
    """Return the vector (m) from the centre of a body to one of its corners, in world axes."""
    is_upper = corner == 0 or corner == 2  # or its opposite
    x = body.upper_x if is_upper else body.lower_x
    y = body.upper_y if is_upper else body.lower_y
    return (x, y) if corner == 1 or corner == 2 else (-x, -y)


@kernel
def place_corners(body: Record) -> None:
    """Update the vectors to the corners of a body after its rotation changed."""
    ux = body.cos * body.half_x
    uy = body.sin * body.half_x
    vx = -body.sin * body.half_y
    vy = body.cos * body.half_y
    body.upper_x = ux + vx
    body.upper_y = uy + vy
    body.lower_x = ux - vx
    body.lower_y = uy - vy

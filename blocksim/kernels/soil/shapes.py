"""Distance of a particle's centre from the exact shape of a body.

Blocks are rectangles. A piece of ground or a wall is its upper face, with the ends that can be touched; what lies
beyond an end is its neighbour's affair. The half-plane, the last of all bodies, is what lies below its height.
"""

import math

from blocksim.kernels.common.arrays import ALL, Record
from blocksim.kernels.common.jit import kernel

UPPER_RIGHT, UPPER_LEFT = 4, 8  # bits of corners that can be touched


@kernel
def from_rectangle(u: float, v: float, half_x: float, half_y: float) -> tuple[float, float, float]:
    """Return the distance (m, negative inside) from a rectangle and its outward normal, all in the body's frame."""
    along, across = abs(u) - half_x, abs(v) - half_y
    if along > 0.0 and across > 0.0:
        distance = math.sqrt(along * along + across * across)
        return distance, math.copysign(along / distance, u), math.copysign(across / distance, v)
    if along > across:
        return along, math.copysign(1.0, u), 0.0
    return across, 0.0, math.copysign(1.0, v)


@kernel
def from_piece(body: Record, u: float, v: float, radius: float) -> tuple[float, float, float]:
    """Return the same of the upper face of a piece of ground or wall; infinite where it is not concerned.

    A centre that is more than half a radius below the face has come around its end, or through it.
    """
    across = v - body.half_y
    if across < -0.5 * radius:
        return math.inf, 0.0, 1.0
    along = abs(u) - body.half_x
    if along <= 0.0:
        return across, 0.0, 1.0
    if not body.corners & (UPPER_RIGHT if u > 0.0 else UPPER_LEFT):
        return math.inf, 0.0, 1.0
    distance = math.sqrt(along * along + across * across)
    return distance, math.copysign(along / distance, u), across / distance


@kernel
def from_body(body: Record, is_ground: bool, x: float, y: float, radius: float) -> tuple[float, float, float]:
    """Return the distance (m) of a place from a body and the outward normal there; a disc of that radius is meant."""
    if is_ground:
        return y - body.y, 0.0, 1.0
    dx, dy = x - body.x, y - body.y
    u, v = body.cos * dx + body.sin * dy, body.cos * dy - body.sin * dx
    if body.faces == ALL:
        distance, nu, nv = from_rectangle(u, v, body.half_x, body.half_y)
    else:
        distance, nu, nv = from_piece(body, u, v, radius)
    return distance, body.cos * nu - body.sin * nv, body.sin * nu + body.cos * nv


@kernel
def is_near(body: Record, is_ground: bool, x: float, y: float, reach: float) -> bool:
    """Return True if a place (m) is within reach (m) of a body, or inside."""
    if is_ground:
        return y - body.y < reach
    dx, dy = x - body.x, y - body.y
    u, v = body.cos * dx + body.sin * dy, body.cos * dy - body.sin * dx
    along, across = max(abs(u) - body.half_x, 0.0), max(abs(v) - body.half_y, 0.0)
    return along * along + across * across < reach * reach

"""Whether two bodies that do not touch, or touch elsewhere, come into contact: for all near pairs, every step.

Vectors are taken from the centre of body b to that of body a, (dx, dy), in world axes.
"""

from typing import Any

import numpy as np

from blocksim.kernels.common import arrays, jit, shapes


@jit.kernel
def extent(body: arrays.Record, nx: float, ny: float) -> float:
    """Return how far (m) a body reaches from its centre along a unit vector."""
    upper = abs(nx * body.upper_x + ny * body.upper_y)
    lower = abs(nx * body.lower_x + ny * body.lower_y)
    return max(upper, lower)


@jit.kernel
def gap_along(axis: int, a: arrays.Record, b: arrays.Record, dx: float, dy: float) -> float:
    """Return the gap (m) between two bodies along one of their four axes; from zero on they do not touch."""
    body = b if axis < 2 else a
    other = a if axis < 2 else b
    is_x = axis == 0 or axis == 2
    nx = body.cos if is_x else -body.sin
    ny = body.sin if is_x else body.cos
    half = body.half_x if is_x else body.half_y
    return abs(nx * dx + ny * dy) - half - extent(other, nx, ny)


@jit.rare_kernel
def choose_axis(
    pair: arrays.Record, a: arrays.Record, b: arrays.Record, dx: float, dy: float, is_ground: bool
) -> float:
    """Note along which axis two bodies that do not touch are farthest apart; the ground has but its vertical one.

    Returns the gap (m) along it.
    """
    best = 1
    for axis in range(0 if is_ground else 4):
        if gap_along(axis, a, b, dx, dy) > gap_along(best, a, b, dx, dy):
            best = axis
    pair.axis = best
    return gap_along(best, a, b, dx, dy)


@jit.kernel
def begins_contact(world: arrays.World, p: int, a: arrays.Record, b: arrays.Record, dx: float, dy: float) -> bool:
    """Return True if a candidate corner that was outside the other body is inside now."""
    pair = world.pairs[p]
    is_ground = pair.b == world.bodies.size - 1
    known: Any = np.int64(pair.duplicates)
    for k in range(pair.active):
        known |= 1 << np.int64(world.contacts[p, k].slot)
    for m in range(pair.near):
        slot: Any = np.int64(world.candidates[p, m])
        if (known >> slot) & 1 == 0:
            is_own = slot < arrays.HALF
            owner, touched, side = (a, b, 1.0) if is_own else (b, a, -1.0)
            ox, oy = shapes.corner_offset(owner, slot % arrays.HALF)
            x = ox + side * dx
            y = oy + side * dy
            if y < 0.0 if is_ground else is_inside(touched, x, y):
                return True
    return False


@jit.kernel
def is_inside(body: arrays.Record, x: float, y: float) -> bool:
    """Return True if a place (m, from its centre, world axes) lies inside a body."""
    px = body.cos * x + body.sin * y
    py = body.cos * y - body.sin * x
    return (abs(px) <= body.half_x) & (abs(py) <= body.half_y)  # no branch, as none is foreseen well

"""Axes of two polygons that overlap: which face is nearest, which one is next, and whether the overlap is a sliver.

An axis is the normal of a face, its depth how far the deepest corner of the other body lies behind that face; see
slivers.py. Of two faces within the cone of one another each has the other `across`.

Numbers that know how they change as body a of a pair is moved, b held: exact gradients by the chain rule.

So a potential is written down once, and its forces follow from it: see slivers.py.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from blocksim.kernels.common.arrays import Corners, Record
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.common.tolerances import SLIVER, TILTED
from blocksim.kernels.explicit import bearing, sides


class Jet(NamedTuple):
    """A value with its derivatives by the place of body a, per m, and by its angle, per rad."""

    value: float
    x: float
    y: float
    turn: float


CONSTANT_ONE = Jet(1.0, 0.0, 0.0, 0.0)


@rare_kernel
def plus(one: Jet, two: Jet, times: float) -> Jet:
    """Return one + times two."""
    return Jet(one.value + times * two.value, one.x + times * two.x, one.y + times * two.y, one.turn + times * two.turn)


@rare_kernel
def product(one: Jet, two: Jet) -> Jet:
    """Return the product of two numbers."""
    p, q = one.value, two.value
    return Jet(p * q, p * two.x + q * one.x, p * two.y + q * one.y, p * two.turn + q * one.turn)


@rare_kernel
def quotient(one: Jet, two: Jet) -> Jet:
    """Return one over two."""
    q = one.value / two.value
    over = 1.0 / two.value
    return Jet(q, over * (one.x - q * two.x), over * (one.y - q * two.y), over * (one.turn - q * two.turn))


@rare_kernel
def mapped(one: Jet, value: float, slope: float) -> Jet:
    """Return f(one), given f and its slope there."""
    return Jet(value, slope * one.x, slope * one.y, slope * one.turn)


@rare_kernel
def powered(one: Jet, exponent: float) -> Jet:
    """Return a positive number to a power."""
    slope = one.value ** (exponent - 1.0)
    return mapped(one, one.value * slope, exponent * slope)


@rare_kernel
def stepped(one: Jet, low: float, high: float) -> Jet:
    """Return the cubic step q^2 (3 - 2 q) from zero at `low` to one at `high`."""
    q = min(max((one.value - low) / (high - low), 0.0), 1.0)
    return mapped(one, q * q * (3.0 - 2.0 * q), 6.0 * q * (1.0 - q) / (high - low))


@rare_kernel
def absolute(one: Jet) -> Jet:
    """Return the absolute value."""
    return mapped(one, abs(one.value), math.copysign(1.0, one.value))


@rare_kernel
def cosine_of(sine: Jet) -> Jet:
    """Return the cosine of an angle of less than a right one, given its sine."""
    cosine = math.sqrt(1.0 - sine.value * sine.value)
    return mapped(sine, cosine, -sine.value / cosine)


class Axis(NamedTuple):
    """The normal of a face."""

    of_b: bool  # whose face it is
    face: int
    corner: int  # the deepest one of the other body
    depth: float  # m


@rare_kernel
def axis_of(of_b: bool, face: int, a: Record, b: Record, table: Corners, least: float = math.inf) -> Axis:
    """Return the axis of a face of b, or of a; of one that cannot be less deep than `least` (m) no corner is sought."""
    body, other = (b, a) if of_b else (a, b)
    nx, ny = sides.side_normal(body, table, face)
    best = -math.inf
    number = 0
    reach = sides.corner_of(body, table, face).distance + nx * (body.x - other.x) + ny * (body.y - other.y)
    if reach + other.inner_radius > least:
        return Axis(of_b, face, number, math.inf)
    for k in range(sides.number_of_corners(other, table)):
        x, y = sides.corner_vector(other, table, k)
        depth = reach - (nx * x + ny * y)
        if depth > best:
            best = depth
            number = k
    return Axis(of_b, face, number, best)


@rare_kernel
def face_across(axis: Axis, a: Record, b: Record, table: Corners) -> int:
    """Return the face of the other body that looks at that of an axis, or -1 where none is within the cone."""
    body, other = (b, a) if axis.of_b else (a, b)
    nx, ny = sides.side_normal(body, table, axis.face)
    found: Any = np.int64(sides.side_along(other, table, -nx, -ny))
    mx, my = sides.side_normal(other, table, found)
    within = nx * mx + ny * my < 0.0 and abs(nx * my - ny * mx) < sides.cone_of(a, b, table)
    return found if within else -1


@rare_kernel
def nearest_axis(a: Record, b: Record, table: Corners) -> Axis:
    """Return the axis of least depth; those of b come first."""
    best = axis_of(True, 0, a, b, table)
    for k in range(1, sides.number_of_corners(b, table)):
        axis = axis_of(True, k, a, b, table, best.depth)
        if axis.depth < best.depth:
            best = axis
    for k in range(sides.number_of_corners(a, table)):
        axis = axis_of(False, k, a, b, table, best.depth)
        if axis.depth < best.depth:
            best = axis
    return best


@rare_kernel
def next_axis(nearest: Axis, across: int, a: Record, b: Record, table: Corners) -> Axis:
    """Return the axis of least depth but the nearest one, whose face looks at the face `across`."""
    best = nearest
    least = math.inf
    for m in range(sides.number_of_corners(b, table) + sides.number_of_corners(a, table)):
        of_b = m < sides.number_of_corners(b, table)
        face = m if of_b else m - sides.number_of_corners(b, table)
        if face != (nearest.face if of_b == nearest.of_b else across):
            axis = axis_of(of_b, face, a, b, table, least)
            if axis.depth < least:
                least = axis.depth
                best = axis
    return best


@rare_kernel
def tilt_between(of_a: int, of_b: int, a: Record, b: Record, table: Corners) -> Jet:
    """Return the sine of the angle between a face of a and one of b."""
    ax, ay = sides.side_normal(a, table, of_a)
    bx, by = sides.side_normal(b, table, of_b)
    return absolute(Jet(ax * by - ay * bx, 0.0, 0.0, -ax * bx - ay * by))


@rare_kernel
def tilt_of(axis: Axis, across: int, a: Record, b: Record, table: Corners) -> Jet:
    """Return the sine of the angle between the face of an axis and the one across."""
    if axis.of_b:
        return tilt_between(across, axis.face, a, b, table)
    return tilt_between(axis.face, across, a, b, table)


@kernel
def least_ratio(cone: float) -> float:
    """Return the overlap over the next one from where on tilted faces may have this potential."""
    return min(SLIVER, TILTED * cone)


@rare_kernel
def is_short(nearest: Axis, across: int, a: Record, b: Record, table: Corners) -> bool:
    """Return True if another axis is about as deep as the nearest one; of parallel faces both are one."""
    cone = sides.cone_of(a, b, table)
    if across >= 0 and tilt_of(nearest, across, a, b, table).value > bearing.flat_within(cone):
        return nearest.depth > least_ratio(cone) * next_axis(nearest, -1, a, b, table).depth
    return nearest.depth > SLIVER * next_axis(nearest, across, a, b, table).depth


@rare_kernel
def is_sliver(a: Record, b: Record, table: Corners) -> bool:
    """Return True if two bodies overlap by a sliver."""
    if not bearing.are_blocks(a, b):
        return False
    nearest = nearest_axis(a, b, table)
    return nearest.depth > 0.0 and is_short(nearest, face_across(nearest, a, b, table), a, b, table)


@kernel
def meets_along(
    owner: Record,
    number: int,
    touched: Record,
    side: sides.Side,
    nx: float,
    ny: float,
    along: float,
    depth: float,
    table: Corners,
) -> bool:
    """Return True if two bodies, of which a corner touches a face, certainly overlap by no sliver; see is_sliver.

    Corner `number` of `owner` is `depth` (m) behind the face `side` of `touched`, of the normal (nx, ny), and `along`
    (m) from its middle. Let its face g there be parallel to that face f to within the sine s <= FLAT/2, G be the length
    of g, and L that of the interval which f and g have in common. Point P of g in its middle and foot Q of P on f are
    L/2 from all ends, and not farther apart than D = depth + s G, which no corner of g exceeds. All other faces are
    c L/2 from P or Q, which is of the same body as they, c the least `clear` of f and g (world/bodies.py), and thus at
    least c L/2 - D from the other one: less deep no other axis can be. The nearest one, f or g, is at most D deep, so
    there is no sliver where D <= SLIVER (c L/2 - D). Another SLIVER D is more than 1 - cos, up to s^2 of G, can change.
    """
    ahead = sides.corner_of(owner, table, number)
    back = sides.corner_of(owner, table, sides.number_before(owner, table, number))
    ax, ay = sides.into_world(owner, ahead.nx, ahead.ny)
    bx, by = sides.into_world(owner, back.nx, back.ny)
    cos_ahead = nx * ax + ny * ay
    cos_back = nx * bx + ny * by
    is_ahead = cos_ahead < cos_back  # that face goes to the end of f where `along` is least
    sine = abs(nx * ay - ny * ax) if is_ahead else abs(nx * by - ny * bx)
    if min(cos_ahead, cos_back) > 0.0 or sine > 0.5 * bearing.flat_within(min(side.cone, ahead.cone)):
        return False
    place = along if is_ahead else -along
    length = 2.0 * (ahead.half if is_ahead else back.half)
    clear = min(side.clear, ahead.clear if is_ahead else back.clear)
    common = min(length, side.half + place) - max(place - side.half, 0.0)
    return (1.0 + 2.0 * SLIVER) * (depth + sine * length) <= 0.5 * SLIVER * clear * common

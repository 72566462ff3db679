"""What two faces that look at each other hold where polygons overlap by a sliver: the energy of slivers.py on an axis.

The interval of the two faces is measured along the face of the axis, as tributary.py does, and all numbers are jets. At
an end where two corners are near one another the inner one counts; within half of the overlap the two are blended, so
that nothing jumps as they pass.
"""

from typing import NamedTuple

from blocksim.kernels.common.arrays import Record, Records
from blocksim.kernels.common.jit import rare_kernel
from blocksim.kernels.explicit.jets import (
    CONSTANT_ONE,
    Jet,
    absolute,
    cosine_of,
    mapped,
    plus,
    powered,
    product,
    quotient,
    stepped,
)
from blocksim.kernels.explicit.outlines import cone_of, corner_of, corner_vector, next_number, side_normal
from blocksim.kernels.explicit.sliver_axes import Axis, flat_within, tilt_of
from blocksim.kernels.explicit.tributary import LEAST, face_per_length

ROUND = 0.5  # of the overlap, of a sliver: corners nearer than that are one end


class Across(NamedTuple):
    """The interval of two faces along the first: its length, and the depth of the end opposite the deepest corner."""

    length: Jet  # m
    other: Jet  # m


@rare_kernel
def depth_behind(of_b: bool, face: int, corner: int, a: Record, b: Record, table: Records) -> Jet:
    """Return how deep (m) a corner of the other body lies behind a face of b, or of a."""
    body, other = (b, a) if of_b else (a, b)
    nx, ny = side_normal(body, table, face)
    rx, ry = corner_vector(other, table, corner)
    qx, qy = other.x - body.x + rx, other.y - body.y + ry
    depth = corner_of(body, table, face).distance - (nx * qx + ny * qy)
    if of_b:
        return Jet(depth, -nx, -ny, nx * ry - ny * rx)
    return Jet(depth, nx, ny, ny * qx - nx * qy)


@rare_kernel
def place_along(of_b: bool, face: int, corner: int, a: Record, b: Record, table: Records) -> Jet:
    """Return the place (m) of a corner of the other body along a face of b, or of a, from where that begins."""
    body, other = (b, a) if of_b else (a, b)
    nx, ny = side_normal(body, table, face)
    rx, ry = corner_vector(other, table, corner)
    qx, qy = other.x - body.x + rx, other.y - body.y + ry
    side = corner_of(body, table, face)
    along = nx * qy - ny * qx - (side.middle - side.half)
    if of_b:
        return Jet(along, -ny, nx, nx * rx + ny * ry)
    return Jet(along, ny, -nx, -nx * qx - ny * qy)


@rare_kernel
def rounding(apart: Jet, width: Jet) -> Jet:
    """Return by how much a smooth maximum of two numbers exceeds theirs: (w - |d|)^2/(4 w) within w, else nothing."""
    within = plus(width, absolute(apart), -1.0)
    if within.value <= 0.0:
        return Jet(0.0, 0.0, 0.0, 0.0)
    square = quotient(product(within, within), width)
    return mapped(square, 0.25 * square.value, 0.25)


@rare_kernel
def blended(one: Jet, two: Jet, ahead: Jet, width: Jet) -> Jet:
    """Return `one` where `ahead` is more than `width`, `two` where it is less than the opposite, a mean in between."""
    if abs(ahead.value) >= width.value:
        return one if ahead.value >= 0.0 else two
    part = stepped(quotient(ahead, width), -1.0, 1.0)
    return plus(two, product(part, plus(one, two, -1.0)), 1.0)


@rare_kernel
def across_from(axis: Axis, across: int, deep: Jet, wide: Jet, a: Record, b: Record, table: Records) -> Across:
    """Return the interval of the face of an axis and the face `across`.

    Where two corners are nearer than `deep` (m) at the deeper end, or `wide` (m) at the other one, it ends a little
    farther in, and where it is shorter than `wide` it is a little longer, so that its length changes smoothly.
    """
    body, other = (b, a) if axis.of_b else (a, b)
    whole = 2.0 * corner_of(body, table, axis.face).half
    # corners follow one another counter-clockwise: the face across leads back
    first, last = next_number(other, across), across
    begin = place_along(axis.of_b, axis.face, first, a, b, table)
    place = place_along(axis.of_b, axis.face, last, a, b, table)
    end = mapped(place, whole - place.value, -1.0)  # how far before the end of the face
    length = plus(place, begin if begin.value > 0.0 else mapped(begin, 0.0, 0.0), -1.0)
    length = length if end.value > 0.0 else plus(length, end, 1.0)
    is_last = axis.corner == last
    ahead, deeper = (begin, end) if is_last else (end, begin)
    length = plus(length, rounding(ahead, wide), -1.0)
    length = plus(length, rounding(deeper, deep), -1.0)
    inner = depth_behind(axis.of_b, axis.face, first if is_last else last, a, b, table)
    own = axis.face if is_last else next_number(body, axis.face)
    outer = depth_behind(not axis.of_b, across, own, a, b, table)
    shallow = blended(inner, outer, ahead, wide)
    deepest = depth_behind(axis.of_b, axis.face, axis.corner, a, b, table)
    half = mapped(wide, 0.5 * wide.value, 0.5)
    shallow = blended(shallow, deepest, plus(length, half, -1.0), half)  # an interval without length has one end only
    some = length if length.value > 0.0 else mapped(length, 0.0, 0.0)
    return Across(plus(some, rounding(length, wide), 1.0), shallow)


@rare_kernel
def share_of(axis: Axis, across: int, length: Jet, tilt: Jet, up: Jet, a: Record, b: Record, table: Records) -> Jet:
    """Return the share S of tributary.py of two faces whose interval has some length (m)."""
    of_a, of_b = (across, axis.face) if axis.of_b else (axis.face, across)
    per_length = face_per_length(a, b, corner_of(a, table, of_a).half, corner_of(b, table, of_b).half)
    along = quotient(length, cosine_of(tilt))  # the face across is seen shorter
    part = mapped(along, per_length * along.value, per_length)
    if part.value < LEAST or part.value > 1.0:
        part = Jet(min(max(part.value, LEAST), 1.0), 0.0, 0.0, 0.0)
    return plus(part, product(plus(CONSTANT_ONE, part, -1.0), up), 1.0)


@rare_kernel
def energy_of_faces(
    axis: Axis, across: int, shallow: Jet, long: Jet, power: float, a: Record, b: Record, table: Records
) -> Jet:
    """Return s D^power on the axis of a face that has one across; `shallow` is 1 - v of slivers.py.

    `long` is zero where the overlap is so short that corners at both ends are blended. Where faces are tilted those at
    the deeper end always are: near there the two axes are about equally deep, and the pair has the potential.
    """
    flat = flat_within(cone_of(a, b, table))
    tilt = tilt_of(axis, across, a, b, table)
    up = stepped(tilt, flat, cone_of(a, b, table))
    parallel = plus(CONSTANT_ONE, stepped(tilt, flat, 2.0 * flat), -1.0)
    depth = depth_behind(axis.of_b, axis.face, axis.corner, a, b, table)
    reach = mapped(depth, ROUND * depth.value, ROUND)
    wide = product(plus(CONSTANT_ONE, long, -1.0), reach)
    deep = product(plus(CONSTANT_ONE, product(parallel, long), -1.0), reach)
    found = across_from(axis, across, deep, wide, a, b, table)
    energy = powered(depth, power)
    if found.other.value > 0.0:
        counts = plus(CONSTANT_ONE, product(up, plus(CONSTANT_ONE, shallow, -1.0)), -1.0)
        energy = plus(energy, product(counts, powered(found.other, power)), 1.0)
    return product(share_of(axis, across, found.length, tilt, up, a, b, table), energy)

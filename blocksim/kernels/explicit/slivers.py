"""Potential of two polygons where they overlap by a sliver: about as deep as it is long, as where corners meet.

The springs of bearing.py belong to a pair of faces. As the overlap of two faces gets shorter than it is deep, other
faces become the nearest ones, and their springs may be many times as stiff: energy would come from nowhere. So there
the elastic energy of a pair is stated as one function of its state that is continuous wherever features change, and
the force is its gradient (sliver_axes.py): what is put in comes out, whichever way the bodies come and go.

An axis is the normal of a face, its depth D how far the deepest corner of the other body lies behind that face; the
least one is the overlap (the nearest edge of the Minkowski difference). On an axis alone the pair would have s U(D), U
the energy of one corner contact, with

    s = S (1 + (1 - v up) U(d)/U(D)) for a face with another one within the cone, their share S and the step `up` as in
        bearing.py, measured along the face of the axis, d the depth at the end of their interval that is opposite the
        deepest corner; v rises from zero to one as the sliver becomes deep, since beyond the cone but the deeper end
        counts;
    s = 1 for a face without another one.

The pair has the mean of s U(D) over all axes. An axis has the weight 1/D^2 times a step of D'/D for all other axes D',
zero up to SLIVER and one from one on: where two axes are equally deep both count alike, and so do their forces, so
nothing jumps as they change places, whatever a third one does, and where the overlap is longer than ten times its depth
it is that of bearing.py. (With steps of the least depth alone forces jump where that belongs to another axis while a
third one has a weight.)

Two faces within the cone are one axis while they are parallel, that of the nearer face, and two beyond it. In between
the nearer one counts one and the other `up`, since they part without a jump; and where they are equally deep, as
corners of both pass one another at the deeper end, both count (1 + up)/2: else the force would turn there by (1 -
up)/(1 + up) of the tilt, up to 5 % of it. The step between the two lasts while the corners are nearer to one another
than about the overlap, D' - D = tilt times their distance; it shrinks to nothing where faces are parallel to within
FLAT, as the contacts of bearing.py have none: there the force may turn by that angle. What is left besides is the
jump of dS/d(slip) where corners pass at the end of a long interval, the overlap over twice its length of the force.

For damping, friction and the ledger the pair has one contact there, the deepest corner on the nearest face, with the
one spring whose energy and force along the normal are those of the potential; the rest of the force is like that of a
share which changes by sliding and tilting. Two bodies of which no faces are parallel have that contact wherever their
corners are found, and two whose corners mark the same end of an interval this potential as long as that matters.

What two faces that look at each other hold where polygons overlap by a sliver: its energy on an axis.

The interval of the two faces is measured along the face of the axis, as bearing.py does, and all numbers are jets. At
an end where two corners are near one another the inner one counts; within half of the overlap the two are blended, so
that nothing jumps as they pass.
"""

import math
from typing import NamedTuple

from blocksim.kernels.common import tolerances
from blocksim.kernels.common.arrays import Corners, Record, World
from blocksim.kernels.common.jit import rare_kernel
from blocksim.kernels.explicit import sides
from blocksim.kernels.explicit.bearing import are_blocks, face_per_length, flat_within
from blocksim.kernels.explicit.damping import renew_dashpots
from blocksim.kernels.explicit.laws import stored_energy
from blocksim.kernels.explicit.sliver_axes import (
    CONSTANT_ONE,
    Axis,
    Jet,
    absolute,
    axis_of,
    cosine_of,
    face_across,
    is_short,
    mapped,
    nearest_axis,
    plus,
    powered,
    product,
    quotient,
    stepped,
    tilt_of,
)


class Across(NamedTuple):
    """The interval of two faces along the first: its length, and the depth of the end opposite the deepest corner."""

    length: Jet  # m
    other: Jet  # m


@rare_kernel
def depth_behind(of_b: bool, face: int, corner: int, a: Record, b: Record, table: Corners) -> Jet:
    """Return how deep (m) a corner of the other body lies behind a face of b, or of a."""
    body, other = (b, a) if of_b else (a, b)
    nx, ny = sides.side_normal(body, table, face)
    rx, ry = sides.corner_vector(other, table, corner)
    qx, qy = other.x - body.x + rx, other.y - body.y + ry
    depth = sides.corner_of(body, table, face).distance - (nx * qx + ny * qy)
    if of_b:
        return Jet(depth, -nx, -ny, nx * ry - ny * rx)
    return Jet(depth, nx, ny, ny * qx - nx * qy)


@rare_kernel
def axis_depth(axis: Axis, a: Record, b: Record, table: Corners) -> Jet:
    """Return the depth (m) of an axis: to the last digit what `axis_of` has found.

    The nearest axis is deeper than zero, and by that all are: of weights and of energies none is divided by zero. The
    sum of depth_behind rounds otherwise: where corners meet, it may be zero or less.
    """
    jet = depth_behind(axis.of_b, axis.face, axis.corner, a, b, table)
    return Jet(axis.depth, jet.x, jet.y, jet.turn)


@rare_kernel
def place_along(of_b: bool, face: int, corner: int, a: Record, b: Record, table: Corners) -> Jet:
    """Return the place (m) of a corner of the other body along a face of b, or of a, from where that begins."""
    body, other = (b, a) if of_b else (a, b)
    nx, ny = sides.side_normal(body, table, face)
    rx, ry = sides.corner_vector(other, table, corner)
    qx, qy = other.x - body.x + rx, other.y - body.y + ry
    side = sides.corner_of(body, table, face)
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
def across_from(axis: Axis, across: int, deep: Jet, wide: Jet, a: Record, b: Record, table: Corners) -> Across:
    """Return the interval of the face of an axis and the face `across`.

    Where two corners are nearer than `deep` (m) at the deeper end, or `wide` (m) at the other one, it ends a little
    farther in, and where it is shorter than `wide` it is a little longer, so that its length changes smoothly.
    """
    body, other = (b, a) if axis.of_b else (a, b)
    whole = 2.0 * sides.corner_of(body, table, axis.face).half
    # corners follow one another counter-clockwise: the face across leads back
    first, last = sides.next_number(other, table, across), across
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
    own = axis.face if is_last else sides.next_number(body, table, axis.face)
    outer = depth_behind(not axis.of_b, across, own, a, b, table)
    shallow = blended(inner, outer, ahead, wide)
    deepest = axis_depth(axis, a, b, table)
    half = mapped(wide, 0.5 * wide.value, 0.5)
    shallow = blended(shallow, deepest, plus(length, half, -1.0), half)  # an interval without length has one end only
    some = length if length.value > 0.0 else mapped(length, 0.0, 0.0)
    return Across(plus(some, rounding(length, wide), 1.0), shallow)


@rare_kernel
def share_of(axis: Axis, across: int, length: Jet, tilt: Jet, up: Jet, a: Record, b: Record, table: Corners) -> Jet:
    """Return the share S of bearing.py of two faces whose interval has some length (m)."""
    of_a, of_b = (across, axis.face) if axis.of_b else (axis.face, across)
    per_length = face_per_length(a, b, sides.corner_of(a, table, of_a).half, sides.corner_of(b, table, of_b).half)
    along = quotient(length, cosine_of(tilt))  # the face across is seen shorter
    part = mapped(along, per_length * along.value, per_length)
    if part.value < tolerances.LEAST_SHARE or part.value > 1.0:
        part = Jet(min(max(part.value, tolerances.LEAST_SHARE), 1.0), 0.0, 0.0, 0.0)
    return plus(part, product(plus(CONSTANT_ONE, part, -1.0), up), 1.0)


@rare_kernel
def energy_of_faces(
    axis: Axis, across: int, shallow: Jet, long: Jet, power: float, a: Record, b: Record, table: Corners
) -> Jet:
    """Return s D^power on the axis of a face that has one across; `shallow` is 1 - v.

    `long` is zero where the overlap is so short that corners at both ends are blended. Where faces are tilted those at
    the deeper end always are: near there the two axes are about equally deep, and the pair has the potential.
    """
    flat = flat_within(sides.cone_of(a, b, table))
    tilt = tilt_of(axis, across, a, b, table)
    up = stepped(tilt, flat, sides.cone_of(a, b, table))
    parallel = plus(CONSTANT_ONE, stepped(tilt, flat, 2.0 * flat), -1.0)
    depth = axis_depth(axis, a, b, table)
    reach = mapped(depth, tolerances.ONE_END * depth.value, tolerances.ONE_END)
    wide = product(plus(CONSTANT_ONE, long, -1.0), reach)
    deep = product(plus(CONSTANT_ONE, product(parallel, long), -1.0), reach)
    found = across_from(axis, across, deep, wide, a, b, table)
    energy = powered(depth, power)
    if found.other.value > 0.0:
        counts = plus(CONSTANT_ONE, product(up, plus(CONSTANT_ONE, shallow, -1.0)), -1.0)
        energy = plus(energy, product(counts, powered(found.other, power)), 1.0)
    return product(share_of(axis, across, found.length, tilt, up, a, b, table), energy)


class Nearness(NamedTuple):
    """What the other axes make of one: products over all of them, so that nothing jumps as two change places."""

    weight: Jet  # W
    shallow: Jet  # 1 - v: zero where another axis than that of the face across is about as deep
    long: Jet  # zero where the overlap is so short that corners at an end of it are blended


@rare_kernel
def nearer_of(depth: Jet, other: Jet, tilt: Jet, flat: float, is_first: bool) -> Jet:
    """Return one for the nearer one of two faces within the cone, zero for the other one, as far as they differ.

    In between, where their depths differ by a smaller share than the sine of the `tilt` exceeds `flat`, which is where
    their corners are nearer than the overlap, it is a step. Of parallel faces that are equal the one which `is_first`.
    """
    apart = plus(other, depth, -1.0)
    mean = plus(other, depth, 1.0)
    width = product(mapped(mean, 0.5 * mean.value, 0.5), mapped(tilt, tilt.value - flat, 1.0))
    if abs(apart.value) < width.value:
        return stepped(quotient(apart, width), -1.0, 1.0)
    is_nearer = apart.value > 0.0 or (apart.value == 0.0 and is_first)
    return CONSTANT_ONE if is_nearer else mapped(CONSTANT_ONE, 0.0, 0.0)


@rare_kernel
def two_of(axis: Axis, second: Axis, a: Record, b: Record, table: Corners) -> tuple[Jet, Jet]:
    """Return `up` of the top of two faces that look at each other, and how far the first is the nearer one."""
    cone = sides.cone_of(a, b, table)
    flat = flat_within(cone)
    tilt = tilt_of(axis, second.face, a, b, table)
    depth, other = axis_depth(axis, a, b, table), axis_depth(second, a, b, table)
    return stepped(tilt, flat, cone), nearer_of(depth, other, tilt, flat, axis.of_b)


@rare_kernel
def between(one: Jet, two: Jet, part: Jet) -> Jet:
    """Return a part of one and the rest of two."""
    return plus(two, product(part, plus(one, two, -1.0)), 1.0)


@rare_kernel
def farther(one: Jet, two: Jet, low: float, high: float) -> Jet:
    """Return zero where one over two is `high`, one where it is `low`."""
    return plus(CONSTANT_ONE, stepped(quotient(one, two), low, high), -1.0)


@rare_kernel
def with_other(
    near: Nearness, depth: Jet, other: Axis, tilted: float, a: Record, b: Record, table: Corners
) -> Nearness:
    """Return what another axis, and the face across from it, make of an axis of some depth (m); see nearness_of.

    Of two within the cone the nearer one does, and beyond it both; a pair is dealt with where its nearer face is.
    """
    across = face_across(other, a, b, table)
    beside = axis_depth(other, a, b, table)
    weight = stepped(quotient(beside, depth), tolerances.SLIVER, 1.0)
    shallow = farther(depth, beside, tilted, 2.0 * tilted)
    long = farther(depth, beside, tolerances.SLIVER, 2.0 * tolerances.SLIVER)
    if across >= 0:
        second = axis_of(not other.of_b, across, a, b, table)
        if second.depth < other.depth or (second.depth == other.depth and not other.of_b):
            return near
        up, nearer = two_of(other, second, a, b, table)
        behind = axis_depth(second, a, b, table)
        weight_2 = stepped(quotient(behind, depth), tolerances.SLIVER, 1.0)
        shallow_2 = farther(depth, behind, tilted, 2.0 * tilted)
        long_2 = farther(depth, behind, tolerances.SLIVER, 2.0 * tolerances.SLIVER)
        weight = between(product(weight, weight_2), between(weight, weight_2, nearer), up)
        shallow = between(product(shallow, shallow_2), between(shallow, shallow_2, nearer), up)
        long = between(product(long, long_2), between(long, long_2, nearer), up)
    return Nearness(product(near.weight, weight), product(near.shallow, shallow), product(near.long, long))


@rare_kernel
def nearness_of(axis: Axis, across: int, a: Record, b: Record, table: Corners) -> Nearness:
    """Return what the other axes make of one; `across` is the face across, or -1."""
    depth = axis_depth(axis, a, b, table)
    tilted = tolerances.TILTED * sides.cone_of(a, b, table)
    near = Nearness(powered(depth, -tolerances.FALLS), CONSTANT_ONE, CONSTANT_ONE)
    farthest = depth.value / min(tolerances.SLIVER, tilted)
    for m in range(sides.number_of_corners(b, table) + sides.number_of_corners(a, table)):
        of_b = m < sides.number_of_corners(b, table)
        face = m if of_b else m - sides.number_of_corners(b, table)
        if face != (axis.face if of_b == axis.of_b else across):
            other = axis_of(of_b, face, a, b, table, farthest)
            if other.depth < farthest:
                near = with_other(near, depth, other, tilted, a, b, table)
    return near


@rare_kernel
def energy_along(axis: Axis, power: float, a: Record, b: Record, table: Corners) -> tuple[Jet, Jet]:
    """Return the weight of an axis times s D^power, and that weight."""
    across = face_across(axis, a, b, table)
    depth = axis_depth(axis, a, b, table)
    if across < 0:
        weight = nearness_of(axis, across, a, b, table).weight
        return product(weight, powered(depth, power)), weight
    second = axis_of(not axis.of_b, across, a, b, table)
    up, nearer = two_of(axis, second, a, b, table)
    count = between(CONSTANT_ONE, up, nearer)
    if count.value <= 0.0:
        return count, count
    near = nearness_of(axis, across, a, b, table)
    weight = product(
        count, product(near.weight, stepped(quotient(axis_depth(second, a, b, table), depth), tolerances.SLIVER, 1.0))
    )
    return product(weight, energy_of_faces(axis, across, near.shallow, near.long, power, a, b, table)), weight


@rare_kernel
def mean_energy(nearest: Axis, power: float, a: Record, b: Record, table: Corners) -> Jet:
    """Return the mean of s D^power over all axes; see the top. `power` is that of the overlap in the energy."""
    total = Jet(0.0, 0.0, 0.0, 0.0)
    weights = Jet(0.0, 0.0, 0.0, 0.0)
    farthest = tolerances.AS_NEAR * nearest.depth / tolerances.SLIVER
    for m in range(sides.number_of_corners(b, table) + sides.number_of_corners(a, table)):
        of_b = m < sides.number_of_corners(b, table)
        axis = axis_of(of_b, m if of_b else m - sides.number_of_corners(b, table), a, b, table, farthest)
        if axis.depth < farthest:
            energy, weight = energy_along(axis, power, a, b, table)
            total = plus(total, energy, 1.0)
            weights = plus(weights, weight, 1.0)
    return quotient(total, weights)


@rare_kernel
def place_nearest(point: Record, nearest: Axis, a: Record, b: Record, table: Corners) -> None:
    """Make a point that of the deepest corner on the nearest face."""
    owner, touched = (a, b) if nearest.of_b else (b, a)
    nx, ny = sides.side_normal(touched, table, nearest.face)
    rx, ry = sides.corner_vector(owner, table, nearest.corner)
    sign = 1.0 if nearest.of_b else -1.0
    point.slot = nearest.corner if nearest.of_b else sides.MOST_CORNERS + nearest.corner
    point.face = nearest.face
    point.x = owner.x + rx
    point.y = owner.y + ry
    point.nx = sign * nx
    point.ny = sign * ny
    point.depth = nearest.depth
    point.beside = math.inf


@rare_kernel
def place_sliver(world: World, p: int, nearest: Axis, table: Corners) -> None:
    """Make the deepest corner on the nearest face the only contact point of a pair, with the spring of the potential.

    Its stiffness, and how that changes by sliding and tilting, is noted in the point until the stiffness is measured.
    """
    pair = world.pairs[p]
    a = world.bodies[pair.a]
    b = world.bodies[pair.b]
    exponent = world.controls[0].exponent
    stiffness = world.interactions[a.contact_class, b.contact_class].normal_stiffness
    whole = stored_energy(exponent, 1.0, 1.0)
    energy = mean_energy(nearest, exponent + 1.0, a, b, table)
    potential = mapped(energy, whole * stiffness * energy.value, whole * stiffness)
    point = world.points[0]
    place_nearest(point, nearest, a, b, table)
    along = -(potential.x * point.ny - potential.y * point.nx)
    plain = potential.value / (whole * nearest.depth)
    force = max(-(potential.x * point.nx + potential.y * point.ny), tolerances.LEAST_FORCE * plain)
    arm_x, arm_y = point.x - a.x, point.y - a.y
    couple = (arm_x * point.ny - arm_y * point.nx) * force - (arm_x * point.nx + arm_y * point.ny) * along
    couple += potential.turn
    point.depth = potential.value / (whole * force)
    point.stiffness = potential.value / stored_energy(exponent, 1.0, point.depth)
    point.before = along / stored_energy(exponent, 1.0, point.depth)
    point.rate = couple / stored_energy(exponent, 1.0, point.depth)


@rare_kernel
def points_of_sliver(world: World, p: int, count: int) -> int:
    """Put the one contact point of a sliver in the place of the `count` that were found; return how many there are."""
    table = world.corners
    pair = world.pairs[p]
    a = world.bodies[pair.a]
    b = world.bodies[pair.b]
    if pair.b == world.bodies.size - 1 or not are_blocks(a, b):
        return count
    nearest = nearest_axis(a, b, table)
    if nearest.depth <= 0.0:
        pair.is_sliver = 0
        return 0
    across = face_across(nearest, a, b, table)
    was_sliver = pair.is_sliver != 0
    pair.is_sliver = is_short(nearest, across, a, b, table)
    if pair.is_sliver == 0 and across >= 0:
        pair.is_sliver = not has_both_ends(world, count, nearest, across, pair.limit, a, b, table)
    if was_sliver or pair.is_sliver != 0:
        renew_dashpots(pair)
    if pair.is_sliver != 0:
        pair.duplicates = 0
        place_sliver(world, p, nearest, table)
        return 1
    if across < 0:
        point = world.points[0]
        slot = nearest.corner if nearest.of_b else sides.MOST_CORNERS + nearest.corner
        if count != 1 or point.slot != slot or point.face != nearest.face:
            pair.duplicates = 0
            place_nearest(point, nearest, a, b, table)
        return 1
    return count


@rare_kernel
def has_both_ends(
    world: World, count: int, nearest: Axis, across: int, limit: float, a: Record, b: Record, table: Corners
) -> bool:
    """Return True if `count` points are both ends of the interval of two faces: they hold as much as these.

    `limit` (m) is that of the overlap.
    """
    exponent = world.controls[0].exponent
    sharp = Jet(0.0, 0.0, 0.0, 0.0)
    other = across_from(nearest, across, sharp, sharp, a, b, table).other.value
    whole = stored_energy(exponent, 1.0, nearest.depth) + stored_energy(exponent, 1.0, max(other, 0.0))
    found = 0.0
    for i in range(count):
        found += stored_energy(exponent, 1.0, world.points[i].depth)
    return abs(found - whole) <= tolerances.ALIKE * whole + stored_energy(exponent, 1.0, tolerances.NEGLIGIBLE * limit)

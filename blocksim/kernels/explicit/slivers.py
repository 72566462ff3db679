"""Potential of two polygons where they overlap by a sliver: about as deep as it is long, as where corners meet.

The springs of tributary.py belong to a pair of faces. As the overlap of two faces gets shorter than it is deep, other
faces become the nearest ones, and their springs may be many times as stiff: energy would come from nowhere. So there
the elastic energy of a pair is stated as one function of its state that is continuous wherever features change, and
the force is its gradient (jets.py): what is put in comes out, whichever way the bodies come and go.

An axis is the normal of a face, its depth D how far the deepest corner of the other body lies behind that face; the
least one, D1, is the overlap (the nearest edge of the Minkowski difference). Two faces within the cone of one another
are one axis, with the lesser of both depths. On an axis alone the pair would have s U(D), U the energy of one corner
contact, with

    s = S (1 + (1 - v up) U(d2)/U(d1)) for two faces, their share S and the step `up` as in tributary.py, d1 >= d2 the
        depths at both ends of their interval, which are measured along the bisector, so that it makes no difference
        whose corner an end is; v rises from zero to one as the sliver becomes deep, since beyond the cone but the
        deeper end counts;
    s = 1 for a face without another one.

The pair has the mean of s U(D) over all axes, each with the weight W(D1/D), zero up to SLIVER and one at one: where two
axes are equally deep both count alike, and so do their forces, so nothing jumps as they change places, and where the
overlap is longer than D1/SLIVER it is that of tributary.py. In the cone the second of two faces has the weight up W
of its own, so that they part without a jump.

For damping, friction and the ledger the pair has one contact there, the deepest corner on the nearest face, with the
one spring whose energy and force along the normal are those of the potential; the rest of the force is like that of a
share which changes by sliding and tilting. Two bodies of which no faces are parallel have that contact wherever their
corners are found, and two whose corners mark the same end of an interval this potential as long as that matters.
"""

import math
from typing import NamedTuple

from blocksim.kernels.common.arrays import Record, Records, World
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.explicit.damping import renew_dashpots
from blocksim.kernels.explicit.jets import (
    CONSTANT_ONE,
    Jet,
    absolute,
    mapped,
    plus,
    powered,
    product,
    quotient,
    stepped,
)
from blocksim.kernels.explicit.laws import stored_energy
from blocksim.kernels.explicit.outlines import (
    MOST_CORNERS,
    cone_of,
    corner_of,
    corner_vector,
    next_number,
    number_of_corners,
    side_normal,
)
from blocksim.kernels.explicit.sliver_axes import (
    SLIVER,
    TILTED,
    Axis,
    axis_of,
    face_across,
    flat_within,
    is_short,
    nearest_axis,
    next_axis,
    tilt_of,
)
from blocksim.kernels.explicit.tributary import LEAST, are_blocks, face_per_length

FALLS = 2.0  # power of D1/D with which the weight of an axis falls, as the energy on it rises
ALIKE = 1e-3  # of the energy of a pair, that it may miss where its contacts are those of tributary.py
ROUND = 0.5  # of the overlap, of a sliver: corners nearer than that are one end
NEGLIGIBLE = 1e-6  # of the limit of overlap: what such an overlap holds may be round-off
LEAST_FORCE = 0.1  # of that of a spring of constant stiffness: the force along the normal never vanishes


class Ends(NamedTuple):
    """The interval of two faces that look at each other: its length and the depths of its ends (m)."""

    length: Jet
    left: Jet
    right: Jet


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
def abscissa_of(of_b: bool, corner: int, tx: float, ty: float, a: Record, b: Record, table: Records) -> Jet:
    """Return the place (m) of a corner of b, or of a, along a tangent from the centre of b; it turns half as a does."""
    body = b if of_b else a
    rx, ry = corner_vector(body, table, corner)
    x, y = body.x - b.x + rx, body.y - b.y + ry
    turn = 0.5 * (tx * y - ty * x)
    if of_b:
        return Jet(tx * x + ty * y, 0.0, 0.0, turn)
    return Jet(tx * x + ty * y, tx, ty, turn + ty * rx - tx * ry)


@rare_kernel
def rounding(apart: Jet, width: Jet) -> Jet:
    """Return by how much a smooth maximum of two numbers exceeds theirs: (w - |d|)^2/(4 w) within w, else nothing."""
    within = plus(width, absolute(apart), -1.0)
    if within.value <= 0.0:
        return Jet(0.0, 0.0, 0.0, 0.0)
    square = quotient(product(within, within), width)
    return mapped(square, 0.25 * square.value, 0.25)


@rare_kernel
def ends_of(of_a: int, of_b: int, width: Jet, a: Record, b: Record, table: Records) -> Ends:
    """Return the interval of a face of a and one of b, along the bisector: of two corners at an end the inner counts.

    Where two are nearer than `width` (m) the interval ends a little farther in, and where it is shorter it is a little
    longer, so that its length changes smoothly.
    """
    ax, ay = side_normal(a, table, of_a)
    bx, by = side_normal(b, table, of_b)
    norm = math.hypot(bx - ax, by - ay)
    tx, ty = (ay - by) / norm, (bx - ax) / norm
    # corners follow one another counter-clockwise: the face of b leads along the tangent, that of a back
    a_left, b_right = next_number(a, of_a), next_number(b, of_b)
    left_a = abscissa_of(False, a_left, tx, ty, a, b, table)
    left_b = abscissa_of(True, of_b, tx, ty, a, b, table)
    right_a = abscissa_of(False, of_a, tx, ty, a, b, table)
    right_b = abscissa_of(True, b_right, tx, ty, a, b, table)
    if left_a.value > left_b.value:
        left, low = left_a, depth_behind(True, of_b, a_left, a, b, table)
    else:
        left, low = left_b, depth_behind(False, of_a, of_b, a, b, table)
    if right_a.value < right_b.value:
        right, high = right_a, depth_behind(True, of_b, of_a, a, b, table)
    else:
        right, high = right_b, depth_behind(False, of_a, b_right, a, b, table)
    length = plus(right, left, -1.0)
    if length.value <= 0.0:
        high = low  # it has one end only
    length = plus(length, rounding(plus(left_a, left_b, -1.0), width), -1.0)
    length = plus(length, rounding(plus(right_a, right_b, -1.0), width), -1.0)
    some = length if length.value > 0.0 else mapped(length, 0.0, 0.0)
    return Ends(plus(some, rounding(length, width), 1.0), low, high)


@rare_kernel
def share_of(
    of_a: int, of_b: int, up: Jet, deep: Jet, overlap: Jet, power: float, a: Record, b: Record, table: Records
) -> Jet:
    """Return the share of a face of a and one of b; `deep` is v at the top."""
    width = product(deep, overlap)
    ends = ends_of(of_a, of_b, mapped(width, ROUND * width.value, ROUND), a, b, table)
    per_length = face_per_length(a, b, corner_of(a, table, of_a).half, corner_of(b, table, of_b).half)
    ax, ay = side_normal(a, table, of_a)
    bx, by = side_normal(b, table, of_b)
    half_sine = 0.5 * math.hypot(ax + bx, ay + by)
    per_length /= math.sqrt(1.0 - half_sine * half_sine)  # faces are seen shorter along their bisector
    part = mapped(ends.length, ends.length.value * per_length, per_length)
    if part.value < LEAST or part.value > 1.0:
        part = Jet(min(max(part.value, LEAST), 1.0), 0.0, 0.0, 0.0)
    share = plus(part, product(plus(CONSTANT_ONE, part, -1.0), up), 1.0)
    deeper, other = (ends.left, ends.right) if ends.left.value >= ends.right.value else (ends.right, ends.left)
    if deeper.value <= 0.0:
        both = CONSTANT_ONE
    elif other.value <= 0.0:
        return share
    else:
        both = powered(quotient(other, deeper), power)
    counts = plus(CONSTANT_ONE, product(up, deep), -1.0)
    return product(share, plus(CONSTANT_ONE, product(counts, both), 1.0))


@rare_kernel
def weight_of(overlap: Jet, depth: Jet) -> Jet:
    """Return the weight W of an axis of some depth; see the top."""
    ratio = quotient(overlap, depth)
    return product(stepped(ratio, SLIVER, 1.0), powered(ratio, FALLS))


@rare_kernel
def axis_depth(axis: Axis, a: Record, b: Record, table: Records) -> Jet:
    """Return the depth (m) of an axis."""
    return depth_behind(axis.of_b, axis.face, axis.corner, a, b, table)


@rare_kernel
def energy_along(
    axis: Axis, across: int, beside: Jet, overlap: Jet, power: float, a: Record, b: Record, table: Records
) -> tuple[Jet, Jet]:
    """Return the weight of an axis, and s D^power times that; `beside` is its depth over that of the next one."""
    depth = axis_depth(axis, a, b, table)
    weight = weight_of(overlap, depth)
    energy = product(weight, powered(depth, power))
    if across < 0:
        return energy, weight
    cone = cone_of(a, b, table)
    up = stepped(tilt_of(axis, across, a, b, table), flat_within(cone), cone)
    deep = stepped(beside, TILTED * cone, 2.0 * TILTED * cone)
    of_a, of_b = (across, axis.face) if axis.of_b else (axis.face, across)
    share = share_of(of_a, of_b, up, deep, overlap, power, a, b, table)
    second = axis_depth(axis_of(not axis.of_b, across, a, b, table), a, b, table)
    aside = product(up, weight_of(overlap, second))
    return product(plus(energy, product(aside, powered(second, power)), 1.0), share), plus(weight, aside, 1.0)


@rare_kernel
def mean_energy(nearest: Axis, power: float, a: Record, b: Record, table: Records) -> Jet:
    """Return the mean of s D^power over all axes; see the top. `power` is that of the overlap in the energy."""
    overlap = axis_depth(nearest, a, b, table)
    across = face_across(nearest, a, b, table)
    following = next_axis(nearest, across, a, b, table)
    ratio = quotient(overlap, axis_depth(following, a, b, table))
    total = Jet(0.0, 0.0, 0.0, 0.0)
    weights = Jet(0.0, 0.0, 0.0, 0.0)
    for m in range(number_of_corners(b) + number_of_corners(a)):
        of_b = m < number_of_corners(b)
        axis = axis_of(of_b, m if of_b else m - number_of_corners(b), a, b, table)
        other = face_across(axis, a, b, table)
        second = axis
        if other >= 0:
            second = axis_of(not of_b, other, a, b, table)
        is_first = axis.depth < second.depth or (axis.depth == second.depth and of_b)
        if min(axis.depth, second.depth) * SLIVER >= overlap.value or not (other < 0 or is_first):
            continue
        is_nearest = axis.face == nearest.face and of_b == nearest.of_b
        beside = ratio if is_nearest else quotient(overlap, axis_depth(axis, a, b, table))
        energy, weight = energy_along(axis, other, beside, overlap, power, a, b, table)
        total = plus(total, energy, 1.0)
        weights = plus(weights, weight, 1.0)
    return quotient(total, weights)


@rare_kernel
def slot_of(nearest: Axis) -> int:
    """Return the slot of the deepest corner along an axis."""
    return nearest.corner if nearest.of_b else MOST_CORNERS + nearest.corner


@rare_kernel
def place_nearest(point: Record, nearest: Axis, a: Record, b: Record, table: Records) -> None:
    """Make a point that of the deepest corner on the nearest face."""
    owner, touched = (a, b) if nearest.of_b else (b, a)
    nx, ny = side_normal(touched, table, nearest.face)
    rx, ry = corner_vector(owner, table, nearest.corner)
    sign = 1.0 if nearest.of_b else -1.0
    point.slot = slot_of(nearest)
    point.face = nearest.face
    point.x = owner.x + rx
    point.y = owner.y + ry
    point.nx = sign * nx
    point.ny = sign * ny
    point.depth = nearest.depth
    point.beside = math.inf


@rare_kernel
def place_sliver(world: World, p: int, nearest: Axis, table: Records) -> None:
    """Make the deepest corner on the nearest face the only contact point of a pair, with the spring of the potential.

    Its stiffness, and how that changes by sliding and tilting, is noted in the point until the stiffness is measured.
    """
    pair = world.pairs[p]
    a = world.bodies[pair.a]
    b = world.bodies[pair.b]
    law = world.controls[0].law
    stiffness = world.interactions[a.contact_class, b.contact_class].normal_stiffness
    whole = stored_energy(law, 1.0, 1.0)  # 1/2 of the linear law, 2/5 of Hertz's
    energy = mean_energy(nearest, 1.0 / whole, a, b, table)
    potential = mapped(energy, whole * stiffness * energy.value, whole * stiffness)
    point = world.points[0]
    place_nearest(point, nearest, a, b, table)
    along = -(potential.x * point.ny - potential.y * point.nx)
    plain = potential.value / (whole * nearest.depth)
    force = max(-(potential.x * point.nx + potential.y * point.ny), LEAST_FORCE * plain)
    arm_x, arm_y = point.x - a.x, point.y - a.y
    couple = (arm_x * point.ny - arm_y * point.nx) * force - (arm_x * point.nx + arm_y * point.ny) * along
    couple += potential.turn
    point.depth = potential.value / (whole * force)
    point.stiffness = potential.value / stored_energy(law, 1.0, point.depth)
    point.before = along / stored_energy(law, 1.0, point.depth)
    point.rate = couple / stored_energy(law, 1.0, point.depth)


@kernel
def points_of_sliver(world: World, p: int, count: int, table: Records | None) -> int:
    """Put the one contact point of a sliver in the place of the `count` that were found; return how many there are."""
    if table is None:
        return count
    return find_sliver(world, p, count, table)


@rare_kernel
def find_sliver(world: World, p: int, count: int, table: Records) -> int:
    """As points_of_sliver, of polygons."""
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
        if count != 1 or point.slot != slot_of(nearest) or point.face != nearest.face:
            pair.duplicates = 0
            place_nearest(point, nearest, a, b, table)
        return 1
    return count


@rare_kernel
def has_both_ends(
    world: World, count: int, nearest: Axis, across: int, limit: float, a: Record, b: Record, table: Records
) -> bool:
    """Return True if `count` points are both ends of the interval of two faces: they hold as much as these.

    `limit` (m) is that of the overlap.
    """
    law = world.controls[0].law
    sharp = Jet(0.0, 0.0, 0.0, 0.0)
    of_a, of_b = (across, nearest.face) if nearest.of_b else (nearest.face, across)
    ends = ends_of(of_a, of_b, sharp, a, b, table)
    whole = stored_energy(law, 1.0, max(ends.left.value, 0.0)) + stored_energy(law, 1.0, max(ends.right.value, 0.0))
    found = 0.0
    for i in range(count):
        found += stored_energy(law, 1.0, world.points[i].depth)
    return abs(found - whole) <= ALIKE * whole + stored_energy(law, 1.0, NEGLIGIBLE * limit)

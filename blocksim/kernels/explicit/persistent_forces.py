"""Pairs whose contacts continue as they were: nearly all pairs at nearly all steps, so they decide the speed.

For the `surface` model with one or two contacts. Nothing is searched, and nothing is written before it is certain that
no contact begins, ends or changes: that is found as contacts are followed. Where it is not so, `persistent_forces`
leaves the pair as it was and contact.py deals with it. Forces are those of forces.py.

Between polygons a contact continues where the search of models/surface.py would find it again: its corner lies behind
the face, no other face is nearer that it can touch, and no other corner begins. Far from the ends of its face no other
can be nearer (`clear`, world/bodies.py). Near an end that rule itself is asked, for this one corner. The same holds for
a corner without a contact: in front of a face that has no sharp end it is outside, elsewhere the rule decides.
"""

import math
from typing import Any

import numpy as np

from blocksim.kernels.common.arrays import NO_FACE, NORMAL, SHEAR, Corners, Record, Records, World
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.common.tolerances import DEEPEST_END, END_RATIO, HAND_OVER, IMPACT_STEPS, SLIVER
from blocksim.kernels.explicit import bearing, damping, kinematics, laws, sides
from blocksim.kernels.explicit.bearing import APART, PLANE, are_blocks, bearing_along, keep_bearing, stiffness_between
from blocksim.kernels.explicit.contact import has_new_neighbours
from blocksim.kernels.explicit.forces import NOTHING, Effect, Touch, forces_of
from blocksim.kernels.explicit.models import SURFACE
from blocksim.kernels.explicit.models.surface import can_touch, corner_seen, face_met, has_inner
from blocksim.kernels.explicit.sliver_axes import is_sliver, least_ratio, meets_along

FRONT_BITS = 4  # of PAIR.fronts for each of the first candidates, enough for the faces of a block
FRONT = (1 << FRONT_BITS) - 1
MOST_FRONTS = 8


@rare_kernel
def stays_on(face: int, owner: Record, number: int, touched: Record, way: float, table: Corners) -> bool:
    """Return True if a corner of `owner` touches this face, and would still do `way` (m) nearer to the next one."""
    cone = sides.cone_of(owner, touched, table)
    found, depth, beside = face_met(corner_seen(owner, number, touched, table), touched, table, cone)
    return found == face and depth > 0.0 and beside >= way


@rare_kernel
def is_admitted(face: int, owner: Record, number: int, touched: Record, table: Corners) -> bool:
    """Return True if a corner of `owner` can touch a face, wherever it is."""
    side = sides.corner_of(touched, table, face)
    return can_touch(corner_seen(owner, number, touched, table), side.nx, side.ny, sides.cone_of(owner, touched, table))


@kernel
def follow(
    contact: Record,
    a: Record,
    b: Record,
    dx: float,
    dy: float,
    motion: kinematics.Motion,
    step: float,
    turns: bool,
    duplicates: int,
    table: Corners,
) -> tuple[bool, kinematics.Point]:
    """Check that a contact continues, and where and how.

    It does not where its corner has left or has passed the end of the face, where another face is nearer that it can
    touch, or will be within a few steps. Whether the corner can still touch its face at all changes by turning only,
    slowly, and is checked where `turns` says so.
    """
    slot: Any = np.int64(contact.slot)
    face: Any = np.int64(contact.face)
    is_own = slot < sides.MOST_CORNERS
    owner = a if is_own else b
    touched = b if is_own else a
    sign = 1.0 if is_own else -1.0
    number = slot if is_own else slot - sides.MOST_CORNERS
    side = sides.corner_of(touched, table, face)
    ox, oy = sides.corner_vector(owner, table, number)
    nx, ny = sides.side_normal(touched, table, face)
    x = ox + sign * dx
    y = oy + sign * dy
    depth = side.distance - (x * nx + y * ny)
    along = y * nx - x * ny - side.middle
    end = side.half - abs(along)
    found = kinematics.moving_point(x if is_own else ox, y if is_own else oy, sign * nx, sign * ny, depth, motion, step)
    goes_on = depth > 0.0
    if sides.is_piece(touched):
        goes_on = goes_on and depth <= END_RATIO * end
    elif end < math.inf:  # else the half-plane
        way = IMPACT_STEPS * abs(found.closing)
        if side.clear * end - depth <= max(depth, way) or depth > side.distance:
            is_last = along > 0.0
            beside = sides.next_number(touched, table, face) if is_last else sides.number_before(touched, table, face)
            beyond = -end - HAND_OVER * depth
            goes_on = goes_on and not has_inner(duplicates, is_own, touched, face, along, beyond, table)
            goes_on = goes_on and (
                is_nearer_than_beside(owner, number, touched, face, beside, x, y, depth, way, end, table)
                or stays_on(face, owner, number, touched, way, table)
            )
    if turns:
        goes_on = goes_on and is_admitted(face, owner, number, touched, table)
    return goes_on, found


@kernel
def is_nearer_than_beside(
    owner: Record,
    number: int,
    touched: Record,
    face: int,
    beside: int,
    x: float,
    y: float,
    depth: float,
    way: float,
    end: float,
    table: Corners,
) -> bool:
    """Return True if a corner of `owner` near an end of a face certainly stays on it; see stays_on.

    (x, y) (m) is its place about the centre of `touched`, `beside` the face there, `depth` (m) and `end` (m) how far
    it is from the face and its end. The other faces are too far away, the one beside farther, or not to be touched.
    """
    side = sides.corner_of(touched, table, face)
    need = max(depth, way)
    if min(side.far, side.clear * side.half) <= need + depth + max(-end, 0.0) or depth > side.distance:
        return False
    other = sides.corner_of(touched, table, beside)
    nx, ny = sides.side_normal(touched, table, beside)
    over = other.distance - (nx * x + ny * y)
    if over < 0.0:
        return False
    fx, fy = sides.side_normal(touched, table, face)
    cone = sides.cone_of(owner, touched, table)
    if goes_inwards(owner, number, fx, fy, beside == sides.next_number(touched, table, face), cone, table):
        return True
    ax, ay = sides.side_normal(owner, table, number)
    bx, by = sides.side_normal(owner, table, sides.number_before(owner, table, number))
    # no branches, as none is foreseen well
    admits = (fy * ax - fx * ay >= -cone) & (fx * by - fy * bx >= -cone)
    return admits & ((over > need) | (ny * ax - nx * ay < -cone) | (nx * by - ny * bx < -cone))


@kernel
def goes_inwards(owner: Record, number: int, nx: float, ny: float, is_last: bool, cone: float, table: Corners) -> bool:
    """Return True if a face of a corner of `owner` goes from the near end of a face of normal (nx, ny) along it.

    `is_last` says which end that is, `cone` is that of both bodies. The two faces are parallel to within half the
    cone. Outlines turn at a corner by at least twice the angle of the cone, and at most by half a turn less that
    (world/bodies.py), so that no face of the corner falls by more than the cone: it can touch this face. Towards the
    face beside, which turns away by as much, its own falls by more than the cone: that one it cannot touch.
    """
    level = number if is_last else sides.number_before(owner, table, number)
    mx, my = sides.side_normal(owner, table, level)
    return (nx * mx + ny * my < 0.0) & (abs(nx * my - ny * mx) <= 0.5 * cone)


@kernel
def ends_in_sliver(contact: Record, a: Record, b: Record, found: kinematics.Point, table: Corners) -> bool:
    """Return True if two bodies with one contact overlap by a sliver.

    No other axis, of faces that are not parallel, is less deep than the way to the end of the face times the sine of
    the angle to it. Of a corner at the very end, as of blocks of one width, that says nothing: see meets_along.
    """
    slot: Any = np.int64(contact.slot)
    face: Any = np.int64(contact.face)
    is_own = slot < sides.MOST_CORNERS
    owner, touched = (a, b) if is_own else (b, a)
    if sides.is_piece(touched) or not sides.has_polygons(table):
        return False
    side = sides.corner_of(touched, table, face)
    nx, ny = sides.side_normal(touched, table, face)
    x = found.x - (touched.x - b.x)
    y = found.y - (touched.y - b.y)
    along = y * nx - x * ny - side.middle
    end = side.half - abs(along)
    cone = sides.cone_of(a, b, table)
    least = least_ratio(cone) * end * min(side.clear, bearing.flat_within(cone))
    if found.depth * (1.0 + SLIVER) <= least:
        return False
    number = slot if is_own else slot - sides.MOST_CORNERS
    return not meets_along(owner, number, touched, side, nx, ny, along, found.depth, table) and is_sliver(a, b, table)


@kernel
def lie_on_sliver(a: Record, b: Record, one: kinematics.Point, two: kinematics.Point, table: Corners) -> bool:
    """Return True if two bodies with two contacts overlap by a sliver; no axis is less deep than the way between."""
    if not sides.has_polygons(table):
        return False
    way = max(abs(one.x - two.x), abs(one.y - two.y))
    return max(one.depth, two.depth) > SLIVER * way * sides.cone_of(a, b, table) and is_sliver(a, b, table)


@rare_kernel
def has_face(owner: Record, number: int, touched: Record, table: Corners) -> bool:
    """Return True if a corner of `owner` touches a face."""
    cone = sides.cone_of(owner, touched, table)
    face, depth, _ = face_met(corner_seen(owner, number, touched, table), touched, table, cone)
    return face != NO_FACE and depth > 0.0


@kernel
def touches(pair: Record, m: int, owner: Record, number: int, touched: Record, is_ground: bool, table: Corners) -> bool:
    """Return True if a corner of `owner`, candidate m of a pair, touches another body, or the half-plane.

    Notes which face it is in front of, for the next time.
    """
    if is_ground:
        return owner.y + sides.corner_vector(owner, table, number)[1] < touched.y
    place = FRONT_BITS * m if m < MOST_FRONTS else 0
    fronts: Any = np.int64(pair.fronts)
    last = (fronts >> place) & FRONT
    ox, oy = sides.corner_vector(owner, table, number)
    x, y = sides.into_frame(touched, owner.x - touched.x + ox, owner.y - touched.y + oy)
    if sides.is_piece(touched):
        face = sides.UPPER if y > touched.half_y else NO_FACE
    else:
        face = sides.face_before(touched, table, x, y, last, DEEPEST_END * touched.radius)
    if face == NO_FACE:
        return has_face(owner, number, touched, table)
    if face != last:
        pair.fronts = fronts ^ ((face ^ last) << place)
    return False


@kernel
def begins_contact(world: World, p: int, a: Record, b: Record, table: Corners) -> bool:
    """Return True if a candidate corner of a pair that was outside the other body touches it now."""
    pair = world.pairs[p]
    is_ground = pair.b == world.bodies.size - 1
    known = 0
    for m in range(pair.near):
        slot: Any = np.int64(world.candidates[p, m])
        if known < pair.active and world.contacts[p, known].slot == slot:
            known += 1
        elif (pair.duplicates >> slot) & 1 == 0:
            if slot < sides.MOST_CORNERS:
                if touches(pair, m, a, slot, b, is_ground, table):
                    return True
            elif touches(pair, m, b, slot - sides.MOST_CORNERS, a, False, table):
                return True
    return False


@rare_kernel
def has_crossed(world: World, p: int, a: Record, b: Record, table: Corners) -> bool:
    """Return True if the faces of a pair that has duplicates are not nearly parallel: others may then be dropped.

    Where dashpots are due, if they are not parallel: of two corners at one end the other may be the inner one by now.
    """
    contact = world.contacts[p, 0]
    slot: Any = np.int64(contact.slot)
    is_own = slot < sides.MOST_CORNERS
    owner, touched = (a, b) if is_own else (b, a)
    corner = corner_seen(owner, slot if is_own else slot - sides.MOST_CORNERS, touched, table)
    face: Any = np.int64(contact.face)
    side = sides.corner_of(touched, table, face)
    ahead = abs(side.nx * corner.ahead_x + side.ny * corner.ahead_y)
    back = abs(side.nx * corner.back_x + side.ny * corner.back_y)
    cone = sides.cone_of(a, b, table)
    return min(ahead, back) > (bearing.flat_within(cone) if world.pairs[p].normal_left == 0 else cone)


CHANGED, UNTOUCHED, TOUCHING = range(3)


@kernel
def followed(
    touch: Touch, step: float, is_two: bool, is_due: bool, table: Corners
) -> tuple[bool, kinematics.Point, kinematics.Point]:
    """Check that the one or two contacts of a pair continue; return them too, the first one twice if there is one.

    Two are on the ground, or the two ends of one interval of parallel faces, and no sliver. That the faces are parallel
    changes by turning only, slowly, and is checked where dashpots are due, as `is_due` says.
    """
    pair, a, b = touch.pair, touch.a, touch.b
    dx = a.x - b.x
    dy = a.y - b.y
    motion = kinematics.relative_motion(a, b, dx, dy, 0.5 * step)
    goes_on, one = follow(touch.first, a, b, dx, dy, motion, step, is_due, pair.duplicates, table)
    if not is_two:
        goes_on = goes_on and one.depth <= pair.limit and not ends_in_sliver(touch.first, a, b, one, table)
        return goes_on, one, one
    goes_too, two = follow(touch.second, a, b, dx, dy, motion, step, is_due, pair.duplicates, table)
    goes_on = goes_on and goes_too and pair.bearing != APART and not lie_on_sliver(a, b, one, two, table)
    if is_due and pair.bearing != PLANE:
        goes_on = goes_on and bearing_along(a, b, one.nx, one.ny, table)[2]
    return goes_on and max(one.depth, two.depth) <= pair.limit, one, two


@kernel
def persistent_forces(world: World, p: int, step: float, particles: Records | None) -> tuple[int, Effect]:
    """Return what pair p does if its contacts continue (TOUCHING) or there are none (UNTOUCHED).

    Otherwise (CHANGED) nothing has been written. `step` is the length (s) of the drift that led here. Where `particles`
    is not None no pair is handled here.
    """
    if particles is not None:
        return CHANGED, NOTHING
    table = world.corners
    pair = world.pairs[p]
    a = world.bodies[pair.a]
    b = world.bodies[pair.b]
    if pair.active > 0:
        if has_changed(world, p, a, b, table):
            return CHANGED, NOTHING
        return forces_of_contacts(world, p, step)
    is_ground = pair.b == world.bodies.size - 1
    axis: Any = np.int64(pair.axis)
    if sides.gap_on(axis, a, b, is_ground, table) >= 0.0:
        return UNTOUCHED, NOTHING
    pair.axis, gap = sides.widest_gap(a, b, is_ground, table)
    if gap < 0.0 and (are_blocks(a, b) or gap < -pair.limit or begins_contact(world, p, a, b, table)):
        return CHANGED, NOTHING
    return UNTOUCHED, NOTHING


@kernel
def has_changed(world: World, p: int, a: Record, b: Record, table: Corners) -> bool:
    """Return True if a new contact begins, or the contacts are of a kind that contact.py handles.

    Has the dashpots rebuilt where the number of pairs on a body has changed.
    """
    pair = world.pairs[p]
    if pair.is_sliver != 0 or (pair.duplicates != 0 and has_crossed(world, p, a, b, table)):
        return True
    if pair.idle > 0 and begins_contact(world, p, a, b, table):
        return True
    if has_new_neighbours(a, b, SURFACE):
        damping.renew_dashpots(pair)
    return False


@kernel
def forces_of_contacts(world: World, p: int, step: float) -> tuple[int, Effect]:
    """Return what a pair with contacts does, if they continue.

    What is checked and measured once in OPERATOR_LIFE steps, where dashpots are due, is compiled apart, so that all
    other steps have neither the tests for it nor what they would keep for it; so is what other laws need.
    """
    pair = world.pairs[p]
    a = world.bodies[pair.a]
    b = world.bodies[pair.b]
    first, second = world.contacts[p, 0], world.contacts[p, 1]
    values = world.interactions[a.contact_class, b.contact_class]
    touch = Touch(pair, a, b, values, first, second, world.operators[p, NORMAL], world.operators[p, SHEAR])
    exponent = world.controls[0].exponent
    if pair.normal_left == 0 or exponent != laws.LINEAR:
        return forces_of_some(touch, step, pair.active == 2, exponent, world.corners)
    if pair.active == 1:
        return forces_that_last(touch, step, False, world.corners)
    return forces_that_last(touch, step, True, world.corners)


@kernel
def forces_that_last(touch: Touch, step: float, is_two: bool, table: Corners) -> tuple[int, Effect]:
    """As forces_of_contacts, for linear springs whose dashpots along the normals are not due."""
    goes_on, one, two = followed(touch, step, is_two, False, table)
    if not goes_on:
        return CHANGED, NOTHING
    return TOUCHING, forces_of(touch, one, two, is_two, 0.0, step, step, laws.LINEAR, True, table, None)


@rare_kernel
def forces_of_some(touch: Touch, step: float, is_two: bool, exponent: float, table: Corners) -> tuple[int, Effect]:
    """As forces_of_contacts, where dashpots along the normals are due, and with them the stiffness; for all laws."""
    pair = touch.pair
    is_due = pair.normal_left == 0
    goes_on, one, two = followed(touch, step, is_two, is_due, table)
    if not goes_on:
        return CHANGED, NOTHING
    before = pair.stiffness
    if is_due and pair.bearing != PLANE:
        if is_two:
            pair.stiffness = stiffness_between(pair, one.x - two.x, one.y - two.y, one.nx, one.ny)
        else:
            measured = bearing_along(touch.a, touch.b, one.nx, one.ny, table)[1]
            keep_bearing(pair, measured, touch.values.normal_stiffness)
    return TOUCHING, forces_of(touch, one, two, is_two, before, step, step, exponent, False, table, None)

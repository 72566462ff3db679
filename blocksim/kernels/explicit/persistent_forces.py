"""Pairs whose contacts continue as they were: nearly all pairs at nearly all steps, so they decide the speed.

For the `surface` model with one or two contacts. Nothing is searched, and nothing is written before it is certain that
no contact begins, ends or changes: that is found as contacts are followed. Where it is not so, `persistent_forces`
leaves the pair as it was and contact.py deals with it. Forces are those of forces.py.

Between polygons a contact continues where the search of models/outlines.py would find it again: its corner lies behind
the face, no other face is nearer that it can touch, and no other corner begins. Far from the ends of its face no other
can be nearer (`clear`, world/bodies.py). Near an end that rule itself is asked, for this one corner. The same holds for
a corner without a contact: in front of a face that has no sharp end it is outside, elsewhere the rule decides.
"""

import math
from typing import Any

import numpy as np

from blocksim.kernels.common.arrays import ALL, HALF, NO_FACE, NORMAL, SHEAR, Record, Records, World
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.common.shapes import corner_offset
from blocksim.kernels.common.tolerances import CONE_TOLERANCE, DEEPEST_END, END_RATIO, HAND_OVER, IMPACT_STEPS, SLIVER
from blocksim.kernels.explicit import damping, kinematics, laws, outlines, separation
from blocksim.kernels.explicit.bearing import APART, PLANE, are_blocks, bearing_along, keep_bearing, stiffness_between
from blocksim.kernels.explicit.contact import has_new_neighbours
from blocksim.kernels.explicit.forces import NOTHING, Effect, Touch, forces_of
from blocksim.kernels.explicit.models import SURFACE, surface
from blocksim.kernels.explicit.models.outlines import can_touch, corner_seen, face_met, has_inner
from blocksim.kernels.explicit.models.surface import corner_signs
from blocksim.kernels.explicit.sliver_axes import flat_within, is_sliver, least_ratio, meets_along


@kernel
def admits(owner: Record, corner: int, nx: float, ny: float) -> bool:
    """Return True if a corner of `owner` can touch a face of the outward normal (nx, ny); see models/surface.py."""
    sx, sy = corner_signs(corner)
    along_x = sx * (nx * owner.cos + ny * owner.sin)
    along_y = sy * (ny * owner.cos - nx * owner.sin)
    return along_x <= CONE_TOLERANCE and along_y <= CONE_TOLERANCE


@kernel
def face_frame(body: Record, face: int) -> tuple[float, float, float, float]:
    """Return the outward normal of a face in world axes, its distance from the centre and half of its length (m)."""
    sign = 1.0 if face < 2 else -1.0
    if face % 2 == 0:
        return sign * body.cos, sign * body.sin, body.half_x, body.half_y
    return -sign * body.sin, sign * body.cos, body.half_y, body.half_x


@kernel
def follow(
    contact: Record, a: Record, b: Record, dx: float, dy: float, motion: kinematics.Motion, step: float, turns: bool
) -> tuple[bool, kinematics.Point]:
    """Check that a contact continues, and where and how.

    It does not where its corner has left or has passed the end of the face, where another face is nearer that it can
    touch, or will be within a few steps. Whether the corner can still touch its face at all changes by turning only,
    slowly, and is checked where `turns` says so.
    """
    slot = contact.slot
    is_own = slot < HALF
    owner = a if is_own else b
    touched = b if is_own else a
    side = 1.0 if is_own else -1.0
    corner = slot % HALF
    ox, oy = corner_offset(owner, corner)
    x = ox + side * dx
    y = oy + side * dy
    nx, ny, half, half_length = face_frame(touched, contact.face)
    depth = half - (x * nx + y * ny)
    along = y * nx - x * ny
    beside = half_length - abs(along)
    goes_on = depth > 0.0 and beside >= 0.0 and (not turns or admits(owner, corner, nx, ny))
    found = kinematics.moving_point(x if is_own else ox, y if is_own else oy, side * nx, side * ny, depth, motion, step)
    if beside < max(depth, IMPACT_STEPS * abs(found.closing)):
        other = 1.0 if along > 0.0 else -1.0
        goes_on = goes_on and not admits(owner, corner, -other * ny, other * nx)
    return goes_on, found


FRONT_BITS = 4  # of PAIR.fronts for each of the first candidates, enough for the faces of a block
FRONT = (1 << FRONT_BITS) - 1
MOST_FRONTS = 8


@rare_kernel
def stays_on(face: int, owner: Record, number: int, touched: Record, way: float, table: Records) -> bool:
    """Return True if a corner of `owner` touches this face, and would still do `way` (m) nearer to the next one."""
    cone = outlines.cone_of(owner, touched, table)
    found, depth, beside = face_met(corner_seen(owner, number, touched, table), touched, table, cone)
    return found == face and depth > 0.0 and beside >= way


@rare_kernel
def is_admitted(face: int, owner: Record, number: int, touched: Record, table: Records) -> bool:
    """Return True if a corner of `owner` can touch a face, wherever it is."""
    side = outlines.corner_of(touched, table, face)
    return can_touch(
        corner_seen(owner, number, touched, table), side.nx, side.ny, outlines.cone_of(owner, touched, table)
    )


@kernel
def follow_on_outlines(
    contact: Record,
    a: Record,
    b: Record,
    dx: float,
    dy: float,
    motion: kinematics.Motion,
    step: float,
    turns: bool,
    duplicates: int,
    table: Records,
) -> tuple[bool, kinematics.Point]:
    """As follow in persistent_forces.py, with corners and faces of the table."""
    slot: Any = np.int64(contact.slot)
    face: Any = np.int64(contact.face)
    is_own = slot < outlines.MOST_CORNERS
    owner = a if is_own else b
    touched = b if is_own else a
    sign = 1.0 if is_own else -1.0
    number = slot if is_own else slot - outlines.MOST_CORNERS
    corner = outlines.corner_of(owner, table, number)
    side = outlines.corner_of(touched, table, face)
    ox, oy = outlines.into_world(owner, corner.x, corner.y)
    nx, ny = outlines.into_world(touched, side.nx, side.ny)
    x = ox + sign * dx
    y = oy + sign * dy
    depth = side.distance - (x * nx + y * ny)
    along = y * nx - x * ny - side.middle
    end = side.half - abs(along)
    found = kinematics.moving_point(x if is_own else ox, y if is_own else oy, sign * nx, sign * ny, depth, motion, step)
    goes_on = depth > 0.0
    if outlines.is_piece(touched):
        goes_on = goes_on and depth <= END_RATIO * end
    elif end < math.inf:  # else the half-plane
        way = IMPACT_STEPS * abs(found.closing)
        if side.clear * end - depth <= max(depth, way) or depth > side.distance:
            beside = outlines.next_number(touched, face) if along > 0.0 else outlines.number_before(touched, face)
            goes_on = goes_on and not has_inner(duplicates, is_own, touched, face, along, -end - HAND_OVER * depth)
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
    table: Records,
) -> bool:
    """Return True if a corner of `owner` near an end of a face certainly stays on it; see stays_on.

    (x, y) (m) is its place about the centre of `touched`, `beside` the face there, `depth` (m) and `end` (m) how far
    it is from the face and its end. The other faces are too far away, the one beside farther, or not to be touched.
    """
    side = outlines.corner_of(touched, table, face)
    need = max(depth, way)
    if min(side.far, side.clear * side.half) <= need + depth + max(-end, 0.0) or depth > side.distance:
        return False
    other = outlines.corner_of(touched, table, beside)
    nx, ny = outlines.into_world(touched, other.nx, other.ny)
    over = other.distance - (nx * x + ny * y)
    if over < 0.0:
        return False
    fx, fy = outlines.into_world(touched, side.nx, side.ny)
    if goes_inwards(owner, number, fx, fy, beside == outlines.next_number(touched, face), side.cone, table):
        return True
    ahead = outlines.corner_of(owner, table, number)
    back = outlines.corner_of(owner, table, outlines.number_before(owner, number))
    ax, ay = outlines.into_world(owner, ahead.nx, ahead.ny)
    bx, by = outlines.into_world(owner, back.nx, back.ny)
    cone = min(side.cone, ahead.cone)
    # no branches, as none is foreseen well
    admits = (fy * ax - fx * ay >= -cone) & (fx * by - fy * bx >= -cone)
    return admits & ((over > need) | (ny * ax - nx * ay < -cone) | (nx * by - ny * bx < -cone))


@kernel
def goes_inwards(owner: Record, number: int, nx: float, ny: float, is_last: bool, cone: float, table: Records) -> bool:
    """Return True if a face of a corner of `owner` goes from the near end of a face of normal (nx, ny) along it.

    `is_last` says which end that is, `cone` is that of the other body. The two faces are parallel to within half the
    cone. Outlines turn at a corner by at least twice the angle of the cone, and at most by half a turn less that
    (world/bodies.py), so that no face of the corner falls by more than the cone: it can touch this face. Towards the
    face beside, which turns away by as much, its own falls by more than the cone: that one it cannot touch.
    """
    level = outlines.corner_of(owner, table, number if is_last else outlines.number_before(owner, number))
    mx, my = outlines.into_world(owner, level.nx, level.ny)
    return (nx * mx + ny * my < 0.0) & (abs(nx * my - ny * mx) <= 0.5 * min(cone, level.cone))


@kernel
def ends_in_sliver(contact: Record, a: Record, b: Record, found: kinematics.Point, table: Records) -> bool:
    """Return True if two bodies with one contact overlap by a sliver.

    No other axis, of faces that are not parallel, is less deep than the way to the end of the face times the sine of
    the angle to it. Of a corner at the very end, as of blocks of one width, that says nothing: see meets_along.
    """
    slot: Any = np.int64(contact.slot)
    face: Any = np.int64(contact.face)
    is_own = slot < outlines.MOST_CORNERS
    owner, touched = (a, b) if is_own else (b, a)
    if outlines.is_piece(touched):
        return False
    side = outlines.corner_of(touched, table, face)
    nx, ny = outlines.into_world(touched, side.nx, side.ny)
    x = found.x - (touched.x - b.x)
    y = found.y - (touched.y - b.y)
    along = y * nx - x * ny - side.middle
    end = side.half - abs(along)
    cone = outlines.cone_of(a, b, table)
    least = least_ratio(cone) * end * min(side.clear, flat_within(cone))
    if found.depth * (1.0 + SLIVER) <= least:
        return False
    number = slot if is_own else slot - outlines.MOST_CORNERS
    return not meets_along(owner, number, touched, side, nx, ny, along, found.depth, table) and is_sliver(a, b, table)


@kernel
def lie_on_sliver(
    a: Record,
    b: Record,
    one: kinematics.Point,
    two: kinematics.Point,
    table: Records,
) -> bool:
    """Return True if two bodies with two contacts overlap by a sliver; no axis is less deep than the way between."""
    way = max(abs(one.x - two.x), abs(one.y - two.y))
    return max(one.depth, two.depth) > SLIVER * way * outlines.cone_of(a, b, table) and is_sliver(a, b, table)


@kernel
def face_below(owner: Record, number: int, touched: Record, last: int, table: Records) -> int:
    """Return a face of `touched` that a corner of `owner` is in front of, under no sharp end of another, or NO_FACE.

    `last` is the one of the last time, which it mostly still is: that is asked first.
    """
    corner = outlines.corner_of(owner, table, number)
    ox, oy = outlines.into_world(owner, corner.x, corner.y)
    x, y = outlines.into_frame(touched, owner.x - touched.x + ox, owner.y - touched.y + oy)
    if outlines.is_piece(touched):
        return outlines.UPPER if y > touched.half_y else NO_FACE
    room = DEEPEST_END * touched.radius
    count = outlines.number_of_corners(touched)
    k = last if last < count else 0
    for _ in range(count):
        side = outlines.corner_of(touched, table, k)
        if side.nx * x + side.ny * y - side.distance > side.sharp * room:
            return k
        k = k + 1 if k + 1 < count else 0
    return NO_FACE


@rare_kernel
def has_face(owner: Record, number: int, touched: Record, table: Records) -> bool:
    """Return True if a corner of `owner` touches a face."""
    cone = outlines.cone_of(owner, touched, table)
    face, depth, _ = face_met(corner_seen(owner, number, touched, table), touched, table, cone)
    return face != NO_FACE and depth > 0.0


@kernel
def touches(pair: Record, m: int, owner: Record, number: int, touched: Record, is_ground: bool, table: Records) -> bool:
    """Return True if a corner of `owner`, candidate m of a pair, touches another body, or the half-plane.

    Notes which face it is in front of, for the next time.
    """
    if is_ground:
        return owner.y + outlines.corner_vector(owner, table, number)[1] < touched.y
    place = FRONT_BITS * m if m < MOST_FRONTS else 0
    fronts: Any = np.int64(pair.fronts)
    last = (fronts >> place) & FRONT
    face = face_below(owner, number, touched, last, table)
    if face == NO_FACE:
        return has_face(owner, number, touched, table)
    if face != last:
        pair.fronts = fronts ^ ((face ^ last) << place)
    return False


@kernel
def begins_on_outlines(world: World, p: int, a: Record, b: Record, table: Records) -> bool:
    """Return True if a candidate corner of a pair that was outside the other body touches it now."""
    pair = world.pairs[p]
    is_ground = pair.b == world.bodies.size - 1
    known = 0
    for m in range(pair.near):
        slot: Any = np.int64(world.candidates[p, m])
        if known < pair.active and world.contacts[p, known].slot == slot:
            known += 1
        elif (pair.duplicates >> slot) & 1 == 0:
            if slot < outlines.MOST_CORNERS:
                if touches(pair, m, a, slot, b, is_ground, table):
                    return True
            elif touches(pair, m, b, slot - outlines.MOST_CORNERS, a, False, table):
                return True
    return False


@rare_kernel
def has_crossed(world: World, p: int, a: Record, b: Record, table: Records) -> bool:
    """Return True if the faces of a pair that has duplicates are not nearly parallel: others may then be dropped.

    Where dashpots are due, if they are not parallel: of two corners at one end the other may be the inner one by now.
    """
    contact = world.contacts[p, 0]
    slot: Any = np.int64(contact.slot)
    is_own = slot < outlines.MOST_CORNERS
    owner, touched = (a, b) if is_own else (b, a)
    corner = corner_seen(owner, slot if is_own else slot - outlines.MOST_CORNERS, touched, table)
    face: Any = np.int64(contact.face)
    side = outlines.corner_of(touched, table, face)
    ahead = abs(side.nx * corner.ahead_x + side.ny * corner.ahead_y)
    back = abs(side.nx * corner.back_x + side.ny * corner.back_y)
    cone = outlines.cone_of(a, b, table)
    return min(ahead, back) > (flat_within(cone) if world.pairs[p].normal_left == 0 else cone)


CHANGED, UNTOUCHED, TOUCHING = range(3)


@kernel
def follow_corner(
    contact: Record,
    a: Record,
    b: Record,
    dx: float,
    dy: float,
    motion: kinematics.Motion,
    step: float,
    turns: bool,
    duplicates: int,
    corners: Records | None,
) -> tuple[bool, kinematics.Point]:
    """Check that a contact continues, and where and how; see py."""
    if corners is None:
        return follow(contact, a, b, dx, dy, motion, step, turns)
    return follow_on_outlines(contact, a, b, dx, dy, motion, step, turns, duplicates, corners)


@kernel
def followed(
    touch: Touch, step: float, is_two: bool, is_due: bool, corners: Records | None
) -> tuple[bool, kinematics.Point, kinematics.Point]:
    """Check that the one or two contacts of a pair continue; return them too, the first one twice if there is one.

    Two are on the ground, or the two ends of one interval of parallel faces, and no sliver. That the faces are parallel
    changes by turning only, slowly, and is checked where dashpots are due, as `is_due` says.
    """
    pair, a, b = touch.pair, touch.a, touch.b
    dx = a.x - b.x
    dy = a.y - b.y
    motion = kinematics.relative_motion(a, b, dx, dy, 0.5 * step)
    goes_on, one = follow_corner(touch.first, a, b, dx, dy, motion, step, is_due, pair.duplicates, corners)
    if not is_two:
        goes_on = goes_on and one.depth <= pair.limit and not one_is_sliver(touch.first, a, b, one, corners)
        return goes_on, one, one
    goes_too, two = follow_corner(touch.second, a, b, dx, dy, motion, step, is_due, pair.duplicates, corners)
    goes_on = goes_on and goes_too and pair.bearing != APART and not two_are_sliver(a, b, one, two, corners)
    if is_due and pair.bearing != PLANE:
        goes_on = goes_on and bearing_along(a, b, one.nx, one.ny, corners)[2]
    return goes_on and max(one.depth, two.depth) <= pair.limit, one, two


@kernel
def one_is_sliver(contact: Record, a: Record, b: Record, found: kinematics.Point, corners: Records | None) -> bool:
    """Return True if a single contact is that of two polygons which overlap by a sliver; see slivers.py."""
    return False if corners is None else ends_in_sliver(contact, a, b, found, corners)


@kernel
def two_are_sliver(a: Record, b: Record, one: kinematics.Point, two: kinematics.Point, corners: Records | None) -> bool:
    """Return True if two contacts are those of two polygons which overlap by a sliver; see slivers.py."""
    return False if corners is None else lie_on_sliver(a, b, one, two, corners)


@kernel
def persistent_forces(
    world: World, p: int, step: float, particles: Records | None, corners: Records | None
) -> tuple[int, Effect]:
    """Return what pair p does if its contacts continue (TOUCHING) or there are none (UNTOUCHED).

    Otherwise (CHANGED) nothing has been written. `step` is the length (s) of the drift that led here. Where `particles`
    is not None no pair is handled here.
    """
    if corners is not None:
        return forces_of_outlines(world, p, step, corners)
    if particles is not None:
        return CHANGED, NOTHING
    return forces_of_rectangles(world, p, step)


@kernel
def forces_of_rectangles(world: World, p: int, step: float) -> tuple[int, Effect]:
    """As persistent_forces, in a scene of rectangles without particles."""
    pair = world.pairs[p]
    a = world.bodies[pair.a]
    b = world.bodies[pair.b]
    dx = a.x - b.x
    dy = a.y - b.y
    if pair.active == 0 and separation.gap_along(pair.axis, a, b, dx, dy) >= 0.0:
        return UNTOUCHED, NOTHING
    if is_unsettled(world, p, a, b, dx, dy):
        return CHANGED, NOTHING
    if pair.active > 0:
        return forces_of_contacts(world, p, step)
    gap = separation.choose_axis(pair, a, b, dx, dy, pair.b == world.bodies.size - 1)
    return UNTOUCHED if gap >= -pair.limit else CHANGED, NOTHING


@kernel
def forces_of_outlines(world: World, p: int, step: float, table: Records) -> tuple[int, Effect]:
    """As persistent_forces, in a scene with polygons."""
    pair = world.pairs[p]
    a = world.bodies[pair.a]
    b = world.bodies[pair.b]
    if pair.active == 0:
        return apart_or_changed(world, p, a, b, table), NOTHING
    if has_changed(world, p, a, b, table):
        return CHANGED, NOTHING
    return forces_of_contacts(world, p, step)


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
def forces_that_last(touch: Touch, step: float, is_two: bool, corners: Records | None) -> tuple[int, Effect]:
    """As forces_of_contacts, for linear springs whose dashpots along the normals are not due."""
    goes_on, one, two = followed(touch, step, is_two, False, corners)
    if not goes_on:
        return CHANGED, NOTHING
    return TOUCHING, forces_of(touch, one, two, is_two, 0.0, step, step, laws.LINEAR, True, corners, None)


@rare_kernel
def forces_of_some(
    touch: Touch, step: float, is_two: bool, exponent: float, corners: Records | None
) -> tuple[int, Effect]:
    """As forces_of_contacts, where dashpots along the normals are due, and with them the stiffness; for all laws."""
    pair = touch.pair
    is_due = pair.normal_left == 0
    goes_on, one, two = followed(touch, step, is_two, is_due, corners)
    if not goes_on:
        return CHANGED, NOTHING
    before = pair.stiffness
    if is_due and pair.bearing != PLANE:
        if is_two:
            pair.stiffness = stiffness_between(pair, one.x - two.x, one.y - two.y, one.nx, one.ny)
        else:
            measured = bearing_along(touch.a, touch.b, one.nx, one.ny, corners)[1]
            keep_bearing(pair, measured, touch.values.normal_stiffness)
    return TOUCHING, forces_of(touch, one, two, is_two, before, step, step, exponent, False, corners, None)


@kernel
def apart_or_changed(world: World, p: int, a: Record, b: Record, table: Records) -> int:
    """Return UNTOUCHED for a pair of a scene with polygons that did not touch and does not now, else CHANGED."""
    pair = world.pairs[p]
    is_ground = pair.b == world.bodies.size - 1
    axis: Any = np.int64(pair.axis)
    if outlines.gap_on(axis, a, b, is_ground, table) >= 0.0:
        return UNTOUCHED
    gap = outlines.widest_gap(pair, a, b, is_ground, table)
    if gap < 0.0 and (are_blocks(a, b) or gap < -pair.limit or begins_on_outlines(world, p, a, b, table)):
        return CHANGED
    return UNTOUCHED


@kernel
def has_changed(world: World, p: int, a: Record, b: Record, table: Records) -> bool:
    """As is_unsettled, for two bodies that touch in a scene with polygons."""
    pair = world.pairs[p]
    if pair.is_sliver != 0:
        return True
    if pair.duplicates != 0 and has_crossed(world, p, a, b, table):
        return True
    if pair.idle > 0 and begins_on_outlines(world, p, a, b, table):
        return True
    if has_new_neighbours(a, b, SURFACE):
        damping.renew_dashpots(pair)
    return False


@kernel
def is_unsettled(world: World, p: int, a: Record, b: Record, dx: float, dy: float) -> bool:
    """Return True if a new contact begins, or the contacts are of a kind that contact.py handles.

    Has the dashpots rebuilt where the number of pairs on a body has changed.
    """
    pair = world.pairs[p]
    if pair.duplicates != 0 and surface.is_oblique(a, b):
        return True
    if pair.idle > 0 and separation.begins_contact(world, p, a, b, dx, dy):
        return True
    if pair.active > 0 and has_new_neighbours(a, b, SURFACE):
        damping.renew_dashpots(pair)
    return pair.active > 0 and b.faces != ALL

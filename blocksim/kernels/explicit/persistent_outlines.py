"""Contacts that continue in a scene with polygons: the same as persistent_contacts.py and separation.py have.

A contact continues where the search of models/outlines.py would find it again: its corner lies behind the face, no
other face is nearer that it can touch, and no other corner begins. Far from the ends of its face no other can be nearer
(`clear`, world/bodies.py). Near an end that rule itself is asked, for this one corner. The same holds for a corner
without a contact: in front of a face that has no sharp end it is outside, elsewhere the rule decides.
"""

import math
from typing import Any

import numpy as np

from blocksim.kernels.common.arrays import NO_FACE, Record, Records, World
from blocksim.kernels.common.jit import kernel, rare_kernel
from blocksim.kernels.common.shapes import END_RATIO
from blocksim.kernels.explicit import kinematics, outlines
from blocksim.kernels.explicit.models.outlines import DEEPEST, HAND_OVER, can_touch, corner_seen, face_met, has_inner
from blocksim.kernels.explicit.sliver_axes import SLIVER, flat_within, is_sliver, least_ratio, meets_along

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
    """As follow in persistent_contacts.py, with corners and faces of the table."""
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
        way = kinematics.IMPACT_STEPS * abs(found.closing)
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
    room = DEEPEST * touched.radius
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

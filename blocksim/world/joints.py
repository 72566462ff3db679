"""Joints: where free blocks touch others and supports as they are placed, and the forces that act on these blocks.

Also where the contacts of a world with springs are, found again as kernels find them (`places_of`).

Joints are found from the corners of bodies as they are placed. Outlines are convex, so that two bodies touch along one
interval or at one point. The ends of an interval are corners of one of the two that lie on an edge of the other,
whatever the shape: rectangles, outlines, drawn polygons, voussoirs, pieces of ground and walls, and the half-plane.
"""

import math
from collections import defaultdict
from collections.abc import Collection, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.kernels.common import loads
from blocksim.kernels.common.arrays import LOAD_ACTUATOR, LOAD_FIELD, LOAD_TILT, LOAD_WATER, World
from blocksim.kernels.explicit import sides as shapes
from blocksim.scenario import PlacedBody, PlacedSegment, geometry, placement
from blocksim.world.bodies import Layout
from blocksim.world.sag import TOUCHING

MOST_AT_ONCE = 1 << 20  # corners times faces
Floats = NDArray[np.float64]
Point = tuple[float, float]


class ContactJoint(NamedTuple):
    """Where two bodies touch; pieces of ground and walls are numbered after the blocks, the half-plane comes last."""

    one: int
    other: int
    normal: Point  # from one to the other
    points: tuple[Point, ...]  # m: one, or the two ends


class _Side(NamedTuple):
    """What a body shows to others: faces from corner to corner, with the solid on the left."""

    body: int
    faces: Sequence[tuple[Point, Point]]
    corners: Sequence[Point]


class _Hit(NamedTuple):
    """A corner of one body on a face of another."""

    point: Point
    owner: int  # of the face
    normal: Point  # out of the owner
    is_inside: bool  # not at an end of the face


def joints_of(
    placed: Sequence[PlacedBody], segments: Sequence[PlacedSegment], free: Collection[int], near: float, *, level: bool
) -> list[ContactJoint]:
    """Return the joints of free blocks with each other and with supports; faces up to `near` (m) apart touch.

    `level` says whether the half-plane y < 0 is one of the supports.
    """
    sides = []
    for i, body in enumerate(placed):
        corners = [body.ground_point(x, y) for x, y in body.corners]
        sides.append(_Side(i, list(zip(corners, [*corners[1:], corners[0]], strict=True)), corners))
    low, high = geometry.box_of([corner for side in sides if side.body in free for corner in side.corners])
    (left, bottom), (right, top) = (low[0] - near, low[1] - near), (high[0] + near, high[1] + near)
    for one in segments:  # a piece has its solid on the right; its ends count where they are edges
        start, end = (one.x0, one.y0), (one.x1, one.y1)
        edges = [*([start] if one.touches_start else []), *([end] if one.touches_end else [])]
        sides.append(_Side(len(sides), [(end, start)], edges))
    if level:
        sides.append(_Side(len(sides), [((right, 0.0), (left, 0.0))], []))
    within = [
        side
        for side in sides
        for (x0, y0), (x1, y1) in [geometry.box_of([corner for face in side.faces for corner in face])]
        if x0 <= right and x1 >= left and y0 <= top and y1 >= bottom
    ]
    hits = defaultdict(list)
    for pair, hit in _hits(within, free, near):
        hits[pair].append(hit)
    found = (_joint(pair, some, near) for pair, some in hits.items())
    return [joint for joint in found if joint is not None]


def _hits(sides: Sequence[_Side], free: Collection[int], near: float) -> Iterator[tuple[tuple[int, int], _Hit]]:
    """Yield all corners on faces of other bodies, where one of the two is free."""
    corners = np.array([corner for side in sides for corner in side.corners])
    owners = np.array([side.body for side in sides for _ in side.corners])
    faces = np.array([face for side in sides for face in side.faces])
    bodies = np.array([side.body for side in sides for _ in side.faces])
    way = faces[:, 1] - faces[:, 0]
    length = np.hypot(way[:, 0], way[:, 1])
    way /= length[:, None]
    some = max(1, MOST_AT_ONCE // len(faces))
    for first in range(0, len(corners), some):
        own = owners[first : first + some]
        x, y = (corners[first : first + some, None, axis] - faces[None, :, 0, axis] for axis in (0, 1))
        along = way[:, 0] * x + way[:, 1] * y
        away = np.abs(way[:, 0] * y - way[:, 1] * x)
        touches = (away <= near) & (np.abs(along - 0.5 * length) <= 0.5 * length + near) & (own[:, None] != bodies)
        for corner, face in np.argwhere(touches).tolist():
            i, j = int(own[corner]), int(bodies[face])
            if i in free or j in free:
                x0, y0 = corners[first + corner].tolist()
                dx, dy = way[face].tolist()
                is_inside = near < along[corner, face] < length[face] - near
                yield (min(i, j), max(i, j)), _Hit((x0, y0), j, (dy, -dx), bool(is_inside))


def _joint(pair: tuple[int, int], hits: Sequence[_Hit], near: float) -> ContactJoint | None:
    """Return the joint of two bodies; None where only corners touch."""
    first = hits[0].point
    one = max((hit.point for hit in hits), key=lambda point: math.dist(point, first))
    other = max((hit.point for hit in hits), key=lambda point: math.dist(point, one))
    width = math.dist(one, other)
    if width > 2.0 * near:
        across = (other[1] - one[1]) / width, (one[0] - other[0]) / width
        along = [hit.normal[0] * across[0] + hit.normal[1] * across[1] for hit in hits]
        best = max(range(len(hits)), key=lambda k: abs(along[k]))
        way = math.copysign(1.0, along[best]) * (1.0 if hits[best].owner == pair[0] else -1.0)
        return ContactJoint(*pair, (way * across[0], way * across[1]), (one, other))
    inside = next((hit for hit in hits if hit.is_inside), None)
    if inside is None:
        return None
    way = 1.0 if inside.owner == pair[0] else -1.0
    return ContactJoint(*pair, (way * inside.normal[0], way * inside.normal[1]), (inside.point,))


def _carried(joints: Sequence[ContactJoint], free: set[int]) -> tuple[list[ContactJoint], list[int]]:
    """Return the joints of blocks that stand on supports, by way of others or not, and these blocks."""
    held: set[int] = set()
    sides = [side for joint in joints for side in ((joint.one, joint.other), (joint.other, joint.one))]
    while more := {i for i, other in sides if i in free - held and (other not in free or other in held)}:
        held |= more
    return [joint for joint in joints if joint.one in held or joint.other in held], sorted(held)


class Assembly(NamedTuple):
    """Blocks that stand on supports, by way of others or not, and the points of their joints."""

    joints: Sequence[ContactJoint]
    blocks: Sequence[int]  # n
    joint: NDArray[np.int64]  # (p,) that a point is of
    arms: Floats  # (p, 2, 2) m: from the centroids of both bodies to the point
    places: NDArray[np.int64]  # (p, 2): of both bodies among the blocks; n for supports
    normals: Floats  # (p, 2), from the first body to the second
    across: Floats  # (p, 2, 3): opening of a point for displacements (m, m, rad) of both bodies
    along: Floats  # (p, 2, 3): slip, along the normal turned by +90 degrees

    @classmethod
    def of(cls, layout: Layout, free: set[int]) -> "Assembly | None":
        """Return the assembly of the free bodies of a layout, None where none of them stands on anything."""
        placed, is_level = layout.placed, layout.scenario.ground.profile is None
        near = TOUCHING * placement.smallest_width(placed)
        joints, blocks = _carried(joints_of(placed, layout.segments, free, near, level=is_level), free)
        if not joints:
            return None
        place, count = {body: k for k, body in enumerate(blocks)}, len(blocks)
        points = np.array([point for joint in joints for point in joint.points])
        joint = np.repeat(np.arange(len(joints)), [len(one.points) for one in joints])
        normals = np.array([one.normal for one in joints])[joint]
        places = np.array([[place.get(one.one, count), place.get(one.other, count)] for one in joints])[joint]
        centres = np.array([*((placed[i].x, placed[i].y) for i in blocks), (0.0, 0.0)])
        arms = points[:, None] - centres[places]
        across, along = (
            np.stack([sign * _rates(arms[:, side], ways) for side, sign in ((0, -1.0), (1, 1.0))], axis=1)
            for ways in (normals, np.column_stack([-normals[:, 1], normals[:, 0]]))
        )
        return cls(joints, blocks, joint, arms, places, normals, across, along)


def _rates(arms: Floats, ways: Floats) -> Floats:
    """Return what of displacements (m, m, rad) of a body is motion of its points along given ways, (p, 3)."""
    return np.column_stack([ways, arms[:, 0] * ways[:, 1] - arms[:, 1] * ways[:, 0]])


def applied_forces(layout: Layout, blocks: Sequence[int]) -> Floats:
    """Return forces (N) and moments (N m) on blocks, (n, 3): weight, and loads as they are at the start."""
    scenario = layout.scenario
    tilt = scenario.ground.tilt
    forces = np.zeros((len(blocks), 3))
    place = {body: k for k, body in enumerate(blocks)}
    push = np.zeros(2)
    for load in layout.applied.loads:
        value = float(layout.applied.pieces["value"][load.first_piece])
        if load.kind == LOAD_TILT:
            tilt = value
        elif load.kind == LOAD_FIELD:
            push += value * np.array([load.fx, load.fy])
        elif load.body in place and load.kind != LOAD_ACTUATOR:
            body = layout.placed[load.body]
            c, s = math.cos(body.angle), math.sin(body.angle)
            size, share = value, 0.0
            if load.kind == LOAD_WATER:
                size, share = loads.water_on(load, value, loads.Pose(body.x, body.y, c, s, 0.0, 0.0, 0.0))
            x, y = load.x + share * (load.end_x - load.x), load.y + share * (load.end_y - load.y)
            x, y = c * x - s * y, s * x + c * y  # the point turns with the body
            fx, fy = (c * load.fx - s * load.fy, s * load.fx + c * load.fy) if load.turns else (load.fx, load.fy)
            forces[place[load.body]] += size * np.array([fx, fy, x * fy - y * fx + load.torque])
    masses = np.array([layout.placed[i].mass for i in blocks])
    forces[:, :2] += np.outer(masses, push + scenario.gravity.pull(tilt))
    return forces


Indices = NDArray[np.intp]
SIDES_X, SIDES_Y = (-1.0, 1.0, 1.0, -1.0), (-1.0, -1.0, 1.0, 1.0)  # of the corners, counter-clockwise from lower left


def places_of(world: World, contacts: Any, a: Indices, b: Indices) -> list[Any]:
    """Return place (m) and normal of contacts (c,) between bodies a and b: x, y, and the normal from b to a.

    Those of particles keep them.
    """
    if "nx" in (contacts.dtype.names or ()):
        return [contacts[name] for name in ("x", "y", "nx", "ny")]
    bodies = world.bodies.view(np.ndarray)
    is_of_a = contacts["slot"] < shapes.MOST_CORNERS
    owner, touched = np.where(is_of_a, a, b), np.where(is_of_a, b, a)
    number, face = contacts["slot"] % shapes.MOST_CORNERS, contacts["face"]
    cosine, sine = bodies["cos"][touched], bodies["sin"][touched]
    if world.corners is None:
        px = np.choose(number, SIDES_X) * bodies["half_x"][owner]
        py = np.choose(number, SIDES_Y) * bodies["half_y"][owner]
        # faces 0: -y, 1: +x, 2: +y, 3: -x
        nx, ny = np.choose(face, [sine, cosine, -sine, -cosine]), np.choose(face, [-cosine, sine, cosine, -sine])
    else:
        corners = world.corners.view(np.ndarray)
        corner, edge = bodies["first_corner"][owner] + number, bodies["first_corner"][touched] + face
        px, py, nx, ny = corners["x"][corner], corners["y"][corner], corners["nx"][edge], corners["ny"][edge]
        nx, ny = cosine * nx - sine * ny, sine * nx + cosine * ny
    outward = np.where(is_of_a, 1.0, -1.0)  # from b to a, whichever of the two is touched
    cosine, sine = bodies["cos"][owner], bodies["sin"][owner]
    x, y = bodies["x"][owner] + cosine * px - sine * py, bodies["y"][owner] + sine * px + cosine * py
    return [x, y, outward * nx, outward * ny]

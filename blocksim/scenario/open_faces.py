"""Where a pressure acts: on one face of a body, or on all that is open on a side of a structure.

A side of a structure is what a fluid that comes from there reaches along level ways: the parts of faces against which
nothing lies, and from which a line along x meets no other block of the structure. Treads of steps and the undersides of
what overhangs belong to it; the jambs of openings do not, nor does a level crown, which both sides see.
"""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.scenario import geometry, overlap, placement
from blocksim.scenario.models.loads import BACK, FRONT, NORMALS, AnyLoad, Face, OnBody, Pressure
from blocksim.scenario.models.scenario import Scenario
from blocksim.scenario.placement import PlacedBody, Placement
from blocksim.scenario.units import ANGLE, Quantity

NO_FACE = (0.0, 0.0), (0.0, 0.0), (0.0, 1.0)
STRIP = 1e-3
"""Thickness of the strip before a face in which nothing else may lie, in smaller sides of the body."""
AS_NEAR = 1e-6
"""Difference of cosines up to which two faces point into a direction as much as one another."""
Floats = NDArray[np.float64]
Interval = tuple[float, float]
OpenFace = tuple[int, geometry.Edge]
"""A face, or a part of one, on which a pressure acts: the number of its body, and an edge along its axes (m)."""
ALL = -1
"""In place of the number of a body."""


class ActingLoad(NamedTuple):
    """A load as it acts on one body, or on ALL free ones; of a pressure with the edge (m) that it is on."""

    load: AnyLoad
    body: int = ALL
    edge: geometry.Edge = NO_FACE


def acting_loads(scenario: Scenario, placed: Placement) -> Iterator[ActingLoad]:
    """Yield the loads of a scenario in order, those on sides of structures once a face."""
    numbers = {body.name: number for number, body in enumerate(placed.bodies)} if scenario.loads else {}
    for load in scenario.loads:
        if not isinstance(load, OnBody):
            yield ActingLoad(load)
        elif load.body is None:
            yield from (ActingLoad(load, *one) for one in faces_under(scenario, load, placed))
        else:
            number, edge = numbers[load.body], NO_FACE
            if isinstance(load, Pressure):
                edge = face_of(placed.bodies[number].corners, load.face) or NO_FACE
            yield ActingLoad(load, number, edge)


def face_of(corners: Sequence[geometry.Corner], face: Face) -> geometry.Edge | None:
    """Return the ends of a face (m, in the body), the left or else lower one first, and its outward normal.

    `corners` are counter-clockwise. None where it does not exist, or two faces point that way as much as one another.
    """
    edges = [*geometry.edges_of(corners)]
    if isinstance(face, int):
        edges = edges[face - 1 : face]
    else:
        angle = 0.0 if face in NORMALS else Quantity(ANGLE).read(face)
        way = NORMALS.get(face, (math.cos(angle), math.sin(angle)))
        most = max(geometry.dot(way, normal) for _, _, normal in edges)
        edges = [edge for edge in edges if geometry.dot(way, edge[2]) >= most - AS_NEAR]
    if len(edges) != 1:
        return None
    begin, end, normal = edges[0]
    return min(begin, end), max(begin, end), normal


def strip_before(body: PlacedBody, face: Face) -> PlacedBody:
    """Return the strip before a face of a body, a little shorter than the face at both ends."""
    thickness = STRIP * body.least_width
    (x0, y0), (x1, y1), (nx, ny) = face_of(body.corners, face) or NO_FACE
    x, y = 0.5 * (x0 + x1 + nx * thickness), 0.5 * (y0 + y1 + ny * thickness)
    size_x, angle = math.hypot(x1 - x0, y1 - y0) - 2.0 * thickness, body.angle + math.atan2(y1 - y0, x1 - x0)
    x, y = body.ground_point(x, y)
    return body._replace(size_x=size_x, size_y=thickness, x=x, y=y, angle=angle, outline=())


def faces_under(scenario: Scenario, load: Pressure, placed: Placement) -> Sequence[OpenFace]:
    """Return the faces of a structure on which a pressure acts, in the order of its bodies."""
    bodies, origins, sides = placed
    structure = load.structure or 0
    side = structure, side_of(scenario, load, placed)
    if side not in sides:
        own = [number for number, origin in enumerate(origins) if origin == ("structures", structure - 1)]
        sides[side] = tuple(exposed_faces(scenario, bodies, own, side[1])) if own else ()
    faces: tuple[OpenFace, ...] = sides[side]
    return faces


def side_of(scenario: Scenario, load: Pressure, placed: Placement) -> float:
    """Return 1.0 for the right side of a structure, -1.0 for the left one.

    Its back is where most soils are, on the left where there are none: what is pushed over falls to its front.
    """
    if load.face not in (BACK, FRONT):
        return NORMALS[str(load.face)][0]
    of_structure = ("structures", (load.structure or 0) - 1)
    own = [body.x for body, origin in zip(placed.bodies, placed.origins, strict=True) if origin == of_structure]
    middle = 0.5 * (min(own) + max(own)) if own else 0.0
    soils = [float(soil.corners[:, 0].mean()) for soil in placement.soil_tables(scenario)]
    back = 1.0 if sum(math.copysign(1.0, place - middle) for place in soils) > 0.0 else -1.0
    return back if load.face == BACK else -back


class _Shapes:
    """Convex polygons: corners (m, (n, k, 2)), the outward normals of their edges, and boxes about them."""

    def __init__(self, corners: Floats) -> None:
        self.corners = corners
        self.normals, self.are_edges = geometry.outward_normals(corners)
        self.low, self.high = corners.min(axis=1), corners.max(axis=1)
        members, strips, _, self.strip_height = overlap.level_strips(self.low[:, 1], self.high[:, 1])
        order = np.argsort(strips, kind="stable")
        self.strips, self.members = strips[order], members[order]

    def near(self, low: Floats, high: Floats) -> NDArray[np.intp]:
        """Return the polygons whose boxes meet a box (m), some twice; only those at its height are looked at."""
        first, last = math.floor(low[1] / self.strip_height), math.floor(high[1] / self.strip_height)
        begin, end = self.strips.searchsorted((first, last + 1))
        some = self.members[begin:end]
        return np.asarray(some[((self.low[some] <= high) & (self.high[some] >= low)).all(axis=1)])

    def on_line(self, begin: Floats, way: Floats, most: float) -> list[Interval]:
        """Return the parts of a line from a place on, at most as long (m), that lie in polygons."""
        ends = np.stack([begin, begin + most * way])
        near = self.near(ends.min(axis=0), ends.max(axis=0))
        normals, are_edges = self.normals[near], self.are_edges[near]
        outside = np.einsum("nkd,nkd->nk", normals, begin - self.corners[near])  # m, of its begin
        rate = normals @ way
        with np.errstate(divide="ignore", invalid="ignore"):
            at = -outside / rate
        low = np.where(are_edges & (rate < 0.0), at, 0.0).max(axis=1, initial=0.0)
        high = np.where(are_edges & (rate > 0.0), at, most).min(axis=1, initial=most)
        misses = (are_edges & (rate == 0.0) & (outside > 0.0)).any(axis=1) | (low >= high)
        return sorted(zip(low[~misses].tolist(), high[~misses].tolist(), strict=True))


def _corners_of(placed: Sequence[PlacedBody]) -> Floats:
    """Return the corners of bodies where they are (m, (n, k, 2)), the last one repeated."""
    most = max(len(body.corners) for body in placed)
    rows = [[body.ground_point(*corner) for corner in body.corners] for body in placed]
    return np.array([[*row, *row[-1:] * (most - len(row))] for row in rows])


def _ground_below(scenario: Scenario, left: float, right: float, depth: float) -> Floats:
    """Return polygons (m) of this depth of what is solid behind the ground's surface and walls."""
    segments = placement.place_segments(scenario)
    rows = [] if scenario.ground.profile else [[(left, -depth), (right, -depth), (right, 0.0), (left, 0.0)]]
    for one in segments:
        x, y = depth * (one.y1 - one.y0) / one.length, depth * (one.x0 - one.x1) / one.length
        rows.append([(one.x0, one.y0), (one.x0 + x, one.y0 + y), (one.x1 + x, one.y1 + y), (one.x1, one.y1)])
    return np.array(rows).reshape(-1, 4, 2)


def exposed_faces(
    scenario: Scenario, placed: Sequence[PlacedBody], own: Sequence[int], side: float
) -> Iterator[OpenFace]:
    """Yield what is open on a side of the free blocks of a structure, in their order."""
    corners = _corners_of(placed)
    left, right = float(corners[..., 0].min()), float(corners[..., 0].max())
    length, depth = right - left, placement.smallest_width(placed)
    ground = _ground_below(scenario, left - length, right + length, depth)
    most = max(corners.shape[1], ground.shape[1])
    solid = [np.pad(one, ((0, 0), (0, most - one.shape[1]), (0, 0)), mode="edge") for one in (corners, ground)]
    blocks, all_solid = _Shapes(corners[own]), _Shapes(np.concatenate(solid))
    for number in own:
        body = placed[number]
        if body.fixed:
            continue
        strip = STRIP * body.least_width
        for begin, end, normal in geometry.edges_of(body.corners):
            first, last = (np.array(body.ground_point(*place)) for place in (begin, end))
            size = math.dist(begin, end)
            way = (last - first) / size
            outward = np.array([way[1], -way[0]])
            if side * outward[0] < -AS_NEAR:
                continue
            before = first + 0.5 * strip * outward
            for low, high in _gaps(all_solid.on_line(before, way, size), size):
                middle = before + 0.5 * (low + high) * way
                if high - low <= strip or blocks.on_line(middle, np.array([side, 0.0]), length):
                    continue
                if outward[1] > 1.0 - AS_NEAR and not blocks.on_line(middle, np.array([-side, 0.0]), length):
                    continue  # a crown
                ends = [
                    (begin[0] + share * (end[0] - begin[0]), begin[1] + share * (end[1] - begin[1]))
                    for share in (low / size, high / size)
                ]
                yield number, (min(ends), max(ends), normal)


def _gaps(covered: Sequence[Interval], size: float) -> Iterator[Interval]:
    """Yield what intervals leave of the one from 0 to a size."""
    reached = 0.0
    for low, high in sorted(covered):
        if low > reached:
            yield reached, low
        reached = max(reached, high)
    if reached < size:
        yield reached, size

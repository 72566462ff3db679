"""From a declared scenario to placed blocks and straight pieces of boundary."""

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.scenario import geometry, overrides
from blocksim.scenario.models.scenario import Scenario
from blocksim.scenario.models.soil import SoilTable
from blocksim.scenario.structures.base import PolygonStructure, Pose, Structure

LENGTH_WITHOUT_BLOCKS = 0.1  # m: can be seen beside soil


GUIDED = 1e15
"""Of the inertia of a guided block: in an hour moments turn it by less than round-off of its corners."""


class PlacedBody(NamedTuple):
    """One block at the start: centroid x, y, turned by angle, all in SI (m, kg/m³, rad, m/s, rad/s).

    A rectangle is given by its sizes along its own axes. Any other block has an outline: its corners counter-clockwise
    along these axes about the centroid; its sizes are then those of the bounding box, which need not be centred.
    """

    name: str
    block: str
    material: str
    size_x: float
    size_y: float
    depth: float
    density: float
    x: float
    y: float
    angle: float
    vx: float
    vy: float
    spin: float
    fixed: bool  # held at the start: forces do not move it
    driven: bool = False  # by a motion of its own; fixed as well
    freed: bool = False  # by an event
    outline: geometry.Corners = ()  # empty for a rectangle
    guided: bool = False  # it does not turn

    @property
    def is_polygon(self) -> bool:
        """Whether the block has an outline that is no rectangle with sides along its axes."""
        return bool(self.outline) and not geometry.is_upright(self.outline)

    @property
    def mass(self) -> float:
        """Mass in kg."""
        if self.is_polygon:
            return self.density * geometry.section_of(self.outline)[0] * self.depth
        return self.density * self.size_x * self.size_y * self.depth

    @property
    def inertia(self) -> float:
        """Moment of inertia about the centroid in kg m²; of a guided block so large that it does not turn."""
        if self.is_polygon:
            own = self.density * geometry.section_of(self.outline)[1] * self.depth
        else:
            own = self.mass * (self.size_x * self.size_x + self.size_y * self.size_y) / 12.0
        return GUIDED * own if self.guided else own

    @property
    def corners(self) -> geometry.Corners:
        """Corners in m along the body's own axes about its centroid, counter-clockwise; of a rectangle too."""
        x, y = 0.5 * self.size_x, 0.5 * self.size_y
        return self.outline or ((-x, -y), (x, -y), (x, y), (-x, y))

    @property
    def least_width(self) -> float:
        """Smaller side in m; of an outline the least distance of two parallel lines with the block between them."""
        return geometry.least_width(self.outline) if self.is_polygon else min(self.size_x, self.size_y)

    @property
    def radius(self) -> float:
        """Distance of the farthest corner from the centroid in m."""
        return max(math.hypot(x, y) for x, y in self.corners)

    def ground_point(self, x: float, y: float) -> geometry.Corner:
        """Return where a point is (m) that is given in the body's own axes (m)."""
        cosine, sine = math.cos(self.angle), math.sin(self.angle)
        return self.x + cosine * x - sine * y, self.y + sine * x + cosine * y

    def own_point(self, x: float, y: float) -> geometry.Corner:
        """Return a point (m) in the body's own axes."""
        cosine, sine = math.cos(self.angle), math.sin(self.angle)
        return cosine * (x - self.x) + sine * (y - self.y), cosine * (y - self.y) - sine * (x - self.x)


def smallest_width(bodies: Iterable[PlacedBody]) -> float:
    """Return the least width (m) of all bodies; infinite where there are none."""
    return min((body.least_width for body in bodies), default=math.inf)


def reference_length(of_blocks: float) -> float:
    """Return a length (m) that blocks give, where there are none LENGTH_WITHOUT_BLOCKS.

    What goes by it moves nothing then, as soil has lengths of its own: lists of pairs that stay empty, how thick ground
    is behind the faces that soil touches, and how far it is drawn.
    """
    return of_blocks if math.isfinite(of_blocks) else LENGTH_WITHOUT_BLOCKS


GEOMETRY = frozenset({"materials", "blocks", "structures", "bodies", "events", "ground", "walls", "systems"})
"""Tables of a scenario that decide what is where at the start, and what is open there."""


class Placement(NamedTuple):
    """All bodies of a scenario, and of each the structure or single body that it comes from."""

    bodies: tuple[PlacedBody, ...]
    origins: tuple[overrides.KeyPath, ...]
    sides: dict[Any, Any]  # of structures, what is open there as soon as it is known: open_faces.py


def outlines_of(placed: Sequence[PlacedBody]) -> NDArray[np.float64] | None:
    """Return the corners (m, (b, k, 2)) of blocks, the last one repeated; None where all are rectangles."""
    if not any(body.outline for body in placed):
        return None
    most = max(len(body.corners) for body in placed)
    full = [(*body.corners, *body.corners[-1:] * (most - len(body.corners))) for body in placed]
    return np.array(full, dtype=np.float64)


def place(scenario: Scenario) -> Placement:
    """Place all bodies: structures first, then single bodies, each in the order of the file.

    Raises UnfitError where a structure does not suit its block; loading a scenario has checked that.
    """
    freed = {name for event in scenario.events for name in event.free}
    bodies: list[PlacedBody] = []
    origins: list[overrides.KeyPath] = []
    for number, structure in enumerate(scenario.structures):
        built = _built(scenario, structure, len(bodies) + 1)
        bodies += [body._replace(freed=True) if body.fixed and body.name in freed else body for body in built]
        origins += [("structures", number)] * len(built)
    for number, spec in enumerate(scenario.bodies):
        pose = Pose(spec.x, spec.y, spec.angle, *spec.velocity, spec.spin)
        name = spec.name or str(len(bodies) + 1)
        is_driven = spec.motion is not None
        body = place_blocks(scenario, spec.block, [(name, pose)], fixed=spec.fixed or is_driven)[0]
        if is_driven or freed or spec.guide != "none":
            body = body._replace(driven=is_driven, freed=name in freed, guided=spec.guide != "none")
        bodies.append(body)
        origins.append(("bodies", number))
    return Placement(tuple(bodies), tuple(origins), {})


def _built(scenario: Scenario, structure: Structure, first: int) -> list[PlacedBody]:
    """Return the bodies of a structure, called by their numbers from a first one on."""
    poses = structure.start(scenario.blocks[structure.block])
    if isinstance(structure, PolygonStructure):
        built = []
        for number, (cell, pose) in enumerate(zip(structure.cells, poses, strict=True), start=first):
            outline = geometry.centre_outline(cell.corners)
            key = cell.block or structure.block
            block = scenario.blocks[key]
            (left, bottom), (right, top) = geometry.box_of(outline)
            density = scenario.materials[block.material].density
            what = cell.name or str(number), key, block.material, right - left, top - bottom, block.depth, density
            built.append(PlacedBody(*what, *pose[:-1], cell.fixed, outline=outline))
        return built
    x, y = geometry.middle_of(scenario.blocks[structure.block].polygon or ((0.0, 0.0),))
    if x or y:  # structures place the middle of the bounding box, bodies are placed by their centroid
        poses = [_moved(pose, -x, -y) for pose in poses]
    named = ((str(index), pose) for index, pose in enumerate(poses, start=first))
    return place_blocks(scenario, structure.block, named, fixed=False)


def _moved(pose: Pose, x: float, y: float) -> Pose:
    """Return the pose of a point x, y along the axes of a body."""
    c, s = math.cos(pose.angle), math.sin(pose.angle)
    dx, dy = c * x - s * y, s * x + c * y
    return pose._replace(x=pose.x + dx, y=pose.y + dy, vx=pose.vx - pose.spin * dy, vy=pose.vy + pose.spin * dx)


def place_blocks(scenario: Scenario, key: str, named: Iterable[tuple[str, Pose]], *, fixed: bool) -> list[PlacedBody]:
    """Return bodies of one kind of block by their names and poses; looking up its sides every time would be slow."""
    block = scenario.blocks[key]
    material, size_x, outline = block.material, block.size_x, block.polygon
    what = block.size_y, block.depth, scenario.materials[material].density
    return [
        PlacedBody(name, key, material, pose.width or size_x, *what, *pose[:-1], fixed, outline=outline)
        for name, pose in named
    ]


ENDLESS = 1e5  # m; how far the level ground beyond the ends of a profile is drawn
STRAIGHT = 1e-12  # sine of the turn below which two pieces are in one line
TOLERANCE = 1e-9  # m; things at this distance touch, and ends at this distance are one

Floats = NDArray[np.float64]


class PlacedSegment(NamedTuple):
    """One piece of boundary in m, solid on the right hand from start to end.

    `material` is None where it is as the ground. `extends_*`: a neighbour or the ground covers this end, so that
    the piece may reach a little beyond it and no crack opens. `touches_*`: this end is an edge that blocks can land
    on; where two pieces share an edge, it belongs to the first. `sharp_*`: that edge has less than a right angle of
    solid behind it, or is the end of a wall.
    """

    x0: float
    y0: float
    x1: float
    y1: float
    material: str | None
    extends_start: bool
    extends_end: bool
    touches_start: bool
    touches_end: bool
    sharp_start: bool = False
    sharp_end: bool = False

    @property
    def length(self) -> float:
        """Length in m."""
        return math.hypot(self.x1 - self.x0, self.y1 - self.y0)


def soil_tables(scenario: Scenario) -> list[SoilTable]:
    """Return the soils of a scenario."""
    return [table for table in scenario.systems.get("soils", ()) if isinstance(table, SoilTable)]


def place_segments(scenario: Scenario) -> tuple[PlacedSegment, ...]:
    """Return the pieces of the profile towards +x, the level ends included, then the walls in the order of the file.

    Without a profile there are none for the ground: it is the half-plane y < 0.
    """
    return (*profile_segments(scenario), *wall_segments(scenario))


def surface_heights(scenario: Scenario, x: Floats) -> Floats:
    """Return the heights (m) of the ground at many places x (n,)."""
    points = scenario.ground.profile
    if points is None:
        return np.zeros(x.shape)
    xs, ys = np.array(points).T
    heights = np.interp(x, xs, ys)
    places, begins = np.unique(xs, return_index=True)
    tops = np.maximum.reduceat(ys, begins)
    nearest = np.minimum(np.searchsorted(places, x), places.size - 1)
    return np.where(places[nearest] == x, tops[nearest], heights)


def profile_segments(scenario: Scenario) -> tuple[PlacedSegment, ...]:
    """Return the pieces of the ground's profile; points within a straight line are left out."""
    points = scenario.ground.profile
    if points is None:
        return ()
    (x_first, y_first), (x_last, y_last) = points[0], points[-1]
    line = [(x_first - ENDLESS, y_first)]
    for middle, other in pairwise([*points, (x_last + ENDLESS, y_last)]):
        if abs(_turn(line[-1], middle, other)) > STRAIGHT:
            line.append(middle)
    line.append((x_last + ENDLESS, y_last))
    joints = list(zip(line, line[1:], line[2:], strict=False))
    turns = [0.0, *(_turn(*joint) for joint in joints), 0.0]
    sharps = [*(_is_sharp(*joint) for joint in joints), False]
    return tuple(
        PlacedSegment(
            *one, *other, None, before > 0.0, after > 0.0, touches_start=False, touches_end=after < 0.0, sharp_end=sharp
        )
        for (one, other), (before, after), sharp in zip(pairwise(line), pairwise(turns), sharps, strict=True)
    )


def _turn(before: geometry.Corner, joint: geometry.Corner, after: geometry.Corner) -> float:
    """Return the sine of the turn at a joint, positive to the left; -1 where it goes back."""
    x0, y0 = joint[0] - before[0], joint[1] - before[1]
    x1, y1 = after[0] - joint[0], after[1] - joint[1]
    sine = (x0 * y1 - y0 * x1) / (math.hypot(x0, y0) * math.hypot(x1, y1))
    return -1.0 if abs(sine) <= STRAIGHT and x0 * x1 + y0 * y1 < 0.0 else sine


def _is_sharp(before: geometry.Corner, joint: geometry.Corner, after: geometry.Corner) -> bool:
    """Return True at an edge with less than a right angle of solid behind it."""
    back = (joint[0] - before[0]) * (after[0] - joint[0]) + (joint[1] - before[1]) * (after[1] - joint[1]) < 0.0
    return back and _turn(before, joint, after) < 0.0


def wall_segments(scenario: Scenario) -> tuple[PlacedSegment, ...]:
    """Return one piece for every wall."""
    walls = scenario.walls
    starts, ends = (np.array([getattr(wall, end) for wall in walls]).reshape(-1, 2) for end in ("start", "end"))
    pieces = []
    for number, wall in enumerate(walls):
        others = np.arange(len(walls)) != number
        before, after = _neighbour(ends, wall.start, number), _neighbour(starts, wall.end, number)
        into = None if before is None else _turn(walls[before].start, walls[before].end, wall.end)
        onwards = None if after is None else _turn(wall.start, wall.end, walls[after].end)
        # ends without a neighbour: covered by the ground or the middle of another wall, or not
        is_start_free, is_end_free = (
            end[1] > float(surface_heights(scenario, np.array(end[:1]))[0]) + TOLERANCE
            and not _touches(end, starts[others], ends[others])
            for end in (wall.start, wall.end)
        )
        piece = PlacedSegment(
            *wall.start,
            *wall.end,
            material=wall.material,
            extends_start=not is_start_free if into is None else into > STRAIGHT,
            extends_end=not is_end_free if onwards is None else onwards > STRAIGHT,
            touches_start=into is None and is_start_free,
            touches_end=is_end_free if onwards is None else onwards < -STRAIGHT,
            sharp_start=into is None and is_start_free,
            sharp_end=is_end_free if after is None else _is_sharp(wall.start, wall.end, walls[after].end),
        )
        pieces.append(piece)
    return tuple(pieces)


def _neighbour(points: Floats, end: geometry.Corner, number: int) -> int | None:
    """Return the first other wall with an end at the same point; ends are (n, 2)."""
    near = np.flatnonzero(np.hypot(points[:, 0] - end[0], points[:, 1] - end[1]) <= TOLERANCE)
    return next((int(other) for other in near if other != number), None)


def _touches(point: geometry.Corner, starts: Floats, ends: Floats) -> bool:
    """Return True if a point is on any of these walls."""
    along, beyond = ends - starts, np.array(point) - starts
    share = np.clip(np.sum(beyond * along, axis=1) / np.sum(along * along, axis=1), 0.0, 1.0)
    distance = beyond - share[:, np.newaxis] * along
    return bool(np.any(np.hypot(distance[:, 0], distance[:, 1]) <= TOLERANCE))

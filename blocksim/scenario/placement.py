"""From declared structures and bodies to placed blocks."""

import math
import weakref
from collections.abc import Iterable
from typing import NamedTuple, Protocol

from blocksim.scenario.keys import KeyPath
from blocksim.scenario.models.scenario import Scenario
from blocksim.scenario.outlines import Corners, box_of, is_upright, least_width, middle_of, section_of
from blocksim.scenario.structures import Pose, Shaped, Structure
from blocksim.scenario.structures.shaped import Cell

LENGTH_WITHOUT_BLOCKS = 0.1  # m: can be seen beside soil


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
    outline: Corners = ()  # empty for a rectangle

    @property
    def is_polygon(self) -> bool:
        """Whether the block has an outline that is no rectangle with sides along its axes."""
        return bool(self.outline) and not is_upright(self.outline)

    @property
    def mass(self) -> float:
        """Mass in kg."""
        if self.is_polygon:
            return self.density * section_of(self.outline)[0] * self.depth
        return self.density * self.size_x * self.size_y * self.depth

    @property
    def inertia(self) -> float:
        """Moment of inertia about the centroid in kg m²."""
        if self.is_polygon:
            return self.density * section_of(self.outline)[1] * self.depth
        return self.mass * (self.size_x * self.size_x + self.size_y * self.size_y) / 12.0

    @property
    def corners(self) -> Corners:
        """Corners in m along the body's own axes about its centroid, counter-clockwise; of a rectangle too."""
        if self.outline:
            return self.outline
        x, y = 0.5 * self.size_x, 0.5 * self.size_y
        return (-x, -y), (x, -y), (x, y), (-x, y)

    @property
    def least_width(self) -> float:
        """Smaller side in m; of an outline the least distance of two parallel lines with the block between them."""
        return least_width(self.outline) if self.is_polygon else min(self.size_x, self.size_y)

    @property
    def radius(self) -> float:
        """Distance of the farthest corner from the centroid in m."""
        if self.outline:
            return max(math.hypot(x, y) for x, y in self.outline)
        return 0.5 * math.hypot(self.size_x, self.size_y)


def smallest_width(bodies: Iterable[PlacedBody]) -> float:
    """Return the least width (m) of all bodies; infinite where there are none."""
    return min((body.least_width for body in bodies), default=math.inf)


def length_beside(of_blocks: float) -> float:
    """Return a length (m) that blocks give, where there are none LENGTH_WITHOUT_BLOCKS.

    What goes by it moves nothing then, as soil has lengths of its own: lists of pairs that stay empty, how thick ground
    is behind the faces that soil touches, and how far it is drawn.
    """
    return of_blocks if math.isfinite(of_blocks) else LENGTH_WITHOUT_BLOCKS


class _Placement(NamedTuple):
    """All bodies of a scenario and their origin."""

    scenario: weakref.ref[Scenario]
    bodies: tuple[PlacedBody, ...]
    origins: tuple[tuple[KeyPath, int], ...]  # structure or body, and how many bodies it gives


_latest: list[_Placement] = []  # at most one, for as long as its scenario lives: a million bodies take seconds to place


def place_bodies(scenario: Scenario) -> tuple[PlacedBody, ...]:
    """Place all bodies: structures first, then single bodies, each in the order of the file.

    The same scenario object gives the same bodies again. Raises UnfitError where a structure does
    not suit its block; loading a scenario has checked that.
    """
    return _placement(scenario).bodies


def has_outlines(scenario: Scenario) -> bool:
    """Return True if any block is no rectangle, without placing them."""
    shaped = any(isinstance(structure, Shaped) for structure in scenario.structures)
    return shaped or any(block.polygon for block in scenario.blocks.values())


def origins_of(scenario: Scenario) -> list[KeyPath]:
    """Return for every placed body the path of the structure or body that it comes from."""
    return [path for path, count in _placement(scenario).origins for _ in range(count)]


def _placement(scenario: Scenario) -> _Placement:
    known = next(iter(_latest), None)
    if known is None or known.scenario() is not scenario:
        known = _placed(scenario)
        _latest[:] = [known]
    return known


def _placed(scenario: Scenario) -> _Placement:
    freed = {name for event in scenario.events for name in event.free}
    bodies: list[PlacedBody] = []
    origins: list[tuple[KeyPath, int]] = []
    for number, structure in enumerate(scenario.structures):
        built = _built(scenario, structure, len(bodies) + 1)
        bodies += [body._replace(freed=True) if body.fixed and body.name in freed else body for body in built]
        origins.append((("structures", number), structure.size))
    for number, spec in enumerate(scenario.bodies):
        pose = Pose(spec.x, spec.y, spec.angle, *spec.velocity, spec.spin)
        name = spec.name or str(len(bodies) + 1)
        is_driven = spec.motion is not None
        body = _placer(scenario, spec.block)(name, pose, fixed=spec.fixed or is_driven)
        bodies.append(body._replace(driven=is_driven, freed=name in freed) if is_driven or freed else body)
        origins.append((("bodies", number), 1))
    return _Placement(weakref.ref(scenario, _forget), tuple(bodies), tuple(origins))


def _forget(dead: weakref.ref[Scenario]) -> None:
    _latest[:] = [one for one in _latest if one.scenario is not dead]


def _built(scenario: Scenario, structure: Structure, first: int) -> list[PlacedBody]:
    """Return the bodies of a structure, called by their numbers from a first one on."""
    poses = structure.start(scenario.blocks[structure.block])
    if isinstance(structure, Shaped):
        return [
            _shaped(scenario, structure.block, str(number), *one)
            for number, one in enumerate(zip(structure.cells, structure.shapes, poses, strict=True), start=first)
        ]
    x, y = middle_of(scenario.blocks[structure.block].polygon or ((0.0, 0.0),))
    if x or y:  # structures place the middle of the bounding box, bodies are placed by their centroid
        poses = [_moved(pose, -x, -y) for pose in poses]
    place = _placer(scenario, structure.block)
    return [place(str(index), pose, fixed=False) for index, pose in enumerate(poses, start=first)]


def _shaped(scenario: Scenario, usual: str, number: str, cell: Cell, outline: Corners, pose: Pose) -> PlacedBody:
    key = cell.block or usual
    block = scenario.blocks[key]
    (left, bottom), (right, top) = box_of(outline)
    sizes = right - left, top - bottom, block.depth
    density = scenario.materials[block.material].density
    name = cell.name or number
    return PlacedBody(name, key, block.material, *sizes, density, *pose, cell.fixed, outline=outline)


def _moved(pose: Pose, x: float, y: float) -> Pose:
    """Return the pose of a point x, y along the axes of a body."""
    c, s = math.cos(pose.angle), math.sin(pose.angle)
    dx, dy = c * x - s * y, s * x + c * y
    return pose._replace(x=pose.x + dx, y=pose.y + dy, vx=pose.vx - pose.spin * dy, vy=pose.vy + pose.spin * dx)


class _Place(Protocol):
    def __call__(self, name: str, pose: Pose, *, fixed: bool) -> PlacedBody: ...


def _placer(scenario: Scenario, key: str) -> _Place:
    """Return a function that places one kind of block; looking up its sides every time would be slow."""
    block = scenario.blocks[key]
    material = block.material
    size_x, size_y, depth, outline = block.size_x, block.size_y, block.depth, block.polygon
    density = scenario.materials[material].density

    def place(name: str, pose: Pose, *, fixed: bool) -> PlacedBody:
        return PlacedBody(name, key, material, size_x, size_y, depth, density, *pose, fixed, outline=outline)

    return place

"""From declared structures and bodies to placed rectangles."""

import weakref
from typing import NamedTuple, Protocol

from blocksim.scenario.keys import KeyPath
from blocksim.scenario.models.scenario import Scenario
from blocksim.scenario.structures import Pose


class PlacedBody(NamedTuple):
    """One rectangle at the start: centre x, y, turned by angle, all in SI (m, kg/m³, rad, m/s, rad/s)."""

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

    @property
    def mass(self) -> float:
        """Mass in kg."""
        return self.density * self.size_x * self.size_y * self.depth

    @property
    def inertia(self) -> float:
        """Moment of inertia about the centre in kg m²."""
        return self.mass * (self.size_x * self.size_x + self.size_y * self.size_y) / 12.0


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


def origins_of(scenario: Scenario) -> list[KeyPath]:
    """Return for every placed body the path of the structure or body that it comes from."""
    return [path for path, count in _placement(scenario).origins for _ in range(count)]


def _placement(scenario: Scenario) -> _Placement:
    known = next(iter(_latest), None)
    if known is None or known.scenario() is not scenario:
        known = _placed(scenario)
        _latest[:] = [known]
    return known


def _forget(dead: weakref.ref[Scenario]) -> None:
    _latest[:] = [one for one in _latest if one.scenario is not dead]


def _placed(scenario: Scenario) -> _Placement:
    freed = {name for event in scenario.events for name in event.free}
    bodies: list[PlacedBody] = []
    origins: list[tuple[KeyPath, int]] = []
    for number, structure in enumerate(scenario.structures):
        poses = structure.start(scenario.blocks[structure.block])
        place = _placer(scenario, structure.block)
        bodies += [place(str(index), pose, fixed=False) for index, pose in enumerate(poses, start=len(bodies) + 1)]
        origins.append((("structures", number), len(poses)))
    for number, spec in enumerate(scenario.bodies):
        pose = Pose(spec.x, spec.y, spec.angle, *spec.velocity, spec.spin)
        name = spec.name or str(len(bodies) + 1)
        is_driven = spec.motion is not None
        body = _placer(scenario, spec.block)(name, pose, fixed=spec.fixed or is_driven)
        bodies.append(body._replace(driven=is_driven, freed=name in freed) if is_driven or freed else body)
        origins.append((("bodies", number), 1))
    return _Placement(weakref.ref(scenario, _forget), tuple(bodies), tuple(origins))


class _Place(Protocol):
    def __call__(self, name: str, pose: Pose, *, fixed: bool) -> PlacedBody: ...


def _placer(scenario: Scenario, key: str) -> _Place:
    """Return a function that places one kind of block; looking up its sides every time would be slow."""
    block = scenario.blocks[key]
    material = block.material
    size_x, size_y, depth = block.size_x, block.size_y, block.depth
    density = scenario.materials[material].density

    def place(name: str, pose: Pose, *, fixed: bool) -> PlacedBody:
        return PlacedBody(name, key, material, size_x, size_y, depth, density, *pose, fixed)

    return place

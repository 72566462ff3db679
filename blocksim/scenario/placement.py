"""From declared structures and bodies to placed rectangles."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

from blocksim.scenario.keys import KeyPath
from blocksim.scenario.models.scenario import Scenario
from blocksim.scenario.structures import Pose


@dataclass(frozen=True, slots=True)
class PlacedBody:
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
    fixed: bool

    @property
    def mass(self) -> float:
        """Mass in kg."""
        return self.density * self.size_x * self.size_y * self.depth

    @property
    def inertia(self) -> float:
        """Moment of inertia about the centre in kg m²."""
        return self.mass * (self.size_x * self.size_x + self.size_y * self.size_y) / 12.0


def place_bodies(scenario: Scenario) -> tuple[PlacedBody, ...]:
    """Place all bodies: structures first, then single bodies, each in the order of the file.

    Raises UnfitError where a structure does not go with its block; loading a scenario has checked that.
    """
    return tuple(body for _, body in placed_with_origin(scenario))


def placed_with_origin(scenario: Scenario) -> Iterator[tuple[KeyPath, PlacedBody]]:
    """Yield every placed body with the path of the structure or body that it comes from."""
    index = 0
    for number, structure in enumerate(scenario.structures):
        place = _placer(scenario, structure.block)
        for pose in structure.start(scenario.blocks[structure.block]):
            index += 1
            yield ("structures", number), place(str(index), pose, fixed=False)
    for number, spec in enumerate(scenario.bodies):
        index += 1
        pose = Pose(spec.x, spec.y, spec.angle, *spec.velocity, spec.spin)
        yield ("bodies", number), _placer(scenario, spec.block)(spec.name or str(index), pose, fixed=spec.fixed)


class _Place(Protocol):
    def __call__(self, name: str, pose: Pose, *, fixed: bool) -> PlacedBody: ...


def _placer(scenario: Scenario, key: str) -> _Place:
    """Return what places one kind of block; looking its sides up for every one of them would take most of the time."""
    block = scenario.blocks[key]
    material = block.material
    size_x, size_y, depth = block.size_x, block.size_y, block.depth
    density = scenario.materials[material].density

    def place(name: str, pose: Pose, *, fixed: bool) -> PlacedBody:
        return PlacedBody(name, key, material, size_x, size_y, depth, density, *pose, fixed=fixed)

    return place

"""From declared structures and bodies to placed rectangles."""

from collections.abc import Iterator
from dataclasses import dataclass

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
        for pose in structure.place(scenario.blocks[structure.block]):
            index += 1
            yield ("structures", number), _placed(scenario, structure.block, str(index), pose)
    for number, spec in enumerate(scenario.bodies):
        index += 1
        pose = Pose(spec.x, spec.y, spec.angle)
        motion = (*spec.velocity, spec.spin)
        name = spec.name or str(index)
        yield ("bodies", number), _placed(scenario, spec.block, name, pose, motion, fixed=spec.fixed)


def _placed(
    scenario: Scenario,
    key: str,
    name: str,
    pose: Pose,
    motion: tuple[float, float, float] = (0.0, 0.0, 0.0),
    *,
    fixed: bool = False,
) -> PlacedBody:
    block = scenario.blocks[key]
    return PlacedBody(
        name=name,
        block=key,
        material=block.material,
        size_x=block.size_x,
        size_y=block.size_y,
        depth=block.depth,
        density=scenario.materials[block.material].density,
        x=pose.x,
        y=pose.y,
        angle=pose.angle,
        vx=motion[0],
        vy=motion[1],
        spin=motion[2],
        fixed=fixed,
    )

"""Scenes of a few blocks, started and stepped: what the tests of kernels, world and verification share.

Blocks are the paper's: 32 x 25 x 50 mm, the height upright, unless a test says otherwise. SI units.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import pytest

from blocksim.kernels.advance import advance
from blocksim.kernels.energy import measure
from blocksim.scenario import Scenario, load_scenario, scenario_from_mapping
from blocksim.world.build import build_world

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from blocksim.kernels.arrays import World

SCENARIOS = Path(__file__).parents[1] / "scenarios"
WIDTH, HEIGHT, DEPTH = 0.032, 0.025, 0.05
STORED_OR_LOST = slice(0, 7)  # of a row of the ledger: all energies


@dataclass(frozen=True)
class PaperBlock:
    """The paper's block in the literal reading, and what follows from its material."""

    width: float = WIDTH  # m
    height: float = HEIGHT  # m
    depth: float = DEPTH  # m
    density: float = 26.7e3 / 9.81  # kg/m3
    modulus: float = 69e9 / (2.0 * (1.0 - 0.3**2))  # Pa, E* of two equal materials

    @property
    def mass(self) -> float:
        """Mass (kg)."""
        return self.density * self.width * self.height * self.depth

    @property
    def inertia(self) -> float:
        """Moment of inertia (kg m2) about the centre."""
        return self.mass * (self.width**2 + self.height**2) / 12.0

    @property
    def point_stiffness(self) -> float:
        """Stiffness (N/m) of one contact point; a face contact has two."""
        return self.modulus * self.depth


class Simulation:
    """A world under way."""

    def __init__(self, world: World) -> None:
        """Find the first contacts and remember the energy."""
        self.world = world
        self.status = advance(world, 0)
        self.start_energy = self.energy()

    @property
    def bodies(self) -> Any:
        """All bodies without the ground: a record array, as in blocksim.kernels.arrays."""
        return self.world.bodies[:-1]

    @property
    def slots(self) -> Any:
        """Contact slots of the pairs in the list: a record array, 8 a pair."""
        return self.world.slots[: self.world.clock[0].pair_count]

    @property
    def step(self) -> float:
        """Length of a step (s)."""
        return float(self.world.controls[0].step)

    @property
    def steps(self) -> int:
        """Steps done."""
        return int(self.world.clock[0].steps)

    @property
    def time(self) -> float:
        """Time (s) since the start."""
        return self.steps * self.step

    def to_step(self, last_step: int) -> Simulation:
        """Go on to a step number."""
        self.status = advance(self.world, last_step)
        return self

    def to_time(self, time: float) -> Simulation:
        """Go on to the step nearest to a time (s)."""
        return self.to_step(round(time / self.step))

    def measured(self) -> np.ndarray:
        """Return kinetic, potential, stored normal, stored shear, dashpot, friction, broken (J), contacts, overlap."""
        row = np.zeros(9)
        measure(self.world, row)
        return row

    @property
    def kinetic(self) -> float:
        """Kinetic energy (J)."""
        return float(self.measured()[0])

    @property
    def contacts(self) -> int:
        """Number of contact points."""
        return int(self.measured()[7])

    def energy(self) -> float:
        """Return everything the scene holds and has lost (J): constant, if the ledger is complete."""
        return float(self.measured()[STORED_OR_LOST].sum())

    def residual(self) -> float:
        """Return what the ledger lacks, as a share of the energy in play."""
        ledger = self.world.ledger[0]
        gravity = float(np.hypot(self.world.controls[0].gravity_x, self.world.controls[0].gravity_y))
        least = float(self.bodies.mass.sum()) * gravity * 1e-3
        in_play = max(float(ledger.largest_kinetic + ledger.travel_work), least)
        return abs(self.energy() - self.start_energy) / in_play

    def state(self) -> np.ndarray:
        """Return x, y, angle, vx, vy, spin of all bodies, one row a body."""
        names = ("x", "y", "angle", "vx", "vy", "spin")
        return np.array([self.bodies[name] for name in names]).T.copy()


class Start(Protocol):
    """Start a scene of single bodies; the signature of the fixture `start`."""

    def __call__(
        self,
        bodies: Sequence[Mapping[str, object]],
        *,
        restitution: float = 0.2,
        friction: float = 0.31,
        ground_friction: float = 0.38,
        gravity: float = 9.81,
        tilt: float = 0.0,
        contact: Mapping[str, object] | None = None,
        time: Mapping[str, object] | None = None,
        change: Callable[[World], None] | None = None,
    ) -> Simulation:
        """`change` edits the world before it starts."""


def block_type(body: Mapping[str, object]) -> dict[str, object]:
    """Return the block table of one body."""
    sizes = {"width": WIDTH, "height": HEIGHT, "length": DEPTH}
    return {key: body.get(key, size) for key, size in sizes.items()} | {"material": "aluminium"}


def scenario_of(bodies: Sequence[Mapping[str, object]], **tables: Any) -> Scenario:
    """Build the scenario; every body has a block type of its own."""
    return scenario_from_mapping(
        {
            "schema": 1,
            "name": "test",
            "materials": {"aluminium": {"unit_weight": 26.7e3, "young_modulus": 69e9, "poisson_ratio": 0.3}},
            "blocks": {f"block{i}": block_type(body) for i, body in enumerate(bodies)},
            "bodies": [
                {"x": 0.0, "block": f"block{i}"}
                | {
                    key: _with_unit(key, value)
                    for key, value in body.items()
                    if key not in {"width", "height", "length"}
                }
                for i, body in enumerate(bodies)
            ],
            **tables,
        }
    )


def _with_unit(key: str, value: object) -> object:
    return f"{float(str(value))!r} rad" if key == "angle" and value else value


@pytest.fixture(scope="session")
def start() -> Start:
    """Start a scene of single bodies."""

    def start_scene(
        bodies: Sequence[Mapping[str, object]],
        *,
        restitution: float = 0.2,
        friction: float = 0.31,
        ground_friction: float = 0.38,
        gravity: float = 9.81,
        tilt: float = 0.0,
        contact: Mapping[str, object] | None = None,
        time: Mapping[str, object] | None = None,
        change: Callable[[World], None] | None = None,
    ) -> Simulation:
        scenario = scenario_of(
            bodies,
            gravity=gravity,
            ground={"tilt": _with_unit("angle", tilt)},
            friction={"block_block": friction, "block_ground": ground_friction},
            contact={"restitution": restitution, **(contact or {})},
            time={"stop_at_rest": False, **(time or {})},
        )
        world = build_world(scenario)
        if change is not None:
            change(world)
        return Simulation(world)

    return start_scene


@pytest.fixture(scope="session")
def start_shipped() -> Callable[..., Simulation]:
    """Start a scenario file that ships, by its name, with other values for some keys."""

    def start_file(name: str, **values: object) -> Simulation:
        overrides = {key.replace("__", "."): value for key, value in values.items()}
        return Simulation(build_world(load_scenario(SCENARIOS / f"{name}.toml", overrides)))

    return start_file


@pytest.fixture(scope="session")
def paper_block() -> PaperBlock:
    """Return the paper's block."""
    return PaperBlock()


@pytest.fixture(scope="session", params=sorted(SCENARIOS.glob("*.toml")), ids=lambda path: path.stem)
def shipped(request: pytest.FixtureRequest) -> Path:
    """Return every scenario file that ships, one a test."""
    path: Path = request.param
    return path

"""Scenes of a few blocks, started, stepped and thrown, for verification cases and tests. SI units, angles in rad."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import cos, sin
from typing import TYPE_CHECKING, Any

import numpy as np

from blocksim.kernels.common.arrays import REACHED
from blocksim.scenario import Scenario, scenario_from_mapping
from blocksim.simulation.ledger import energy_ledger, start_energy
from blocksim.simulation.schemes import AnyScene, build_scene, measure_row, scheme_of
from blocksim.simulation.team import ALONE
from blocksim.verification import closed_forms as forms
from blocksim.world.build import arrays_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import NDArray

    from blocksim.kernels.common.arrays import World
    from blocksim.verification.case import Setting


HELD = {"kinetic", "potential", "stored_normal", "stored_shear"}  # entries of a ledger that are no losses
WIDTH, HEIGHT, DEPTH = 0.032, 0.025, 0.05  # m, the paper's block in the literal reading
YOUNG_MODULUS, POISSON_RATIO, UNIT_WEIGHT = 69e9, 0.3, 26.7e3  # Pa, -, N/m3
SIZES = {"width": WIDTH, "height": HEIGHT, "length": DEPTH}


@dataclass(frozen=True)
class PaperBlock:
    """The paper's block, the height upright unless other sides are given, and what follows from its material."""

    width: float = WIDTH  # m
    height: float = HEIGHT  # m
    depth: float = DEPTH  # m
    density: float = UNIT_WEIGHT / 9.81  # kg/m3
    modulus: float = YOUNG_MODULUS / (2.0 * (1.0 - POISSON_RATIO**2))  # Pa, E* of two equal materials

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
        """Stiffness (N/m) of one linear contact point; a face contact has two."""
        return self.modulus * self.depth


class Simulation:
    """A scene under way, of any scheme."""

    def __init__(self, scene: AnyScene) -> None:
        """Find the first contacts and remember the energy."""
        self.scene = scene
        self.status = REACHED
        self.to_step(0)
        self.start_energy = self.energy()

    @property
    def bodies(self) -> Any:
        """All bodies without the ground: a record array, as in blocksim.kernels.common.arrays."""
        return self.world.bodies[:-1]

    @property
    def world(self) -> World:
        """The arrays that all schemes have."""
        return self.scene.world

    @property
    def touching(self) -> Any:
        """Records of all contacts, pair after pair; of the explicit scheme."""
        count = int(self.world.clock[0].pair_count)
        is_active = np.arange(self.world.contacts.shape[1]) < self.world.pairs.active[:count, np.newaxis]
        return self.world.contacts[:count][is_active]

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
        """Advance to a step number."""
        self.scene, self.status = ALONE.advance(self.scene, last_step)
        return self

    def to_time(self, time: float) -> Simulation:
        """Advance to the step nearest to a time (s)."""
        return self.to_step(round(time / self.step))

    def measured(self) -> NDArray[np.float64]:
        """Return the energies (J) of the scheme's ledger, the number of contacts and the largest overlap (m)."""
        return measure_row(self.scene)

    @property
    def kinetic(self) -> float:
        """Kinetic energy (J)."""
        return float(self.measured()[0])

    @property
    def mechanical(self) -> float:
        """Kinetic, potential and stored energy (J): the entries that any ledger begins with."""
        held = sum(name in HELD for name in scheme_of(self.scene).ledger)
        return float(self.measured()[:held].sum())

    @property
    def contacts(self) -> int:
        """Number of contact points."""
        return int(self.measured()[-2])

    def energy(self) -> float:
        """Return everything the scene holds and has lost (J): constant, if the ledger is complete."""
        return start_energy(self.scene)

    def residual(self) -> float:
        """Return the residual of the ledger, as a share of the energy in play."""
        return energy_ledger(self.scene, self.start_energy).relative_residual

    def state(self) -> NDArray[np.float64]:
        """Return x, y, angle, vx, vy, spin of all bodies, one row a body."""
        names = ("x", "y", "angle", "vx", "vy", "spin")
        return np.array([self.bodies[name] for name in names]).T.copy()


@dataclass(frozen=True)
class Scene:
    """Single bodies on the ground, each with sides of its own (default: the paper's block)."""

    bodies: Sequence[Mapping[str, object]]  # keys of [[bodies]] without `block`; width, height, length, or outline
    restitution: float = 0.2
    friction: float = 0.31  # between blocks
    ground_friction: float = 0.38
    gravity: float = 9.81  # m/s2
    tilt: float = 0.0  # rad
    contact: Mapping[str, object] = field(default_factory=dict)  # more keys of [contact]
    time: Mapping[str, object] = field(default_factory=dict)  # more keys of [time]
    ground: Mapping[str, object] = field(default_factory=dict)  # more keys of [ground]

    def start(self, change: Callable[[World], None] | None = None) -> Simulation:
        """Start it; `change` edits the world before the first contacts are found."""
        scene = build_scene(self.scenario())
        if change is not None:
            change(scene.world)
        return Simulation(scene)

    def scenario(self) -> Scenario:
        """Return the scenario."""
        return scenario_of(
            self.bodies,
            gravity=self.gravity,
            ground={"tilt": in_radians(self.tilt), **self.ground},
            friction={"block_block": self.friction, "block_ground": self.ground_friction},
            contact={"restitution": self.restitution, **self.contact},
            time={"stop_at_rest": False, **self.time},
        )


def scenario_of(bodies: Sequence[Mapping[str, object]], **tables: Any) -> Scenario:
    """Build a scenario of single bodies of the paper's material; every body has a block type of its own."""
    material = {"unit_weight": UNIT_WEIGHT, "young_modulus": YOUNG_MODULUS, "poisson_ratio": POISSON_RATIO}
    return scenario_from_mapping(
        {
            "schema": 1,
            "name": "scene",
            "materials": {"aluminium": material},
            "blocks": {f"block{i}": block_type(body) for i, body in enumerate(bodies)},
            "bodies": [{"x": 0.0, "block": f"block{i}", **placement(body)} for i, body in enumerate(bodies)],
            **tables,
        }
    )


def block_type(body: Mapping[str, object]) -> dict[str, object]:
    """Return the block table of one body."""
    if "outline" in body:
        return {"outline": body["outline"], "depth": body.get("length", DEPTH), "material": "aluminium"}
    return {key: body.get(key, size) for key, size in SIZES.items()} | {"material": "aluminium"}


def placement(body: Mapping[str, object]) -> dict[str, object]:
    """Return the body table without what belongs to its block."""
    shape = {*SIZES, "outline"}
    return {key: in_radians(value) if key == "angle" else value for key, value in body.items() if key not in shape}


def in_radians(angle: object) -> object:
    """Return an angle (rad) as in scenarios: with its unit, unless it is zero."""
    return f"{float(str(angle))!r} rad" if angle else angle


POLL = 40  # steps; an impact on springs takes thirty and more; a rigid one a part of one, so that others may follow
MOST_STEPS = 4_000_000
STEPS_BEFORE = 2.0  # of free flight
GOLDEN = 0.6180339887498949  # its multiples, modulo 1, spread phases evenly over a step


@dataclass(frozen=True)
class Throw:
    """How a block comes down, straight."""

    angle: float = 0.0  # rad
    friction: float = 0.0
    phase: float = 0.5  # of a step, at which the contact begins


class Thrower:
    """A world with one block, ready to be thrown."""

    def __init__(self, setting: Setting, restitution: float, speed: float = 1.0, **values: Any) -> None:
        """Build the world for impacts at `speed` (m/s), on which its step may depend; `values` go to Scene."""
        body = {"y": 1.0, "velocity": [0.0, -speed]}
        scene = setting.scene([body], restitution=restitution, gravity=0.0, **values)
        self.speed = speed
        self.scene = build_scene(scene.scenario())
        self.world = self.scene.world
        self.scheme = scheme_of(self.scene)
        self.fresh = [array.copy() for array in arrays_of(self.scene)]
        self.row = np.zeros(len(self.scheme.measured))

    @property
    def step(self) -> float:
        """Length of a step (s)."""
        return float(self.world.controls[0].step)

    def throw(self, throw: Throw, poll: int = POLL) -> Any:
        """Throw the block; return its record after the impact, once it has no contact at the end of `poll` steps."""
        self._place(throw)
        body = self.world.bodies[0]
        steps, before = 0, float(body.vy)
        while steps < MOST_STEPS:
            steps += poll
            self.scheme.advance(self.scene, steps)
            self.scheme.measure(self.scene, self.row)
            if self.row[len(self.scheme.ledger)] == 0.0 and body.vy != before:
                break
        return body

    def _place(self, throw: Throw) -> None:
        for array, fresh in zip(arrays_of(self.scene), self.fresh, strict=True):
            array[...] = fresh
        body = self.world.bodies[0]
        lowest = forms.lowest_corner(WIDTH, HEIGHT, throw.angle)[1]
        body.y = self.speed * self.step * (STEPS_BEFORE + throw.phase) - lowest
        body.angle, body.cos, body.sin = throw.angle, cos(throw.angle), sin(throw.angle)
        self.world.interactions.static_friction[...] = throw.friction
        self.world.interactions.kinetic_friction[...] = throw.friction


def kinetic_energy(body: Any) -> float:
    """Return the kinetic energy (J) of one body."""
    return float(0.5 * (body.mass * (body.vx**2 + body.vy**2) + body.inertia * body.spin**2))

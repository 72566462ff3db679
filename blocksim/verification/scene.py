"""Scenes of a few blocks, started, stepped and thrown, for verification cases and tests. SI units, angles in rad."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import cos, sin
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from blocksim.kernels.common.arrays import World
from blocksim.scenario import Model, Scenario, scenario_from_mapping
from blocksim.scenario.models import timeline
from blocksim.simulation.loop import Simulation
from blocksim.simulation.schemes import AnyScene, build, measure_row, scheme_of
from blocksim.verification import closed_forms as forms
from blocksim.world.build import arrays_of

if TYPE_CHECKING:
    from blocksim.verification.case import Setting

HELD = {"kinetic", "potential", "stored_normal", "stored_shear"}  # entries of a ledger that are no losses
WIDTH, HEIGHT, DEPTH = 0.032, 0.025, 0.05  # m, the paper's block in the literal reading
YOUNG_MODULUS, POISSON_RATIO, UNIT_WEIGHT = 69e9, 0.3, 26.7e3  # Pa, -, N/m3
SIZES = {"width": WIDTH, "height": HEIGHT, "length": DEPTH}


class PaperBlock:
    """The paper's block, the height upright, and what follows from its material."""

    width, height, depth = WIDTH, HEIGHT, DEPTH  # m
    density = UNIT_WEIGHT / 9.81  # kg/m3
    mass = density * width * height * depth  # kg
    inertia = mass * (width**2 + height**2) / 12.0  # kg m2, about the centre
    modulus = YOUNG_MODULUS / (2.0 * (1.0 - POISSON_RATIO**2))  # Pa, E* of two equal materials
    point_stiffness = modulus * depth  # N/m, of one linear contact point; a face contact has two


class SteppedScene(Simulation):
    """A scene under way, of any scheme, that goes on whatever happens, and what cases measure of it."""

    def __init__(self, scene: AnyScene) -> None:
        """Find the first contacts and remember the energy."""
        self._take(scene)

    @property
    def bodies(self) -> Any:
        """All bodies without the ground: a record array, as in blocksim.kernels.common.arrays."""
        return self.world.bodies[:-1]

    @property
    def world(self) -> World:
        """The arrays that all schemes have."""
        return self.scene.world

    def to_step(self, last_step: int) -> Self:
        """Advance to a step number."""
        self._call(last_step)
        return self

    def to_time(self, time: float) -> Self:
        """Advance to the step nearest to a time (s)."""
        return self.to_step(round(time / self.step))

    @property
    def kinetic(self) -> float:
        """Kinetic energy (J)."""
        return float(measure_row(self.scene)[0])

    @property
    def mechanical(self) -> float:
        """Kinetic, potential and stored energy (J): the entries that any ledger begins with."""
        held = sum(name in HELD for name in scheme_of(self.scene).ledger)
        return float(measure_row(self.scene)[:held].sum())

    @property
    def contact_count(self) -> int:
        """Number of contact points."""
        return int(measure_row(self.scene)[-2])

    def residual(self) -> float:
        """Return the residual of the ledger, as a share of the energy in play."""
        return self.energy().relative_residual

    def state(self) -> NDArray[np.float64]:
        """Return x, y, angle, vx, vy, spin of all bodies, one row a body."""
        names = ("x", "y", "angle", "vx", "vy", "spin")
        return np.array([self.bodies[name] for name in names]).T.copy()


@dataclass(frozen=True)
class CaseScene:
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

    def start(self, change: Callable[[World], None] | None = None) -> SteppedScene:
        """Start it; `change` edits the world before the first contacts are found."""
        scene = build(Model(self.scenario()))
        if change is not None:
            change(scene.world)
        return SteppedScene(scene)

    @property
    def impacts(self) -> dict[str, str]:
        """The key of impacts: with rigid contacts sequential for a block or two, and for strong restitution."""
        free = sum(not body.get("fixed") for body in self.bodies)
        is_bouncing = self.restitution > STRONG or free <= 1 or (free <= 2 and self.restitution > 0.0)
        return {"impacts": "sequential"} if is_bouncing and self.time.get("scheme") == timeline.IMPULSES else {}

    def scenario(self) -> Scenario:
        """Return the scenario."""
        return scenario_of(
            self.bodies,
            gravity=self.gravity,
            ground={"tilt": f"{float(self.tilt)!r} rad", **self.ground},
            friction={"block_block": self.friction, "block_ground": self.ground_friction},
            contact={"restitution": self.restitution, **self.impacts, **self.contact},
            time={"stop_at_rest": False, **self.time},
        )


def scenario_of(bodies: Sequence[Mapping[str, object]], **tables: Any) -> Scenario:
    """Build a scenario of single bodies of the paper's material; every body has a block type of its own."""
    blocks: dict[str, object] = {}
    placed = []
    for name, body in ((f"block{i}", body) for i, body in enumerate(bodies)):
        if "outline" in body:
            shape = {"outline": body["outline"], "depth": body.get("length", DEPTH)}
        else:
            shape = {key: body.get(key, size) for key, size in SIZES.items()}
        blocks[name] = {**shape, "material": "aluminium"}
        place = {key: value for key, value in body.items() if key not in {*SIZES, "outline"}}
        angle = {"angle": f"{float(str(body['angle']))!r} rad"} if "angle" in body else {}
        placed.append({"x": 0.0, "block": name, **place, **angle})
    material = {"unit_weight": UNIT_WEIGHT, "young_modulus": YOUNG_MODULUS, "poisson_ratio": POISSON_RATIO}
    return scenario_from_mapping(
        {
            "schema": 1,
            "name": "scene",
            "materials": {"aluminium": material},
            "blocks": blocks,
            "bodies": placed,
            **tables,
        }
    )


STRONG = 0.5  # restitution
POLL = 40  # steps; an impact on springs takes thirty and more; a rigid one a part of one, so that others may follow
MOST_STEPS = 4_000_000
GOLDEN = 0.6180339887498949  # its multiples, modulo 1, spread phases evenly over a step


@dataclass(frozen=True)
class Throw:
    """How a block comes down, straight."""

    angle: float = 0.0  # rad
    friction: float = 0.0
    phase: float = 0.5  # of a step, at which the contact begins


class Thrower:
    """A world with one block, ready to be thrown."""

    def __init__(self, setting: "Setting", restitution: float, speed: float = 1.0, **values: Any) -> None:
        """Build the world for impacts at `speed` (m/s), on which its step may depend; `values` go to CaseScene."""
        body = {"y": 1.0, "velocity": [0.0, -speed]}
        self.speed = speed
        self.scene = build(Model(setting.scene([body], restitution=restitution, gravity=0.0, **values).scenario()))
        self.world = self.scene.world
        self.scheme = scheme_of(self.scene)
        self.fresh = [array.copy() for array in arrays_of(self.scene)]
        self.row = np.zeros(len(self.scheme.row_names))

    def throw(self, throw: Throw, poll: int = POLL) -> Any:
        """Throw the block; return its record after the impact, once it has no contact at the end of `poll` steps."""
        for array, fresh in zip(arrays_of(self.scene), self.fresh, strict=True):
            array[...] = fresh
        body, step = self.world.bodies[0], float(self.world.controls[0].step)
        lowest = forms.lowest_corner(WIDTH, HEIGHT, throw.angle)[1]
        body.y = self.speed * step * (2.0 + throw.phase) - lowest  # of free flight
        body.angle, body.cos, body.sin = throw.angle, cos(throw.angle), sin(throw.angle)
        self.world.interactions.static_friction[...] = throw.friction
        self.world.interactions.kinetic_friction[...] = throw.friction
        steps, before = 0, float(body.vy)
        while steps < MOST_STEPS:
            steps += poll
            self.scheme.advance(self.scene, steps)
            self.scheme.measure(self.scene, self.row)
            if self.row[len(self.scheme.ledger)] == 0.0 and body.vy != before:
                break
        return body


def kinetic_energy(body: Any) -> float:
    """Return the kinetic energy (J) of one body."""
    return float(0.5 * (body.mass * (body.vx**2 + body.vy**2) + body.inertia * body.spin**2))

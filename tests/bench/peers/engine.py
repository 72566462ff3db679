"""The engines: a scene, its result, the timed loop over steps; pymunk, Box2D, and blocksim with either scheme."""

import math
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import Any, ClassVar, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from blocksim.bench import harness
from blocksim.bench.harness import FRICTION, Number, Rerun, TimeSteps
from blocksim.scenario import Model, PlacedBody, Scenario
from blocksim.scenario.geometry import edges_of
from blocksim.simulation.loop import last_step_of
from blocksim.simulation.schemes import ALONE
from tests.bench.peers.work_precision import Panel

Floats = NDArray[np.float64]
CALLS = 20_000  # that are timed on an empty scene


@dataclass(frozen=True)
class Readings(harness.Readings):
    """Result of a measurement, with its part of the work-precision picture."""

    panel: Panel | None = None


class Make(Protocol):
    """Make the scene's scenario with more keys of [contact] and [time]."""

    def __call__(
        self, *, contact: Mapping[str, object] | None = None, time: Mapping[str, object] | None = None
    ) -> Scenario:
        """Return it."""


@dataclass(frozen=True)
class Scene:
    """Blocks on level ground, let go at time zero; they are not turned."""

    make: Make
    shift: Floats  # (b,) m, along x, of every block at the start
    restitution: float
    end: float  # s

    def placed(self) -> list[PlacedBody]:
        """Return the blocks at the start."""
        bodies = Model(self.make()).bodies
        return [body._replace(x=body.x + by) for body, by in zip(bodies, self.shift.tolist(), strict=True)]


class Final(NamedTuple):
    """Centres (m) of all blocks at the end, and the CPU seconds that the engine's steps took."""

    x: Floats
    y: Floats
    seconds: float


class Solver(Protocol):
    """An engine at one setting."""

    @property
    def setting(self) -> str:
        """The refined quantity, as text."""

    def calls(self, scene: Scene) -> int:
        """Return how often Python calls the engine for a scene."""

    def solve(self, scene: Scene) -> Final:
        """Compute the scene up to its end."""


@dataclass(frozen=True)
class Series:
    """Settings of one engine from coarse to fine, and its converged reference."""

    engine: str
    label: str
    levels: tuple[Solver, ...]
    reference: Solver


@dataclass(frozen=True)
class Stepper(ABC):
    """An engine that Python calls for every step: one step length and number of iterations."""

    step: float  # s
    iterations: int
    units: ClassVar[float] = 1.0  # lengths of the engine in a metre

    @property
    def setting(self) -> str:
        """For people."""
        return f"step {1e3 * self.step:g} ms"

    def calls(self, scene: Scene) -> int:
        """Return the number of steps: each is a call from Python."""
        return round(scene.end / self.step)

    def solve(self, scene: Scene) -> Final:
        """Compute the scene. Not counted: making it."""
        return self.run(*self.made(scene), scene)

    def run(self, world: Any, bodies: list[Any], scene: Scene) -> Final:
        """Step a world up to the end of the scene."""
        seconds = timed(*self.call(world), count=self.calls(scene))
        x, y = np.array([body.position for body in bodies]).T / self.units
        return Final(x, y, seconds)

    @abstractmethod
    def made(self, scene: Scene) -> tuple[Any, list[Any]]:
        """Return the engine's world and its blocks."""

    @abstractmethod
    def call(self, world: Any) -> tuple[Callable[..., object], tuple[Any, ...]]:
        """Return the function of a step, and its arguments."""


def timed(call: Callable[..., object], arguments: tuple[Any, ...], count: int) -> float:
    """Return the CPU seconds of so many calls."""
    began = time.process_time()
    for _ in range(count):
        call(*arguments)
    return time.process_time() - began


def raced(
    racers: Mapping[str, Solver], scene: Callable[[], Scene], rounds: int
) -> tuple[list[Number], dict[str, Final]]:
    """Return the CPU time of the first one, and how many times as long the others take; and the last finals of all.

    They run in turns, so that what else the machine does slows all of them.
    """
    finals = [{name: solver.solve(scene()) for name, solver in racers.items()} for _ in range(rounds)]
    first, *others = racers
    own = Number(f"{first}, {racers[first].setting}", "CPU s", tuple(one[first].seconds for one in finals))
    ratios = [tuple(one[name].seconds / one[first].seconds for one in finals) for name in others]
    numbers = [own, *(Number(f"{name}: times that", "", ratio) for name, ratio in zip(others, ratios, strict=True))]
    return numbers, finals[-1]


def call_time(stepper: Stepper, empty: Any) -> float:
    """Return the seconds that a call from Python costs where there is nothing to compute."""
    return timed(*stepper.call(empty), count=CALLS) / CALLS


# Overlap that is left alone so that contacts last. The default of 0.1 is a tenth of a pixel; here it would be 0.1 m.
SLOP = 1e-6  # m
GROUND = ((-50.0, -1.0), (100.0, -1.0), (100.0, 0.0), (-50.0, 0.0))  # m


class Pymunk(Stepper):
    """Chipmunk2D: rigid contacts, impulses by Gauss-Seidel iterations, double precision."""

    def call(self, world: Any) -> tuple[Callable[..., object], tuple[Any, ...]]:
        """Return the function of a step, and its arguments."""
        return world.step, (self.step,)

    def made(self, scene: Scene) -> tuple[Any, list[Any]]:
        """Sleeping is off by default, and so is any damping of free motion.

        `collision_bias` stays as it is: a tenth of the overlap beyond the slop goes in a sixtieth of a second, by
        velocities that are forgotten after the step, so that it brings no energy in.
        """
        pymunk = import_module("pymunk")
        space = empty_space()
        space.iterations = self.iterations
        # Both coefficients of a pair are products: blocks a and ground b with a*a and a*b as wanted.
        friction = math.sqrt(FRICTION["block_block"])
        bounce = math.sqrt(scene.restitution)
        ground = pymunk.Poly(space.static_body, GROUND)
        ground.friction = FRICTION["block_ground"] / friction
        ground.elasticity = bounce
        space.add(ground)
        bodies = []
        placed = scene.placed()
        for block in placed:
            body = pymunk.Body(block.mass / placed[0].mass, block.inertia / placed[0].mass)
            body.position = (block.x, block.y)
            body.velocity = (block.vx, block.vy)
            shape = pymunk.Poly(body, block.corners)  # its corners are sharp: radius 0
            shape.friction, shape.elasticity = friction, bounce
            space.add(body, shape)
            bodies.append(body)
        return space, bodies


def empty_space() -> Any:
    """Return an empty space."""
    space = import_module("pymunk").Space()
    space.gravity = (0.0, -9.81)
    space.collision_slop = SLOP
    return space


UNITS = 200.0  # a metre
GRAVITY = 9.81  # m/s2
GROUND_LENGTH, GROUND_DEPTH = 150.0, 1.0  # m


class Box2D(Stepper):
    """Box2D 2.3: rigid contacts, impulses by as many iterations for velocities as for positions, single precision.

    Its lengths are made for metres: overlap up to 5 mm is left alone (b2_linearSlop), polygons have a skin of twice
    that, approaches below 1 m/s do not bounce (b2_velocityThreshold), and nothing moves more than 2 m a step
    (b2_maxTranslation). All this is compiled in. So lengths and gravity are scaled up together, which leaves times as
    they are: 200 units a metre make that 25 µm, 50 µm, 5 mm/s and 10 mm a step, which a block at 2.5 m/s does not reach
    in 4 ms. Ten times more would cut the motion of long steps short, ten times less would end bounces at 50 mm/s.
    """

    units = UNITS

    def call(self, world: Any) -> tuple[Callable[..., object], tuple[Any, ...]]:
        """Return the function of a step, and its arguments."""
        return world.Step, (self.step, self.iterations, self.iterations)

    def made(self, scene: Scene) -> tuple[Any, list[Any]]:
        """Return world and blocks, lengths in the engine's units."""
        box2d = import_module("Box2D")
        world = empty_world()
        # Friction of a pair is the root of the product, restitution the larger one.
        blocks = {"friction": FRICTION["block_block"], "restitution": scene.restitution}
        ground = {"friction": FRICTION["block_ground"] ** 2 / FRICTION["block_block"], "restitution": scene.restitution}
        skin = box2d.b2_polygonRadius
        depth = 0.5 * UNITS * GROUND_DEPTH
        slab = box2d.b2PolygonShape(box=(0.5 * UNITS * GROUND_LENGTH, depth, (0.0, -depth - skin), 0.0))
        world.CreateStaticBody().CreateFixture(box2d.b2FixtureDef(shape=slab, **ground))
        bodies = []
        placed = scene.placed()
        for block in placed:
            body = world.CreateDynamicBody(
                position=(UNITS * block.x, UNITS * block.y), linearVelocity=(UNITS * block.vx, UNITS * block.vy)
            )
            shape = box2d.b2PolygonShape(vertices=_inside_of_skin(block, skin))
            body.CreateFixture(box2d.b2FixtureDef(shape=shape, density=1.0, **blocks))
            body.massData = _mass_data(box2d, block, placed[0].mass)
            bodies.append(body)
        return world, bodies


def empty_world() -> Any:
    """Return an empty world.

    Nothing sleeps: a stack has to stand by itself. Continuous physics, which keeps fast bodies from passing through the
    ground, is off: at these steps none does, and without it a step takes 10 to 25 % less time for the same answers.
    """
    world = import_module("Box2D").b2World(gravity=(0.0, -GRAVITY * UNITS), doSleep=False)
    world.continuousPhysics = False
    return world


def _inside_of_skin(block: PlacedBody, skin: float) -> list[tuple[float, float]]:
    """Return corners in the engine's units: the skin is part of the block, what is inside of it smaller by as much."""
    edges = list(edges_of(block.corners))
    found = []
    for (_, _, (ax, ay)), ((x, y), _, (bx, by)) in zip([edges[-1], *edges[:-1]], edges, strict=True):
        reach = skin / (1.0 + ax * bx + ay * by)
        found.append((UNITS * x - reach * (ax + bx), UNITS * y - reach * (ay + by)))
    return found


def _mass_data(box2d: Any, block: PlacedBody, unit: float) -> Any:
    """Return mass, in units of that of a block, and inertia of the whole block, skin included."""
    data = box2d.b2MassData()
    data.mass = block.mass / unit
    data.center = (0.0, 0.0)
    data.I = UNITS**2 * block.inertia / unit
    return data


OWN_CALLS = 1000  # that are timed with nothing to do
Table = dict[str, object]


class Blocksim(ABC):
    """One setting of a scheme: springs, whose step follows from their stiffness, or impulses, with a step of choice."""

    @property
    @abstractmethod
    def setting(self) -> str:
        """For people."""

    @abstractmethod
    def tables(self) -> tuple[Table, Table]:
        """Return keys of [contact] and of [time]."""

    def calls(self, scene: Scene) -> int:  # noqa: ARG002 - others have one a step
        """Return how often Python calls the engine for a scene."""
        return 1

    def solve(self, scene: Scene) -> Final:
        """Compute the scene. Not counted: building the world and what a run does once, as the others' scenes are not.

        A run that fails, as when soft blocks overlap too far, ends at positions that are NaN.
        """
        start = self._started(scene, {"end": scene.end, "stop_at_rest": False})
        run = start.attempt(last_step_of(scene.end, start.step))
        places = np.array([run.bodies.x, run.bodies.y])
        x, y = places if run.outcome.status == "finished" else np.full_like(places, np.nan)
        return Final(x, y, run.seconds)

    def call_time(self, scene: Scene) -> float:
        """Return the seconds that a call from Python costs where there is nothing to compute."""
        return timed(ALONE.advance, (self._started(scene, {}).scene, 0), OWN_CALLS) / OWN_CALLS

    def _started(self, scene: Scene, more: Mapping[str, object]) -> Rerun:
        contact, time = self.tables()
        return Rerun(scene.make(contact=contact, time={**time, **more}), scene.shift)


@dataclass(frozen=True)
class Explicit(Blocksim):
    """One stiffness and safety of the step."""

    scale: float  # stiffness_scale
    safety: float

    @property
    def setting(self) -> str:
        """For people."""
        return f"stiffness {self.scale:g}"

    def tables(self) -> tuple[Table, Table]:
        """Return stiffness and step."""
        return {"stiffness_scale": self.scale}, {"safety": self.safety}


@dataclass(frozen=True)
class Nonsmooth(Blocksim):
    """One step and its parts, also where it is longer than what is safe: the error will tell."""

    stepping: TimeSteps

    @property
    def setting(self) -> str:
        """For people."""
        return self.stepping.setting

    def tables(self) -> tuple[Table, Table]:
        """Return step, parts and sweeps."""
        return {}, self.stepping.time(force_step=True)

"""Blocks in free flight by Euler's forward rule, in plain Python: a stepping scheme of tests alone."""

from collections.abc import Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
from pydantic import Field

from blocksim.kernels.common.arrays import REACHED, Floats, World
from blocksim.scenario.models.timeline import Time
from blocksim.simulation.schemes import Scheme
from blocksim.world.bodies import Layout
from blocksim.world.build import Construction, Parts, assemble_world, run_controls
from blocksim.world.memory import scene_size
from blocksim.world.step import Bounds, Stride

STEP = 1e-3  # s


class FlightTime(Time):
    """The table of the scheme."""

    declared_in = "tests.simulation.flight:FLIGHT"
    scheme: Literal["flight"]  # type: ignore[assignment]  # another word than those of the usual schemes
    drag: float = Field(default=0.0, description="1/s, share of the velocity that is lost")


class Flight(NamedTuple):
    """A world without contacts."""

    world: World
    drag: Floats  # (1,) 1/s


def choose(layout: Layout, _: Bounds) -> Stride:
    step = layout.scenario.time.step
    return Stride(STEP if step == "auto" else step, 0.0)


def assemble(parts: Parts, strides: Sequence[Stride]) -> Flight:
    drag = np.array([[getattr(layout.scenario.time, "drag", 0.0)] for layout in parts.layouts])
    return Flight(assemble_world(parts, run_controls(parts, strides)), drag)


def advance(scene: Flight, last_step: int) -> int:
    """Take steps of positions and velocities with what both were before."""
    bodies: Any = scene.world.bodies[:-1]
    clock, controls = scene.world.clock[0], scene.world.controls[0]
    clock.is_started = 1
    while clock.steps < last_step:
        for place, speed, pull in (("x", "vx", controls.gravity_x), ("y", "vy", controls.gravity_y)):
            bodies[place] += controls.step * bodies[speed]
            bodies[speed] += controls.step * (pull - scene.drag[0] * bodies[speed])
        bodies.angle += controls.step * bodies.spin
        clock.steps += 1
    return REACHED


def measure(scene: Flight, row: Any) -> None:
    bodies: Any = scene.world.bodies[:-1]
    controls = scene.world.controls[0]
    row[0] = 0.5 * np.sum(bodies.mass * (bodies.vx**2 + bodies.vy**2) + bodies.inertia * bodies.spin**2)
    row[1] = -np.sum(bodies.mass * (controls.gravity_x * bodies.x + controls.gravity_y * bodies.y))


FLIGHT = Scheme(
    name="flight",
    scene_type=Flight,
    ledger=("kinetic", "potential"),
    construction=Construction(
        choose=choose,
        size=lambda parts: scene_size(parts.bodies.shape[1], 1, 1),
        assemble=assemble,
    ),
    advance=advance,
    measure=measure,
    kernels=lambda _: "flight",
)

"""Free point masses in gravity that bounce on the ground: a system of tests alone.

Registered by two lines a test: one for its table, and one for each pair that can meet.
"""

import math
from collections.abc import Iterator
from typing import Annotated, Any, NamedTuple

import numpy as np

from blocksim.kernels.common.arrays import Floats, Records, World, record_type, zeros
from blocksim.kernels.common.jit import rare_kernel
from blocksim.kernels.common.systems import Stages, part_of_thread
from blocksim.scenario import Scenario, units as q
from blocksim.scenario.models.base import SystemTable, Whole
from blocksim.world.systems import Function
from blocksim.world.systems.system import Channel, Dataset, Elements, Indices, System, Track, discs

POINT = record_type("x y vx vy fx fy mass stiffness")  # m, m/s, N, kg, N/m
RADIUS = 0.004  # m, in pictures


class MassTable(SystemTable):
    """A row of masses."""

    declared_in = "tests.simulation.masses:MASSES"
    x: q.Length
    y: q.Length
    count: Annotated[int, Whole(1, 1000)] = 1
    spacing: q.Length = 0.01
    mass: q.PositiveLength = 1.0  # kg; there is no quantity of masses
    stiffness: q.PositiveLength = 1e4  # N/m

    def impossible(self, scenario: Scenario) -> Iterator[tuple[str, str]]:
        """Find masses that begin in level ground."""
        if self.y < 0.0 and scenario.ground.profile is None:
            yield "y", f"{self.y:g} m is below the ground"


class Masses(NamedTuple):
    """The arrays of all masses."""

    points: Records  # (n,) POINT


@rare_kernel
def kick(system: Masses, world: World, k: int, step: float) -> None:
    first, last = part_of_thread(system.points.size, world, k)
    controls = world.controls[0]
    for i in range(first, last):
        point = system.points[i]
        point.vx += 0.5 * step * (controls.gravity_x + point.fx / point.mass)
        point.vy += 0.5 * step * (controls.gravity_y + point.fy / point.mass)


@rare_kernel
def start(system: Masses, world: World, k: int, step: float) -> None:
    kick(system, world, k, step)
    first, last = part_of_thread(system.points.size, world, k)
    for i in range(first, last):
        point = system.points[i]
        point.x += step * point.vx
        point.y += step * point.vy
        point.fx = point.fy = 0.0


@rare_kernel
def survey(system: Masses, world: World) -> tuple[float, float, float]:
    fastest, kinetic, power = 0.0, 0.0, 0.0
    controls = world.controls[0]
    for i in range(system.points.size):
        point = system.points[i]
        speed = math.sqrt(point.vx**2 + point.vy**2)
        fastest = max(fastest, speed if math.isfinite(speed + point.x + point.y) else math.inf)
        kinetic += 0.5 * point.mass * speed**2
        power += point.mass * abs(controls.gravity_x * point.vx + controls.gravity_y * point.vy)
    return fastest, kinetic, power


@rare_kernel
def measure(system: Masses, world: World, row: Floats) -> None:
    row[:] = 0.0
    controls = world.controls[0]
    for i in range(system.points.size):
        point = system.points[i]
        depth = max(0.0, -point.y)
        row[0] += 0.5 * point.mass * (point.vx**2 + point.vy**2)
        row[1] -= point.mass * (controls.gravity_x * point.x + controls.gravity_y * point.y)
        row[2] += 0.5 * point.stiffness * depth**2
        row[3] += point.mass


@rare_kernel
def bounce(system: Masses, _: World, world: World, k: int, _step: float) -> None:
    """Push masses out of the ground."""
    first, last = part_of_thread(system.points.size, world, k)
    for i in range(first, last):
        point = system.points[i]
        point.fy += point.stiffness * max(0.0, -point.y)


def ground() -> Function:
    """Return how masses and supports act on one another."""
    return bounce


def _tables(scenario: Scenario) -> list[MassTable]:
    return [table for table in scenario.systems["masses"] if isinstance(table, MassTable)]


def _rows(scenario: Scenario) -> list[tuple[float, float, MassTable]]:
    return [(table.x + table.spacing * i, table.y, table) for table in _tables(scenario) for i in range(table.count)]


def _elements(scenario: Scenario) -> Elements:
    rows = _rows(scenario)
    start = np.array([(x, y, 0.0, 0.0) for x, y, _ in rows]).T
    names = tuple(f"m{number}" for number in range(1, len(rows) + 1))
    return Elements(names, np.array([[table.mass for *_, table in rows]]), start)


def _build(scenario: Scenario) -> Masses:
    rows = _rows(scenario)
    points = zeros(len(rows), POINT)
    for point, (x, y, table) in zip(points, rows, strict=True):
        point.x, point.y, point.mass, point.stiffness = x, y, table.mass, table.stiffness
    return Masses(points)


def _state(arrays: Masses, count: int) -> Any:
    return np.stack([arrays.points[name][:count] for name in ("x", "y", "vx", "vy")])


def _outlines(track: Track, chosen: Indices) -> Any:
    return discs(track, chosen, np.full(len(track.names), RADIUS))


def _largest_step(scenario: Scenario) -> float:
    return min(0.1 * math.sqrt(table.mass / table.stiffness) for table in _tables(scenario))


MASSES = System(
    name="masses",
    element="mass",
    quantities=(Dataset("x", "m"), Dataset("y", "m"), Dataset("vx", "m/s"), Dataset("vy", "m/s")),
    constants=(Dataset("mass", "kg"),),
    outputs=(
        Channel("x", "m", "place along the ground", "x_mm", 1e3),
        Channel("y", "m", "place above the ground", "y_mm", 1e3),
        Channel("vy", "m/s", "velocity normal to the ground", "vy_mm_s", 1e3),
        Channel("height", "m", "height above the start", "height_mm", 1e3, lambda one: one["y"] - one.at_start("y")),
    ),
    elements=_elements,
    state=_state,
    outlines=_outlines,
    energies=("kinetic", "potential", "stored"),
    build=_build,
    largest_step=_largest_step,
    stages=lambda: Stages(start, kick, survey, measure),
)

"""Soil that is pushed over: time of a step and memory, how they grow with the particles, and two threads on it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

from blocksim.bench.measurement import Findings, Measurement, Number, Setting, single
from blocksim.bench.scenes import MATERIAL, PUSH, SIDES, Rerun
from blocksim.bench.walls import Case, Size, explicit_wall, thread_numbers
from blocksim.scenario import scenario_from_mapping
from blocksim.simulation.schemes.scheme import BODIES_A_THREAD

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from blocksim.scenario import Scenario

RODS = {"unit_weight": 20e3, "young_modulus": 5.84e6, "poisson_ratio": 0.3, "friction_angle": "21.9 deg"}  # N/m3, Pa
SPACING = 2.5e-3  # m
STIFFNESS_SCALE = 1e-4  # of the block, which then allows the steps that the soil needs
STEPS, QUICK_STEPS = 300, 60  # of small soils; new lists every 20
MOST, QUICK_MOST = 2_000_000, 30_000  # particles times steps of one sample
THREADS_STEPS, QUICK_THREADS_STEPS = 200, 20


class Sizes(NamedTuple):
    """Particles of the soils, of the one that two threads advance, and the wall that they are compared with."""

    soils: tuple[int, ...]
    threads: int
    wall: Size


FULL = Sizes((1000, 3600, 10_000, 50_000), 10_000, Size(40, 25))
QUICK = Sizes((250, 500), 500, Size(10, 10))


def pushed_soil(particles: int) -> Scenario:
    """Return a square of rods on the ground, with about so many particles; the block that a scene needs is far away."""
    side = round(math.sqrt(particles)) * SPACING
    soil = {"name": "rods", "material": "rods", "spacing": SPACING, "kind": "rectangle", "gradient": "raw"}
    return scenario_from_mapping(
        {
            "schema": 1,
            "name": "pushed_soil",
            "materials": {"aluminium": MATERIAL, "rods": RODS},
            "blocks": {"brick": {**SIDES, "material": "aluminium"}},
            "bodies": [{"block": "brick", "x": -1.0, "y": 0.5 * SIDES["height"]}],
            "soils": [{**soil, "x": [0.0, side], "y": [0.0, side]}],
            "contact": {"stiffness_scale": STIFFNESS_SCALE},
            "time": {"end": 1.0, "stop_at_rest": False},
        }
    )


class PushedSoil(Rerun):
    """Soil whose particles at height y move along x with 1 m/s y / H, H the height of it, as those of walls do."""

    def __init__(self, particles: int) -> None:
        """Build it, and keep its state."""
        super().__init__(pushed_soil(particles))
        points = self.soils.points
        points["vx"] = PUSH * points["y"] / points["y"].max()
        self.keep()

    @property
    def soils(self) -> Any:
        """The arrays of the soil."""
        scene: Any = self.scene
        return scene.systems[0]

    @property
    def particles(self) -> int:
        """Number of particles."""
        return int(self.soils.points.size)


def measure(setting: Setting) -> Findings:
    """Measure all sizes and a wall in turns, each from the same start; then one thread and two in turns."""
    sizes = QUICK if setting.quick else FULL
    soils = [PushedSoil(count) for count in sizes.soils]
    numbers = _in_turns(soils, sizes.wall, setting)
    memory = [
        single(f"{one.particles} particles, memory", "bytes/particle", one.bytes / one.particles) for one in soils
    ]
    note = (
        f"a square of rods, spacing {1e3 * SPACING:g} mm, pushed with 1 m/s y/H; wall: {sizes.wall.blocks} blocks on "
        f"springs, pushed alike; speed-up: wall time of one thread over that of two; two cores must be idle"
    )
    return Findings((*numbers, *memory, *_threads(sizes, setting)), notes=(note,))


def _in_turns(soils: Sequence[PushedSoil], wall: Size, setting: Setting) -> list[Number]:
    """Return the times of soils, and how many times that of a block of a wall they are."""
    most, limit = (QUICK_MOST, QUICK_STEPS) if setting.quick else (MOST, STEPS)
    blocks = explicit_wall(wall)
    times: list[list[float]] = [[] for _ in soils]
    block_times = []
    for _ in range(setting.repeats):
        block_times.append(blocks.run(limit).seconds / (limit * wall.blocks))
        for one, found in zip(soils, times, strict=True):
            steps = min(limit, most // one.particles)
            found.append(one.run(steps).seconds / (steps * one.particles))
    numbers = [
        Number(f"{one.particles} particles", "ns/particle/step", tuple(1e9 * time for time in found))
        for one, found in zip(soils, times, strict=True)
    ]
    for one, found in zip(soils, times, strict=True):
        ratios = tuple(time / block for time, block in zip(found, block_times, strict=True))
        numbers.append(Number(f"{one.particles} particles, over a block of a wall", "", ratios))
    return numbers


def _threads(sizes: Sizes, setting: Setting) -> Iterable[Number]:
    soil = PushedSoil(sizes.threads)
    steps = QUICK_THREADS_STEPS if setting.quick else THREADS_STEPS
    case = Case(soil, soil.particles, steps, BODIES_A_THREAD, element="particle")
    return thread_numbers(case, setting.repeats)


SOILS = Measurement("soils", "pushed soil", measure, quick="250 and 500 particles, a wall of 100 blocks, 60 steps")

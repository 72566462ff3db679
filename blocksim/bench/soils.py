"""Soil that is pushed over: time of a step and memory, how they grow with the particles, and two threads on it."""

import math

from blocksim.bench.measurement import Findings, Measurement, Number, Setting, single
from blocksim.bench.scenes import MATERIAL, PUSH, SIDES, Rerun
from blocksim.bench.walls import THREADS, Size, explicit_wall, thread_numbers
from blocksim.scenario import scenario_from_mapping
from blocksim.simulation.schemes import BODIES_A_THREAD, useful_threads

RODS = {"unit_weight": 20e3, "young_modulus": 5.84e6, "poisson_ratio": 0.3, "friction_angle": "21.9 deg"}  # N/m3, Pa
SPACING = 2.5e-3  # m
STIFFNESS_SCALE = 1e-4  # of the block, which then allows the steps that the soil needs
STEPS, QUICK_STEPS = 300, 60  # of small soils; new lists every 20
MOST, QUICK_MOST = 2_000_000, 30_000  # particles times steps of one sample
# particles of the soils, of the one that two threads advance, its steps, and the wall that they are compared with
FULL = ((1000, 3600, 10_000, 50_000), 10_000, 200, Size(40, 25))
QUICK = ((250, 500), 500, 20, Size(10, 10))


def pushed_soil(particles: int) -> tuple[int, Rerun]:
    """Return a square of rods on the ground with about so many particles, and how many they are.

    Particles at height y move along x with 1 m/s y / H, H the height of the soil, as those of walls do. The block that
    a scene needs is far away.
    """
    side = round(math.sqrt(particles)) * SPACING
    soil = {"name": "rods", "material": "rods", "spacing": SPACING, "kind": "rectangle", "gradient": "raw"}
    scenario = scenario_from_mapping(
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
    scene = Rerun(scenario)
    points = scene.scene.systems[0].points  # type: ignore[union-attr]
    points["vx"] = PUSH * points["y"] / points["y"].max()
    scene.keep()
    return int(points.size), scene


def measure(setting: Setting) -> Findings:
    """Measure all sizes and a wall in turns, each from the same start; then one thread and two in turns."""
    sizes, many, steps, size = QUICK if setting.quick else FULL
    most, limit = (QUICK_MOST, QUICK_STEPS) if setting.quick else (MOST, STEPS)
    soils, wall = [pushed_soil(particles) for particles in sizes], explicit_wall(size)
    times: dict[int, list[float]] = {count: [] for count, _ in soils}
    block_times = []
    for _ in range(setting.repeats):
        block_times.append(wall.run(limit).seconds / (limit * size.blocks))
        for count, soil in soils:
            last = min(limit, most // count)
            times[count].append(soil.run(last).seconds / (last * count))
    ratios = {count: zip(found, block_times, strict=True) for count, found in times.items()}
    numbers = [
        *(Number(f"{n} particles", "ns/particle/step", tuple(1e9 * one for one in times[n])) for n in times),
        *(Number(f"{n} particles, over a block of a wall", "", tuple(a / b for a, b in ratios[n])) for n in times),
        *(single(f"{n} particles, memory", "bytes/particle", soil.bytes / n) for n, soil in soils),
    ]
    count, soil = pushed_soil(many)
    threads = useful_threads(THREADS, count, BODIES_A_THREAD)
    numbers += thread_numbers(soil, count, steps, threads, setting.repeats, "particle")
    note = (
        f"a square of rods, spacing {1e3 * SPACING:g} mm, pushed with 1 m/s y/H; wall: {size.blocks} blocks on "
        f"springs, pushed alike; speed-up: wall time of one thread over that of two; two cores must be idle"
    )
    return Findings(tuple(numbers), notes=(note,))


SOILS = Measurement("soils", "pushed soil", measure, quick="250 and 500 particles, a wall of 100 blocks, 60 steps")

"""Pushed walls by both schemes, and soil: time of a step, memory, growth with size, a whole fall, two threads."""

import functools
import math
import statistics
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from blocksim.bench import harness
from blocksim.scenario import scenario_from_mapping
from blocksim.scenario.models.timeline import IMPULSES, SPRINGS
from blocksim.simulation.loop import last_step_of
from blocksim.simulation.schemes import BODIES_A_THREAD, SCHEMES, Team, useful_threads


class WallGrid(NamedTuple):
    """Blocks in a course, and courses; about 1.6 times as many, so that walls of all sizes look alike."""

    columns: int
    rows: int

    @property
    def blocks(self) -> int:
        """Number of blocks."""
        return self.columns * self.rows


SIZES = (WallGrid(10, 10), WallGrid(40, 25), WallGrid(125, 80), WallGrid(400, 250))
QUICK_SIZES = (WallGrid(10, 10), WallGrid(25, 16))
STIFFNESS_SCALE = 1e-4  # long steps, so that blocks move and pair lists are updated, as in a whole collapse
STEPS, QUICK_STEPS = 300, 150
FEWEST_BLOCKS = 3000  # of one sample: smaller walls are advanced several times
RIGID_SIZES = (WallGrid(40, 25), WallGrid(90, 56), WallGrid(180, 112))
QUICK_RIGID_SIZES = (WallGrid(8, 5), WallGrid(16, 10))
END = 1.0  # s, of the first wall; where it ends is known
COMMON, QUICK_END = 0.5, 0.1  # s, of all walls
USUAL = harness.TimeSteps(1e-3)


def explicit_wall(size: WallGrid, stiffness_scale: float = STIFFNESS_SCALE) -> harness.Rerun:
    """Return the wall on springs, at its start."""
    return harness.Rerun(harness.pushed_wall(*size, contact={"stiffness_scale": stiffness_scale}))


def nonsmooth_wall(size: WallGrid) -> harness.Rerun:
    """Return the wall of the non-smooth scheme, at its start."""
    return harness.Rerun(harness.pushed_wall(*size, time=USUAL.time(), upright=harness.LOW_COURSES))


def growth(sizes: Sequence[WallGrid], block_times: Sequence[harness.Number]) -> float:
    """Return the exponent that fits time per step over number of blocks best, both in logarithms.

    `block_times` are those of a step and block, in any unit.
    """
    blocks = [size.blocks for size in sizes]
    times = [one.median * count for one, count in zip(block_times, blocks, strict=True)]
    return float(np.polyfit(np.log(blocks), np.log(times), 1)[0])


def measure_explicit(effort: harness.Effort) -> harness.Readings:
    """Measure all sizes from the same start, over the same time."""
    sizes, steps = (QUICK_SIZES, QUICK_STEPS) if effort.quick else (SIZES, STEPS)
    times, memory, details = [], [], []
    for size in sizes:
        scene, rounds = explicit_wall(size), max(1, FEWEST_BLOCKS // size.blocks)
        repeats = [[scene.run(steps) for _ in range(rounds)] for _ in range(effort.repeats)]
        share = 1e9 / (rounds * steps * size.blocks)
        samples = tuple(share * sum(run.seconds for run in runs) for runs in repeats)
        times.append(harness.Number(f"{size.blocks} blocks", "ns/block/step", samples))
        memory.append(harness.single(f"{size.blocks} blocks, memory", "bytes/block", scene.bytes / size.blocks))
        details.append(
            {
                "blocks": size.blocks,
                **size._asdict(),
                "ns_per_block_and_step": times[-1].median,
                "bytes_per_block": scene.bytes / size.blocks,
                "rebuilds": int(repeats[-1][-1].scene.world.clock[0].rebuilds) - 1,
                "simulated_s": steps * scene.step,
            }
        )
    exponent = harness.single("growth exponent of a step's time", "", growth(sizes, times))
    first, last = details[0], details[-1]
    note = (
        f"running bond, pushed with 1 m/s y/H, restitution 0.1, stiffness_scale {STIFFNESS_SCALE:g}, the first "
        f"{1e3 * first['simulated_s']:.1f} ms, {first['rebuilds']} to {last['rebuilds']} pair list updates"
    )
    return harness.Readings((*times, *memory, exponent), notes=(note,), details=tuple(details))


def measure_nonsmooth(effort: harness.Effort) -> harness.Readings:
    """Measure all sizes from the same start, over the same time, and the smallest over its whole collapse."""
    end, common = (QUICK_END, QUICK_END) if effort.quick else (END, COMMON)
    sizes = QUICK_RIGID_SIZES if effort.quick else RIGID_SIZES

    def watch(size: WallGrid, end: float) -> tuple[tuple[float, ...], harness.Number, dict[str, Any]]:
        """Return the CPU seconds of all repeats, those of a substep and block, and more for programs."""
        scene = nonsmooth_wall(size)
        steps = last_step_of(end, scene.step)
        runs = [scene.run(steps) for _ in range(effort.repeats)]
        final, seconds = runs[-1], tuple(run.seconds for run in runs)  # every run ends with the same bits
        substeps = steps * USUAL.substeps
        samples = tuple(1e9 / (substeps * size.blocks) * one for one in seconds)
        number = harness.Number(f"{size.blocks} blocks, a substep", "ns/block", samples)
        detail = {
            "blocks": size.blocks,
            **size._asdict(),
            "cpu_s": statistics.median(seconds),
            "ns_per_block_and_substep": number.median,
            "rebuilds": int(final.scene.world.clock[0].rebuilds),
            "sweeps_per_substep": int(final.scene.contacts.stepping[0].sweeps) / substeps,  # of the velocity pass
            "mean_x_m": float(final.bodies.x.mean()),
            "mean_y_m": float(final.bodies.y.mean()),
        }
        return seconds, number, detail

    seconds, substep, whole = watch(sizes[0], end)
    walls = [watch(size, common) for size in sizes]
    times, details = [number for _, number, _ in walls], [detail for *_, detail in walls]
    name = f"{whole['blocks']} blocks"
    numbers = (
        harness.Number(f"{name}, {end:g} s", "CPU s", seconds),
        harness.Number(f"{name}, {end:g} s, a substep", "ns/block", substep.samples),
        *times,
        harness.single("growth exponent of a substep's time", "", growth(sizes, times)),
        harness.single(f"{name}, mean x at {end:g} s", "mm", 1e3 * whole["mean_x_m"]),
        harness.single(f"{name}, mean y at {end:g} s", "mm", 1e3 * whole["mean_y_m"]),
    )
    first, last = details[0], details[-1]
    note = (
        f"running bond of 32 x 25 mm, pushed with 1 m/s y/H, restitution 0.1, {USUAL.setting}; a substep and growth: "
        f"the first {common:g} s of every wall (a smaller part of higher walls has fallen), {first['rebuilds']} to "
        f"{last['rebuilds']} pair list updates, {first['sweeps_per_substep']:.2f} to "
        f"{last['sweeps_per_substep']:.2f} velocity sweeps a substep"
    )
    return harness.Readings(numbers, notes=(note,), details=(whole, *details))


THREADS = 2
SOFT_SCALE = 1e-3  # a wall of a hundred blocks has fallen by then; softer ones would overlap too far


def measure_threads(
    effort: harness.Effort,
    *,
    scheme: str,
    wall: Callable[[WallGrid], harness.Rerun],
    sizes: tuple[tuple[WallGrid, ...], tuple[WallGrid, ...]],
    block_steps: tuple[int, int],
    most_steps: tuple[int, int],
) -> harness.Readings:
    """Advance walls with one thread and with two, in turns, from the start: the smaller they are, the longer.

    Sizes, blocks times steps of one sample, and the most steps of one are given in full and quick.
    """
    most, limit = block_steps[effort.quick], most_steps[effort.quick]
    numbers: list[harness.Number] = []
    alone = []  # walls that use one thread
    for size in sizes[effort.quick]:
        threads = useful_threads(THREADS, size.blocks, SCHEMES[scheme].least_bodies)
        if threads == 1:
            alone.append(str(size.blocks))
        steps = min(limit, most // size.blocks)
        numbers += thread_numbers(wall(size), size.blocks, steps, threads, effort.repeats)
    notes = [f"speed-up: wall time of one thread over that of {THREADS}; {THREADS} cores must be idle"]
    if alone:
        notes.append(f"walls of {', '.join(alone)} blocks always use one thread")
    return harness.Readings(tuple(numbers), notes=tuple(notes))


def thread_numbers(
    scene: harness.Rerun, count: int, steps: int, threads: int, repeats: int, element: str = "block"
) -> Iterator[harness.Number]:
    """Yield the time of a scene of so many elements with two threads, and by how much that is faster than one.

    `threads` are as many as are of use.
    """
    times, gains = [], []
    with Team(threads) as team:
        scene.run(1, team)  # starts everything that is started once
        for _ in range(repeats):
            alone = scene.run(steps).waited
            times.append(scene.run(steps, team).waited)
            gains.append(alone / times[-1])
    share = 1e9 / (steps * count)
    samples = tuple(share * one for one in times)
    yield harness.Number(f"{count} {element}s, {THREADS} threads", f"ns/{element}/step", samples)
    yield harness.Number(f"{count} {element}s, speed-up", "", tuple(gains))


EXPLICIT = harness.Benchmark(
    "walls", "pushed walls", measure_explicit, quick="walls of 100 and 400 blocks, 150 steps instead of 300"
)
NONSMOOTH = harness.Benchmark(
    "nonsmooth-walls",
    "pushed walls, non-smooth",
    measure_nonsmooth,
    quick="walls of 40 and 160 blocks for 0.1 s",
)
EXPLICIT_THREADS = harness.Benchmark(
    "threads",
    "two threads on one wall",
    functools.partial(
        measure_threads,
        scheme=SPRINGS,
        wall=functools.partial(explicit_wall, stiffness_scale=SOFT_SCALE),
        sizes=((WallGrid(10, 10), WallGrid(20, 10), WallGrid(40, 25), WallGrid(125, 80)), QUICK_SIZES),
        block_steps=(2_000_000, 200_000),
        most_steps=(5000, 5000),
    ),
    quick="walls of 100 and 400 blocks, a tenth of the steps",
)
NONSMOOTH_THREADS = harness.Benchmark(
    "nonsmooth-threads",
    "two threads on one wall, non-smooth",
    functools.partial(
        measure_threads,
        scheme=IMPULSES,
        wall=nonsmooth_wall,
        sizes=(
            (WallGrid(10, 10), WallGrid(20, 10), WallGrid(40, 25), WallGrid(90, 56)),
            (WallGrid(8, 5), WallGrid(40, 25)),
        ),
        block_steps=(1_000_000, 1_000_000),
        most_steps=(1000, 20),
    ),
    quick="walls of 40 and 1000 blocks, 20 steps",
)


RODS = {"unit_weight": 20e3, "young_modulus": 5.84e6, "poisson_ratio": 0.3, "friction_angle": "21.9 deg"}  # N/m3, Pa
SPACING = 2.5e-3  # m
BRICK_SCALE = 1e-4  # of the block, which then allows the steps that the soil needs
SOIL_STEPS, QUICK_SOIL_STEPS = 300, 60  # of small soils; new lists every 20
MOST, QUICK_MOST = 2_000_000, 30_000  # particles times steps of one sample
# particles of the soils, of the one that two threads advance, its steps, and the wall that they are compared with
FULL = ((1000, 3600, 10_000, 50_000), 10_000, 200, WallGrid(40, 25))
QUICK = ((250, 500), 500, 20, WallGrid(10, 10))


def pushed_soil(particles: int) -> tuple[int, harness.Rerun]:
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
            "materials": {"aluminium": harness.MATERIAL, "rods": RODS},
            "blocks": {"brick": {**harness.SIDES, "material": "aluminium"}},
            "bodies": [{"block": "brick", "x": -1.0, "y": 0.5 * harness.SIDES["height"]}],
            "soils": [{**soil, "x": [0.0, side], "y": [0.0, side]}],
            "contact": {"stiffness_scale": BRICK_SCALE},
            "time": {"end": 1.0, "stop_at_rest": False},
        }
    )
    scene = harness.Rerun(scenario)
    points = scene.scene.systems[0].points  # type: ignore[union-attr]
    points["vx"] = harness.PUSH * points["y"] / points["y"].max()
    scene.keep()
    return int(points.size), scene


def measure_soils(effort: harness.Effort) -> harness.Readings:
    """Measure all sizes and a wall in turns, each from the same start; then one thread and two in turns."""
    sizes, many, steps, size = QUICK if effort.quick else FULL
    most, limit = (QUICK_MOST, QUICK_SOIL_STEPS) if effort.quick else (MOST, SOIL_STEPS)
    soils, wall = [pushed_soil(particles) for particles in sizes], explicit_wall(size)
    times: dict[int, list[float]] = {count: [] for count, _ in soils}
    block_times = []
    for _ in range(effort.repeats):
        block_times.append(wall.run(limit).seconds / (limit * size.blocks))
        for count, soil in soils:
            last = min(limit, most // count)
            times[count].append(soil.run(last).seconds / (last * count))
    ratios = {count: zip(found, block_times, strict=True) for count, found in times.items()}
    numbers = [
        *(harness.Number(f"{n} particles", "ns/particle/step", tuple(1e9 * one for one in times[n])) for n in times),
        *(
            harness.Number(f"{n} particles, over a block of a wall", "", tuple(a / b for a, b in ratios[n]))
            for n in times
        ),
        *(harness.single(f"{n} particles, memory", "bytes/particle", soil.bytes / n) for n, soil in soils),
    ]
    count, soil = pushed_soil(many)
    threads = useful_threads(THREADS, count, BODIES_A_THREAD)
    numbers += thread_numbers(soil, count, steps, threads, effort.repeats, "particle")
    note = (
        f"a square of rods, spacing {1e3 * SPACING:g} mm, pushed with 1 m/s y/H; wall: {size.blocks} blocks on "
        f"springs, pushed alike; speed-up: wall time of one thread over that of two; two cores must be idle"
    )
    return harness.Readings(tuple(numbers), notes=(note,))


SOILS = harness.Benchmark(
    "soils", "pushed soil", measure_soils, quick="250 and 500 particles, a wall of 100 blocks, 60 steps"
)

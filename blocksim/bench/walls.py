"""Pushed walls by both schemes: time of a step, memory, growth with the blocks, a whole fall, and two threads."""

import functools
import statistics
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from blocksim.bench import measurement, scenes
from blocksim.scenario.models.timeline import IMPULSES, SPRINGS
from blocksim.simulation.loop import last_step_of
from blocksim.simulation.schemes import SCHEMES, Team, useful_threads


class Size(NamedTuple):
    """Blocks in a course, and courses; about 1.6 times as many, so that walls of all sizes look alike."""

    columns: int
    rows: int

    @property
    def blocks(self) -> int:
        """Number of blocks."""
        return self.columns * self.rows


SIZES = (Size(10, 10), Size(40, 25), Size(125, 80), Size(400, 250))
QUICK_SIZES = (Size(10, 10), Size(25, 16))
STIFFNESS_SCALE = 1e-4  # long steps, so that blocks move and pair lists are updated, as in a whole collapse
STEPS, QUICK_STEPS = 300, 150
FEWEST_BLOCKS = 3000  # of one sample: smaller walls are advanced several times
RIGID_SIZES = (Size(40, 25), Size(90, 56), Size(180, 112))
QUICK_RIGID_SIZES = (Size(8, 5), Size(16, 10))
END = 1.0  # s, of the first wall; where it ends is known
COMMON, QUICK_END = 0.5, 0.1  # s, of all walls
USUAL = scenes.Stepping(1e-3)


def explicit_wall(size: Size, stiffness_scale: float = STIFFNESS_SCALE) -> scenes.Rerun:
    """Return the wall on springs, at its start."""
    return scenes.Rerun(scenes.pushed_wall(*size, contact={"stiffness_scale": stiffness_scale}))


def nonsmooth_wall(size: Size) -> scenes.Rerun:
    """Return the wall of the non-smooth scheme, at its start."""
    return scenes.Rerun(scenes.pushed_wall(*size, time=USUAL.time(), upright=scenes.LOW_COURSES))


def growth(sizes: Sequence[Size], block_times: Sequence[measurement.Number]) -> float:
    """Return the exponent that fits time per step over number of blocks best, both in logarithms.

    `block_times` are those of a step and block, in any unit.
    """
    blocks = [size.blocks for size in sizes]
    times = [one.median * count for one, count in zip(block_times, blocks, strict=True)]
    return float(np.polyfit(np.log(blocks), np.log(times), 1)[0])


def measure_explicit(setting: measurement.Setting) -> measurement.Findings:
    """Measure all sizes from the same start, over the same time."""
    sizes, steps = (QUICK_SIZES, QUICK_STEPS) if setting.quick else (SIZES, STEPS)
    times, memory, details = [], [], []
    for size in sizes:
        scene, rounds = explicit_wall(size), max(1, FEWEST_BLOCKS // size.blocks)
        repeats = [[scene.run(steps) for _ in range(rounds)] for _ in range(setting.repeats)]
        share = 1e9 / (rounds * steps * size.blocks)
        samples = tuple(share * sum(run.seconds for run in runs) for runs in repeats)
        times.append(measurement.Number(f"{size.blocks} blocks", "ns/block/step", samples))
        memory.append(measurement.single(f"{size.blocks} blocks, memory", "bytes/block", scene.bytes / size.blocks))
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
    exponent = measurement.single("growth exponent of a step's time", "", growth(sizes, times))
    first, last = details[0], details[-1]
    note = (
        f"running bond, pushed with 1 m/s y/H, restitution 0.1, stiffness_scale {STIFFNESS_SCALE:g}, the first "
        f"{1e3 * first['simulated_s']:.1f} ms, {first['rebuilds']} to {last['rebuilds']} pair list updates"
    )
    return measurement.Findings((*times, *memory, exponent), notes=(note,), details=tuple(details))


def measure_nonsmooth(setting: measurement.Setting) -> measurement.Findings:
    """Measure all sizes from the same start, over the same time, and the smallest over its whole collapse."""
    end, common = (QUICK_END, QUICK_END) if setting.quick else (END, COMMON)
    sizes = QUICK_RIGID_SIZES if setting.quick else RIGID_SIZES

    def watch(size: Size, end: float) -> tuple[tuple[float, ...], measurement.Number, dict[str, Any]]:
        """Return the CPU seconds of all repeats, those of a substep and block, and more for programs."""
        scene = nonsmooth_wall(size)
        steps = last_step_of(end, scene.step)
        runs = [scene.run(steps) for _ in range(setting.repeats)]
        final, seconds = runs[-1], tuple(run.seconds for run in runs)  # every run ends with the same bits
        substeps = steps * USUAL.substeps
        samples = tuple(1e9 / (substeps * size.blocks) * one for one in seconds)
        number = measurement.Number(f"{size.blocks} blocks, a substep", "ns/block", samples)
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
        measurement.Number(f"{name}, {end:g} s", "CPU s", seconds),
        measurement.Number(f"{name}, {end:g} s, a substep", "ns/block", substep.samples),
        *times,
        measurement.single("growth exponent of a substep's time", "", growth(sizes, times)),
        measurement.single(f"{name}, mean x at {end:g} s", "mm", 1e3 * whole["mean_x_m"]),
        measurement.single(f"{name}, mean y at {end:g} s", "mm", 1e3 * whole["mean_y_m"]),
    )
    first, last = details[0], details[-1]
    note = (
        f"running bond of 32 x 25 mm, pushed with 1 m/s y/H, restitution 0.1, {USUAL.setting}; a substep and growth: "
        f"the first {common:g} s of every wall (a smaller part of higher walls has fallen), {first['rebuilds']} to "
        f"{last['rebuilds']} pair list updates, {first['sweeps_per_substep']:.2f} to "
        f"{last['sweeps_per_substep']:.2f} velocity sweeps a substep"
    )
    return measurement.Findings(numbers, notes=(note,), details=(whole, *details))


THREADS = 2
SOFT_SCALE = 1e-3  # a wall of a hundred blocks has fallen by then; softer ones would overlap too far


def measure_threads(
    setting: measurement.Setting,
    *,
    scheme: str,
    wall: Callable[[Size], scenes.Rerun],
    sizes: tuple[tuple[Size, ...], tuple[Size, ...]],
    block_steps: tuple[int, int],
    most_steps: tuple[int, int],
) -> measurement.Findings:
    """Advance walls with one thread and with two, in turns, from the start: the smaller they are, the longer.

    Sizes, blocks times steps of one sample, and the most steps of one are given in full and quick.
    """
    most, limit = block_steps[setting.quick], most_steps[setting.quick]
    numbers: list[measurement.Number] = []
    alone = []  # walls that use one thread
    for size in sizes[setting.quick]:
        threads = useful_threads(THREADS, size.blocks, SCHEMES[scheme].least_bodies)
        if threads == 1:
            alone.append(str(size.blocks))
        steps = min(limit, most // size.blocks)
        numbers += thread_numbers(wall(size), size.blocks, steps, threads, setting.repeats)
    notes = [f"speed-up: wall time of one thread over that of {THREADS}; {THREADS} cores must be idle"]
    if alone:
        notes.append(f"walls of {', '.join(alone)} blocks always use one thread")
    return measurement.Findings(tuple(numbers), notes=tuple(notes))


def thread_numbers(
    scene: scenes.Rerun, count: int, steps: int, threads: int, repeats: int, element: str = "block"
) -> Iterator[measurement.Number]:
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
    yield measurement.Number(f"{count} {element}s, {THREADS} threads", f"ns/{element}/step", samples)
    yield measurement.Number(f"{count} {element}s, speed-up", "", tuple(gains))


EXPLICIT = measurement.Measurement(
    "walls", "pushed walls", measure_explicit, quick="walls of 100 and 400 blocks, 150 steps instead of 300"
)
NONSMOOTH = measurement.Measurement(
    "nonsmooth-walls",
    "pushed walls, non-smooth",
    measure_nonsmooth,
    quick="walls of 40 and 160 blocks for 0.1 s",
)
EXPLICIT_THREADS = measurement.Measurement(
    "threads",
    "two threads on one wall",
    functools.partial(
        measure_threads,
        scheme=SPRINGS,
        wall=functools.partial(explicit_wall, stiffness_scale=SOFT_SCALE),
        sizes=((Size(10, 10), Size(20, 10), Size(40, 25), Size(125, 80)), QUICK_SIZES),
        block_steps=(2_000_000, 200_000),
        most_steps=(5000, 5000),
    ),
    quick="walls of 100 and 400 blocks, a tenth of the steps",
)
NONSMOOTH_THREADS = measurement.Measurement(
    "nonsmooth-threads",
    "two threads on one wall, non-smooth",
    functools.partial(
        measure_threads,
        scheme=IMPULSES,
        wall=nonsmooth_wall,
        sizes=((Size(10, 10), Size(20, 10), Size(40, 25), Size(90, 56)), (Size(8, 5), Size(40, 25))),
        block_steps=(1_000_000, 1_000_000),
        most_steps=(1000, 20),
    ),
    quick="walls of 40 and 1000 blocks, 20 steps",
)

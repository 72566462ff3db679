"""Pushed walls by both schemes: time of a step, memory, growth with the blocks, a whole fall, and two threads."""

from __future__ import annotations

import functools
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from blocksim.bench.measurement import Findings, Measurement, Number, Setting, repeat, single
from blocksim.bench.scenes import LOW_COURSES, Rerun, Stepping, pushed_wall
from blocksim.scenario.models.stepping import IMPULSES, SPRINGS
from blocksim.simulation.loop import last_step_of
from blocksim.simulation.schemes import SCHEMES
from blocksim.simulation.team import ALONE, Team, useful_threads

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence


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
USUAL = Stepping(1e-3)


def explicit_wall(size: Size, stiffness_scale: float = STIFFNESS_SCALE) -> Rerun:
    """Return the wall on springs, at its start."""
    return Rerun(pushed_wall(*size, contact={"stiffness_scale": stiffness_scale}))


def nonsmooth_wall(size: Size) -> Rerun:
    """Return the wall of the non-smooth scheme, at its start."""
    return Rerun(pushed_wall(*size, time=USUAL.time(), upright=LOW_COURSES))


def growth(sizes: Sequence[Size], block_times: Sequence[Number]) -> float:
    """Return the exponent that fits time per step over number of blocks best, both in logarithms.

    `block_times` are those of a step and block, in any unit.
    """
    blocks = [size.blocks for size in sizes]
    times = [one.median * count for one, count in zip(block_times, blocks, strict=True)]
    return float(np.polyfit(np.log(blocks), np.log(times), 1)[0])


@dataclass(frozen=True)
class Wall:
    """Result for one size on springs."""

    size: Size
    times: Number  # ns per block and step
    bytes_a_block: float
    rebuilds: int
    duration: float  # s simulated

    def detail(self) -> dict[str, object]:
        """Return it for programs."""
        return {
            "blocks": self.size.blocks,
            **self.size._asdict(),
            "ns_per_block_and_step": self.times.median,
            "bytes_per_block": self.bytes_a_block,
            "rebuilds": self.rebuilds,
            "simulated_s": self.duration,
        }


def measure_explicit(setting: Setting) -> Findings:
    """Measure all sizes from the same start, over the same time."""
    sizes = QUICK_SIZES if setting.quick else SIZES
    walls = [_explicit(size, setting) for size in sizes]
    times = [wall.times for wall in walls]
    numbers = (
        *times,
        *(single(f"{wall.times.quantity}, memory", "bytes/block", wall.bytes_a_block) for wall in walls),
        single("growth exponent of a step's time", "", growth(sizes, times)),
    )
    first = walls[0]
    note = (
        f"running bond, pushed with 1 m/s y/H, restitution 0.1, stiffness_scale {STIFFNESS_SCALE:g}, the first "
        f"{1e3 * first.duration:.1f} ms, {first.rebuilds} to {walls[-1].rebuilds} pair list updates"
    )
    return Findings(numbers, notes=(note,), details=tuple(wall.detail() for wall in walls))


def _explicit(size: Size, setting: Setting) -> Wall:
    steps = QUICK_STEPS if setting.quick else STEPS
    scene = explicit_wall(size)
    rounds = max(1, FEWEST_BLOCKS // size.blocks)
    rebuilds: list[int] = []

    def sample() -> float:
        runs = [scene.run(steps) for _ in range(rounds)]
        rebuilds.append(int(runs[-1].world.clock[0].rebuilds))
        return 1e9 * sum(run.seconds for run in runs) / (rounds * steps * size.blocks)

    times = repeat(f"{size.blocks} blocks", "ns/block/step", sample, setting.repeats)
    return Wall(size, times, scene.bytes / size.blocks, rebuilds[-1] - 1, steps * scene.step)


@dataclass(frozen=True)
class RigidWall:
    """Result for one size with rigid contacts."""

    size: Size
    seconds: tuple[float, ...]  # CPU time of every repeat
    steps: int
    rebuilds: int  # of the pair list
    sweeps: int  # of the velocity pass, over all substeps
    mean_x: float  # m, of all centres at the end
    mean_y: float  # m

    @property
    def substeps(self) -> int:
        """Substeps of the run."""
        return self.steps * USUAL.substeps

    @property
    def times(self) -> Number:
        """Time of a block and substep."""
        share = 1e9 / (self.substeps * self.size.blocks)
        name = f"{self.size.blocks} blocks, a substep"
        return Number(name, "ns/block", tuple(share * one for one in self.seconds))

    def detail(self) -> dict[str, object]:
        """Return it for programs."""
        return {
            "blocks": self.size.blocks,
            **self.size._asdict(),
            "cpu_s": self.times.median * self.size.blocks * 1e-9 * self.substeps,
            "ns_per_block_and_substep": self.times.median,
            "rebuilds": self.rebuilds,
            "sweeps_per_substep": self.sweeps / self.substeps,
            "mean_x_m": self.mean_x,
            "mean_y_m": self.mean_y,
        }


def measure_nonsmooth(setting: Setting) -> Findings:
    """Measure all sizes from the same start, over the same time, and the smallest over its whole collapse."""
    end, common = (QUICK_END, QUICK_END) if setting.quick else (END, COMMON)
    sizes = QUICK_RIGID_SIZES if setting.quick else RIGID_SIZES
    whole = _nonsmooth(sizes[0], end, setting.repeats)
    walls = [_nonsmooth(size, common, setting.repeats) for size in sizes]
    times = [wall.times for wall in walls]
    name = f"{whole.size.blocks} blocks"
    numbers = (
        Number(f"{name}, {end:g} s", "CPU s", whole.seconds),
        Number(f"{name}, {end:g} s, a substep", "ns/block", whole.times.samples),
        *times,
        single("growth exponent of a substep's time", "", growth(sizes, times)),
        single(f"{name}, mean x at {end:g} s", "mm", 1e3 * whole.mean_x),
        single(f"{name}, mean y at {end:g} s", "mm", 1e3 * whole.mean_y),
    )
    first, last = walls[0], walls[-1]
    note = (
        f"running bond of 32 x 25 mm, pushed with 1 m/s y/H, restitution 0.1, {USUAL.setting}; a substep and growth: "
        f"the first {common:g} s of every wall (a smaller part of higher walls has fallen), {first.rebuilds} to "
        f"{last.rebuilds} pair list updates, {first.sweeps / first.substeps:.2f} to "
        f"{last.sweeps / last.substeps:.2f} velocity sweeps a substep"
    )
    return Findings(numbers, notes=(note,), details=tuple(wall.detail() for wall in (whole, *walls)))


def _nonsmooth(size: Size, end: float, repeats: int) -> RigidWall:
    scene = nonsmooth_wall(size)
    last = last_step_of(end, scene.step)
    runs = [scene.run(last) for _ in range(repeats)]
    bodies, scene_at_end = runs[-1].bodies, runs[-1].scene  # every run ends with the same bits
    return RigidWall(
        size,
        tuple(run.seconds for run in runs),
        last,
        rebuilds=int(scene_at_end.world.clock[0].rebuilds),
        sweeps=int(scene_at_end.contacts.stepping[0].sweeps),
        mean_x=float(bodies.x.mean()),
        mean_y=float(bodies.y.mean()),
    )


EXPLICIT = Measurement(
    "walls", "pushed walls", measure_explicit, quick="walls of 100 and 400 blocks, 150 steps instead of 300"
)
NONSMOOTH = Measurement(
    "nonsmooth-walls",
    "pushed walls, non-smooth",
    measure_nonsmooth,
    quick="walls of 40 and 160 blocks for 0.1 s",
)


THREADS = 2
SOFT_SCALE = 1e-3  # a wall of a hundred blocks has fallen by then; softer ones would overlap too far


@dataclass(frozen=True)
class Plan:
    """Walls of a scheme, and how far they are advanced for one sample; the quick size second."""

    scheme: str
    wall: Callable[[Size], Rerun]
    sizes: tuple[tuple[Size, ...], tuple[Size, ...]]
    block_steps: tuple[int, int]
    most_steps: tuple[int, int]


@dataclass(frozen=True)
class Case:
    """A scene, and how far it is advanced for one sample."""

    scene: Rerun
    blocks: int
    steps: int
    least_bodies: int  # a thread, of the scheme
    element: str = "block"

    @property
    def threads(self) -> int:
        """How many are of use."""
        return useful_threads(THREADS, self.blocks, self.least_bodies)


def measure_threads(plan: Plan, setting: Setting) -> Findings:
    """Advance walls with one thread and with two, in turns, from the start: the smaller they are, the longer."""
    block_steps, most_steps = plan.block_steps[setting.quick], plan.most_steps[setting.quick]
    least = SCHEMES[plan.scheme].least_bodies
    cases = [
        Case(plan.wall(size), size.blocks, min(most_steps, block_steps // size.blocks), least)
        for size in plan.sizes[setting.quick]
    ]
    numbers = [number for case in cases for number in thread_numbers(case, setting.repeats)]
    return Findings(tuple(numbers), notes=notes(cases))


def thread_numbers(case: Case, repeats: int) -> Iterable[Number]:
    """Yield the time with two threads, and by how much that is faster than one."""
    times: list[float] = []
    gains: list[float] = []
    with Team(case.threads) as team:
        _seconds(case.scene, team, 1)  # starts everything that is started once
        for _ in range(repeats):
            alone = _seconds(case.scene, ALONE, case.steps)
            times.append(_seconds(case.scene, team, case.steps))
            gains.append(alone / times[-1])
    share = 1e9 / (case.steps * case.blocks)
    yield Number(
        f"{case.blocks} {case.element}s, {THREADS} threads",
        f"ns/{case.element}/step",
        tuple(share * one for one in times),
    )
    yield Number(f"{case.blocks} {case.element}s, speed-up", "", tuple(gains))


def notes(cases: Sequence[Case]) -> tuple[str, ...]:
    """Explain the speed-up, and which walls have none."""
    note = f"speed-up: wall time of one thread over that of {THREADS}; {THREADS} cores must be idle"
    few = [case.blocks for case in cases if case.threads == 1]
    unused = f"walls of {', '.join(map(str, few))} blocks always use one thread"
    return (note, unused) if few else (note,)


def _seconds(scene: Rerun, team: Team, steps: int) -> float:
    scene.restore()
    began = time.perf_counter()
    scene.advance(steps, team)
    return time.perf_counter() - began


SPRINGS_PLAN = Plan(
    SPRINGS,
    functools.partial(explicit_wall, stiffness_scale=SOFT_SCALE),
    sizes=((Size(10, 10), Size(20, 10), Size(40, 25), Size(125, 80)), (Size(10, 10), Size(25, 16))),
    block_steps=(2_000_000, 200_000),
    most_steps=(5000, 5000),
)
RIGID_PLAN = Plan(
    IMPULSES,
    nonsmooth_wall,
    sizes=((Size(10, 10), Size(20, 10), Size(40, 25), Size(90, 56)), (Size(8, 5), Size(40, 25))),
    block_steps=(1_000_000, 1_000_000),
    most_steps=(1000, 20),
)
EXPLICIT_THREADS = Measurement(
    "threads",
    "two threads on one wall",
    functools.partial(measure_threads, SPRINGS_PLAN),
    quick="walls of 100 and 400 blocks, a tenth of the steps",
)
NONSMOOTH_THREADS = Measurement(
    "nonsmooth-threads",
    "two threads on one wall, non-smooth",
    functools.partial(measure_threads, RIGID_PLAN),
    quick="walls of 40 and 1000 blocks, 20 steps",
)

"""Two threads on one wall, by both schemes: their speed-up over one, and that small walls do not become slower."""

from __future__ import annotations

import functools
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

from blocksim.bench.measurement import Findings, Measurement, Number, Setting
from blocksim.bench.walls import Size, explicit_wall, nonsmooth_wall
from blocksim.scenario.models.stepping import IMPULSES, SPRINGS
from blocksim.simulation.schemes import SCHEMES
from blocksim.simulation.team import ALONE, Team, useful_threads

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from blocksim.bench.timing import Rerun

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

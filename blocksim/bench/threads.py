"""Two threads on one wall: their speed-up over one, and that small walls do not become slower."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

from blocksim.bench.measurement import Findings, Number, Setting
from blocksim.bench.scenes import pushed_wall
from blocksim.bench.timing import Rerun
from blocksim.bench.walls import Size
from blocksim.simulation.schemes import SCHEMES
from blocksim.simulation.team import ALONE, Team, useful_threads

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

QUICK = "walls of 100 and 400 blocks, a tenth of the steps"
SIZES = (Size(10, 10), Size(20, 10), Size(40, 25), Size(125, 80))
QUICK_SIZES = (Size(10, 10), Size(25, 16))
THREADS = 2
BLOCK_STEPS = 2_000_000  # of one sample
QUICK_BLOCK_STEPS = 200_000
MOST_STEPS = 5000
STIFFNESS_SCALE = 1e-3  # a wall of a hundred blocks has fallen by then; softer ones would overlap too far
LEAST_BODIES = SCHEMES["explicit"].least_bodies


@dataclass(frozen=True)
class Case:
    """A scene, and how far it is advanced for one sample."""

    scene: Rerun
    blocks: int
    steps: int
    least_bodies: int  # a thread, of the scheme

    @property
    def threads(self) -> int:
        """How many are of use."""
        return useful_threads(THREADS, self.blocks, self.least_bodies)


def measure(setting: Setting) -> Findings:
    """Advance walls with one thread and with two, in turns."""
    cases = [_case(size, setting) for size in (QUICK_SIZES if setting.quick else SIZES)]
    numbers = [number for case in cases for number in compared(case, setting.repeats)]
    return Findings(tuple(numbers), notes=notes(cases))


def _case(size: Size, setting: Setting) -> Case:
    steps = min(MOST_STEPS, (QUICK_BLOCK_STEPS if setting.quick else BLOCK_STEPS) // size.blocks)
    scene = Rerun(pushed_wall(size.columns, size.rows, contact={"stiffness_scale": STIFFNESS_SCALE}))
    return Case(scene, size.blocks, steps, LEAST_BODIES)


def compared(case: Case, repeats: int) -> Iterable[Number]:
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
    yield Number(f"{case.blocks} blocks, {THREADS} threads", "ns/block/step", tuple(share * one for one in times))
    yield Number(f"{case.blocks} blocks, speed-up", "", tuple(gains))


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

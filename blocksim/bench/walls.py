"""Pushed walls of 100 to 100 000 blocks: time of a step, memory, and how both grow with the number of blocks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from blocksim.bench.measurement import Findings, Number, Setting, repeated, single
from blocksim.bench.scenes import pushed_wall
from blocksim.bench.timing import Rerun

if TYPE_CHECKING:
    from collections.abc import Sequence

QUICK = "walls of 100 and 400 blocks, 150 steps instead of 300"


class Size(NamedTuple):
    """Blocks in a course, and courses; about 1.6 times as many, so that walls of all sizes look alike."""

    columns: int
    rows: int

    @property
    def blocks(self) -> int:
        """Number of blocks."""
        return self.columns * self.rows


class Sized(Protocol):
    """A wall, and the time of its step."""

    @property
    def size(self) -> Size:
        """Blocks in it."""

    @property
    def step_time(self) -> float:
        """Time (ns) of one step of the whole wall."""


SIZES = (Size(10, 10), Size(40, 25), Size(125, 80), Size(400, 250))
QUICK_SIZES = (Size(10, 10), Size(25, 16))
STIFFNESS_SCALE = 1e-4  # long steps, so that blocks move and pair lists are updated, as in a whole collapse
STEPS, QUICK_STEPS = 300, 150
FEWEST_BLOCKS = 3000  # of one sample: smaller walls are advanced several times


@dataclass(frozen=True)
class Wall:
    """Result for one size."""

    size: Size
    times: Number  # ns per block and step
    bytes_a_block: float
    rebuilds: int
    duration: float  # s simulated

    @property
    def step_time(self) -> float:
        """Time (ns) of one step of the whole wall."""
        return self.times.median * self.size.blocks


def measure(setting: Setting) -> Findings:
    """Measure all sizes from the same start, over the same time."""
    walls = [_measured(size, setting) for size in (QUICK_SIZES if setting.quick else SIZES)]
    numbers = (
        *(wall.times for wall in walls),
        *(single(f"{_named(wall.size)}, memory", "bytes/block", wall.bytes_a_block) for wall in walls),
        single("growth exponent of a step's time", "", growth(walls)),
    )
    first = walls[0]
    note = (
        f"running bond, pushed with 1 m/s y/H, restitution 0.1, stiffness_scale {STIFFNESS_SCALE:g}, the first "
        f"{1e3 * first.duration:.1f} ms, {first.rebuilds} to {walls[-1].rebuilds} pair list updates"
    )
    return Findings(numbers, notes=(note,), details=tuple(_detail(wall) for wall in walls))


def growth(walls: Sequence[Sized]) -> float:
    """Return the exponent that fits time per step over number of blocks best, both in logarithms."""
    blocks = np.log([wall.size.blocks for wall in walls])
    return float(np.polyfit(blocks, np.log([wall.step_time for wall in walls]), 1)[0])


def _named(size: Size) -> str:
    return f"{size.blocks} blocks"


def _measured(size: Size, setting: Setting) -> Wall:
    steps = QUICK_STEPS if setting.quick else STEPS
    scene = Rerun(pushed_wall(size.columns, size.rows, contact={"stiffness_scale": STIFFNESS_SCALE}))
    rounds = max(1, FEWEST_BLOCKS // size.blocks)
    rebuilds: list[int] = []

    def sample() -> float:
        runs = [scene.run(steps) for _ in range(rounds)]
        rebuilds.append(int(runs[-1].world.clock[0].rebuilds))
        return 1e9 * sum(run.seconds for run in runs) / (rounds * steps * size.blocks)

    times = repeated(_named(size), "ns/block/step", sample, setting.repeats)
    return Wall(size, times, scene.bytes / size.blocks, rebuilds[-1] - 1, steps * scene.step)


def _detail(wall: Wall) -> dict[str, object]:
    return {
        "blocks": wall.size.blocks,
        "columns": wall.size.columns,
        "rows": wall.size.rows,
        "ns_per_block_and_step": wall.times.median,
        "bytes_per_block": wall.bytes_a_block,
        "rebuilds": wall.rebuilds,
        "simulated_s": wall.duration,
    }

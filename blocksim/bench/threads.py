"""Two threads on one wall: by how much they are faster than one, and that small walls do not become slower."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from blocksim.bench.measurement import Findings, Number, Setting
from blocksim.bench.scenes import pushed_wall
from blocksim.bench.timing import Rerun
from blocksim.bench.walls import Size
from blocksim.simulation.team import ALONE, Team, useful_threads

if TYPE_CHECKING:
    from collections.abc import Iterable

QUICK = "walls of 100 and 400 blocks, a tenth of the steps"
SIZES = (Size(10, 10), Size(20, 10), Size(40, 25), Size(125, 80))
QUICK_SIZES = (Size(10, 10), Size(25, 16))
THREADS = 2
BLOCK_STEPS = 2_000_000  # of one sample
QUICK_BLOCK_STEPS = 200_000
MOST_STEPS = 5000
STIFFNESS_SCALE = 1e-3  # a wall of a hundred blocks has fallen by then; softer ones would overlap too far


def measure(setting: Setting) -> Findings:
    """Advance walls with one thread and with two, in turns."""
    sizes = QUICK_SIZES if setting.quick else SIZES
    numbers = [number for size in sizes for number in _measured(size, setting)]
    note = f"speed-up: one thread's seconds of the clock over those of {THREADS}; {THREADS} cores must be idle"
    few = [size.blocks for size in sizes if useful_threads(THREADS, size.blocks) == 1]
    unused = f"walls of {', '.join(map(str, few))} blocks are left to one thread, whatever is asked for"
    return Findings(tuple(numbers), notes=(note, unused) if few else (note,))


def _measured(size: Size, setting: Setting) -> Iterable[Number]:
    steps = min(MOST_STEPS, (QUICK_BLOCK_STEPS if setting.quick else BLOCK_STEPS) // size.blocks)
    scene = Rerun(pushed_wall(size.columns, size.rows, contact={"stiffness_scale": STIFFNESS_SCALE}))
    times: list[float] = []
    gains: list[float] = []
    with Team(useful_threads(THREADS, size.blocks)) as team:
        _seconds(scene, team, 1)  # starts everything that is started once
        for _ in range(setting.repeats):
            alone = _seconds(scene, ALONE, steps)
            times.append(_seconds(scene, team, steps))
            gains.append(alone / times[-1])
    share = 1e9 / (steps * size.blocks)
    yield Number(f"{size.blocks} blocks, {THREADS} threads", "ns/block/step", tuple(share * one for one in times))
    yield Number(f"{size.blocks} blocks, speed-up", "", tuple(gains))


def _seconds(scene: Rerun, team: Team, steps: int) -> float:
    scene.restore()
    began = time.perf_counter()
    scene.advance(steps, team)
    return time.perf_counter() - began

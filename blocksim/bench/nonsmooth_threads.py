"""Two threads on one wall with the non-smooth scheme."""

from __future__ import annotations

from blocksim.bench.measurement import Findings, Setting
from blocksim.bench.nonsmooth_walls import wall_scene
from blocksim.bench.threads import Case, compared, notes
from blocksim.bench.walls import Size
from blocksim.simulation.schemes import SCHEMES

QUICK = "walls of 40 and 1000 blocks, 20 steps"
SIZES = (Size(10, 10), Size(20, 10), Size(40, 25), Size(90, 56))
QUICK_SIZES = (Size(8, 5), Size(40, 25))
BLOCK_STEPS = 1_000_000  # of one sample
MOST_STEPS, QUICK_STEPS = 1000, 20
LEAST_BODIES = SCHEMES["nonsmooth"].least_bodies


def measure(setting: Setting) -> Findings:
    """Advance walls with one thread and with two, in turns, from the start: the smaller they are, the longer."""
    cases = [_case(size, setting) for size in (QUICK_SIZES if setting.quick else SIZES)]
    numbers = [number for case in cases for number in compared(case, setting.repeats)]
    return Findings(tuple(numbers), notes=notes(cases))


def _case(size: Size, setting: Setting) -> Case:
    steps = QUICK_STEPS if setting.quick else min(MOST_STEPS, BLOCK_STEPS // size.blocks)
    return Case(wall_scene(size), size.blocks, steps, LEAST_BODIES)

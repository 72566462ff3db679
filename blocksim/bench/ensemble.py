"""Ensembles: collapses of the three blocks per second, each with its own friction, by both schemes."""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from blocksim.bench.measurement import Findings, Measurement, Number, Setting, repeated
from blocksim.bench.scenes import FRICTION, Stepping, Table, three_blocks
from blocksim.scenario.structures.base import draws
from blocksim.simulation.ensemble import Ensemble, run_ensemble
from blocksim.simulation.schemes import build_stacks
from blocksim.world.scenes import only

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from blocksim.scenario import Scenario

MEMBERS, QUICK_MEMBERS = 256, 8
SCATTER = 0.1  # of both coefficients of friction, uniform
SEED = 1
THREADS = (1, 2)


class Way(NamedTuple):
    """Settings of the collapses."""

    scheme: str
    contact: Table
    time: Table
    told: str


LEVEL, SAFETY = {"stiffness_scale": 3e-4}, 0.1  # as the measurement three-blocks finds it: within 0.2 mm
CONVERGED = Stepping(5e-4, substeps=1)  # as the measurement nonsmooth-blocks finds it: within 0.2 mm
EXPLICIT = Way(
    "explicit", LEVEL, {"safety": SAFETY}, f"stiffness_scale {LEVEL['stiffness_scale']:g}, safety {SAFETY:g}"
)
NONSMOOTH = Way("nonsmooth", {}, CONVERGED.time(), CONVERGED.setting)
WAYS = (EXPLICIT, NONSMOOTH)


def measure(setting: Setting) -> Findings:
    """Advance the same members on one thread and on two, by either scheme."""
    count = QUICK_MEMBERS if setting.quick else MEMBERS
    numbers = [number for way in WAYS for number in _numbers(way, scattered(count, way), setting.repeats)]
    note = (
        f"{count} members with friction scattered by {SCATTER:.0%}, until rest, each scheme within 0.2 mm of its own "
        f"finest run ({'; '.join(f'{way.scheme}: {way.told}' for way in WAYS)}); building the scenes is not counted"
    )
    return Findings(tuple(numbers), notes=(note,))


def scattered(count: int, way: Way = EXPLICIT) -> list[Scenario]:
    """Return three blocks with different friction."""
    scatter = SCATTER * (2.0 * draws(SEED, count, len(FRICTION)) - 1.0)
    values = np.array([*FRICTION.values()]) * (1.0 + scatter)
    frictions = (dict(zip(FRICTION, row, strict=True)) for row in values.tolist())
    return [three_blocks(way.contact, way.time, friction) for friction in frictions]


def rates(members: Sequence[Scenario], threads: int, repeats: int) -> tuple[Number, Number]:
    """Return collapses per CPU second, and per second of the clock."""
    run_ensemble(members[:1])  # compiles what single runs do not need
    clock: list[float] = []

    def sample() -> float:
        ensemble = Ensemble(members, only(build_stacks(members)))
        with ThreadPoolExecutor(threads) as pool:
            cpu, began = time.process_time(), time.perf_counter()
            ensemble.advance(pool, threads)
            clock.append(len(members) / (time.perf_counter() - began))
            return len(members) / (time.process_time() - cpu)

    rate = repeated("a second and core", "1/s", sample, repeats)
    return rate, Number(f"a second, {threads} thread{'s' if threads > 1 else ''}", "1/s", tuple(clock))


def _numbers(way: Way, members: Sequence[Scenario], repeats: int) -> Iterable[Number]:
    found = [rates(members, threads, repeats) for threads in THREADS]
    for number in (found[0][0], *(clock for _, clock in found)):
        yield Number(f"{way.scheme}: {number.quantity}", number.unit, number.samples)


ENSEMBLE = Measurement("ensemble", "many collapses together", measure, quick="8 members instead of 256")

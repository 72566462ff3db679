"""Ensembles: collapses of the three blocks per second, each with its own friction, by both schemes."""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from blocksim.bench.measurement import Findings, Measurement, Number, Setting, repeated
from blocksim.bench.scenes import FRICTION, Stepping, Table, three_blocks
from blocksim.scenario.models.stepping import IMPULSES, SPRINGS
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


class SchemeSetting(NamedTuple):
    """A scheme with the cheapest setting that ends within 0.2 mm, as the measurements of the three blocks find it."""

    scheme: str
    contact: Table
    time: Table
    text: str


CONVERGED = Stepping(5e-4, substeps=1)
SETTINGS = (
    SchemeSetting(SPRINGS, {"stiffness_scale": 3e-4}, {"safety": 0.1}, "stiffness_scale 0.0003, safety 0.1"),
    SchemeSetting(IMPULSES, {}, CONVERGED.time(), CONVERGED.setting),
)


def measure_ensemble(setting: Setting) -> Findings:
    """Advance the same members on one thread and on two, by either scheme."""
    count = QUICK_MEMBERS if setting.quick else MEMBERS
    numbers = [number for one in SETTINGS for number in _numbers(one.scheme, scattered(count, one), setting.repeats)]
    note = (
        f"{count} members with friction scattered by {SCATTER:.0%}, until rest, each scheme within 0.2 mm of its own "
        f"finest run ({'; '.join(f'{one.scheme}: {one.text}' for one in SETTINGS)}); building the scenes is not counted"
    )
    return Findings(tuple(numbers), notes=(note,))


def scattered(count: int, setting: SchemeSetting) -> list[Scenario]:
    """Return three blocks with different friction."""
    scatter = SCATTER * (2.0 * draws(SEED, count, len(FRICTION)) - 1.0)
    values = np.array([*FRICTION.values()]) * (1.0 + scatter)
    frictions = (dict(zip(FRICTION, row, strict=True)) for row in values.tolist())
    return [three_blocks(setting.contact, setting.time, friction) for friction in frictions]


def rates(members: Sequence[Scenario], threads: int, repeats: int) -> tuple[Number, Number]:
    """Return collapses per CPU second, and per second of the clock."""
    run_ensemble(members[:1])  # compiles what single runs do not need
    clock: list[float] = []

    def sample() -> float:
        ensemble = Ensemble(members, only(build_stacks(members)), peaks=False)
        with ThreadPoolExecutor(threads) as pool:
            cpu, began = time.process_time(), time.perf_counter()
            ensemble.advance(pool, threads)
            clock.append(len(members) / (time.perf_counter() - began))
            return len(members) / (time.process_time() - cpu)

    rate = repeated("a second and core", "1/s", sample, repeats)
    return rate, Number(f"a second, {threads} thread{'s' if threads > 1 else ''}", "1/s", tuple(clock))


def _numbers(scheme: str, members: Sequence[Scenario], repeats: int) -> Iterable[Number]:
    found = [rates(members, threads, repeats) for threads in THREADS]
    for number in (found[0][0], *(clock for _, clock in found)):
        yield Number(f"{scheme}: {number.quantity}", number.unit, number.samples)


ENSEMBLE = Measurement("ensemble", "many collapses together", measure_ensemble, quick="8 members instead of 256")

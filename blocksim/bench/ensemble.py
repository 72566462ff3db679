"""Ensembles: how many collapses of the three blocks a second, each with friction of its own."""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING

import numpy as np

from blocksim.bench.measurement import Findings, Number, Setting, repeated
from blocksim.bench.scenes import FRICTION, three_blocks
from blocksim.scenario.structures.base import draws
from blocksim.simulation.ensemble import Ensemble, run_ensemble
from blocksim.world.build import build_world

if TYPE_CHECKING:
    from collections.abc import Sequence

    from blocksim.scenario import Scenario

QUICK = "8 members instead of 256"
MEMBERS, QUICK_MEMBERS = 256, 8
LEVEL = {"stiffness_scale": 3e-4}  # as the measurement three-blocks finds it: within 0.2 mm of the stiffest run
SAFETY = 0.1
SCATTER = 0.1  # of both coefficients of friction, uniform
SEED = 1
THREADS = (1, 2)


def measure(setting: Setting) -> Findings:
    """Advance the same members on one thread and on two."""
    members = scattered(QUICK_MEMBERS if setting.quick else MEMBERS)
    run_ensemble(members[:1])  # compiles what single runs do not need
    rates = [_rates(members, threads, setting) for threads in THREADS]
    note = (
        f"{len(members)} members with friction scattered by {SCATTER:.0%}, stiffness_scale "
        f"{LEVEL['stiffness_scale']:g}, safety {SAFETY:g}, until rest; building the scenes is not counted"
    )
    return Findings((rates[0][0], *(clock for _, clock in rates)), notes=(note,))


def scattered(count: int) -> list[Scenario]:
    """Return three blocks with different friction."""
    scatter = SCATTER * (2.0 * draws(SEED, count, len(FRICTION)) - 1.0)
    values = np.array([*FRICTION.values()]) * (1.0 + scatter)
    frictions = (dict(zip(FRICTION, row, strict=True)) for row in values.tolist())
    return [three_blocks(LEVEL, {"safety": SAFETY}, friction) for friction in frictions]


def _rates(members: Sequence[Scenario], threads: int, setting: Setting) -> tuple[Number, Number]:
    """Return collapses per CPU second, and per second of the clock."""
    clock: list[float] = []

    def sample() -> float:
        ensemble = Ensemble(members, [build_world(scenario) for scenario in members])
        with ThreadPoolExecutor(threads) as pool:
            cpu, began = time.process_time(), time.perf_counter()
            ensemble.advance(pool)
            clock.append(len(members) / (time.perf_counter() - began))
            return len(members) / (time.process_time() - cpu)

    rate = repeated("collapses per second and core", "1/s", sample, setting.repeats)
    return rate, Number(f"collapses per second, {threads} thread{'s' if threads > 1 else ''}", "1/s", tuple(clock))

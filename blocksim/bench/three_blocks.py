"""The three blocks by both schemes: time of a step, time to a converged answer, and ensembles."""

import itertools
import statistics
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from blocksim.bench import harness
from blocksim.scenario import Model, Scenario
from blocksim.scenario.models.timeline import IMPULSES, SPRINGS
from blocksim.scenario.structures.base import draws
from blocksim.simulation.ensemble import Ensemble, run_ensemble
from blocksim.simulation.loop import last_step_of
from blocksim.simulation.schemes import build_stacks
from blocksim.world.build import only_stack

MEMBERS, QUICK_MEMBERS = 256, 8
SCATTER = 0.1  # of both coefficients of friction, uniform
SEED = 1
THREADS = (1, 2)
CONVERGED = harness.TimeSteps(5e-4, substeps=1)
SETTINGS: dict[str, tuple[harness.Table, harness.Table, str]] = {
    SPRINGS: ({"stiffness_scale": 3e-4}, {"safety": 0.1}, "stiffness_scale 0.0003, safety 0.1"),
    IMPULSES: ({}, CONVERGED.time(), CONVERGED.setting),
}
"""Tables [contact] and [time] of each scheme, and their text: the cheapest that end within 0.2 mm, as found below."""


def measure_ensemble(effort: harness.Effort) -> harness.Readings:
    """Advance the same members on one thread and on two, by either scheme."""
    count = QUICK_MEMBERS if effort.quick else MEMBERS
    numbers: list[harness.Number] = []
    for scheme in SETTINGS:
        members = scatter_friction(count, scheme)
        alone, together = (rates(members, threads, effort.repeats) for threads in THREADS)
        found = (*alone, together[1])
        numbers += [harness.Number(f"{scheme}: {number.quantity}", number.unit, number.samples) for number in found]
    converged = "; ".join(f"{scheme}: {text}" for scheme, (*_, text) in SETTINGS.items())
    note = (
        f"{count} members with friction scattered by {SCATTER:.0%}, until rest, each scheme within 0.2 mm of its own "
        f"finest run ({converged}); building the scenes is not counted"
    )
    return harness.Readings(tuple(numbers), notes=(note,))


def scatter_friction(count: int, scheme: str) -> list[Model]:
    """Return three blocks with different friction, by the converged setting of a scheme."""
    contact, stepping, _ = SETTINGS[scheme]
    scatter = SCATTER * (2.0 * draws(SEED, count, len(harness.FRICTION)) - 1.0)
    values = np.array([*harness.FRICTION.values()]) * (1.0 + scatter)
    return [
        Model(harness.three_blocks(contact, stepping, dict(zip(harness.FRICTION, row, strict=True))))
        for row in values.tolist()
    ]


def rates(members: Sequence[Model], threads: int, repeats: int) -> tuple[harness.Number, harness.Number]:
    """Return collapses per CPU second, and per second of the clock."""
    run_ensemble(members[:1])  # compiles what single runs do not need
    clock: list[float] = []

    def sample() -> float:
        ensemble = Ensemble(members, only_stack(build_stacks(members)).scenes, peaks=False)
        with ThreadPoolExecutor(threads) as pool:
            cpu, began = time.process_time(), time.perf_counter()
            ensemble.advance(pool, threads)
            clock.append(len(members) / (time.perf_counter() - began))
            return len(members) / (time.process_time() - cpu)

    rate = harness.repeat("a second and core", "1/s", sample, repeats)
    return rate, harness.Number(f"a second, {threads} thread{'s' if threads > 1 else ''}", "1/s", tuple(clock))


ENSEMBLE = harness.Benchmark("ensemble", "many collapses together", measure_ensemble, quick="8 members instead of 256")


CLOSE = 0.2e-3  # m
DURATION, QUICK_DURATION = 0.4, 0.01  # s
SCALES = (1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 1e-1, 3e-1, 1.0)
QUICK_SCALES = (1e-4, 1e-3, 1e-2)
SAFETIES = (0.1, 0.05)
ONE_SWEEP = harness.TimeSteps(1e-3, substeps=1, velocity_sweeps=1)  # enough without restitution
STEPS = (1e-3, 5e-4, 2e-4, 1e-4)  # s
QUICK_STEPS = (1e-3, 5e-4)
SUBSTEPS = (1, 2, 4)
FINEST, QUICK_FINEST = 1e-5, 2e-4  # s


@dataclass(frozen=True)
class Solution:
    """One way to compute the collapse."""

    setting: Mapping[str, float]  # its keys of the scenario
    centres: NDArray[np.float64]  # (2, 3) m, at rest
    seconds: tuple[float, ...]  # CPU time of every repeat
    steps: int

    @property
    def text(self) -> str:
        """For people."""
        return ", ".join(f"{name} {value:g}" for name, value in self.setting.items())

    def off(self, other: "Solution") -> float:
        """Return the largest distance (m) between final positions of a block by this and another way."""
        return float(np.hypot(*(self.centres - other.centres)).max())

    def number(self, quantity: str) -> harness.Number:
        """Return its CPU time for the table."""
        return harness.Number(quantity, "CPU ms", tuple(1e3 * one for one in self.seconds))

    def detail(self, finest: "Solution") -> dict[str, object]:
        """Return it for programs."""
        return {
            **self.setting,
            "steps": self.steps,
            "off_mm": 1e3 * self.off(finest),
            "cpu_ms": 1e3 * statistics.median(self.seconds),
            "x_mm": [1e3 * x for x in self.centres[0].tolist()],
        }


def converged_levels(levels: Sequence[Solution], finest: Solution) -> list[Solution]:
    """Return the levels, coarse to fine, that are close to the finest, all finer ones too: one can be so by chance."""
    return list(itertools.takewhile(lambda level: level.off(finest) <= CLOSE, reversed(levels)))


def solve_level(setting: Mapping[str, float], scenario: Scenario, repeats: int) -> Solution:
    """Run until the blocks rest."""
    scene = harness.Rerun(scenario)
    last = last_step_of(scenario.time.end, scene.step)
    runs = [scene.run(last) for _ in range(repeats)]
    bodies, steps = runs[-1].bodies, int(runs[-1].scene.world.clock[0].steps)  # every run ends with the same bits
    return Solution(setting, np.array([bodies.x, bodies.y]), tuple(run.seconds for run in runs), steps)


def measure_explicit(effort: harness.Effort) -> harness.Readings:
    """Measure a step at full stiffness, and the cheapest collapse that greater stiffnesses confirm."""
    scales = QUICK_SCALES if effort.quick else SCALES
    rows = []
    for safety in SAFETIES:
        keys = [{"stiffness_scale": scale, "safety": safety} for scale in scales]
        scenarios = [harness.three_blocks({"stiffness_scale": scale}, {"safety": safety}) for scale in scales]
        rows.append([solve_level(*one, effort.repeats) for one in zip(keys, scenarios, strict=True)])
    levels = [level for row in rows for level in row]
    finest = levels[-1]
    close = [level for row in rows for level in converged_levels(row, finest)]
    cheapest = min(close, key=lambda level: statistics.median(level.seconds))
    scene = harness.Rerun(
        harness.three_blocks(time={"stop_at_rest": False})
    )  # the blocks are at rest for the last quarter
    last = last_step_of(QUICK_DURATION if effort.quick else DURATION, scene.step)
    numbers = (
        harness.repeat("a step", "ns", lambda: 1e9 * scene.run(last).seconds / last, effort.repeats),
        cheapest.number("time to a converged answer"),
        finest.number("the stiffest run, its measure"),
    )
    note = (
        f"converged: here and at all greater stiffnesses, centres at rest within {1e3 * CLOSE:g} mm of the stiffest "
        f"run ({finest.text}); the cheapest of {len(close)} such settings of {len(levels)} has {cheapest.text}, "
        f"{cheapest.steps} steps, and is off by {1e3 * cheapest.off(finest):.2f} mm"
    )
    return harness.Readings(numbers, notes=(note,), details=tuple(level.detail(finest) for level in levels))


def measure_nonsmooth(effort: harness.Effort) -> harness.Readings:
    """Measure a collapse without restitution in few long steps, and one with restitution that finer steps confirm."""

    def solve(stepping: harness.TimeSteps, restitution: float = harness.RESTITUTION) -> Solution:
        scenario = harness.three_blocks({"restitution": restitution}, stepping.time())
        return solve_level(asdict(stepping), scenario, effort.repeats)

    without = solve(ONE_SWEEP, 0.0)
    steps, finest_step = (QUICK_STEPS, QUICK_FINEST) if effort.quick else (STEPS, FINEST)
    finest = solve(harness.TimeSteps(finest_step, substeps=1))
    rows = [[solve(harness.TimeSteps(step, parts)) for step in steps] for parts in SUBSTEPS]
    close = [level for row in rows for level in converged_levels(row, finest)] or [finest]
    cheapest = min(close, key=lambda level: statistics.median(level.seconds))
    members = QUICK_MEMBERS if effort.quick else MEMBERS
    numbers, ends = [], []
    for restitution, level in ((0.0, without), (harness.RESTITUTION, cheapest)):
        scenario = harness.three_blocks({"restitution": restitution}, {"scheme": IMPULSES, **level.setting})
        together, _ = rates([Model(scenario)] * members, 1, effort.repeats)
        name, (_, two, three) = f"e = {restitution:g}", 1e3 * level.centres[0]
        numbers += [
            level.number(f"{name}: alone"),
            harness.Number(f"{name}: among many", "CPU ms", tuple(1e3 / one for one in together.samples)),
            harness.Number(f"{name}: collapses a second and core", "1/s", together.samples),
        ]
        at = f"blocks 2 and 3 at x = {two:.2f} and {three:.2f} mm"
        ends.append(f"{name}: {level.text}, {level.steps} steps, {at}; ")
    meaning = f"all runs until rest; alone includes one call from Python; among many: {members} equal members"
    converged = (
        f"the cheapest of {len(close)} settings that are, as all with shorter steps, within {1e3 * CLOSE:g} mm of "
        f"{finest.text}; itself off by {1e3 * cheapest.off(finest):.2f} mm"
    )
    details = [level.detail(finest) for row in rows for level in row]
    details += [finest.detail(finest), without.detail(without)]
    return harness.Readings(tuple(numbers), notes=(ends[0] + meaning, ends[1] + converged), details=tuple(details))


EXPLICIT = harness.Benchmark(
    "three-blocks",
    "collapse of the three blocks",
    measure_explicit,
    quick="0.01 s instead of 0.4 s at full stiffness, converged answer against a hundredth of the stiffness",
)
NONSMOOTH = harness.Benchmark(
    "nonsmooth-blocks",
    "collapse of the three blocks, non-smooth",
    measure_nonsmooth,
    quick="8 members instead of 256, coarse steps against one that is not much finer",
)

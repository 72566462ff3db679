"""The three blocks by both schemes: time of a step, time to a converged answer, and ensembles."""

from __future__ import annotations

import itertools
import statistics
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from blocksim.bench.measurement import Findings, Measurement, Number, Setting, repeat
from blocksim.bench.scenes import FRICTION, RESTITUTION, Rerun, Stepping, Table, three_blocks
from blocksim.scenario.models.stepping import IMPULSES, SPRINGS
from blocksim.scenario.structures.base import draws
from blocksim.simulation.ensemble import Ensemble, run_ensemble
from blocksim.simulation.loop import last_step_of
from blocksim.simulation.schemes import build_stacks
from blocksim.world.build import only_stack

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from numpy.typing import NDArray

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
    numbers = [
        number for one in SETTINGS for number in _numbers(one.scheme, scatter_friction(count, one), setting.repeats)
    ]
    note = (
        f"{count} members with friction scattered by {SCATTER:.0%}, until rest, each scheme within 0.2 mm of its own "
        f"finest run ({'; '.join(f'{one.scheme}: {one.text}' for one in SETTINGS)}); building the scenes is not counted"
    )
    return Findings(tuple(numbers), notes=(note,))


def scatter_friction(count: int, setting: SchemeSetting) -> list[Scenario]:
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
        ensemble = Ensemble(members, only_stack(build_stacks(members)), peaks=False)
        with ThreadPoolExecutor(threads) as pool:
            cpu, began = time.process_time(), time.perf_counter()
            ensemble.advance(pool, threads)
            clock.append(len(members) / (time.perf_counter() - began))
            return len(members) / (time.process_time() - cpu)

    rate = repeat("a second and core", "1/s", sample, repeats)
    return rate, Number(f"a second, {threads} thread{'s' if threads > 1 else ''}", "1/s", tuple(clock))


def _numbers(scheme: str, members: Sequence[Scenario], repeats: int) -> Iterable[Number]:
    found = [rates(members, threads, repeats) for threads in THREADS]
    for number in (found[0][0], *(clock for _, clock in found)):
        yield Number(f"{scheme}: {number.quantity}", number.unit, number.samples)


ENSEMBLE = Measurement("ensemble", "many collapses together", measure_ensemble, quick="8 members instead of 256")


CLOSE = 0.2e-3  # m
DURATION, QUICK_DURATION = 0.4, 0.01  # s
SCALES = (1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 1e-1, 3e-1, 1.0)
QUICK_SCALES = (1e-4, 1e-3, 1e-2)
SAFETIES = (0.1, 0.05)
ONE_SWEEP = Stepping(1e-3, substeps=1, sweeps=1)  # enough without restitution
STEPS = (1e-3, 5e-4, 2e-4, 1e-4)  # s
QUICK_STEPS = (1e-3, 5e-4)
SUBSTEPS = (1, 2, 4)
FINEST, QUICK_FINEST = 1e-5, 2e-4  # s


@dataclass(frozen=True)
class Level:
    """One way to compute the collapse."""

    setting: Mapping[str, float]  # its keys of the scenario
    centres: NDArray[np.float64]  # (2, 3) m, at rest
    seconds: tuple[float, ...]  # CPU time of every repeat
    steps: int

    @property
    def text(self) -> str:
        """For people."""
        return ", ".join(f"{name} {value:g}" for name, value in self.setting.items())

    @property
    def median(self) -> float:
        """CPU seconds."""
        return statistics.median(self.seconds)

    def off(self, other: Level) -> float:
        """Return the largest distance (m) between final positions of a block by this and another way."""
        return float(np.hypot(*(self.centres - other.centres)).max())

    def number(self, quantity: str) -> Number:
        """Return its CPU time for the table."""
        return Number(quantity, "CPU ms", tuple(1e3 * one for one in self.seconds))

    def detail(self, finest: Level) -> dict[str, object]:
        """Return it for programs."""
        return {
            **self.setting,
            "steps": self.steps,
            "off_mm": 1e3 * self.off(finest),
            "cpu_ms": 1e3 * self.median,
            "x_mm": [1e3 * x for x in self.centres[0].tolist()],
        }


def converged_levels(levels: Sequence[Level], finest: Level) -> list[Level]:
    """Return the levels, coarse to fine, that are close to the finest, all finer ones too: one can be so by chance."""
    return list(itertools.takewhile(lambda level: level.off(finest) <= CLOSE, reversed(levels)))


def solve_level(setting: Mapping[str, float], scenario: Scenario, repeats: int) -> Level:
    """Run until the blocks rest."""
    scene = Rerun(scenario)
    last = last_step_of(scenario.time.end, scene.step)
    runs = [scene.run(last) for _ in range(repeats)]
    bodies = runs[-1].bodies  # every run ends with the same bits
    return Level(setting, np.array([bodies.x, bodies.y]), tuple(run.seconds for run in runs), runs[-1].steps)


def measure_explicit(setting: Setting) -> Findings:
    """Measure a step at full stiffness, and the cheapest collapse that greater stiffnesses confirm."""
    scales = QUICK_SCALES if setting.quick else SCALES
    rows = [[_explicit(scale, safety, setting.repeats) for scale in scales] for safety in SAFETIES]
    levels = [level for row in rows for level in row]
    finest = levels[-1]
    close = [level for row in rows for level in converged_levels(row, finest)]
    cheapest = min(close, key=lambda level: level.median)
    numbers = (
        _step_time(setting),
        cheapest.number("time to a converged answer"),
        finest.number("the stiffest run, its measure"),
    )
    note = (
        f"converged: here and at all greater stiffnesses, centres at rest within {1e3 * CLOSE:g} mm of the stiffest "
        f"run ({finest.text}); the cheapest of {len(close)} such settings of {len(levels)} has {cheapest.text}, "
        f"{cheapest.steps} steps, and is off by {1e3 * cheapest.off(finest):.2f} mm"
    )
    return Findings(numbers, notes=(note,), details=tuple(level.detail(finest) for level in levels))


def _step_time(setting: Setting) -> Number:
    """At the aluminium's own stiffness, with the blocks at rest for the last quarter."""
    scene = Rerun(three_blocks(time={"stop_at_rest": False}))
    last = last_step_of(QUICK_DURATION if setting.quick else DURATION, scene.step)
    return repeat("a step", "ns", lambda: 1e9 * scene.run(last).seconds / last, setting.repeats)


def _explicit(scale: float, safety: float, repeats: int) -> Level:
    scenario = three_blocks(contact={"stiffness_scale": scale}, time={"safety": safety})
    return solve_level({"stiffness_scale": scale, "safety": safety}, scenario, repeats)


def measure_nonsmooth(setting: Setting) -> Findings:
    """Measure a collapse without restitution in few long steps, and one with restitution that finer steps confirm."""
    without = _nonsmooth(ONE_SWEEP, 0.0, setting)
    steps, finest_step = (QUICK_STEPS, QUICK_FINEST) if setting.quick else (STEPS, FINEST)
    finest = _nonsmooth(Stepping(finest_step, substeps=1), RESTITUTION, setting)
    rows = [[_nonsmooth(Stepping(step, parts), RESTITUTION, setting) for step in steps] for parts in SUBSTEPS]
    close = [level for row in rows for level in converged_levels(row, finest)] or [finest]
    cheapest = min(close, key=lambda level: level.median)
    members = QUICK_MEMBERS if setting.quick else MEMBERS
    numbers = (*_alone_and_among(members, 0.0, without), *_alone_and_among(members, RESTITUTION, cheapest))
    meaning = (
        f"e = 0: {without.text}, {without.steps} steps, blocks 2 and 3 at x = {_places(without)}; all runs until rest; "
        f"alone includes one call from Python; among many: {members} equal members"
    )
    converged = (
        f"e = {RESTITUTION:g}: {cheapest.text}, {cheapest.steps} steps, blocks 2 and 3 at x = {_places(cheapest)}; the "
        f"cheapest of {len(close)} settings that are, as all with shorter steps, within {1e3 * CLOSE:g} mm of "
        f"{finest.text}; itself off by {1e3 * cheapest.off(finest):.2f} mm"
    )
    details = [level.detail(finest) for row in rows for level in row]
    details += [finest.detail(finest), without.detail(without)]
    return Findings(numbers, notes=(meaning, converged), details=tuple(details))


def _nonsmooth(stepping: Stepping, restitution: float, setting: Setting) -> Level:
    return solve_level(stepping.keys, three_blocks({"restitution": restitution}, stepping.time()), setting.repeats)


def _places(level: Level) -> str:
    _, two, three = 1e3 * level.centres[0]
    return f"{two:.2f} and {three:.2f} mm"


def _alone_and_among(members: int, restitution: float, level: Level) -> Iterable[Number]:
    name = f"e = {restitution:g}"
    scenario = three_blocks({"restitution": restitution}, {"scheme": IMPULSES, **level.setting})
    together, _ = rates([scenario] * members, 1, len(level.seconds))
    yield level.number(f"{name}: alone")
    yield Number(f"{name}: among many", "CPU ms", tuple(1e3 / one for one in together.samples))
    yield Number(f"{name}: collapses a second and core", "1/s", together.samples)


EXPLICIT = Measurement(
    "three-blocks",
    "collapse of the three blocks",
    measure_explicit,
    quick="0.01 s instead of 0.4 s at full stiffness, converged answer against a hundredth of the stiffness",
)
NONSMOOTH = Measurement(
    "nonsmooth-blocks",
    "collapse of the three blocks, non-smooth",
    measure_nonsmooth,
    quick="8 members instead of 256, coarse steps against one that is not much finer",
)

"""The three blocks with the non-smooth scheme: time of a collapse, alone and among many advanced together."""

from __future__ import annotations

from typing import TYPE_CHECKING

from blocksim.bench.ensemble import MEMBERS, QUICK_MEMBERS, rates
from blocksim.bench.levels import CLOSE, Level, settled, solved
from blocksim.bench.measurement import Findings, Number, Setting
from blocksim.bench.scenes import RESTITUTION, three_blocks
from blocksim.bench.stepping import Stepping

if TYPE_CHECKING:
    from collections.abc import Iterable

    from blocksim.scenario import Scenario

QUICK = "8 members instead of 256, coarse steps against one that is not much finer"
ONE_SWEEP = Stepping(1e-3, substeps=1, sweeps=1)  # enough without restitution
STEPS = (1e-3, 5e-4, 2e-4, 1e-4)  # s
QUICK_STEPS = (1e-3, 5e-4)
SUBSTEPS = (1, 2, 4)
FINEST, QUICK_FINEST = 1e-5, 2e-4  # s


def measure(setting: Setting) -> Findings:
    """Measure a collapse without restitution in few long steps, and one with restitution that finer steps confirm."""
    without = _solved(ONE_SWEEP, 0.0, setting)
    steps, finest_step = (QUICK_STEPS, QUICK_FINEST) if setting.quick else (STEPS, FINEST)
    finest = _solved(Stepping(finest_step, substeps=1), RESTITUTION, setting)
    rows = [[_solved(Stepping(step, parts), RESTITUTION, setting) for step in steps] for parts in SUBSTEPS]
    close = [level for row in rows for level in settled(row, finest)] or [finest]
    cheapest = min(close, key=lambda level: level.median)
    numbers = (
        *_numbers("e = 0", _scenario(without, 0.0), without, setting),
        *_numbers(f"e = {RESTITUTION:g}", _scenario(cheapest, RESTITUTION), cheapest, setting),
    )
    told = (
        f"e = 0: {without.told}, {without.steps} steps, blocks 2 and 3 at x = {_places(without)}; all runs until rest; "
        f"alone includes one call from Python; among many: {_members(setting)} equal members"
    )
    converged = (
        f"e = {RESTITUTION:g}: {cheapest.told}, {cheapest.steps} steps, blocks 2 and 3 at x = {_places(cheapest)}; the "
        f"cheapest of {len(close)} settings that are, as all with shorter steps, within {1e3 * CLOSE:g} mm of "
        f"{finest.told}; itself off by {1e3 * cheapest.off(finest):.2f} mm"
    )
    details = [level.detail(finest) for row in rows for level in row]
    details += [finest.detail(finest), without.detail(without)]
    return Findings(numbers, notes=(told, converged), details=tuple(details))


def _members(setting: Setting) -> int:
    return QUICK_MEMBERS if setting.quick else MEMBERS


def _solved(stepping: Stepping, restitution: float, setting: Setting) -> Level:
    scenario = three_blocks({"restitution": restitution}, stepping.time())
    return solved(stepping.keys, scenario, setting.repeats)


def _scenario(level: Level, restitution: float) -> Scenario:
    return three_blocks({"restitution": restitution}, {"scheme": "nonsmooth", **level.setting})


def _places(level: Level) -> str:
    _, two, three = 1e3 * level.centres[0]
    return f"{two:.2f} and {three:.2f} mm"


def _numbers(name: str, scenario: Scenario, level: Level, setting: Setting) -> Iterable[Number]:
    together, _ = rates([scenario] * _members(setting), 1, setting.repeats)
    yield Number(f"{name}: alone", "CPU ms", tuple(1e3 * one for one in level.seconds))
    yield Number(f"{name}: among many", "CPU ms", tuple(1e3 / one for one in together.samples))
    yield Number(f"{name}: collapses a second and core", "1/s", together.samples)

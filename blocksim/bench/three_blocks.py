"""The three blocks: time of a step, and time to an answer that finer settings do not change."""

from __future__ import annotations

from blocksim.bench.levels import CLOSE, Level, settled, solved
from blocksim.bench.measurement import Findings, Number, Setting, repeated
from blocksim.bench.scenes import three_blocks
from blocksim.bench.timing import Rerun
from blocksim.simulation.loop import last_step_of

QUICK = "0.01 s instead of 0.4 s at full stiffness, converged answer against a hundredth of the stiffness"
DURATION, QUICK_DURATION = 0.4, 0.01  # s
SCALES = (1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 1e-1, 3e-1, 1.0)
QUICK_SCALES = (1e-4, 1e-3, 1e-2)
SAFETIES = (0.1, 0.05)


def measure(setting: Setting) -> Findings:
    """Measure both."""
    scales = QUICK_SCALES if setting.quick else SCALES
    rows = [[_solved(scale, safety, setting.repeats) for scale in scales] for safety in SAFETIES]
    levels = [level for row in rows for level in row]
    finest = levels[-1]
    close = [level for row in rows for level in settled(row, finest)]
    cheapest = min(close, key=lambda level: level.median)
    numbers = (
        _step_time(setting),
        Number("time to a converged answer", "CPU ms", tuple(1e3 * one for one in cheapest.seconds)),
        Number("the stiffest run, its measure", "CPU ms", tuple(1e3 * one for one in finest.seconds)),
    )
    note = (
        f"converged: here and at all greater stiffnesses, centres at rest within {1e3 * CLOSE:g} mm of the stiffest "
        f"run ({finest.told}); the cheapest of {len(close)} such settings of {len(levels)} has {cheapest.told}, "
        f"{cheapest.steps} steps, and is off by {1e3 * cheapest.off(finest):.2f} mm"
    )
    return Findings(numbers, notes=(note,), details=tuple(level.detail(finest) for level in levels))


def _step_time(setting: Setting) -> Number:
    """At the aluminium's own stiffness, with the blocks at rest for the last quarter."""
    scene = Rerun(three_blocks(time={"stop_at_rest": False}))
    last = last_step_of(QUICK_DURATION if setting.quick else DURATION, scene.step)
    return repeated("a step", "ns", lambda: 1e9 * scene.run(last).seconds / last, setting.repeats)


def _solved(scale: float, safety: float, repeats: int) -> Level:
    scenario = three_blocks(contact={"stiffness_scale": scale}, time={"safety": safety})
    return solved({"stiffness_scale": scale, "safety": safety}, scenario, repeats)

"""The one time loop: compiled code runs until the recorder wants a frame."""

import time
from collections.abc import Callable
from dataclasses import dataclass

from blocksim.kernels.advance import advance
from blocksim.kernels.arrays import PAIRS_FULL, REACHED, World
from blocksim.simulation import outcome as ends
from blocksim.simulation.ledger import EnergyLedger, energy_ledger, start_energy
from blocksim.simulation.outcome import Outcome
from blocksim.simulation.recorder import Recorder
from blocksim.world.build import with_more_room


@dataclass(frozen=True)
class Progress:
    """Where a run stands, for whoever shows it."""

    time: float  # s simulated
    end: float  # s
    steps: int
    relative_residual: float


@dataclass(frozen=True)
class LoopResult:
    """The world at the end, why it ended, where the energy went, and the seconds spent in compiled code."""

    world: World
    outcome: Outcome
    ledger: EnergyLedger
    solver_seconds: float


def last_step_of(end: float, step: float) -> int:
    """Return the number of steps (at least one) that comes nearest to `end` (s)."""
    return max(1, round(end / step))


def advance_with_room(world: World, last_step: int) -> tuple[World, int]:
    """Advance to a step, giving the pair lists more room as often as needed; return world and status code."""
    status = int(advance(world, last_step))
    while status == PAIRS_FULL:
        world = with_more_room(world)
        status = int(advance(world, last_step))
    return world, status


def run_loop(
    world: World, recorder: Recorder, end: float, *, on_frame: Callable[[Progress], None] = lambda _: None
) -> LoopResult:
    """Advance the world to `end` (s) or until it rests or fails; the recorder samples on the way.

    `on_frame` is called after every frame. Ctrl-C ends the run between two frames with the outcome INTERRUPTED.
    """
    step = float(world.controls[0].step)
    last = last_step_of(end, step)
    outcome = ends.END_OF_TIME
    seconds = -time.perf_counter()
    world, status = advance_with_room(world, 0)
    seconds += time.perf_counter()
    start = start_energy(world)
    recorder.sample(world)
    try:
        while world.clock[0].steps < last and status == REACHED:
            seconds -= time.perf_counter()
            world, status = advance_with_room(world, min(recorder.next_step(int(world.clock[0].steps)), last))
            seconds += time.perf_counter()
            recorder.sample(world)
            steps = int(world.clock[0].steps)
            on_frame(Progress(steps * step, end, steps, energy_ledger(world, start).relative_residual))
        outcome = ends.BY_CODE[status]
    except KeyboardInterrupt:
        outcome = ends.INTERRUPTED
    ledger = energy_ledger(world, start)
    if outcome.is_finished and ledger.relative_residual > ends.RESIDUAL_LIMIT:
        outcome = ends.RESIDUAL
    return LoopResult(world, outcome, ledger, seconds)

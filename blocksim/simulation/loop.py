"""The one time loop: compiled code runs until the recorder wants a frame."""

import time
from collections.abc import Callable
from dataclasses import dataclass

from blocksim.kernels.arrays import REACHED, World
from blocksim.simulation import outcome as ends
from blocksim.simulation.ledger import EnergyLedger, energy_ledger, start_energy
from blocksim.simulation.outcome import Outcome
from blocksim.simulation.recorder import Recorder
from blocksim.simulation.schemes import AnyScene
from blocksim.simulation.team import ALONE, Team

BODY_STEPS_A_CALL = 1_000_000  # a tenth of a second or so; after that Ctrl-C is heard and progress is shown


@dataclass(frozen=True)
class Progress:
    """Where a run stands, for whoever shows it."""

    time: float  # s simulated
    end: float  # s
    steps: int
    relative_residual: float


Watcher = Callable[[Progress], None]


@dataclass(frozen=True)
class LoopResult:
    """The world at the end, why it ended, where the energy went, the seconds spent in compiled code and its threads."""

    world: World
    outcome: Outcome
    ledger: EnergyLedger
    solver_seconds: float
    threads: int


def last_step_of(end: float, step: float) -> int:
    """Return the number of steps (at least one) that comes nearest to `end` (s)."""
    return max(1, round(end / step))


def outcome_of(code: int, ledger: EnergyLedger) -> Outcome:
    """Return what a run came to that was not interrupted: its status code, and whether its energy adds up."""
    outcome = ends.BY_CODE[code]
    if outcome.is_finished and ledger.relative_residual > ends.RESIDUAL_LIMIT:
        return ends.RESIDUAL
    return outcome


def run_loop(
    scene: AnyScene,
    recorder: Recorder,
    end: float,
    *,
    team: Team = ALONE,
    on_progress: Watcher = lambda _: None,
    is_stopped: Callable[[], bool] = lambda: False,
) -> LoopResult:
    """Advance a scene to `end` (s) or until it rests, fails or `is_stopped`; the recorder samples on the way."""
    step = float(scene.world.controls[0].step)
    last = last_step_of(end, step)
    most = max(1, BODY_STEPS_A_CALL // scene.world.bodies.size)
    seconds = -time.perf_counter()
    scene, status = team.advance(scene, 0)
    seconds += time.perf_counter()
    start = start_energy(scene)
    recorder.sample(scene)
    done, wanted = 0, 0
    while status == REACHED and done < last and not is_stopped():
        wanted = min(recorder.next_step(done), last) if done == wanted else wanted
        seconds -= time.perf_counter()
        scene, status = team.advance(scene, min(wanted, done + most))
        seconds += time.perf_counter()
        done = int(scene.world.clock[0].steps)
        if done == wanted:
            recorder.sample(scene)
        on_progress(Progress(done * step, end, done, energy_ledger(scene, start).relative_residual))
    recorder.sample(scene)  # wherever it ended
    ledger = energy_ledger(scene, start)
    outcome = ends.INTERRUPTED if status == REACHED and done < last else outcome_of(status, ledger)
    return LoopResult(scene.world, outcome, ledger, seconds, team.threads)

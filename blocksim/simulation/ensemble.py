"""Many runs of scenes of one shape, advanced together in compiled code: the engine of large sweeps.

No process is started and nothing is recorded on the way; only where everything ended comes back, with the same bits as
from a run of its own.
"""

import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING, Generic

import numpy as np
from numpy.typing import NDArray

from blocksim.kernels.arrays import PAIRS_FULL
from blocksim.scenario import Scenario, place_bodies
from blocksim.simulation.compilation import compile_kernels, kernels_of
from blocksim.simulation.frames import Frames
from blocksim.simulation.ledger import EnergyLedger, energy_ledger, start_energy
from blocksim.simulation.loop import last_step_of, outcome_of
from blocksim.simulation.outcome import Outcome
from blocksim.simulation.recorder import MOTION, Rows, frames_from_rows
from blocksim.simulation.schemes import Scene, build_scene, measured_row, scheme_of
from blocksim.simulation.stacking import member, shape_of, stack
from blocksim.simulation.table import final_table
from blocksim.simulation.team import ALONE

if TYPE_CHECKING:
    import pandas as pd

BATCH = 256  # members in memory at the same time
CHUNK = 4  # members that a thread takes at a time: few enough that all threads end together


@dataclass(frozen=True)
class MemberEnd:
    """Where one member ended and how."""

    frames: Frames  # one: the last
    outcome: Outcome
    ledger: EnergyLedger

    @property
    def final(self) -> "pd.DataFrame":
        """The final table, as `final.csv` has it."""
        return final_table(self.frames)


def run_ensemble(scenarios: Sequence[Scenario], *, threads: int | None = None) -> list[MemberEnd]:
    """Run scenarios to their ends and return those in the same order.

    They may differ in anything; those whose scenes have the same shape (scheme, numbers of bodies and material pairs)
    are advanced together, on `threads` threads (default: one a core). The result does not depend on that number. Raises
    what building a world raises, and ValueError for less than one thread.
    """
    count = os.cpu_count() or 1 if threads is None else threads
    if count < 1:
        message = f"threads must be at least 1, not {count}"
        raise ValueError(message)
    for kernels in dict.fromkeys(map(kernels_of, scenarios)):
        compile_kernels(kernels)
    with ThreadPoolExecutor(count) as pool:
        batches = (scenarios[first : first + BATCH] for first in range(0, len(scenarios), BATCH))
        return [end for batch in batches for end in _run_batch(batch, pool)]


def _run_batch(scenarios: Sequence[Scenario], pool: ThreadPoolExecutor) -> list[MemberEnd]:
    scenes = [build_scene(scenario) for scenario in scenarios]
    keys = [(scenario.time.scheme, shape_of(scene)) for scenario, scene in zip(scenarios, scenes, strict=True)]
    order = sorted(range(len(scenes)), key=keys.__getitem__)
    ends: dict[int, MemberEnd] = {}
    for _, group in groupby(order, key=keys.__getitem__):
        numbers = list(group)
        ensemble = Ensemble([scenarios[i] for i in numbers], [scenes[i] for i in numbers])
        ensemble.advance(pool)
        ends.update(zip(numbers, ensemble.ends(), strict=True))
    return [ends[i] for i in range(len(scenes))]


class Ensemble(Generic[Scene]):
    """Scenes of one scheme and shape, stacked, to be advanced together once."""

    def __init__(self, scenarios: Sequence[Scenario], scenes: Sequence[Scene]) -> None:
        """Stack scenes that have not moved yet."""
        self.scenarios = scenarios
        self.scheme = scheme_of(scenes[0])
        self.scenes: Scene = stack(scenes)
        steps = [float(scene.world.controls[0].step) for scene in scenes]
        ends = [last_step_of(scenario.time.end, step) for scenario, step in zip(scenarios, steps, strict=True)]
        self.last_steps = np.array(ends, dtype=np.int64)
        self.starts = np.zeros((len(scenes), len(self.scheme.measured)))
        self.codes = np.zeros(len(scenes), dtype=np.int64)

    def advance(self, pool: ThreadPoolExecutor) -> None:
        """Advance all members to their ends; a thread that is done with some takes the next ones."""
        self._advance(np.zeros(0, dtype=np.int64))  # compiles, before there are threads
        count = len(self.codes)
        list(pool.map(self._advance, (np.arange(i, min(i + CHUNK, count)) for i in range(0, count, CHUNK))))

    def _advance(self, members: NDArray[np.int64]) -> None:
        self.scheme.advance_members(self.scenes, members, self.last_steps, self.starts, self.codes)

    def ends(self) -> Iterator[MemberEnd]:
        """Yield where the members ended, in order."""
        for m, scenario in enumerate(self.scenarios):
            scene, code = member(self.scenes, m), int(self.codes[m])
            start = float(self.starts[m, : len(self.scheme.ledger)].sum())
            if code == PAIRS_FULL:
                scene, code, start = self._run_alone(scene, int(self.last_steps[m]), start)
            yield self._end(scenario, scene, code, start)

    def _run_alone(self, scene: Scene, last_step: int, start: float) -> tuple[Scene, int, float]:
        """Go on with a scene whose pair list is full."""
        if not scene.world.clock[0].is_started:
            scene, _ = ALONE.advance(self.scheme.with_more_room(scene), 0)
            start = start_energy(scene)
        scene, code = ALONE.advance(scene, last_step)
        return scene, code, start

    def _end(self, scenario: Scenario, scene: Scene, code: int, start: float) -> MemberEnd:
        world, placed = scene.world, place_bodies(scenario)
        ledger = energy_ledger(scene, start)
        steps = np.array([world.clock[0].steps], dtype=np.int64)
        motion = np.stack([world.bodies[name][: len(placed)] for name in MOTION])
        rows = Rows(steps, motion[np.newaxis], measured_row(scene)[np.newaxis], self.scheme.ledger)
        frames = frames_from_rows(placed, float(world.controls[0].step), rows)
        return MemberEnd(frames, outcome_of(code, ledger), ledger)

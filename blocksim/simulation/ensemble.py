"""Many runs of scenes of one shape, advanced together in compiled code: the engine of large sweeps.

No process is started and nothing is recorded on the way; only where everything ended comes back, with the same bits as
from a run of its own.
"""

import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from blocksim.kernels.arrays import PAIRS_FULL, World, zeros
from blocksim.kernels.energy import LEDGER_ROW
from blocksim.kernels.ensemble import advance_members
from blocksim.scenario import Scenario, place_bodies
from blocksim.simulation.compilation import compile_kernels
from blocksim.simulation.frames import Frames
from blocksim.simulation.ledger import ROW_LENGTH, EnergyLedger, energy_ledger, energy_row, start_energy
from blocksim.simulation.loop import last_step_of, outcome_of
from blocksim.simulation.outcome import Outcome
from blocksim.simulation.recorder import MOTION, frames_from_rows
from blocksim.simulation.table import final_table
from blocksim.simulation.team import ALONE
from blocksim.world.build import build_world, with_more_room

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

    They may differ in anything; those whose scenes have the same shape (numbers of bodies and material pairs) are
    advanced together, on `threads` threads (default: one a core). The result does not depend on that number. Raises
    what building a world raises, and ValueError for less than one thread.
    """
    count = os.cpu_count() or 1 if threads is None else threads
    if count < 1:
        message = f"threads must be at least 1, not {count}"
        raise ValueError(message)
    for model in dict.fromkeys(scenario.contact.model for scenario in scenarios):
        compile_kernels(model)
    with ThreadPoolExecutor(count) as pool:
        batches = (scenarios[first : first + BATCH] for first in range(0, len(scenarios), BATCH))
        return [end for batch in batches for end in _run_batch(batch, pool)]


def _run_batch(scenarios: Sequence[Scenario], pool: ThreadPoolExecutor) -> list[MemberEnd]:
    worlds = [build_world(scenario) for scenario in scenarios]
    order = sorted(range(len(worlds)), key=lambda i: shape_of(worlds[i]))
    ends: dict[int, MemberEnd] = {}
    for _, group in groupby(order, key=lambda i: shape_of(worlds[i])):
        numbers = list(group)
        ensemble = Ensemble([scenarios[i] for i in numbers], [worlds[i] for i in numbers])
        ensemble.advance(pool)
        ends.update(zip(numbers, ensemble.ends(), strict=True))
    return [ends[i] for i in range(len(worlds))]


def shape_of(world: World) -> tuple[tuple[Any, ...], ...]:
    """Return what worlds must have in common to be stacked: shapes and types of all arrays."""
    return tuple(() if array is None else (*array.shape, array.dtype.str) for array in world)


def stack(worlds: Sequence[World]) -> World:
    """Return one world whose arrays have the members along their first axis."""
    arrays: list[Any] = [None if same[0] is None else _stacked(same) for same in zip(*worlds, strict=True)]
    return World(*arrays)


def _stacked(arrays: Sequence[NDArray[Any]]) -> NDArray[Any]:
    """Return arrays of one shape as one, whose memory starts on a cache line."""
    first = arrays[0]
    whole = zeros((len(arrays), *first.shape), first.dtype).view(type(first))
    np.stack(arrays, out=whole)
    return whole


def _member(worlds: World, m: int) -> World:
    arrays: list[Any] = [None if array is None else array[m] for array in worlds]
    return World(*arrays)


class Ensemble:
    """Worlds of one shape, stacked, to be advanced together once."""

    def __init__(self, scenarios: Sequence[Scenario], worlds: Sequence[World]) -> None:
        """Stack worlds that have not moved yet."""
        self.scenarios = scenarios
        self.worlds = stack(worlds)
        steps = [float(world.controls[0].step) for world in worlds]
        ends = [last_step_of(scenario.time.end, step) for scenario, step in zip(scenarios, steps, strict=True)]
        self.last_steps = np.array(ends, dtype=np.int64)
        self.starts = np.zeros((len(worlds), ROW_LENGTH))
        self.codes = np.zeros(len(worlds), dtype=np.int64)

    def advance(self, pool: ThreadPoolExecutor) -> None:
        """Advance all members to their ends; a thread that is done with some takes the next ones."""
        self._advance(np.zeros(0, dtype=np.int64))  # compiles, before there are threads
        count = len(self.codes)
        list(pool.map(self._advance, (np.arange(i, min(i + CHUNK, count)) for i in range(0, count, CHUNK))))

    def _advance(self, members: NDArray[np.int64]) -> None:
        advance_members(self.worlds, members, self.last_steps, self.starts, self.codes)

    def ends(self) -> Iterator[MemberEnd]:
        """Yield where the members ended, in order."""
        for m, scenario in enumerate(self.scenarios):
            world, code = _member(self.worlds, m), int(self.codes[m])
            start = float(self.starts[m, : len(LEDGER_ROW)].sum())
            if code == PAIRS_FULL:
                world, code, start = _run_alone(world, int(self.last_steps[m]), start)
            yield _end(scenario, world, code, start)


def _run_alone(world: World, last_step: int, start: float) -> tuple[World, int, float]:
    """Go on with a world whose pair list is full."""
    if not world.clock[0].is_started:
        world, _ = ALONE.advance(with_more_room(world), 0)
        start = start_energy(world)
    world, code = ALONE.advance(world, last_step)
    return world, code, start


def _end(scenario: Scenario, world: World, code: int, start: float) -> MemberEnd:
    placed = place_bodies(scenario)
    ledger = energy_ledger(world, start)
    steps = np.array([world.clock[0].steps], dtype=np.int64)
    motion = np.stack([world.bodies[name][: len(placed)] for name in MOTION])
    step = float(world.controls[0].step)
    frames = frames_from_rows(placed, steps, step, motion[np.newaxis], energy_row(world)[np.newaxis])
    return MemberEnd(frames, outcome_of(code, ledger), ledger)

"""Many runs of scenes of one shape, advanced together in compiled code: the engine of large sweeps.

No process is started and nothing is recorded on the way; only where everything ended and what moved first comes back,
with the same bits as from a run of its own.
"""

import os
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from blocksim.errors import BlocksimError
from blocksim.kernels.common.arrays import PAIRS_FULL, REACHED
from blocksim.kernels.common.compiler import compiling
from blocksim.kernels.common.frame_times import next_frame
from blocksim.kernels.common.watch import Watched
from blocksim.scenario import Scenario
from blocksim.scenario.motion import settles
from blocksim.simulation.compilation import compile_kernels, kernels_of
from blocksim.simulation.events import NEVER, Timeline
from blocksim.simulation.ledger import (
    adds_up,
    energy_ledger,
    ledger_of,
    next_energy_check,
    start_energy,
)
from blocksim.simulation.loop import last_step_of
from blocksim.simulation.member_end import Closing, Ended, MemberEnd, MemberFailure, in_play_of
from blocksim.simulation.movement import Watch
from blocksim.simulation.moving_support import MovingSupport
from blocksim.simulation.recorder import POSITION, steps_per_frame
from blocksim.simulation.schemes import AnyScene, build_stacks, ledger_names, measured_row, scheme_of
from blocksim.simulation.settling import begun
from blocksim.simulation.team import ALONE
from blocksim.world.scenes import Refusal, Stack, member, stack_of_one
from blocksim.world.systems.blocks import motion_of

BATCH = 256  # members in memory at the same time
MOST_BODIES = 16_384  # of all members of a batch
CHUNK = 4  # members at most that a thread takes at a time: few enough that all threads end together

Steps = NDArray[np.int64]


def run_ensemble(scenarios: Sequence[Scenario], *, threads: int | None = None, peaks: bool = False) -> list[MemberEnd]:
    """Run scenarios to their ends and return those in the same order.

    They may differ in anything; those whose scenes have the same shape (scheme, numbers of bodies and material pairs)
    are advanced together, on `threads` threads (default: one a core). The result does not depend on that number. With
    `peaks` the largest rotation of each is followed from frame to frame, which takes longer. Raises what building a
    world raises, and ValueError for less than one thread.
    """
    ends: list[MemberEnd] = []
    for batch in run_in_batches(scenarios, threads=threads, peaks=peaks):
        for end in batch:
            if isinstance(end, MemberFailure):
                raise end.error
            ends.append(end)
    return ends


def run_in_batches(
    scenarios: Iterable[Scenario], *, threads: int | None = None, most: int = BATCH, peaks: bool = False
) -> Iterator[list[Ended]]:
    """Run scenarios as `run_ensemble` does, at most `most` at a time; yield where those of a batch ended, in order.

    Scenarios are taken from where they come from as they are needed, and nothing of a batch is kept. One that cannot be
    built is a MemberFailure in its place; the others continue. No result depends on which others are in its batch.
    Raises ValueError for less than one thread or member.
    """
    count = os.cpu_count() or 1 if threads is None else threads
    for what, number in (("threads", count), ("members", most)):
        if number < 1:
            message = f"{what} must be at least 1, not {number}"
            raise ValueError(message)
    return _run_all(scenarios, count, most, peaks=peaks)


def _run_all(scenarios: Iterable[Scenario], threads: int, most: int, *, peaks: bool) -> Iterator[list[Ended]]:
    with ThreadPoolExecutor(threads) as pool:
        for batch in _batches(scenarios, most):
            for kernels in dict.fromkeys(map(kernels_of, batch)):
                compile_kernels(kernels)
            yield _run_batch(batch, pool, threads, peaks=peaks)


def _batches(scenarios: Iterable[Scenario], most: int) -> Iterator[list[Scenario]]:
    batch: list[Scenario] = []
    bodies = 0
    for scenario in scenarios:
        count = sum(structure.size for structure in scenario.structures) + len(scenario.bodies)
        if batch and (len(batch) == most or bodies + count > MOST_BODIES):
            yield batch
            batch, bodies = [], 0
        batch.append(scenario)
        bodies += count
    if batch:
        yield batch


def _run_batch(scenarios: Sequence[Scenario], pool: ThreadPoolExecutor, threads: int, *, peaks: bool) -> list[Ended]:
    ends: dict[int, Ended] = {}
    for one in build_stacks(scenarios):
        if isinstance(one, Refusal):
            ends[one.number] = MemberFailure(one.error)
            continue
        try:
            stack = _settled(scenarios[one.numbers[0]], one)
        except BlocksimError as error:
            ends[one.numbers[0]] = MemberFailure(error)
            continue
        ensemble = Ensemble(scenarios, stack, peaks=peaks)
        ensemble.advance(pool, threads)
        ends.update(zip(one.numbers, ensemble.ends(), strict=True))
    return [ends[i] for i in range(len(scenarios))]


def _settled(scenario: Scenario, stack: Stack) -> Stack:
    """Return a stack as its runs begin; one that settles first has one scene. Raises SettleError."""
    if not settles(scenario):
        return stack
    scene, _ = begun(member(stack.scenes, 0), scenario, stack.placed[0], ALONE)
    return stack._replace(scenes=stack_of_one(scene))


class Ensemble:
    """Scenes of one scheme and shape, stacked, to be advanced together once."""

    def __init__(self, scenarios: Sequence[Scenario], stack: Stack, *, peaks: bool = False) -> None:
        """Take a stack of scenes that have not moved yet, and the scenarios that its numbers count.

        `peaks` says whether the largest rotations on the way are followed.
        """
        self.placed = stack.placed
        self.has_peaks = peaks
        self.scenes: AnyScene = stack.scenes
        self.scheme, self.names = scheme_of(self.scenes), ledger_names(self.scenes)
        self.bodies = int(self.scenes.world.bodies.shape[1]) - 1
        self.time_steps: list[float] = self.scenes.world.controls["step"][:, 0].tolist()
        own = zip([scenarios[number] for number in stack.numbers], self.placed, self.time_steps, strict=True)
        self.timelines = [Timeline(one, placed, step) if one.events else None for one, placed, step in own]
        ends = [scenarios[number].time.end for number in stack.numbers]
        self.last_steps = np.array([*map(last_step_of, ends, self.time_steps)], dtype=np.int64)
        self.starts = np.zeros((len(ends), len(self.scheme.measured)))
        self.codes = np.zeros(len(ends), dtype=np.int64)
        every = [scenarios[number].output.every for number in stack.numbers]
        self.periods = np.array([*map(steps_per_frame, every, self.time_steps)])
        start = self._positions(self.scenes, slice(None))
        self.supports = [MovingSupport(scenarios[number]) for number in stack.numbers]
        self.watch = Watch(self.placed, self.supports, start)
        steps, places = np.zeros(len(ends), dtype=np.int64), np.zeros_like(start)
        reach, thresholds = self.watch.shapes.reach, self.watch.thresholds
        # compiled code sees no motion relative to a support that moves
        periods = np.where([support.moves for support in self.supports], 0.0, self.periods)
        frames = self.periods if peaks else np.zeros(len(ends))
        self.watched = Watched(frames, periods, steps, places, start, reach, thresholds, np.zeros(len(ends)))

    def advance(self, pool: ThreadPoolExecutor, threads: int) -> None:
        """Advance all members to their ends; a thread that is done with some takes the next ones."""
        nobody = np.zeros(0, dtype=np.int64)
        with compiling():  # what a single run has no use for, before there are threads
            self._advance_members(nobody, self.last_steps, self.starts, self.codes)
        count = len(self.codes)
        if any(self.timelines):  # each is advanced alone, from where it begins
            self._advance_members(np.arange(count), np.zeros_like(self.codes), self.starts, self.codes)
        if self.scheme.advance_members is None or any(self.timelines):
            self.codes[:] = PAIRS_FULL
            return
        chunk = min(CHUNK, -(-count // threads))
        list(pool.map(self._advance, (np.arange(i, min(i + chunk, count)) for i in range(0, count, chunk))))

    def _advance(self, members: NDArray[np.int64]) -> None:
        """Advance some members from check to check, without those whose energy does not add up any more."""
        rows, stops = self.starts, np.zeros_like(self.codes)
        done = 0
        while members.size:
            done = next_energy_check(done, self.bodies)
            np.minimum(self.last_steps, done, out=stops)
            rides = np.array([self.supports[m].moves for m in members.tolist()])
            self._advance_members(members[~rides], stops, rows, self.codes)
            for m in members[rides].tolist():
                self._advance_watching(m, int(stops[m]), rows)
            rows = np.zeros_like(self.starts)  # what is measured at the start of a later call
            members = members[(self.codes[members] == REACHED) & (self.last_steps[members] > done)]
            if members.size:
                members = members[self._add_up(members)]

    def _advance_watching(self, m: int, stop: int, rows: NDArray[np.float64]) -> None:
        """Advance a member on a moving support to a step, from frame to frame until something has moved there."""
        stops, is_under_way = np.zeros_like(self.codes), True
        while is_under_way:
            frame = stop if self.watch.first[m] else min(stop, self._next_frame(m))
            stops[m] = frame
            self._advance_members(np.array([m]), stops, rows, self.codes)
            rows = np.zeros_like(rows)  # what is measured at the start of a later call
            is_under_way = self.codes[m] == REACHED and frame < stop
            if self.codes[m] == REACHED and self._is_frame(m, frame):
                self.watch.see([m], self._motion(self.scenes, [m]), [frame * self.time_steps[m]])

    def _next_frame(self, m: int) -> int:
        return next_frame(int(self.scenes.world.clock["steps"][m, 0]), self.periods[m])

    def _advance_members(self, members: Steps, stops: Steps, rows: NDArray[np.float64], codes: Steps) -> None:
        """Advance some members in compiled code, where the scheme can."""
        if self.scheme.advance_members is not None:
            self.scheme.advance_members(self.scenes, members, stops, rows, codes, self.watched)

    def _next_look(self, m: int, done: int) -> int:
        """Return the step at which the energy of a member is checked next, or its last."""
        return min(next_energy_check(done, self.bodies), int(self.last_steps[m]))

    def _next_stop(self, m: int, done: int) -> int:
        """Return where a member stops next that is advanced alone: frames count until something has moved."""
        look = self._next_look(m, done)
        if self.watch.first[m] and not self.supports[m].moves:  # which carries a block until it is removed
            return look
        return min(look, next_frame(done, self.periods[m]))

    def _is_frame(self, m: int, step: int) -> bool:
        return step > 0 and next_frame(step - 1, self.periods[m]) == step

    def _see_ends(self) -> None:
        """Find what moved first in members without a frame in which anything had: the end is one too.

        Those whose list of pairs is full continue alone.
        """
        self.watch.take(self.watched.steps, self.watched.places, self.time_steps)
        which = [m for m, code in enumerate(self.codes) if self.watch.first[m] is None and code != PAIRS_FULL]
        steps = self.scenes.world.clock["steps"][which, 0].tolist()
        times = [step * self.time_steps[m] for m, step in zip(which, steps, strict=True)]
        self.watch.see(which, self._motion(self.scenes, which), times)

    def _positions(self, scenes: AnyScene, which: list[int] | slice) -> NDArray[np.float64]:
        """Return x, y (m) and angle (rad) of the blocks of some scenes of a stack, (k, 3, b)."""
        bodies = scenes.world.bodies.view(np.ndarray)  # a record array takes five times as long for a field
        return np.stack([bodies[name][which, : len(self.placed[0])] for name in POSITION], axis=1)

    def _motion(self, scenes: AnyScene, which: list[int]) -> NDArray[np.float64]:
        """Return the states of the blocks of some scenes of a stack, (k, 6, b)."""
        return motion_of(scenes.world.bodies[which, : len(self.placed[0])])

    def _add_up(self, members: Steps) -> list[bool]:
        """Return for each of some members if its energy adds up."""
        rows, which = self._measured(members), members.tolist()
        in_play = in_play_of(self.scenes, which)
        ledgers = (ledger_of(self.names, rows[m], self._start(m), own) for m, own in zip(which, in_play, strict=True))
        return [*map(adds_up, ledgers)]

    def _start(self, m: int) -> float:
        """Return the energy (J) of a member at the start."""
        return float(self.starts[m, : len(self.scheme.ledger)].sum())

    def ends(self) -> list[Ended]:
        """Return where the members ended, in order."""
        self._see_ends()
        measured = self._measured(np.arange(len(self.codes)))
        closing = Closing(self.scenes, self.placed, measured, self.watch, self._peaks())
        return [
            self._run_alone(m, self._start(m)) if code == PAIRS_FULL else closing.end(m, self._start(m), code)
            for m, code in enumerate(self.codes.tolist())
        ]

    def _peaks(self) -> NDArray[np.float64] | None:
        """Return the largest rotation (rad) of each member, (m, 1), in frames and at the end, where it was followed."""
        if not self.has_peaks:
            return None
        turns = np.abs(self._positions(self.scenes, slice(None))[:, 2] - self.watched.start[:, 2])
        at_end = np.where(self.watch.shapes.is_free, turns, 0.0).max(axis=1, initial=0.0)
        return np.asarray(np.fmax(self.watched.peaks, at_end))[:, None]

    def _measured(self, members: Steps) -> NDArray[np.float64]:
        """Return rows as `measured` of the scheme names them: a call that goes to no further step only measures."""
        rows, nowhere = np.zeros_like(self.starts), np.zeros_like(self.codes)
        self._advance_members(members, nowhere, rows, nowhere.copy())
        return rows

    def _run_alone(self, m: int, start: float) -> Ended:
        """Go on with a member whose pair list is full."""
        scene, placed = member(self.scenes, m), [self.placed[m]]
        try:
            if not scene.world.clock[0].is_started:
                scene, _ = ALONE.advance(self.scheme.with_more_room(scene), 0)
                start = start_energy(scene)
            scene, code = self._finish(m, scene, start)
        except BlocksimError as error:
            return MemberFailure(error)
        closing = Closing(stack_of_one(scene), placed, measured_row(scene)[np.newaxis], self.watch.only(m))
        return closing.end(0, start, code)

    def _finish(self, m: int, scene: AnyScene, start: float) -> tuple[AnyScene, int]:
        """Advance one scene from stop to stop, as `_advance` does; return it and its status code."""
        while True:
            done = int(scene.world.clock[0].steps)
            look, timeline = self._next_look(m, done), self.timelines[m]
            event = NEVER if timeline is None else timeline.next_step(done)
            scene, code = ALONE.advance(scene, min(self._next_stop(m, done), event))
            if timeline is not None:
                scene, code = timeline.act(scene, ALONE, code)
            now = int(scene.world.clock[0].steps)
            is_under_way = code == REACHED and now < self.last_steps[m]
            continues = is_under_way and (now != look or adds_up(energy_ledger(scene, start)))
            if not continues or self._is_frame(m, now):
                time = now * self.time_steps[m]
                self.watch.see([m], self._motion(stack_of_one(scene), [0]), [time])
            if not continues:
                return scene, code

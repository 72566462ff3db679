"""Many runs of scenes of one shape, advanced together in compiled code: the engine of large sweeps."""

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from blocksim.errors import BlocksimError
from blocksim.kernels.common import arrays, compiler, systems
from blocksim.kernels.common.members import Watched, next_frame
from blocksim.scenario import Model, PlacedBody, Scenario, placement
from blocksim.simulation import balance, instruments, loop, observables, rest_state, schemes, trajectory
from blocksim.simulation.observables import MOVED_SHARE, OBSERVABLES, OUTCOME, Value, Watch, observe
from blocksim.world import build
from blocksim.world.systems import blocks, system

if TYPE_CHECKING:
    import pandas as pd


Placed = tuple[PlacedBody, ...]


@dataclass(frozen=True)
class MemberEnd:
    """Where one member ended and how."""

    outcome: loop.Outcome
    ledger: balance.EnergyLedger
    seconds: float  # simulated
    columns: trajectory.Columns  # the final table, as `final.csv` has it
    placed: Placed = field(repr=False)
    time_step: float  # s
    rows: instruments.FrameRows = field(repr=False)  # one: the last
    observables: dict[str, Value] = field(default_factory=dict)  # observables of rows, by name
    convergence: Mapping[str, float] | None = None  # as results.ImpulseConvergence, of rigid contacts

    @cached_property
    def frames(self) -> trajectory.Frames:
        """One: the last."""
        return instruments.frames_from_rows((blocks.block_system(self.placed),), self.time_step, self.rows)

    @property
    def final(self) -> "pd.DataFrame":
        """The final table for people who know pandas."""
        return trajectory.as_frame(self.columns)


@dataclass(frozen=True)
class MemberFailure:
    """A member that could not be built, or for whose contacts there was no room."""

    error: BlocksimError

    @property
    def outcome(self) -> loop.Outcome:
        """The same words and code as where it had been run by itself."""
        return loop.Outcome("failed", str(self.error), self.error.exit_code)


EnsembleEnd = MemberEnd | MemberFailure


def in_play_of(scenes: schemes.AnyScene | systems.Coupled, members: Sequence[int]) -> list[tuple[float, float]]:
    """Return mass (kg) and energy moved (J), which decide the energy in play, of some members of a stack."""
    # systems are in a stack of one
    further = schemes.system_totals(build.member(scenes, 0))[1] if isinstance(scenes, systems.Coupled) else 0.0
    mass = scenes.world.bodies.view(np.ndarray)["mass"]
    masses = [float(np.sum(mass[m])) + further for m in members]  # one by one: the order matters
    book = scenes.world.ledger[:, 0]
    moved = book["largest_kinetic"] + book["travel_work"]
    return [*zip(masses, moved[list(members)].tolist(), strict=True)]


def member_ends(
    scenes: schemes.AnyScene,
    placed: list[Placed],
    measured: NDArray[np.float64],
    watch: Watch,
    starts: Sequence[float],
    codes: Sequence[int],
    turned: NDArray[np.float64] | None = None,
) -> dict[int, MemberEnd]:
    """Return where the members of a stack of scenes are now, without those that lack room for contacts.

    `measured` (m, e + 2) is as the scheme's `measured`, `starts` are energies (J) at the start, `codes` status codes.
    `watch` has seen them on the way; `turned` (m, 1) is their largest rotation (rad), where it was followed.
    """
    world, bodies = scenes.world, [body for one in placed for body in one]
    count, names = len(placed), schemes.ledger_names(scenes)
    motion = blocks.motion_of(world.bodies[:, : len(placed[0])])  # (m, 6, b)
    steps: NDArray[np.int64] = world.clock["steps"].copy()  # (m, 1)
    time_steps: list[float] = world.controls["step"][:, 0].tolist()
    seconds = [float(steps[m, 0]) * time_steps[m] for m in range(count)]
    size_x, size_y, angles = np.array([(one.size_x, one.size_y, one.angle) for one in bodies]).reshape(-1, 3).T
    corners, angles = system.local_corners(size_x, size_y, placement.outlines_of(bodies)), angles.reshape(count, -1)
    tables = trajectory.final_values(motion, corners.reshape(*angles.shape, *corners.shape[1:]), angles).tolist()
    support = np.stack([world.bodies["vx"][:, -1], world.bodies["vy"][:, -1]], axis=1)
    in_rows = [name for name, one in OBSERVABLES.items() if one.in_rows]
    sunk = np.where(np.array(codes) == arrays.OVERLAP_LIMIT, measured[:, -1], 0.0)[:, np.newaxis]
    observables = observe(replace(watch.ends(motion, support, seconds, turned), sunk=sunk), in_rows)
    ends: dict[int, MemberEnd] = {}
    for m, (code, in_play) in enumerate(zip(codes, in_play_of(scenes, range(count)), strict=True)):
        if code == arrays.PAIRS_FULL:
            continue
        some, ledger = slice(m, m + 1), balance.ledger_of(names, measured[m], starts[m], *in_play)
        outcome, observed = loop.outcome_of(code, ledger), observables[m]
        if outcome.status != "finished":
            outcome = loop.diagnose(outcome, code, build.member(scenes, m), placed[m])
            outcome = loop.after_a_fall(outcome, code, ledger, observed.get(OUTCOME))
        if outcome.status == "failed" and observed:
            observed[OUTCOME] = None
        ends[m] = MemberEnd(
            outcome=outcome,
            ledger=ledger,
            seconds=seconds[m],
            columns=dict(zip(trajectory.COLUMNS, ([body.name for body in placed[m]], *tables[m]), strict=True)),
            placed=placed[m],
            time_step=time_steps[m],
            rows=instruments.FrameRows(steps[m], (motion[some],), measured[some], names),
            observables=observed,
            convergence=schemes.scheme_of(scenes).convergence(scenes, m),
        )
    return ends


BATCH = 256  # members in memory at the same time
MOST_BODIES = 16_384  # of all members of a batch
CHUNK = 4  # members at most that a thread takes at a time: few enough that all threads end together

Steps = NDArray[np.int64]


def run_ensemble(
    sources: Sequence[Scenario | Model], *, threads: int | None = None, peaks: bool = False
) -> list[MemberEnd]:
    """Run scenarios, or models, to their ends and return those in the same order.

    They may differ in anything; those whose scenes have the same shape (scheme, numbers of bodies and material pairs)
    are advanced together, on `threads` threads (default: one a core). The result does not depend on that number. With
    `peaks` the largest rotation of each is followed from frame to frame, which takes longer. Raises what building a
    world raises, and ValueError for less than one thread.
    """
    ends: list[MemberEnd] = []
    for batch in run_in_batches(sources, threads=threads, peaks=peaks):
        for end in batch:
            if isinstance(end, MemberFailure):
                raise end.error
            ends.append(end)
    return ends


def run_in_batches(
    sources: Iterable[Scenario | Model], *, threads: int | None = None, most: int = BATCH, peaks: bool = False
) -> Iterator[list[EnsembleEnd]]:
    """Run scenarios as `run_ensemble` does, at most `most` at a time; yield where those of a batch ended, in order.

    Scenarios are taken from where they come from as they are needed, and nothing of a batch is kept. One that cannot be
    built is a MemberFailure in its place; the others continue. No result depends on which others are in its batch.
    Raises ValueError for less than one thread or member.
    """
    count = os.cpu_count() or 1 if threads is None else threads
    for what, number in (("threads", count), ("members", most)):
        if number < 1:
            raise ValueError(f"{what} must be at least 1, not {number}")
    return _run_all(map(Model, sources), count, most, peaks=peaks)


def _run_all(models: Iterable[Model], threads: int, most: int, *, peaks: bool) -> Iterator[list[EnsembleEnd]]:
    """Yield the ends of one batch after the other, each in the order of its scenarios."""
    with ThreadPoolExecutor(threads) as pool:
        for batch in _batches(models, most):
            for kernels in dict.fromkeys(schemes.kernels_of(model.scenario) for model in batch):
                schemes.compile_kernels(kernels)
            ends: dict[int, EnsembleEnd] = {}
            for one in schemes.build_stacks(batch):
                if isinstance(one, build.Refusal):
                    ends[one.number] = MemberFailure(one.error)
                    continue
                first, scenes = batch[one.numbers[0]], one.scenes
                try:
                    if first.settles:  # it has one scene
                        scene = build.member(scenes, 0)
                        scene, _ = rest_state.initial_scene(scene, first, schemes.ALONE)
                        scenes = build.stack_of_one(scene)
                except BlocksimError as error:
                    ends[one.numbers[0]] = MemberFailure(error)
                    continue
                own = [batch[number] for number in one.numbers]
                ensemble = Ensemble(own, scenes, peaks=peaks)
                ensemble.advance(pool, threads)
                ends.update(zip(one.numbers, ensemble.ends(), strict=True))
            yield [ends[i] for i in range(len(batch))]


def _batches(models: Iterable[Model], most: int) -> Iterator[list[Model]]:
    batch: list[Model] = []
    bodies = 0
    for model in models:
        count = len(model.bodies)
        if batch and (len(batch) == most or bodies + count > MOST_BODIES):
            yield batch
            batch, bodies = [], 0
        batch.append(model)
        bodies += count
    if batch:
        yield batch


class Ensemble:
    """Scenes of one scheme and shape, stacked, to be advanced together once."""

    def __init__(self, models: Sequence[Model], scenes: schemes.AnyScene, *, peaks: bool = False) -> None:
        """Take a stack of scenes that have not moved yet, and what they are scenes of.

        `peaks` says whether the largest rotations on the way are followed.
        """
        self.placed = [model.bodies for model in models]
        self.has_peaks = peaks
        self.scenes = scenes
        self.scheme, self.names = schemes.scheme_of(self.scenes), schemes.ledger_names(self.scenes)
        self.bodies = int(self.scenes.world.bodies.shape[1]) - 1
        self.time_steps: list[float] = self.scenes.world.controls["step"][:, 0].tolist()
        own = [*zip(models, self.time_steps, strict=True)]
        self.timelines = [loop.Timeline(*one) if one[0].scenario.events else None for one in own]
        ends = [loop.last_step_of(model.scenario.time.end, step) for model, step in own]
        self.last_steps = np.array(ends, dtype=np.int64)
        self.starts = np.zeros((len(own), len(self.scheme.row_names)))
        self.codes = np.zeros(len(own), dtype=np.int64)
        self.periods = np.array([max(model.scenario.output.every / step, 1.0) for model, step in own])
        start = self._positions(self.scenes, slice(None))
        self.supports = [observables.MovingSupport(model) for model in models]
        self.watch = Watch(self.placed, self.supports, start)
        steps, places = np.zeros(len(own), dtype=np.int64), np.zeros_like(start)
        shapes = self.watch.shapes
        thresholds = np.where(
            shapes.is_free, MOVED_SHARE * shapes.shortest, np.inf
        )  # m, beyond which a block has moved
        # compiled code sees no motion relative to a support that moves
        periods = np.where([support.moves for support in self.supports], 0.0, self.periods)
        frames = self.periods if peaks else np.zeros(len(own))
        self.watched = Watched(frames, periods, steps, places, start, shapes.reach, thresholds, np.zeros(len(own)))

    def advance(self, pool: ThreadPoolExecutor, threads: int) -> None:
        """Advance all members to their ends; a thread that is done with some takes the next ones."""
        nobody = np.zeros(0, dtype=np.int64)
        with compiler.compiling():  # what a single run has no use for, before there are threads
            self._advance_members(nobody, self.last_steps, self.starts, self.codes)
        count = len(self.codes)
        if any(self.timelines):  # each is advanced alone, from where it begins
            self._advance_members(np.arange(count), np.zeros_like(self.codes), self.starts, self.codes)
        if self.scheme.advance_members is None or any(self.timelines):
            self.codes[:] = arrays.PAIRS_FULL
            return
        chunk = min(CHUNK, -(-count // threads))
        list(pool.map(self._advance, (np.arange(i, min(i + chunk, count)) for i in range(0, count, chunk))))

    def _advance(self, members: NDArray[np.int64]) -> None:
        """Advance some members from check to check, without those whose energy does not add up any more."""
        rows, stops = self.starts, np.zeros_like(self.codes)
        done = 0
        while members.size:
            done = balance.next_energy_check(done, self.bodies)
            np.minimum(self.last_steps, done, out=stops)
            rides = np.array([self.supports[m].moves for m in members.tolist()])
            self._advance_members(members[~rides], stops, rows, self.codes)
            for m in members[rides].tolist():
                self._advance_watching(m, int(stops[m]), rows)
            rows = np.zeros_like(self.starts)  # what is measured at the start of a later call
            members = members[(self.codes[members] == arrays.REACHED) & (self.last_steps[members] > done)]
            if members.size:
                measured, which = self._measured(members), members.tolist()
                ledgers = (
                    balance.ledger_of(
                        self.names, measured[m], float(self.starts[m, : len(self.scheme.ledger)].sum()), *own
                    )
                    for m, own in zip(which, in_play_of(self.scenes, which), strict=True)
                )
                members = members[[*map(balance.adds_up, ledgers)]]

    def _advance_watching(self, m: int, stop: int, rows: NDArray[np.float64]) -> None:
        """Advance a member on a moving support to a step, from frame to frame until something has moved there."""
        stops, is_under_way = np.zeros_like(self.codes), True
        while is_under_way:
            done = int(self.scenes.world.clock["steps"][m, 0])
            frame = stop if self.watch.first[m] else min(stop, next_frame(done, self.periods[m]))
            stops[m] = frame
            self._advance_members(np.array([m]), stops, rows, self.codes)
            rows = np.zeros_like(rows)  # what is measured at the start of a later call
            is_under_way = self.codes[m] == arrays.REACHED and frame < stop
            if self.codes[m] == arrays.REACHED and next_frame(frame - 1, self.periods[m]) == frame:
                motion = blocks.motion_of(self.scenes.world.bodies[[m], : len(self.placed[0])])
                self.watch.follow([m], motion, [frame * self.time_steps[m]])

    def _advance_members(self, members: Steps, stops: Steps, rows: NDArray[np.float64], codes: Steps) -> None:
        """Advance some members in compiled code, where the scheme can."""
        if self.scheme.advance_members is not None:
            self.scheme.advance_members(self.scenes, members, stops, rows, codes, self.watched)

    def _positions(self, scenes: schemes.AnyScene, which: list[int] | slice) -> NDArray[np.float64]:
        """Return x, y (m) and angle (rad) of the blocks of some scenes of a stack, (k, 3, b)."""
        bodies = scenes.world.bodies.view(np.ndarray)  # a record array takes five times as long for a field
        return np.stack([bodies[name][which, : len(self.placed[0])] for name in instruments.POSITION], axis=1)

    def _measured(self, members: Steps) -> NDArray[np.float64]:
        """Return rows as `measured` of the scheme names them: a call that goes to no further step only measures."""
        rows, nowhere = np.zeros_like(self.starts), np.zeros_like(self.codes)
        self._advance_members(members, nowhere, rows, nowhere.copy())
        return rows

    def ends(self) -> list[EnsembleEnd]:
        """Return where the members ended, in order; those whose list of pairs is full go on alone."""
        codes: list[int] = self.codes.tolist()
        # the end is a frame too: it shows what moved first where nothing had before
        self.watch.take_first_moves(self.watched.steps, self.watched.places, self.time_steps)
        which = [m for m, code in enumerate(codes) if self.watch.first[m] is None and code != arrays.PAIRS_FULL]
        steps = self.scenes.world.clock["steps"][which, 0].tolist()
        times = [step * self.time_steps[m] for m, step in zip(which, steps, strict=True)]
        self.watch.follow(which, blocks.motion_of(self.scenes.world.bodies[which, : len(self.placed[0])]), times)
        turned = None
        if self.has_peaks:  # in frames and at the end
            turns = np.abs(self._positions(self.scenes, slice(None))[:, 2] - self.watched.start[:, 2])
            at_end = np.where(self.watch.shapes.is_free, turns, 0.0).max(axis=1, initial=0.0)
            turned = np.asarray(np.fmax(self.watched.peaks, at_end))[:, None]
        measured = self._measured(np.arange(len(codes)))
        starts = [float(row.sum()) for row in self.starts[:, : len(self.scheme.ledger)]]
        ends = member_ends(self.scenes, self.placed, measured, self.watch, starts, codes, turned)
        return [ends.get(m) or self._run_alone(m, starts[m]) for m in range(len(codes))]

    def _run_alone(self, m: int, start: float) -> EnsembleEnd:
        """Go on with a member whose pair list is full, from stop to stop, as `_advance` does."""
        scene, last = build.member(self.scenes, m), int(self.last_steps[m])
        continues = True
        try:
            if not scene.world.clock[0].is_started:
                scene, _ = schemes.ALONE.advance(self.scheme.with_more_room(scene), 0)
                start = balance.start_energy(scene)
            run = loop.Simulation.of(scene, self.placed[m], self.timelines[m], start)
            while continues:
                done = run.steps
                look = stop = min(balance.next_energy_check(done, self.bodies), last)
                # frames count until something has moved, and on a support that moves until a block is removed
                if self.supports[m].moves or not self.watch.first[m]:
                    stop = min(stop, next_frame(done, self.periods[m]))
                run.step_to(stop)
                now = run.steps
                is_under_way = run.code == arrays.REACHED and now < last
                continues = is_under_way and (now != look or balance.adds_up(run.energy()))
                if not continues or next_frame(now - 1, self.periods[m]) == now:
                    motion = blocks.motion_of(build.stack_of_one(run.scene).world.bodies[[0], : len(self.placed[0])])
                    self.watch.follow([m], motion, [now * self.time_steps[m]])
        except BlocksimError as error:
            return MemberFailure(error)
        measured, scenes = schemes.measure_row(run.scene)[np.newaxis], build.stack_of_one(run.scene)
        return member_ends(scenes, [self.placed[m]], measured, self.watch.only(m), [start], [run.code])[0]

"""Run one scenario: build the scene, step it, keep what it did.

`simulate` does so in memory, `simulate_into` in a folder, with checkpoints.
"""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

from blocksim.scenario import PlacedBody, Scenario, scenario_hash
from blocksim.scenario.placement import smallest_width
from blocksim.silence import silent
from blocksim.simulation import folder as files
from blocksim.simulation.checkpoint import origin_of, restored
from blocksim.simulation.checkpoint_policy import DEFAULTS, NO_PAST, CheckpointPolicy, CheckpointWriter, Past
from blocksim.simulation.compilation import compile_kernels, compile_systems, kernels_of
from blocksim.simulation.disk_room import refuse_full_disk
from blocksim.simulation.events import Timeline
from blocksim.simulation.folder import folder_lock
from blocksim.simulation.happened import in_words
from blocksim.simulation.keeping import keep_result
from blocksim.simulation.ledger import RESIDUAL_PROMISE
from blocksim.simulation.loop import LoopResult, RunControl, Watcher, run_loop
from blocksim.simulation.movement import Movement
from blocksim.simulation.moving_support import MovingSupport
from blocksim.simulation.onset import onset_warning
from blocksim.simulation.probes import probes_of
from blocksim.simulation.provenance import environment, run_hash, state_hash
from blocksim.simulation.recorder import Recorder
from blocksim.simulation.result import Result
from blocksim.simulation.result_files import keep_scenario, probe_tables, read_tables
from blocksim.simulation.resumption import (
    NEW,
    Resumption,
    check_frames,
    find_resumption,
    kept_rows,
    remarks_on,
    take_over_probes,
)
from blocksim.simulation.schemes import AnyScene, build, ledger_names, scheme_of
from blocksim.simulation.settled import Settled
from blocksim.simulation.settling import begun
from blocksim.simulation.stopping import WallTime, stop_requests
from blocksim.simulation.stores.hdf5_writer import FrameFile
from blocksim.simulation.summary import Summary
from blocksim.simulation.table import final_columns
from blocksim.simulation.team import Team, team_for
from blocksim.world.memory import is_shorter_than_step
from blocksim.world.scenes import Built
from blocksim.world.systems import others_of, warnings_of


@dataclass(frozen=True)
class Listener:
    """What is called before the first step of a run; nothing by default."""

    on_remark: Callable[[str], None] = silent  # a line: a run already computed, or resumed and where
    on_start: Callable[[str], None] = silent  # the set of kernels, which is compiled next


SILENT = Listener()


def simulate(
    scenario: Scenario, *, threads: int = 1, on_progress: Watcher = silent, wall_time: float | None = None
) -> Result:
    """Run a scenario in memory, without writing anything. A signal or the limit of wall time (s) interrupts it.

    The result does not depend on the number of threads; small scenes do not use them all.
    """
    limit, began = WallTime(wall_time), time.perf_counter()
    built = build(scenario)
    began += _compiled(scenario)
    recorder = _recorder(scenario, built)
    with _attended(built.scene, scenario, threads, limit, on_progress) as (team, control):
        scene, settled = begun(built.scene, scenario, built.placed, team, control.stop)
        watched = replace(control, timeline=_timeline(scenario, recorder))
        ended = run_loop(scene, recorder, scenario.time.end, team=team, control=watched)
    return _result(scenario, recorder, ended, time.perf_counter() - began, settled)


def simulate_into(
    scenario: Scenario,
    folder: Path,
    *,
    overwrite: bool = False,
    resume: bool = False,
    threads: int = 1,
    precautions: CheckpointPolicy = DEFAULTS,
    on_progress: Watcher = silent,
    listener: Listener = SILENT,
) -> Result:
    """Run a scenario and keep everything in a folder, frames while it runs, the mark of a finished run last.

    With `resume` it continues from the newest whole checkpoint there, to the same bits as without the interruption;
    without any it starts again. Raises InvalidInputError for checkpoints of another scenario or version of the code,
    OutputExistsError where the folder is not free, or another run is in progress in it, and OutputError where writing
    fails. A signal (SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGUSR1) or the limit of wall time ends it with the status
    `interrupted`, and what was computed until then is kept.
    """
    limit, began = WallTime(precautions.wall_time, precautions.time_over), time.perf_counter()
    built = build(scenario)
    refuse_full_disk(folder, scenario, built.scene)
    tables = read_tables(scenario)
    with folder_lock(folder):
        resumption = find_resumption(folder, scenario) if resume else NEW
        for remark in remarks_on(resumption, folder) if resume else ():
            listener.on_remark(remark)
        began += _compiled(scenario, listener)
        with _attended(built.scene, scenario, threads, limit, on_progress) as (team, control):
            settled = None if resumption.checkpoint is None else resumption.checkpoint.position.settled
            if resumption.checkpoint is None:
                scene, settled = begun(built.scene, scenario, built.placed, team, control.stop)
                built = built._replace(scene=scene)
            segment = RunSegment(scenario, folder, built, resumption, settled)
            toml = segment.prepare(tables, overwrite=overwrite or resume)
            ended = segment.run(toml, precautions, team, control)
            result = _result(scenario, segment.recorder, ended, time.perf_counter() - began, settled)
            return keep_result(result, segment.account(result.summary), folder)


def _compiled(scenario: Scenario, listener: Listener = SILENT) -> float:
    """Compile what a run needs and return the seconds it took, which are no part of the run. Raises OutputError."""
    began = time.perf_counter()
    kernels = kernels_of(scenario)
    listener.on_start(kernels)
    compile_kernels(kernels)
    compile_systems(scenario)
    return time.perf_counter() - began


@contextmanager
def _attended(
    scene: AnyScene, scenario: Scenario, threads: int, limit: WallTime, on_progress: Watcher
) -> Iterator[tuple[Team, RunControl]]:
    """Give the threads of a run, and what stops it: a signal, or the limit of wall time."""
    elements = sum(one.count for one in others_of(scenario))
    with stop_requests() as requests, team_for(scene, threads, elements) as team:
        yield team, RunControl(on_progress, lambda: requests.reason() or limit.reason())


def _timeline(scenario: Scenario, recorder: Recorder) -> Timeline | None:
    """Return the events of a run, None where it has none."""
    return Timeline(scenario, recorder.placed, recorder.time_step) if scenario.events else None


def _recorder(scenario: Scenario, built: Built) -> Recorder:
    step, output = float(built.scene.world.controls[0].step), scenario.output
    probes, others = probes_of(scenario, built.placed, step, ledger_names(built.scene)), others_of(scenario)
    support = MovingSupport(scenario)
    return Recorder(
        built.placed, output.every, step, others=others, contacts=output.contacts, probes=probes, support=support
    )


class RunSegment:
    """A run, or a part of one that was resumed, in its folder: its frames and checkpoints."""

    def __init__(
        self, scenario: Scenario, folder: Path, built: Built, resumption: Resumption, settled: Settled | None = None
    ) -> None:
        """Take the scene at time zero and go to the checkpoint, if there is one.

        Nothing is written yet. Raises InvalidInputError where the checkpoint or the frames before it do not fit.
        """
        self.scenario, self.folder, self.resumption = scenario, folder, resumption
        stored = resumption.checkpoint
        self.scene = built.scene if stored is None else restored(stored, built.scene)
        self.recorder = _recorder(scenario, built)
        self.step = self.recorder.time_step
        self.past = replace(NO_PAST, settled=settled)
        if stored is not None:
            self.past = Past.of(stored.path, stored.position)
            self.recorder.take_over(kept_rows(folder, self.recorder))
            check_frames(stored, self.recorder)
            take_over_probes(stored, scenario, self.recorder)

    def prepare(self, tables: Mapping[str, bytes], *, overwrite: bool) -> str:
        """Make the folder ready for this part; return the resolved scenario. Raises OutputExistsError, OutputError."""
        if self.resumption.checkpoint is None:
            files.prepare_folder(self.folder, overwrite=overwrite)
        return keep_scenario(self.scenario, tables, self.folder)

    def run(self, toml: str, precautions: CheckpointPolicy, team: Team, control: RunControl) -> LoopResult:
        """Run to the end or an interruption; the file of the frames says `toml`. Raises OutputError."""
        with FrameFile(
            self.folder / files.FRAMES,
            self.recorder.placed,
            self.step,
            toml,
            ledger=ledger_names(self.scene),
            kept=self.recorder.held,
            others=self.recorder.systems[1:],
            contacts=self.scenario.output.contacts,
            probes=self.recorder.probes,
        ) as sink:
            self.recorder.pour_into(sink)
            files.clear_remains(
                self.folder, (files.FINAL, files.SOILS, files.SUMMARY, *probe_tables(self.scenario))
            )  # of the part before
            self.writer = CheckpointWriter(
                self.folder,
                origin_of(self.scenario),
                sink.sync,
                precautions.periods(self.step),
                precautions.checkpoint_seconds,
                self.past,
            )
            control = replace(control, checkpoints=self.writer, timeline=_timeline(self.scenario, self.recorder))
            since = self.resumption.checkpoint and self.resumption.checkpoint.position
            return run_loop(self.scene, self.recorder, self.scenario.time.end, team=team, control=control, since=since)

    def account(self, summary: Summary) -> Summary:
        """Return the summary of this part as that of the whole run."""
        last = None if summary.status == "finished" else self.writer.last_step
        altered, warnings = self.recorder.altered, self.resumption.remarks
        if altered:
            more = f" and {len(altered) - 1} more" if len(altered) > 1 else ""
            where = f"{self.folder / files.FRAMES}: the frame of step {altered[0]}{more}"
            text = f"{where} differs from the recomputed one: it was changed after recording"
            warnings = (*warnings, text)
        return summary.model_copy(
            update={
                "total_seconds": self.past.seconds + summary.total_seconds,
                "resumed_from": self.past.resumed_from,
                "last_checkpoint": last,
                "warnings": (*warnings, *summary.warnings),
            }
        )


def _result(
    scenario: Scenario, recorder: Recorder, ended: LoopResult, seconds: float, settled: Settled | None
) -> Result:
    frames = recorder.frames()
    summary = _summary(scenario, recorder, ended, seconds)
    added = [text for text in [onset_warning(scenario, recorder.placed, ended.scene.world, settled)] if text]
    summary = summary.model_copy(update={"settled": settled, "warnings": (*summary.warnings, *added)})
    probes = recorder.probes.series()
    return Result(scenario.name, final_columns(frames), summary, scenario, held=frames, held_probes=probes)


def _summary(scenario: Scenario, recorder: Recorder, ended: LoopResult, seconds: float) -> Summary:
    world = ended.scene.world
    step = float(world.controls[0].step)
    steps, ground = int(world.clock[0].steps), world.bodies[-1]
    return Summary(
        name=scenario.name,
        status=ended.outcome.status,
        reason=ended.outcome.reason,
        exit_code=ended.outcome.exit_code,
        run=run_hash(scenario),
        scenario_hash=scenario_hash(scenario),
        final_state_sha256=state_hash(ended.scene),
        steps=steps,
        time_step_s=step,
        simulated_time_s=steps * step,
        ended_at=datetime.now(UTC).isoformat(timespec="seconds"),
        compile_seconds=compile_kernels(kernels_of(scenario, recorder.placed)),
        solver_seconds=ended.solver_seconds,
        total_seconds=seconds,
        energy_J=ended.ledger,
        threads=ended.threads,
        events=ended.events,
        movement=Movement.of(recorder.watch, recorder.held[-1].states[0], (ground.vx, ground.vy), steps * step),
        warnings=tuple(_warnings(scenario, recorder.placed, ended)),
        environment=environment(),
    )


def _warnings(scenario: Scenario, placed: Sequence[PlacedBody], ended: LoopResult) -> Iterator[str]:
    residual, every = ended.ledger.relative_residual, scenario.output.every
    if residual > RESIDUAL_PROMISE:
        yield f"relative energy error {residual:.1e}, above {RESIDUAL_PROMISE:g}"
    if is_shorter_than_step(every, float(ended.scene.world.controls[0].step)):
        yield f"output.every = {every:.3g} s is shorter than a step: a frame at every step"
    yield from warnings_of(scenario)
    for number in ended.pending if ended.outcome.is_finished else ():
        yield f"events.{number} has not happened, as nothing came to rest: {in_words(scenario.events[number])}"
    if ended.outcome.is_finished and placed:
        sunk = scheme_of(ended.scene).warning(ended.scene, ended.overlap, smallest_width(placed))
        if sunk:
            yield sunk

"""Run one scenario: build the world, step it, keep what it did."""

import json
import time
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path

from blocksim.scenario import Scenario, place_bodies, scenario_hash
from blocksim.scenario.models.stepping import Nonsmooth
from blocksim.simulation import folder as files
from blocksim.simulation.atomic import sha256_of, write_text
from blocksim.simulation.claim import claimed
from blocksim.simulation.compilation import compile_kernels, kernels_of
from blocksim.simulation.copies import keep_scenario, read_tables
from blocksim.simulation.disk import refuse_full_disk
from blocksim.simulation.loop import Attendance, LoopResult, Progress, Watcher, run_loop
from blocksim.simulation.outcome import RESIDUAL_PROMISE
from blocksim.simulation.part import Part
from blocksim.simulation.precautions import DEFAULTS, Precautions
from blocksim.simulation.provenance import environment, run_hash, state_hash
from blocksim.simulation.recorder import Recorder
from blocksim.simulation.result import Result
from blocksim.simulation.resumption import NEW, find_resumption
from blocksim.simulation.schemes import build_scene
from blocksim.simulation.stopping import WallTime, stop_requests
from blocksim.simulation.summary import Summary, read_summary
from blocksim.simulation.table import csv_text, final_columns
from blocksim.simulation.team import team_for
from blocksim.world.memory import is_shorter_than_step
from blocksim.world.sag import overlap_warning

COPIES = (files.SCENARIO, files.EXPERIMENT, files.MOTION)


def _ignore(_: Progress) -> None:
    pass


def simulate(
    scenario: Scenario, *, threads: int = 1, on_progress: Watcher = _ignore, wall_time: float | None = None
) -> Result:
    """Run a scenario in memory, without writing anything. A signal or the limit of wall time (s) interrupts it.

    The result does not depend on the number of threads; small scenes do not use them all.
    """
    limit = WallTime(wall_time)
    compile_kernels(kernels_of(scenario))
    began = time.perf_counter()
    scene = build_scene(scenario)
    step, output = float(scene.world.controls[0].step), scenario.output
    recorder = Recorder(place_bodies(scenario), output.every, step, contacts=output.contacts)
    with stop_requests() as requests, team_for(scene, threads) as team:
        attendance = Attendance(on_progress, lambda: requests.reason() or limit.reason())
        ended = run_loop(scene, recorder, scenario.time.end, team=team, attendance=attendance)
    return _result(scenario, recorder, ended, time.perf_counter() - began)


def simulate_into(  # noqa: PLR0913 - what a user can choose for a run
    scenario: Scenario,
    folder: Path,
    *,
    overwrite: bool = False,
    resume: bool = False,
    threads: int = 1,
    precautions: Precautions = DEFAULTS,
    on_progress: Watcher = _ignore,
) -> Result:
    """Run a scenario and keep everything in a folder, frames while it runs, the mark of a finished run last.

    With `resume` it continues from the newest whole checkpoint there, to the same bits as without the interruption;
    without any it starts again. Raises InvalidInputError for checkpoints of another scenario or version of the code,
    OutputExistsError where the folder is not free, or another run is in progress in it, and OutputError where writing
    fails. A signal (SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGUSR1) or the limit of wall time ends it with the status
    `interrupted`, and what was computed until then is kept.
    """
    limit = WallTime(precautions.wall_time)
    compile_kernels(kernels_of(scenario))
    began = time.perf_counter()
    built = build_scene(scenario)
    refuse_full_disk(folder, scenario, built)
    tables = read_tables(scenario)
    with claimed(folder):
        part = Part(scenario, folder, built, find_resumption(folder, scenario) if resume else NEW)
        toml = _made_ready(part, tables, overwrite=overwrite or resume)
        with stop_requests() as requests, team_for(part.scene, threads) as team:
            attendance = Attendance(on_progress, lambda: requests.reason() or limit.reason())
            ended = part.run(toml, precautions, team, attendance)
            result = _result(scenario, part.recorder, ended, time.perf_counter() - began)
            return _keep_result(result, part.account(result.summary), folder)


def _made_ready(part: Part, tables: Mapping[str, bytes], *, overwrite: bool) -> str:
    """Make the folder of a run ready for this part of it; return the resolved scenario."""
    if not part.goes_on:
        files.prepare_folder(part.folder, overwrite=overwrite)
    return keep_scenario(part.scenario, tables, part.folder)


def renew_copies(scenario: Scenario, folder: Path) -> None:
    """Bring the resolved scenario and the experiment table in a finished run's folder up to date.

    Neither decides the motion, so both may have changed since the run: another table, or another description.
    """
    tables = read_tables(scenario)
    old = tuple(_bytes_of(folder / name) for name in COPIES)
    keep_scenario(scenario, tables, folder)
    if old != tuple(_bytes_of(folder / name) for name in COPIES):
        summary = _with_checksums(read_summary(folder / files.SUMMARY), folder)
        write_text(folder / files.SUMMARY, summary.to_json())


def _bytes_of(path: Path) -> bytes | None:
    return path.read_bytes() if path.is_file() else None


def _result(scenario: Scenario, recorder: Recorder, ended: LoopResult, seconds: float) -> Result:
    frames = recorder.frames()
    summary = _summary(scenario, ended, seconds).model_copy(update={"movement": recorder.watch.found()})
    return Result(scenario.name, final_columns(frames), summary, scenario, held=frames)


def _summary(scenario: Scenario, ended: LoopResult, seconds: float) -> Summary:
    step = float(ended.world.controls[0].step)
    steps = int(ended.world.clock[0].steps)
    return Summary(
        name=scenario.name,
        status=ended.outcome.status,
        reason=ended.outcome.reason,
        exit_code=ended.outcome.exit_code,
        run=run_hash(scenario),
        scenario_hash=scenario_hash(scenario),
        final_state_sha256=state_hash(ended.world),
        steps=steps,
        time_step_s=step,
        simulated_time_s=steps * step,
        ended_at=datetime.now(UTC).isoformat(timespec="seconds"),
        compile_seconds=compile_kernels(kernels_of(scenario)),
        solver_seconds=ended.solver_seconds,
        total_seconds=seconds,
        energy_J=ended.ledger,
        threads=ended.threads,
        warnings=tuple(_warnings(scenario, ended)),
        environment=environment(),
    )


def _warnings(scenario: Scenario, ended: LoopResult) -> Iterator[str]:
    residual, every = ended.ledger.relative_residual, scenario.output.every
    if residual > RESIDUAL_PROMISE:
        yield f"energy is off by {residual:.1e} of the energy in play, more than {RESIDUAL_PROMISE:g}"
    if is_shorter_than_step(every, float(ended.world.controls[0].step)):
        yield f"output.every = {every:.3g} s is shorter than a step: a frame at every step"
    if isinstance(scenario.time, Nonsmooth) and ended.outcome.is_finished:
        sunk = overlap_warning(ended.overlap, min(min(body.size_x, body.size_y) for body in place_bodies(scenario)))
        if sunk:
            yield sunk


def _with_checksums(summary: Summary, folder: Path) -> Summary:
    kept = [name for name in (*COPIES, files.FINAL, files.FRAMES) if (folder / name).is_file()]
    return summary.model_copy(update={"sha256": {name: sha256_of(folder / name) for name in kept}})


def _keep_result(result: Result, summary: Summary, folder: Path) -> Result:
    write_text(folder / files.FINAL, csv_text(result.columns))
    summary = _with_checksums(summary, folder)
    write_text(folder / files.SUMMARY, summary.to_json())
    if result.status == "finished":
        write_text(folder / files.DONE, json.dumps({"run": summary.run, "status": summary.status}) + "\n")
        files.clear_remains(folder, files.CHECKPOINTS)
    return Result(result.name, result.columns, summary, result.scenario, folder)

"""Run one scenario: build the world, step it, keep what it did."""

import json
import time
from datetime import UTC, datetime
from pathlib import Path

from blocksim.errors import InputMissingError
from blocksim.scenario import Scenario, place_bodies, scenario_hash, scenario_to_toml
from blocksim.simulation import folder as files
from blocksim.simulation.atomic import sha256_of, write_bytes, write_text
from blocksim.simulation.compilation import compile_kernels
from blocksim.simulation.loop import LoopResult, Progress, Watcher, run_loop
from blocksim.simulation.outcome import RESIDUAL_PROMISE
from blocksim.simulation.provenance import environment, run_hash, state_hash
from blocksim.simulation.recorder import Recorder
from blocksim.simulation.result import Result
from blocksim.simulation.stopping import stop_requests
from blocksim.simulation.stores.hdf5_writer import FrameFile
from blocksim.simulation.summary import Summary, read_summary
from blocksim.simulation.table import final_table
from blocksim.world.build import build_world


def _ignore(_: Progress) -> None:
    pass


def simulate(scenario: Scenario, *, on_progress: Watcher = _ignore) -> Result:
    """Run a scenario in memory, without writing anything. Ctrl-C ends it with the status `interrupted`."""
    compile_kernels()
    began = time.perf_counter()
    world = build_world(scenario)
    recorder = Recorder(place_bodies(scenario), scenario.output.every, float(world.controls[0].step))
    with stop_requests() as is_stopped:
        ended = run_loop(world, recorder, scenario.time.end, on_progress=on_progress, is_stopped=is_stopped)
    return _result(scenario, recorder, ended, began)


def simulate_into(
    scenario: Scenario, folder: Path, *, overwrite: bool = False, on_progress: Watcher = _ignore
) -> Result:
    """Run a scenario and keep everything in a folder, frames while it runs, the mark of a finished run last.

    Raises OutputExistsError where the folder is not free and OutputError where writing fails. Ctrl-C ends it with the
    status `interrupted`, and what there is by then is kept.
    """
    compile_kernels()
    began = time.perf_counter()
    world = build_world(scenario)
    measured = _experiment_bytes(scenario)
    files.prepare_folder(folder, overwrite=overwrite)
    toml = _keep_scenario(scenario, measured, folder)
    placed = place_bodies(scenario)
    step = float(world.controls[0].step)
    with stop_requests() as is_stopped:
        with FrameFile(folder / files.FRAMES, placed, step, toml) as sink:
            recorder = Recorder(placed, scenario.output.every, step, sink)
            ended = run_loop(world, recorder, scenario.time.end, on_progress=on_progress, is_stopped=is_stopped)
        return _keep_result(_result(scenario, recorder, ended, began), folder)


def renew_copies(scenario: Scenario, folder: Path) -> None:
    """Bring the resolved scenario and the experiment table in a finished run's folder up to date.

    Neither decides the motion, so both may have changed since the run: another table, or another description.
    """
    measured = _experiment_bytes(scenario)
    old = tuple(_bytes_of(folder / name) for name in (files.SCENARIO, files.EXPERIMENT))
    if measured is None:
        (folder / files.EXPERIMENT).unlink(missing_ok=True)
    _keep_scenario(scenario, measured, folder)
    if old != tuple(_bytes_of(folder / name) for name in (files.SCENARIO, files.EXPERIMENT)):
        summary = _with_checksums(read_summary(folder / files.SUMMARY), folder)
        write_text(folder / files.SUMMARY, summary.to_json())


def _bytes_of(path: Path) -> bytes | None:
    return path.read_bytes() if path.is_file() else None


def _experiment_bytes(scenario: Scenario) -> bytes | None:
    """Read the experiment table before the folder is emptied: it may lie in there, where a run is repeated."""
    if scenario.experiment is None:
        return None
    try:
        return scenario.experiment.table.read_bytes()
    except OSError as error:
        message = f"{scenario.experiment.table}: cannot be read: {error.strerror}"
        raise InputMissingError(message) from error


def _keep_scenario(scenario: Scenario, measured: bytes | None, folder: Path) -> str:
    """Write the resolved scenario, and beside it a copy of its experiment table; return the TOML."""
    toml = scenario_to_toml(scenario, experiment_table=None if measured is None else files.EXPERIMENT)
    write_text(folder / files.SCENARIO, toml)
    if measured is not None:
        write_bytes(folder / files.EXPERIMENT, measured)
    return toml


def _result(scenario: Scenario, recorder: Recorder, ended: LoopResult, began: float) -> Result:
    frames = recorder.frames()
    summary = _summary(scenario, ended, time.perf_counter() - began)
    return Result(scenario.name, final_table(frames), frames, summary, scenario)


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
        compile_seconds=compile_kernels(),
        solver_seconds=ended.solver_seconds,
        total_seconds=seconds,
        energy_J=ended.ledger,
        warnings=_warnings(ended),
        environment=environment(),
    )


def _warnings(ended: LoopResult) -> tuple[str, ...]:
    residual = ended.ledger.relative_residual
    if residual <= RESIDUAL_PROMISE:
        return ()
    return (f"energy is off by {residual:.1e} of the energy in play, more than {RESIDUAL_PROMISE:g}",)


def _with_checksums(summary: Summary, folder: Path) -> Summary:
    kept = [name for name in (files.SCENARIO, files.EXPERIMENT, files.FINAL, files.FRAMES) if (folder / name).is_file()]
    return summary.model_copy(update={"sha256": {name: sha256_of(folder / name) for name in kept}})


def _keep_result(result: Result, folder: Path) -> Result:
    write_text(folder / files.FINAL, result.final.to_csv(index=False, lineterminator="\n"))
    summary = _with_checksums(result.summary, folder)
    write_text(folder / files.SUMMARY, summary.to_json())
    if result.status == "finished":
        write_text(folder / files.DONE, json.dumps({"run": summary.run, "status": summary.status}) + "\n")
    return Result(result.name, result.final, result.frames, summary, result.scenario, folder)

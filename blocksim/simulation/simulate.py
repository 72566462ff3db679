"""Run one scenario: build the world, step it, keep what it did."""

import json
import shutil
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from blocksim.errors import OutputError
from blocksim.kernels.arrays import World
from blocksim.scenario import Scenario, place_bodies, scenario_hash, scenario_to_toml
from blocksim.simulation import folder as files
from blocksim.simulation.atomic import sha256_of, write_text
from blocksim.simulation.compilation import compile_kernels
from blocksim.simulation.loop import LoopResult, Progress, run_loop
from blocksim.simulation.outcome import RESIDUAL_PROMISE
from blocksim.simulation.provenance import environment, run_hash, state_hash
from blocksim.simulation.recorder import Recorder
from blocksim.simulation.result import Result
from blocksim.simulation.stores.hdf5 import FrameFile
from blocksim.simulation.table import final_table
from blocksim.world.build import build_world

Watcher = Callable[[Progress], None]


def _ignore(_: Progress) -> None:
    pass


def simulate(scenario: Scenario, *, on_frame: Watcher = _ignore) -> Result:
    """Run a scenario in memory, without writing anything."""
    compile_kernels()
    began = time.perf_counter()
    world = build_world(scenario)
    recorder = Recorder(place_bodies(scenario), scenario.output.every, float(world.controls[0].step))
    ended = run_loop(world, recorder, scenario.time.end, on_frame=on_frame)
    return _result(scenario, recorder, ended, time.perf_counter() - began)


def simulate_into(scenario: Scenario, folder: Path, *, overwrite: bool = False, on_frame: Watcher = _ignore) -> Result:
    """Run a scenario and keep everything in a folder, frames while it runs, the mark of a finished run last.

    Raises OutputExistsError where the folder is not free and OutputError where writing fails.
    """
    compile_kernels()
    began = time.perf_counter()
    world = build_world(scenario)
    files.prepare_folder(folder, overwrite=overwrite)
    toml = _keep_scenario(scenario, folder)
    placed = place_bodies(scenario)
    step = float(world.controls[0].step)
    with FrameFile(folder / files.FRAMES, placed, step, toml) as sink:
        recorder = Recorder(placed, scenario.output.every, step, sink)
        ended = run_loop(world, recorder, scenario.time.end, on_frame=on_frame)
    result = _result(scenario, recorder, ended, time.perf_counter() - began)
    return _keep_result(result, folder)


def _keep_scenario(scenario: Scenario, folder: Path) -> str:
    """Write the resolved scenario and copy its experiment table beside it; return the TOML."""
    copy = None
    if scenario.experiment is not None:
        copy = scenario.experiment.table.name
        try:
            shutil.copyfile(scenario.experiment.table, folder / copy)
        except OSError as error:
            message = f"{folder / copy}: cannot be written: {error.strerror}"
            raise OutputError(message) from error
    toml = scenario_to_toml(scenario, experiment_table=copy) if copy else scenario_to_toml(scenario)
    write_text(folder / files.SCENARIO, toml)
    return toml


def _result(scenario: Scenario, recorder: Recorder, ended: LoopResult, seconds: float) -> Result:
    frames = recorder.frames()
    return Result(scenario.name, final_table(frames), frames, _summary(scenario, ended, seconds), scenario)


def _summary(scenario: Scenario, ended: LoopResult, seconds: float) -> dict[str, Any]:
    world: World = ended.world
    step = float(world.controls[0].step)
    steps = int(world.clock[0].steps)
    ledger = ended.ledger.to_dict()
    warnings = []
    if ended.ledger.relative_residual > RESIDUAL_PROMISE:
        warnings.append(f"energy residual {ended.ledger.relative_residual:.1e} of the energy in play, above 1e-3")
    return {
        "name": scenario.name,
        "status": ended.outcome.status,
        "reason": ended.outcome.reason,
        "exit_code": int(ended.outcome.exit_code),
        "run": run_hash(scenario),
        "scenario_hash": scenario_hash(scenario),
        "final_state_sha256": state_hash(world),
        "steps": steps,
        "time_step_s": step,
        "simulated_time_s": steps * step,
        "compile_seconds": compile_kernels(),
        "solver_seconds": ended.solver_seconds,
        "total_seconds": seconds,
        "energy_J": ledger,
        "warnings": warnings,
        "environment": environment(),
    }


def _keep_result(result: Result, folder: Path) -> Result:
    write_text(folder / files.FINAL, result.final.to_csv(index=False, lineterminator="\n"))
    checksums = {name: sha256_of(folder / name) for name in (files.SCENARIO, files.FINAL, files.FRAMES)}
    summary = {**result.summary, "sha256": checksums}
    write_text(folder / files.SUMMARY, json.dumps(summary, indent=2) + "\n")
    if result.status == "finished":
        write_text(folder / files.DONE, json.dumps({"run": summary["run"], "status": result.status}) + "\n")
    return Result(result.name, result.final, result.frames, summary, result.scenario, folder)

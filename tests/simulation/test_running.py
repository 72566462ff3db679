"""A run from scenario to folder: what it keeps, and that nothing but the scenario decides its bits."""

from __future__ import annotations

import hashlib
import json
import os
import signal
from datetime import datetime
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import pytest

from blocksim.errors import InputMissingError, OutputError, OutputExistsError
from blocksim.scenario import Scenario, load_scenario, placement
from blocksim.simulation import Progress, Result, read_result, simulate_into
from blocksim.simulation.run import RunCallbacks, bytes_needed
from blocksim.simulation.schemes import build_scene, compile_kernels
from blocksim.world.step import StepError
from tests.simulation.sliding import sliding

if TYPE_CHECKING:
    import weakref
    from pathlib import Path

    from tests.simulation.conftest import Shipped

FILES = {"scenario.toml", "experiment.csv", "final.csv", "run.h5", "run.json", "done.json"}


def bits(result: Result) -> str:
    return result.summary.final_state_sha256


def test_folder_holds_what_the_design_promises_and_done_is_written_last(kept: Result, folder: Path) -> None:
    times = {path.name: path.stat().st_mtime_ns for path in folder.iterdir()}
    assert set(times) == FILES
    assert max(times, key=lambda name: times[name]) == "done.json"
    assert json.loads((folder / "done.json").read_text()) == {"run": kept.summary.run, "status": "finished"}
    assert set(kept.summary.sha256) == FILES - {"run.json", "done.json"}
    for name, checksum in kept.summary.sha256.items():
        assert hashlib.sha256((folder / name).read_bytes()).hexdigest() == checksum


def test_summary_tells_status_cost_versions_and_ledger(folder: Path) -> None:
    told = json.loads((folder / "run.json").read_text())
    assert (told["status"], told["reason"], told["exit_code"]) == ("finished", "at rest", 0)
    assert told["simulated_time_s"] == pytest.approx(told["steps"] * told["time_step_s"])
    assert 0.0 < told["solver_seconds"] <= told["total_seconds"]
    assert {"blocksim", "code", "python", "numpy", "numba", "h5py", "platform"} <= set(told["environment"])
    assert told["energy_J"]["relative_residual"] < 1e-3
    assert told["energy_J"]["friction"] > 0.0
    assert datetime.fromisoformat(told["ended_at"]).tzinfo is not None


def test_resolved_scenario_runs_to_the_same_bits_from_its_own_folder_too(
    kept: Result, folder: Path, copy: Path, tmp_path: Path
) -> None:
    experiment = load_scenario(folder / "scenario.toml").experiment
    assert experiment is not None
    assert experiment.table == (folder / "experiment.csv").resolve()
    assert kept.experiment is not None
    assert experiment.table.read_bytes() == kept.experiment.read_bytes()
    for source, place in ((folder, tmp_path / "again"), (copy, copy)):
        again = simulate_into(load_scenario(source / "scenario.toml"), place, overwrite=True)
        assert bits(again) == bits(kept)
        assert again.summary.run == kept.summary.run
        assert {path.name for path in place.iterdir()} == FILES
        for name in ("scenario.toml", "experiment.csv", "final.csv"):
            assert (place / name).read_bytes() == (folder / name).read_bytes()


def test_result_comes_back_from_its_folder_with_frames_from_start_to_end(kept: Result, folder: Path) -> None:
    back = read_result(folder)
    pd.testing.assert_frame_equal(back.final, kept.final, check_exact=True)
    assert back.summary == kept.summary
    np.testing.assert_array_equal(back.frames.x, kept.frames.x)
    np.testing.assert_array_equal(back.frames.energy["friction"], kept.frames.energy["friction"])
    assert back.frames.names == ("1", "2", "3")
    frames = kept.frames
    assert (frames.time[0], frames.time[-1]) == (0.0, kept.summary.simulated_time_s)
    assert np.all(np.diff(frames.step) > 0)
    np.testing.assert_allclose(np.diff(frames.time[:-1]), 1e-3, atol=kept.summary.time_step_s)


@pytest.mark.parametrize(
    "values",
    [
        {"contact__max_overlap": 1e-9},
        {"time__force_step": True, "time__step": 1e-3, "contact__max_overlap": 1.0},  # numbers that JSON does not know
    ],
    ids=["overlap", "explosion"],
)
def test_failed_run_is_kept_in_valid_json_without_the_mark_of_a_finished_one(
    soft: Shipped, tmp_path: Path, values: dict[str, Any]
) -> None:
    result = simulate_into(soft(**values), tmp_path / "run")
    assert (result.status, result.summary.exit_code) == ("failed", 76)
    assert "max_overlap" in result.reason or len(values) > 1
    assert {path.name for path in (tmp_path / "run").iterdir()} == FILES - {"done.json"}
    json.loads((tmp_path / "run" / "run.json").read_text(), parse_constant=pytest.fail)
    assert read_result(tmp_path / "run").status == "failed"


def test_ctrl_c_keeps_what_there_is(soft: Shipped, tmp_path: Path) -> None:
    def press_ctrl_c(where: Progress) -> None:
        if where.time > 0.05:
            os.kill(os.getpid(), signal.SIGINT)

    result = simulate_into(soft(), tmp_path / "run", on_progress=press_ctrl_c)
    assert (result.status, result.summary.exit_code) == ("interrupted", 75)
    assert 0.05 < result.summary.simulated_time_s < 0.06
    assert read_result(tmp_path / "run").frames.time[-1] == result.summary.simulated_time_s
    assert not (tmp_path / "run" / "done.json").exists()


def test_vanished_experiment_leaves_no_folder(soft: Shipped, tmp_path: Path) -> None:
    scenario = soft()
    assert scenario.experiment is not None
    gone = scenario.experiment.model_copy(update={"table": tmp_path / "gone.csv"})
    with pytest.raises(InputMissingError, match=r"gone\.csv"):
        simulate_into(scenario.model_copy(update={"experiment": gone}), tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_run_is_not_overwritten_unasked(folder: Path, soft: Shipped) -> None:
    with pytest.raises(OutputExistsError, match="contains another run; --overwrite"):
        simulate_into(soft(time__end=0.01), folder)


def test_estimate_is_no_less_than_what_a_run_leaves_and_the_disk_has_to_have_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario = sliding({}, end=0.05, every=5e-5)
    simulate_into(scenario, tmp_path / "run")
    needed = bytes_needed(scenario, build_scene(scenario))
    assert 0.5 * needed < (tmp_path / "run" / "run.h5").stat().st_size < 1.3 * needed
    asked: list[Path] = []

    def usage(place: Path) -> SimpleNamespace:
        asked.append(place)
        return SimpleNamespace(free=1_000_000)

    monkeypatch.setattr("blocksim.simulation.run.shutil.disk_usage", usage)
    with pytest.raises(OutputError, match=r"the results may take 2 MB, but only 1 MB are free there"):
        simulate_into(sliding({}, end=0.05, every=1e-7), tmp_path / "not" / "yet")
    assert asked == [tmp_path]
    assert not (tmp_path / "not").exists()


def test_blocks_are_placed_once_from_loading_to_the_result(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    times: list[str] = []
    new = placement.Placement

    def counted(scenario: weakref.ref[Scenario], *parts: Any) -> placement.Placement:
        times.append(getattr(scenario(), "name", ""))
        return new(scenario, *parts)

    monkeypatch.setattr(placement, "Placement", counted)
    compile_kernels.cache_clear()  # the scene that is compiled with is placed on the way
    simulate_into(sliding({"time": {"scheme": "nonsmooth"}}, end=0.01), tmp_path / "run")
    assert (times.count("sliding"), times.count("compile")) == (1, 1)


def test_a_run_that_cannot_be_built_is_refused_before_it_compiles_and_compiling_can_be_stopped(
    soft: Shipped, tmp_path: Path
) -> None:
    started: list[str] = []

    def stop(kernels: str) -> None:
        started.append(kernels)
        assert (tmp_path / "results" / "run").is_dir()  # locked by now
        raise KeyboardInterrupt

    listener = RunCallbacks(on_start=stop)
    with pytest.raises(StepError):
        simulate_into(soft(time__step=1.0, time__end=2.0), tmp_path / "results" / "run", listener=listener)
    assert started == []
    with pytest.raises(KeyboardInterrupt):
        simulate_into(soft(time__end=1e-4), tmp_path / "results" / "run", listener=listener)
    assert started == ["surface"]
    assert list(tmp_path.iterdir()) == []

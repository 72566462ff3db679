"""A run from scenario to folder: what it keeps, and that nothing but the scenario decides its bits."""

from __future__ import annotations

import hashlib
import json
import os
import signal
from datetime import datetime
from itertools import pairwise
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import pytest

from blocksim.errors import InputMissingError, OutputError, OutputExistsError
from blocksim.scenario import Scenario, load_scenario, placement
from blocksim.simulation import Progress, Result, read_result, simulate, simulate_into
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


def test_folder_holds_what_the_design_promises(kept: Result) -> None:
    assert kept.folder is not None
    assert {path.name for path in kept.folder.iterdir()} == FILES
    done = json.loads((kept.folder / "done.json").read_text())
    assert done == {"run": kept.summary.run, "status": "finished"}


def test_done_is_written_last(kept: Result) -> None:
    assert kept.folder is not None
    times = {path.name: path.stat().st_mtime_ns for path in kept.folder.iterdir()}
    assert max(times, key=lambda name: times[name]) == "done.json"


def test_summary_tells_status_cost_versions_and_ledger(kept: Result) -> None:
    assert kept.folder is not None
    told = json.loads((kept.folder / "run.json").read_text())
    assert (told["status"], told["reason"], told["exit_code"]) == ("finished", "at rest", 0)
    assert told["simulated_time_s"] == pytest.approx(told["steps"] * told["time_step_s"])
    assert 0.0 < told["solver_seconds"] <= told["total_seconds"]
    assert {"blocksim", "code", "python", "numpy", "numba", "h5py", "platform"} <= set(told["environment"])
    assert told["energy_J"]["relative_residual"] < 1e-3
    assert told["energy_J"]["friction"] > 0.0
    assert datetime.fromisoformat(told["ended_at"]).tzinfo is not None


def test_checksums_are_those_of_the_files(kept: Result) -> None:
    assert kept.folder is not None
    assert set(kept.summary.sha256) == FILES - {"run.json", "done.json"}
    for name, checksum in kept.summary.sha256.items():
        assert hashlib.sha256((kept.folder / name).read_bytes()).hexdigest() == checksum


@pytest.mark.parametrize("every", [1.7e-4, 0.02, 10.0])
def test_output_interval_does_not_change_the_motion(kept: Result, soft: Shipped, every: float) -> None:
    assert bits(simulate(soft(output__every=every))) == bits(kept)


def test_resolved_scenario_runs_to_the_same_bits(kept: Result, tmp_path: Path) -> None:
    assert kept.folder is not None
    again = simulate_into(load_scenario(kept.folder / "scenario.toml"), tmp_path / "again")
    assert bits(again) == bits(kept)
    assert again.summary.run == kept.summary.run
    assert again.folder is not None
    for name in ("scenario.toml", "experiment.csv", "final.csv"):
        assert (again.folder / name).read_bytes() == (kept.folder / name).read_bytes()


def test_run_can_be_repeated_from_its_own_folder(soft: Shipped, tmp_path: Path) -> None:
    first = simulate_into(soft(time__end=0.01), tmp_path)
    second = simulate_into(load_scenario(tmp_path / "scenario.toml"), tmp_path, overwrite=True)
    assert bits(first) == bits(second)
    assert {path.name for path in tmp_path.iterdir()} == FILES


def test_resolved_scenario_names_the_copy_of_the_table(kept: Result) -> None:
    assert kept.folder is not None
    experiment = load_scenario(kept.folder / "scenario.toml").experiment
    assert experiment is not None
    assert experiment.table == (kept.folder / "experiment.csv").resolve()
    assert kept.experiment is not None
    assert experiment.table.read_bytes() == kept.experiment.read_bytes()


def test_result_comes_back_from_its_folder(kept: Result) -> None:
    assert kept.folder is not None
    back = read_result(kept.folder)
    pd.testing.assert_frame_equal(back.final, kept.final, check_exact=True)
    assert back.summary == kept.summary
    np.testing.assert_array_equal(back.frames.x, kept.frames.x)
    np.testing.assert_array_equal(back.frames.energy["friction"], kept.frames.energy["friction"])
    assert back.frames.names == ("1", "2", "3")


def test_frames_run_from_start_to_end(kept: Result) -> None:
    frames = kept.frames
    assert frames.time[0] == 0.0
    assert frames.time[-1] == kept.summary.simulated_time_s
    assert np.all(np.diff(frames.step) > 0)
    np.testing.assert_allclose(np.diff(frames.time[:-1]), 1e-3, atol=kept.summary.time_step_s)


def test_failed_run_is_kept_without_the_mark_of_a_finished_one(soft: Shipped, tmp_path: Path) -> None:
    result = simulate_into(soft(contact__max_overlap=1e-9), tmp_path / "run")
    assert (result.status, result.summary.exit_code) == ("failed", 76)
    assert "max_overlap" in result.reason
    assert {path.name for path in (tmp_path / "run").iterdir()} == FILES - {"done.json"}
    assert read_result(tmp_path / "run").status == "failed"


def test_exploding_run_says_so_and_writes_valid_json(soft: Shipped, tmp_path: Path) -> None:
    wild = soft(time__force_step=True, time__step=1e-3, contact__max_overlap=1.0)
    result = simulate_into(wild, tmp_path / "run")
    assert result.summary.exit_code == 76

    def refuse(word: str) -> None:
        raise AssertionError(word)

    json.loads((tmp_path / "run" / "run.json").read_text(), parse_constant=refuse)
    assert read_result(tmp_path / "run").summary.status == "failed"


def test_ctrl_c_keeps_what_there_is(soft: Shipped, tmp_path: Path) -> None:
    def press_ctrl_c(where: Progress) -> None:
        if where.time > 0.05:
            os.kill(os.getpid(), signal.SIGINT)

    result = simulate_into(soft(), tmp_path / "run", on_progress=press_ctrl_c)
    assert (result.status, result.summary.exit_code) == ("interrupted", 75)
    assert 0.05 < result.summary.simulated_time_s < 0.06
    back = read_result(tmp_path / "run")
    assert back.frames.time[-1] == result.summary.simulated_time_s
    assert not (tmp_path / "run" / "done.json").exists()


def test_vanished_experiment_leaves_no_folder(soft: Shipped, tmp_path: Path) -> None:
    scenario = soft()
    assert scenario.experiment is not None
    gone = scenario.experiment.model_copy(update={"table": tmp_path / "gone.csv"})
    with pytest.raises(InputMissingError, match=r"gone\.csv"):
        simulate_into(scenario.model_copy(update={"experiment": gone}), tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_run_is_not_overwritten_unasked(kept: Result, soft: Shipped) -> None:
    assert kept.folder is not None
    with pytest.raises(OutputExistsError, match="contains another run; --overwrite"):
        simulate_into(soft(time__end=0.01), kept.folder)


def test_progress_comes_to_the_end(soft: Shipped) -> None:
    seen: list[Progress] = []
    simulate(soft(time__end=0.02, time__stop_at_rest=False), on_progress=seen.append)
    assert seen[-1].time == pytest.approx(0.02, abs=1e-5)
    assert seen[-1].end == 0.02
    assert all(a.steps < b.steps for a, b in pairwise(seen))


def test_estimate_is_no_less_than_what_a_run_leaves(tmp_path: Path) -> None:
    scenario = sliding({}, end=0.05, every=1e-5)
    simulate_into(scenario, tmp_path / "run")
    needed = bytes_needed(scenario, build_scene(scenario))
    assert 0.5 * needed < (tmp_path / "run" / "run.h5").stat().st_size < 1.3 * needed


def test_too_small_a_disk_is_reported_with_both_sizes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Path] = []

    def usage(place: Path) -> SimpleNamespace:
        asked.append(place)
        return SimpleNamespace(free=1_000_000)

    monkeypatch.setattr("blocksim.simulation.run.shutil.disk_usage", usage)
    scenario = sliding({}, end=0.05, every=1e-7)
    with pytest.raises(OutputError, match=r"the results may take 2 MB, but only 1 MB are free there"):
        simulate_into(scenario, tmp_path / "not" / "yet")
    assert asked == [tmp_path]
    assert list(tmp_path.iterdir()) == []


def test_blocks_are_placed_once_from_loading_to_the_result(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    times: list[str] = []
    new = placement.Placement

    def counted(scenario: weakref.ref[Scenario], *parts: Any) -> placement.Placement:
        times.append(getattr(scenario(), "name", ""))
        return new(scenario, *parts)

    monkeypatch.setattr(placement, "Placement", counted)
    compile_kernels.cache_clear()  # the scene that is compiled with is placed on the way
    simulate_into(sliding({"time": {"scheme": "nonsmooth"}}, end=0.01), tmp_path / "run")
    assert times.count("sliding") == 1
    assert times.count("compile") == 1


def test_a_run_that_cannot_be_built_is_refused_before_it_compiles(soft: Shipped, tmp_path: Path) -> None:
    started: list[str] = []
    listener = RunCallbacks(on_start=started.append)
    with pytest.raises(StepError):
        simulate_into(soft(time__step=1.0, time__end=2.0), tmp_path / "run", listener=listener)
    assert started == []
    assert not (tmp_path / "run").exists()
    simulate_into(soft(time__end=1e-4), tmp_path / "run", listener=listener)
    assert started == ["surface"]


def test_stopping_while_the_solver_is_compiled_leaves_no_folder(soft: Shipped, tmp_path: Path) -> None:
    def stop(_: str) -> None:
        assert (tmp_path / "results" / "run").is_dir()  # locked by now
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        simulate_into(soft(time__end=1e-4), tmp_path / "results" / "run", listener=RunCallbacks(on_start=stop))
    assert list(tmp_path.iterdir()) == []

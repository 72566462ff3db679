"""A run from scenario to folder: what it keeps, what its tables say, and that the scenario alone decides its bits."""

import hashlib
import json
import math
import os
import platform
import tomllib
from dataclasses import replace
from datetime import datetime
from pathlib import Path

import llvmlite.binding
import numba
import numpy as np
import pytest

from blocksim.errors import InputMissingError, InvalidInputError
from blocksim.scenario import Model, Scenario, load_scenario, placement, scenario_to_toml
from blocksim.simulation import Progress, Result, provenance, simulate_into
from blocksim.simulation.balance import RESIDUAL_PROMISE
from blocksim.simulation.results import read_summary
from blocksim.simulation.run import RunCallbacks, bytes_needed
from blocksim.simulation.schemes import build, compile_kernels
from blocksim.simulation.trajectory import COLUMNS, Frames, as_frame, csv_text, final_columns, read_table
from blocksim.world.step import StepError
from tests.golden import Golden
from tests.simulation.conftest import SCENARIOS, Shipped
from tests.simulation.sliding import sliding
from tests.view.made_up import blocks_at, polygons

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


def test_summary_tells_status_cost_versions_code_and_ledger(folder: Path) -> None:
    told = json.loads((folder / "run.json").read_text())
    assert (told["status"], told["reason"], told["exit_code"]) == ("finished", "at rest", 0)
    assert told["simulated_time_s"] == pytest.approx(told["steps"] * told["time_step_s"])
    assert 0.0 < told["solver_seconds"] <= told["total_seconds"]
    assert told["energy_J"]["relative_residual"] < 1e-3
    assert told["energy_J"]["friction"] > 0.0
    assert datetime.fromisoformat(told["ended_at"]).tzinfo is not None
    made_by = told["environment"]
    assert {"blocksim", "code", "numpy", "h5py", "platform"} <= set(made_by)
    versions = (llvmlite.__version__, numba.__version__, platform.python_version())
    assert tuple(made_by[name] for name in ("llvmlite", "numba", "python")) == versions
    assert made_by["cpu"] == llvmlite.binding.get_host_cpu_name()
    present = {name for name, is_there in llvmlite.binding.get_host_cpu_features().items() if is_there}
    assert set() < set(made_by["cpu_features"].split()) <= present
    assert {f"code_{room}": digest for room, digest in provenance.code_hashes().items()}.items() <= made_by.items()


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


def test_estimate_is_no_less_than_what_a_run_leaves(tmp_path: Path) -> None:
    scenario = sliding({}, end=0.05, every=5e-5)
    simulate_into(scenario, tmp_path / "run")
    needed = bytes_needed(Model(scenario), build(Model(scenario)))
    assert 0.5 * needed < (tmp_path / "run" / "run.h5").stat().st_size < 1.3 * needed


def test_blocks_are_placed_once_from_loading_to_the_result(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    times: list[str] = []
    place = placement.place

    def counted(scenario: Scenario) -> placement.Placement:
        times.append(scenario.name)
        return place(scenario)

    monkeypatch.setattr(placement, "place", counted)
    data = tomllib.loads(scenario_to_toml(sliding({"time": {"scheme": "nonsmooth"}}, end=0.01)))
    compile_kernels("nonsmooth")
    times.clear()
    simulate_into(Model(data), tmp_path / "run")
    assert times == ["sliding"]


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


def row_of(frames: Frames) -> dict[str, float]:
    """Return the row of the only block of a frame that goes at 0.5 m/s and -0.25 m/s and turns by pi rad/s."""
    frames.vx[:], frames.vy[:], frames.spin[:] = 0.5, -0.25, np.pi
    return {name: values[0] for name, values in final_columns(frames).items()}


def near(row: dict[str, float], **expected: float) -> bool:
    return {name: row[name] for name in expected} == pytest.approx(expected)


def test_extents_are_those_of_the_turned_block() -> None:
    row = row_of(blocks_at([0.1], 0.2, -np.pi / 2))
    assert near(row, rotation_deg=-90.0, left_mm=75.0, right_mm=125.0, bottom_mm=184.0, top_mm=216.0)
    assert near(row, vx_mm_s=500.0, vy_mm_s=-250.0, spin_deg_s=180.0)
    row = row_of(polygons(blocks_at([0.1], 0.2, np.pi / 2), ((-0.01, -0.01), (0.02, -0.01), (-0.01, 0.02))))
    assert near(row, left_mm=80.0, right_mm=110.0, bottom_mm=190.0, top_mm=220.0)


def test_rotation_counts_from_the_start_and_is_not_wrapped() -> None:
    row = row_of(replace(blocks_at([0.1], 0.2, 0.3 + 4 * np.pi), start_angle=np.array([0.3])))
    assert row["rotation_deg"] == pytest.approx(720.0)
    assert row["right_mm"] - row["left_mm"] == pytest.approx(1e3 * (0.032 * np.cos(0.3) + 0.05 * np.sin(0.3)))


def test_csv_text_is_what_pandas_writes_and_is_read_back_to_the_last_bit(tmp_path: Path) -> None:
    numbers = [0.1 + 0.2, -0.0, 1e16, 1e-5, 123456789.125, np.pi * 1e-300, math.inf, math.nan]
    names = ["1", "with, comma", 'with "quotes"', "two\nlines", "ä", " ", "#", "nan"]
    columns = {name: names if name == "block" else numbers for name in COLUMNS}
    assert csv_text(columns) == as_frame(columns).to_csv(index=False, lineterminator="\n")
    (tmp_path / "final.csv").write_text(csv_text(columns), encoding="utf-8")
    assert repr(read_table(tmp_path / "final.csv")) == repr(columns)


DEEP = ("[" * 100_000, '{"name":' * 100_000, '{"steps": ' + "9" * 100_000 + "}")
RUBBISH = {
    "final.csv": ("", "block,x_mm\n1,2\n", ",".join(COLUMNS) + "\n1,abc" + 9 * ",0" + "\n", "\0\0\0", "a\n1,2,3\n"),
    "run.json": ("", "{", "\x00\xff", "{}", '{"name": "' + "x" * 2_000_000 + '"}', "[]", *DEEP),
}


def test_rubbish_is_refused_with_the_reason(tmp_path: Path, golden: Golden) -> None:
    texts = []
    for name, some in RUBBISH.items():
        read = read_table if name == "final.csv" else read_summary
        for text in some:
            (tmp_path / name).write_text(text, encoding="utf-8")
            with pytest.raises(InvalidInputError) as refused:
                read(tmp_path / name)
            texts.append(f"{text[:20]!r}: {refused.value}")
        (tmp_path / name).unlink()
        with pytest.raises(InputMissingError) as missing:
            read(tmp_path / name)
        texts.append(str(missing.value))
    golden("\n".join(texts))


def test_wrong_value_is_named_and_energy_that_is_not_finite_survives(kept: Result, tmp_path: Path) -> None:
    ledger = kept.summary.energy_J.model_copy(update={"kinetic": math.nan})
    data = json.loads(kept.summary.model_copy(update={"energy_J": ledger}).to_json())
    assert data["energy_J"]["kinetic"] is None
    (tmp_path / "run.json").write_text(json.dumps(data))
    assert math.isnan(read_summary(tmp_path / "run.json").energy_J.kinetic)
    data["energy_J"]["friction"] = "much"
    (tmp_path / "run.json").write_text(json.dumps(data))
    with pytest.raises(InvalidInputError, match=r"energy_J\.friction: "):
        read_summary(tmp_path / "run.json")


RIGID = {"time": {"scheme": "nonsmooth", "step": 1e-3}}


@pytest.mark.parametrize("sweeps", [1, 1000])
def test_passes_that_end_unsolved_are_in_the_summary_and_warned_of(tmp_path: Path, sweeps: int) -> None:
    tight = {"velocity_sweeps": sweeps, "velocity_tolerance": 1e-6}
    result = simulate_into(sliding({"time": {**RIGID["time"], **tight}}), tmp_path / "run")
    found = read_summary(tmp_path / "run" / "run.json").convergence
    assert found is not None
    assert found.passes >= 4 * result.summary.steps
    warned = [text for text in result.summary.warnings if "time.velocity_sweeps = 1," in text]
    assert len(warned) == (sweeps == 1)
    if sweeps == 1:
        assert found.unsolved > 0.5 * found.passes
        assert f"{1e3 * found.largest_change_m_s:.3g} mm/s" in warned[0]
        assert found.largest_change_m_s > 1e-6
    else:
        assert (found.unsolved, found.largest_change_m_s) == (0, 0.0)
        assert found.last_change_m_s <= 1e-6


def test_command_with_a_name_that_is_no_text_can_be_written(kept: Result, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.argv", ["blocksim", os.fsdecode(b"caf\xe9")])
    summary = kept.summary.model_copy(update={"environment": provenance.environment()})
    assert json.loads(summary.to_json())["environment"]["command"] == "blocksim 'caf\\udce9'"


def test_edited_code_gives_runs_another_name(soft: Shipped, monkeypatch: pytest.MonkeyPatch) -> None:
    before = provenance.run_hash(Model(soft()))
    monkeypatch.setattr(provenance, "code_hash", lambda: "of other code")
    assert provenance.run_hash(Model(soft())) != before


# 250 blocks, a minute or so; with BLOCKSIM_SOAK=full the 1000 of scenarios/wall.toml, four minutes
SIZE = {} if os.environ.get("BLOCKSIM_SOAK") == "full" else {"structures.0.rows": 10, "structures.0.columns": 25}
WARM, SETTLED, END = 1.0, 3.0, 10.0  # s: by which all lists have found their size, and most blocks their place
MEMORY = Path("/proc/self/statm")


def memory() -> float:
    """Return the memory of this process (pages), or nothing where the system does not tell."""
    return int(MEMORY.read_text().split()[1]) if MEMORY.exists() else 1.0


@pytest.mark.long
def test_long_run_keeps_its_memory_its_energy_and_its_rest(tmp_path: Path) -> None:
    values = {"time.end": END, "time.stop_at_rest": False, "output.every": "10 ms", **SIZE}
    sizes: list[float] = []
    residuals: list[float] = []

    def watch(where: Progress) -> None:
        residuals.append(where.relative_residual)
        if where.time > WARM:
            sizes.append(memory())

    result = simulate_into(load_scenario(SCENARIOS / "wall.toml", values), tmp_path / "run", on_progress=watch)
    assert (result.status, result.reason) == ("finished", "end of simulated time")
    assert max(residuals) <= RESIDUAL_PROMISE
    assert 0.95 * sizes[0] <= min(sizes) <= max(sizes) <= 1.05 * sizes[0]  # frames go to the disk
    frames = result.frames
    settled = int(np.searchsorted(frames.time, SETTLED))
    resting = np.hypot(frames.vx[settled], frames.vy[settled]) < 1e-6  # m/s
    moved = np.hypot(frames.x[settled:] - frames.x[settled], frames.y[settled:] - frames.y[settled])
    assert resting.mean() > 0.9
    assert moved[:, resting].max() <= 1e-9  # m; measured for 1000 blocks: 8e-11

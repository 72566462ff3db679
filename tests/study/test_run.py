"""One run and its comparison, from Python."""

import json
import shutil
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

import blocksim
from blocksim.errors import InputMissingError, InvalidInputError
from blocksim.scenario import Scenario
from blocksim.simulation import Result
from blocksim.study import run as single
from blocksim.study.compare import compare_run
from blocksim.study.run import run
from blocksim.study.stored_run import find_run
from tests.study.conftest import SCENARIOS

if TYPE_CHECKING:
    import pandas as pd


@pytest.fixture(scope="module")
def kept(scenario: Scenario, tmp_path_factory: pytest.TempPathFactory) -> Result:
    return run(scenario, out=tmp_path_factory.mktemp("results") / "three_blocks_nominal" / "abc")


@pytest.fixture
def copy(kept: Result, tmp_path: Path) -> Path:
    assert kept.folder is not None
    return Path(shutil.copytree(kept.folder, tmp_path / "run"))


def test_python_users_need_four_names(tmp_path: Path) -> None:
    scenario = blocksim.load(SCENARIOS / "three_blocks.toml", {"contact.stiffness_scale": 0.001})
    result = blocksim.run(scenario)
    assert result.folder is None
    assert blocksim.compare(result).to_frame().shape[0] == 6
    swept = blocksim.sweep(
        SCENARIOS / "tower.toml", {"contact.stiffness_scale": [0.001], "time.end": [0.01]}, out=tmp_path, jobs=1
    )
    assert swept.failed == 0


def test_run_without_a_folder_writes_nothing(
    scenario: Scenario, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    run(scenario)
    assert list(tmp_path.iterdir()) == []


def test_finished_run_is_not_run_again(kept: Result, scenario: Scenario, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(single, "simulate_into", None)
    assert run(scenario, out=kept.folder).summary == kept.summary


def test_overwrite_runs_again(copy: Path, scenario: Scenario) -> None:
    before = (copy / "run.json").stat().st_mtime_ns
    run(scenario, out=copy, overwrite=True)
    assert (copy / "run.json").stat().st_mtime_ns > before


def test_table_that_does_not_fit_the_blocks_is_reported_before_the_run(scenario: Scenario, tmp_path: Path) -> None:
    table = tmp_path / "table.csv"
    table.write_text("block,quantity,unit,replicate,value\n4,x,mm,1,5.0\n")
    assert scenario.experiment is not None
    other = scenario.model_copy(update={"experiment": scenario.experiment.model_copy(update={"table": table})})
    with pytest.raises(InvalidInputError, match="measures block '4'"):
        run(other, out=tmp_path / "run")
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("what", ["result", "table", "folder", "parent"])
def test_result_table_and_folder_compare_alike(kept: Result, what: str) -> None:
    assert kept.folder is not None
    given: dict[str, Result | pd.DataFrame | Path] = {
        "result": kept,
        "table": kept.final,
        "folder": kept.folder,
        "parent": kept.folder.parent,
    }
    found = compare_run(given[what], SCENARIOS / "experiments" / "three_blocks.csv")
    assert [row.simulated for row in found.rows] == [row.simulated for row in compare_run(kept).rows]


def test_comparison_needs_a_table(kept: Result) -> None:
    with pytest.raises(InputMissingError, match="--experiment"):
        compare_run(kept.final)


def test_unfinished_run_is_not_judged(scenario: Scenario, tmp_path: Path) -> None:
    limited = scenario.contact.model_copy(update={"max_overlap": 1e-9})
    failed = run(scenario.model_copy(update={"contact": limited}), out=tmp_path / "run")
    for given in (failed, tmp_path / "run"):
        with pytest.raises(InvalidInputError, match="has failed"):
            compare_run(given)


@pytest.mark.parametrize("name", ["run.json", "final.csv", "scenario.toml"])
def test_missing_file_of_a_run_is_named(copy: Path, name: str) -> None:
    (copy / name).unlink()
    with pytest.raises(InputMissingError, match=name.replace(".", r"\.")):
        compare_run(copy, SCENARIOS / "experiments" / "three_blocks.csv")


def test_final_table_without_one_of_the_blocks_is_named(copy: Path) -> None:  # and not the experiment's, which has it
    lines = (copy / "final.csv").read_text().splitlines(keepends=True)
    (copy / "final.csv").write_text("".join(lines[:1] + lines[2:]))
    with pytest.raises(InvalidInputError, match=r"final\.csv: its blocks are not those of scenario\.toml"):
        compare_run(copy)


def test_status_in_run_json_counts(copy: Path) -> None:
    data = json.loads((copy / "run.json").read_text())
    (copy / "run.json").write_text(json.dumps({**data, "status": "interrupted"}))
    with pytest.raises(InvalidInputError, match="interrupted"):
        compare_run(copy)


def test_scenario_without_its_run_says_what_to_do(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputMissingError, match=r"first: blocksim run .*tower\.toml"):
        find_run(SCENARIOS / "tower.toml")


def test_scenario_run_with_other_values_names_the_newest_of_those_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    values = {"time.end": 0.001, "contact.stiffness_scale": 0.001}
    kept = blocksim.run(blocksim.load(SCENARIOS / "tower.toml", values), out="results/tower/other")
    assert kept.folder is not None
    with pytest.raises(InputMissingError, match=r"runs with other values .* the newest: results/tower/other"):
        find_run(SCENARIOS / "tower.toml")


def test_folder_that_holds_a_sweep_only_names_the_sweep(tmp_path: Path) -> None:
    (tmp_path / "sweep-a").mkdir()
    (tmp_path / "sweep-a" / "sweep.csv").touch()
    with pytest.raises(InputMissingError, match=r"no finished run in this folder, but a sweep: .*sweep-a"):
        find_run(tmp_path)


def test_folder_above_results_names_those_that_hold_runs(tmp_path: Path) -> None:
    for name in ("quay", "wall"):
        (tmp_path / name / "a1").mkdir(parents=True)
        (tmp_path / name / "a1" / "done.json").touch()
    with pytest.raises(InputMissingError, match=r"no finished run in this folder, but runs .*: .*/quay, .*/wall$"):
        find_run(tmp_path)


def test_folder_whose_only_run_was_stopped_names_that_run(tmp_path: Path) -> None:
    (tmp_path / "a1").mkdir()
    (tmp_path / "a1" / "run.h5").touch()
    with pytest.raises(InputMissingError, match=r"no finished run in this folder, but an unfinished run: .*/a1$"):
        find_run(tmp_path)


def test_sweep_in_place_of_a_run_is_called_a_sweep(tmp_path: Path) -> None:
    (tmp_path / "sweep.csv").touch()
    with pytest.raises(InputMissingError, match="this is a sweep, not a run"):
        find_run(tmp_path)


def test_table_in_place_of_a_run_is_called_a_table(tmp_path: Path) -> None:
    (tmp_path / "measured.csv").write_text("block,quantity,unit,replicate,value\n1,x,mm,1,16\n")
    with pytest.raises(InvalidInputError, match=r"measured\.csv: this is a table, not a run"):
        find_run(tmp_path / "measured.csv")


def test_folder_without_a_run_is_reported(tmp_path: Path) -> None:
    with pytest.raises(InputMissingError, match="no finished run in this folder"):
        find_run(tmp_path)
    with pytest.raises(InputMissingError, match="no such run folder or scenario file"):
        find_run(tmp_path / "nix")

"""One run and its comparison, from Python."""

import os
import shutil
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

import blocksim
from blocksim.errors import InputMissingError, InvalidInputError
from blocksim.scenario import Scenario, load_scenario
from blocksim.simulation import Result
from blocksim.simulation.instruments import bytes_of_series
from blocksim.study import run as single
from blocksim.study.compare import compare_run
from blocksim.study.run import run
from blocksim.study.run_folder import find_run
from blocksim.world.describe import describe
from tests.golden import Golden
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
    os.utime(copy / "run.json", (0.0, 0.0))
    run(scenario, out=copy, overwrite=True)
    assert (copy / "run.json").stat().st_mtime_ns > 0


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


def test_scenario_without_its_run_says_what_to_do_or_which_run_there_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, golden: Golden
) -> None:
    monkeypatch.chdir(tmp_path)
    tower = SCENARIOS / "tower.toml"
    golden(refused(tower), "none")
    values = {"time.end": 0.001, "contact.stiffness_scale": 0.001}
    blocksim.run(blocksim.load(tower, values), out="results/tower/other")
    golden(refused(tower), "with other values")


def refused(path: Path) -> str:
    """Return why there is no run to be found."""
    with pytest.raises((InputMissingError, InvalidInputError)) as caught:
        find_run(path)
    return str(caught.value)


@pytest.mark.parametrize(
    ("files", "place"),
    [
        (["sweep-a/sweep.csv"], ""),
        (["quay/a1/done.json", "wall/a1/done.json"], ""),
        (["a1/run.h5"], ""),
        (["sweep.csv"], ""),
        (["measured.csv"], "measured.csv"),
        ([], ""),
        ([], "nix"),
    ],
    ids=["sweep below", "results above", "stopped run", "sweep", "table", "empty", "nothing"],
)
def test_folder_without_a_run_says_what_it_is(tmp_path: Path, golden: Golden, files: list[str], place: str) -> None:
    for name in files:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("block,quantity,unit,replicate,value\n1,x,mm,1,16\n" * name.startswith("measured"))
    golden(refused(tmp_path / place))


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("tower", {"time.end": 0.05}),
        ("three_blocks_nonsmooth", {"time.end": 0.2, "output.every": "1 ms", "output.contacts": True}),
        ("record_column", {"time.end": 0.5}),
        ("soil/vertical_cut", {"time.end": 0.01}),
    ],
)
def test_size_of_a_run_is_forecast_within_a_factor_of_two(
    tmp_path: Path, name: str, changes: dict[str, object]
) -> None:
    scenario = load_scenario(SCENARIOS / f"{name}.toml", changes)
    result = run(scenario, out=tmp_path / "run")
    described = describe(scenario)
    assert result.frames.time.size > 0.9 * described.frames  # nothing came to rest before
    stored = sum(
        path.stat().st_size for path in (tmp_path / "run").iterdir() if path.name.startswith(("run.h5", "probe-"))
    )
    told = described.bytes + bytes_of_series(scenario, described.steps, described.step, 14)
    assert 0.5 * stored < told < 2.0 * stored

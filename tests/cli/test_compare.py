"""blocksim compare: what it takes, what it says, and its exit code."""

import json
import shutil
from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from blocksim.analysis.compare import compare_final
from blocksim.analysis.experiment import ExperimentTable, Measurement
from blocksim.cli.compare import verdict_lines
from tests.cli.conftest import SOFT, Command
from tests.golden import Golden

TABLE = "scenarios/experiments/three_blocks.csv"


def test_calibrated_scenario_is_inside(blocksim: Command) -> None:
    assert blocksim("run", "scenarios/three_blocks.toml", "--quiet").code == 0
    answer = blocksim("compare", "scenarios/three_blocks.toml")
    assert answer.code == 0
    assert answer.out.splitlines()[-1] == "all inside"
    assert answer.err == ""


def test_literal_reading_is_outside_and_says_what_is_off(blocksim: Command) -> None:
    assert blocksim("run", "scenarios/three_blocks_literal.toml", "--quiet").code == 0
    answer = blocksim("compare", "results/three_blocks_literal")
    assert answer.code == 1
    assert "outside: x of block 2 by " in answer.out
    assert "outside: x of block 3 by " in answer.out
    assert "block 1 by" not in answer.out


FAR = "3,x,mm,1,3500\n3,x,mm,2,3900\n2,rotation,deg,1,180\n2,rotation,deg,2,180\n"
WIDE = "2,x,mm,1,0\n2,x,mm,2,1000\n"


@pytest.fixture
def place(made_up: Path, made_up_run: Path, tmp_path: Path) -> None:
    """Write tables, beside a run and a sweep that is made up."""
    for name, rows in (("far", FAR), ("wide", WIDE)):
        (tmp_path / f"{name}.csv").write_text(f"block,quantity,unit,replicate,value\n{rows}")
    shutil.copytree(made_up_run, tmp_path / "run")
    assert made_up.is_dir()


LINES = ["run", "run run", "run --experiment far.csv", "run --experiment wide.csv", "made_up --experiment own.csv"]


@pytest.mark.usefixtures("place")
@pytest.mark.parametrize("line", LINES)
def test_tables(blocksim: Command, golden: Golden, line: str) -> None:
    answer = blocksim("compare", *line.split())
    assert max(map(len, answer.out.splitlines())) <= 80
    golden(f"exit code {answer.code}\n{answer.out}{answer.err}")


@pytest.mark.usefixtures("place")
def test_one_run_outside_is_enough_whatever_comes_after(blocksim: Command) -> None:
    shutil.copytree("run", "inside")
    shutil.copy("wide.csv", "inside/experiment.csv")
    assert [blocksim("compare", *runs.split()).code for runs in ("inside", "run inside", "inside run")] == [0, 1, 1]


def test_json_is_a_list_with_an_entry_a_run(blocksim: Command, finished: Path) -> None:
    answer = blocksim("compare", finished, finished, "--json")
    data = json.loads(answer.out)
    assert (answer.err, [entry["inside"] for entry in data], len(data[0]["rows"])) == ("", [False, False], 6)
    assert data[0]["run"] == str(finished)


def test_hair_outside_is_not_outside_by_nothing() -> None:
    repeats = tuple(Measurement("1", "x", "mm", number, value) for number, value in enumerate((5.0, 6.0), 1))
    table = ExperimentTable(repeats, source="made up")
    comparison = compare_final({"block": ["1"], "x_mm": [6.000001]}, table)
    assert verdict_lines(comparison) == ["outside: x of block 1 by less than 0.01 mm"]


def test_run_without_experiment_asks_for_a_table(blocksim: Command) -> None:
    assert blocksim("run", "scenarios/tower.toml", *SOFT, "--set", "time.end=0.01", "--out", "out").code == 0
    answer = blocksim("compare", "out")
    assert answer.code == 66
    assert "give a table with --experiment" in answer.err


def test_sweep_is_judged_by_its_share_inside(blocksim: Command) -> None:
    swept = blocksim(
        "sweep", "scenarios/three_blocks.toml", "--vary", "contact.max_overlap=1e-3,1e-12", "--out", "out", "--jobs", 1
    )
    assert swept.code == 77
    assert blocksim("compare", "out").code == 0
    answer = blocksim("compare", "out", "--threshold", 0.6)
    assert answer.code == 1
    last = answer.out.splitlines()[-1]
    assert last == "1 of 2 samples (50.0 %) are within all measured ranges; threshold: 60.0 %"
    assert ": failed: " in answer.out
    assert json.loads(blocksim("compare", "out", "--json").out)[0]["share_inside"] == 0.5
    assert "1 of 2 samples" in blocksim("compare", "out", "--experiment", TABLE).out


@pytest.fixture
def made_up(tmp_path: Path) -> Path:
    """Give the folder of a sweep of 5000 members with large numbers, long names and failures."""
    count = 5000
    data: dict[str, list[object]] = {
        "case": [f"{number:012x}" for number in range(count)],
        "status": [*["finished"] * 7, *["failed"] * 13, *["finished"] * (count - 20)],
        "reason": ["x" * 200] * count,
    }
    for block in ("a_block_with_quite_a_long_name", "b"):
        data[f"{block}.x_mm"] = [-1234.5 + number / 10 for number in range(count)]
        data[f"{block}.rotation_deg"] = [-90.0 * (number % 60) for number in range(count)]
    folder = tmp_path / "made_up"
    folder.mkdir()
    pd.DataFrame(data).to_csv(folder / "sweep.csv", index=False)
    rows = [
        f"{block},{quantity},{unit},{replicate},{value}"
        for block in ("a_block_with_quite_a_long_name", "b")
        for quantity, unit, values in (("x", "mm", (-1200, -1100.5, -999)), ("rotation", "deg", (-90, -90, -180)))
        for replicate, value in enumerate(values, 1)
    ]
    (tmp_path / "own.csv").write_text("\n".join(["block,quantity,unit,replicate,value", *rows]))
    return folder


def test_judgement_as_json_has_every_row_and_the_meaning_of_every_number(blocksim: Command, made_up: Path) -> None:
    answer = blocksim("compare", made_up, "--experiment", "own.csv", "--json", "--u-num", 0.25)
    told = json.loads(answer.out)[0]
    assert (told["members"], len(told["failed"])) == (5000, 13)
    assert len(told["metrics"]["outcome"]["rows"]) == 61
    assert told["metrics"]["validation"]["rows"][0]["u_num"] == 0.25
    assert set(told["metrics"]["area"]["rows"][0]) == set(told["metrics"]["area"]["columns"])


def test_known_statistics_come_back(blocksim: Command, tmp_path: Path) -> None:
    second, third = [72.0, 74.0, 76.0, 78.0, 80.0], [128.0, 131.0, 131.0, 136.0, 137.0]
    columns = {"1.x_mm": [16.0] * 5, "2.x_mm": second, "3.x_mm": third, "1.rotation_deg": [0.1] * 5}
    turned = {"2.rotation_deg": [-90.0] * 5, "3.rotation_deg": [-90.0, -90.0, -90.0, -180.0, -90.0]}
    table = pd.DataFrame({"case": list("abcde"), "status": "finished", "reason": "", **columns, **turned})
    table.to_csv(tmp_path / "sweep.csv", index=False)
    metrics = json.loads(blocksim("compare", ".", "--experiment", TABLE, "--json").out)[0]["metrics"]

    def numbers(metric: str, column: str) -> list[Any]:
        return [row[column] for row in metrics[metric]["rows"]]

    repeats = [[71.69, 76.57, 72.70, 73.22, 73.73, 78.53], [132.86, 136.05, 128.89, 128.55, 131.70, 129.92]]
    # second: 72 to 78 are inside; third: 131, 131, 136; both: 74 and 76, as the member with 78 has turned too far
    assert numbers("inside", "inside") == [5, 4, 3, 5, 5, 4, 2]
    assert numbers("validation", "S") == pytest.approx([16.0, 76.0, 132.6], abs=1e-6)
    assert numbers("validation", "u_input") == pytest.approx([0.0, sqrt(10.0), np.std(third, ddof=1)], abs=1e-6)
    expected = [0.5, *(sqrt(np.var(values, ddof=1) / 6 + 0.25) for values in repeats)]
    assert numbers("validation", "u_D") == pytest.approx(expected, abs=1e-6)
    halves = [2.570581836 * np.std(values, ddof=1) * sqrt(7 / 6) for values in repeats]  # t_(5, 0.975) from tables
    ends = [
        end for mean, half in zip(np.mean(repeats, axis=1), halves, strict=True) for end in (mean - half, mean + half)
    ]
    assert np.ravel(numbers("prediction", "prediction")) == pytest.approx(ends, abs=1e-6)
    areas = [stats.wasserstein_distance(*pair) for pair in zip((second, third), repeats, strict=True)]
    assert numbers("area", "area") == pytest.approx([0.0, *areas], abs=1e-6)
    difference = np.mean(repeats, axis=1) - [76.0, 132.6]
    both = np.cov(repeats) / 6 + np.cov([second, third]) / 5
    assert numbers("joint", "T2") == pytest.approx([difference @ np.linalg.inv(both) @ difference], abs=1e-6)
    assert numbers("outcome", "share") == [0.8, 0.2]

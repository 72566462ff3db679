"""blocksim compare: what it takes, what it says, and its exit code; an observable that is added is found everywhere."""

import json
import shutil
from pathlib import Path

import pandas as pd
import pytest

from blocksim.analysis.compare import compare_final
from blocksim.analysis.experiment import ExperimentTable, Measurement
from blocksim.cli.compare import verdict_lines
from blocksim.scenario import Model
from blocksim.simulation.observables import OBSERVABLES, Observable
from blocksim.study.executors.ensemble import run_case
from tests.cli.conftest import SOFT, Command
from tests.golden import Golden


def test_calibrated_scenario_is_inside(blocksim: Command) -> None:
    assert blocksim("run", "scenarios/three_blocks.toml", "--quiet").code == 0
    answer = blocksim("compare", "scenarios/three_blocks.toml")
    assert answer.code == 0
    assert answer.out.splitlines()[-1] == "all inside"
    assert answer.err == ""


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


def test_hair_outside_is_not_outside_by_nothing() -> None:
    repeats = tuple(Measurement("1", "x", "mm", number, value) for number, value in enumerate((5.0, 6.0), 1))
    table = ExperimentTable(repeats, source="made up")
    comparison = compare_final({"block": ["1"], "x_mm": [6.000001]}, table)
    assert verdict_lines(comparison) == ["outside: x of block 1 by less than 0.01 mm"]


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


EDGE = 0.1  # m: of a table on which the block slides
OVERHANG = Observable(
    "overhang_mm",
    lambda ends: 1e3 * (ends.motion[:, 0] + ends.shapes.reach - EDGE).max(axis=1),
    "mm",
    title="greatest overhang",
    word="overhang",
)


def test_an_added_observable_is_found_everywhere(blocksim: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(OBSERVABLES, OVERHANG.name, OVERHANG)
    scenario = ("scenarios/slide.toml", *SOFT, "--set", "time.end=0.3")
    run = blocksim("run", *scenario, "--set", "ground.tilt=30deg", "--out", "run")
    value = json.loads(Path("run/run.json").read_text())["movement"]["overhang_mm"]
    assert f"greatest overhang {value:.2f}" in run.err.replace("\n", " ")

    swept = blocksim("sweep", *scenario, "--vary", "ground.tilt=0deg,30deg", "--out", "sweep")
    assert "overhang_mm" in swept.out
    table = pd.read_csv("sweep/sweep.csv")
    assert table["overhang_mm"][1] == value  # of the same run, in an ensemble
    assert (
        run_case(Model(Model.stored(Path("run/scenario.toml")).scenario), Path("run"))["overhang_mm"] == value
    )  # of a kept case

    middle = f"{table['overhang_mm'].mean()} mm"
    limit = ("--vary", "ground.tilt=0deg:30deg:2", "--stands", f"overhang > {middle}", "--to", "50%", "--no-runs")
    assert "stands up to" in blocksim("limit", *scenario, *limit, "--out", "limit").out
    assert "overhang_mm" in pd.read_csv("limit/limit.csv")
    fails = ("--intensity", "ground.tilt=1deg,30deg", "--fails", f"overhang < {middle}", "--samples", 2)
    scatter = ("--scatter", "friction.block_ground=0.3:0.4")
    fragility = blocksim("fragility", *scenario, *fails, *scatter, "--out", "fragility")
    assert fragility.code in (0, 1), fragility.err
    assert pd.read_csv("fragility/fragility.csv")["failures"].tolist() == [0, 2]

    assert blocksim("report", "run", "sweep", "--out", "report.html").code == 0
    page = Path("report.html").read_text()
    assert "greatest overhang" in page
    columns = page.replace(", ", ",").replace(": ", ":")
    assert '"name":"overhang_mm","label":"greatest overhang (mm)"' in columns  # of the table; the label is an axis's

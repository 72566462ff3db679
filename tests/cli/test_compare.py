"""blocksim compare: what it takes, what it says, and its exit code."""

import json
from pathlib import Path

import pytest

from tests.cli.conftest import SOFT, Command

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


def test_table_is_not_wider_than_80_columns(blocksim: Command, finished: Path) -> None:
    table = blocksim("compare", finished, "--quiet").out.splitlines()
    assert max(map(len, table)) <= 80
    assert "[min, max]" in table[0]
    assert len(table) == 2 + 6 + 1


def test_several_runs_are_judged_together(blocksim: Command, finished: Path) -> None:
    answer = blocksim("compare", finished, finished)
    assert answer.code == 1
    assert answer.out.count("outside: x of block 2") == 2
    assert answer.out.count(f"{finished} against ") == 2


def test_json_is_a_list_with_an_entry_a_run(blocksim: Command, finished: Path) -> None:
    answer = blocksim("compare", finished, finished, "--json")
    data = json.loads(answer.out)
    assert answer.err == ""
    assert [entry["inside"] for entry in data] == [False, False]
    assert len(data[0]["rows"]) == 6
    assert data[0]["run"] == str(finished)


def test_other_table_can_be_given(blocksim: Command, finished: Path, tmp_path: Path) -> None:
    (tmp_path / "wide.csv").write_text("block,quantity,unit,replicate,value\n2,x,mm,1,0\n2,x,mm,2,1000\n")
    answer = blocksim("compare", finished, "--experiment", "wide.csv")
    assert answer.code == 0
    assert "block '1' is not in wide.csv, it is not compared" in answer.out


@pytest.mark.parametrize(
    ("arguments", "code", "told"),
    [
        (["nix"], 66, "nix: no such run folder or scenario file"),
        (["empty"], 66, "no finished run in this folder"),
        (["scenarios/tower.toml"], 66, "first: blocksim run scenarios/tower.toml"),
        (["scenarios/experiments/three_blocks.csv"], 65, "three_blocks.csv"),
        (["copied", "--experiment", "nix.csv"], 66, "nix.csv: no such file"),
        (["copied", "--experiment", "scenarios/tower.toml"], 65, "scenarios/tower.toml:"),
    ],
)
def test_wrong_places_are_told(
    blocksim: Command, copied: Path, tmp_path: Path, arguments: list[str], code: int, told: str
) -> None:
    assert copied.is_dir()
    (tmp_path / "empty").mkdir()
    answer = blocksim("compare", *arguments)
    assert (answer.code, answer.out) == (code, "")
    assert told in answer.err


@pytest.mark.parametrize("name", ["run.json", "final.csv", "scenario.toml", "experiment.csv"])
@pytest.mark.parametrize("content", [None, b"", b"rubbish", b"\x00\xff\xfe"])
def test_damaged_run_is_told_with_its_file(blocksim: Command, copied: Path, name: str, content: bytes | None) -> None:
    if content is None:
        (copied / name).unlink()
    else:
        (copied / name).write_bytes(content)
    answer = blocksim("compare", copied)
    assert answer.code in {65, 66}
    assert name in answer.err
    assert answer.out == ""


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
    assert "50% of 2 cases are inside all measured ranges (asked for: 60%)" in answer.out
    assert json.loads(blocksim("compare", "out", "--json").out)[0]["share_inside"] == 0.5
    assert "50% of 2 cases" in blocksim("compare", "out", "--experiment", TABLE).out


def test_sweep_without_experiment_asks_for_a_table(blocksim: Command) -> None:
    vary = ("--vary", "time.end=0.001,0.002", "--jobs", 1)
    assert blocksim("sweep", "scenarios/slide.toml", *vary, "--out", "out").code == 0
    answer = blocksim("compare", "out")
    assert answer.code == 66
    assert "--experiment" in answer.err

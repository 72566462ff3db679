"""blocksim export: frames for other programs."""

import csv
from pathlib import Path

import h5py
import pytest

from tests.cli.conftest import SOFT, Command


def test_csv_ends_where_the_final_table_does(blocksim: Command, finished: Path) -> None:
    answer = blocksim("export", finished)
    assert (answer.code, answer.out) == (0, "")
    assert answer.err.startswith("file: three_blocks_nominal.csv (")
    assert "(replaces an older file, " in blocksim("export", finished).err
    with Path("three_blocks_nominal.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    with (finished / "final.csv").open(encoding="utf-8", newline="") as file:
        final = list(csv.DictReader(file))
    keys = ("block", "x_mm", "y_mm", "rotation_deg", "vx_mm_s", "vy_mm_s", "spin_deg_s")
    assert [[row[key] for key in keys] for row in rows[-3:]] == [[row[key] for key in keys] for row in final]


def test_vtkhdf_has_the_times_of_the_run(blocksim: Command, finished: Path) -> None:
    assert blocksim("export", finished, "--format", "vtkhdf", "--out", "run.vtkhdf", "--quiet").err == ""
    with h5py.File("run.vtkhdf") as file, h5py.File(finished / "run.h5") as run:
        assert file["VTKHDF/Steps/Values"][:].tolist() == run["particles/blocks/time"][:].tolist()


@pytest.mark.parametrize("command", ["export", "plot", "animate"])
def test_killed_run_is_exported_and_told(blocksim: Command, copied: Path, command: str) -> None:
    for name in ("run.json", "done.json", "final.csv"):
        (copied / name).unlink()
    brief = ("--speed", "1", "--fps", "5", "--width", "200") if command == "animate" else ()
    answer = blocksim(command, copied, *brief)
    assert answer.code == 0
    assert f"{copied}: this run was killed or is still running; its " in answer.err


def test_contacts_get_a_file_beside_where_they_are_stored(blocksim: Command, tmp_path: Path) -> None:
    nominal = "scenarios/three_blocks_nominal.toml"
    settings = ("--set", "time.end=0.02", "--set", "output.contacts=true", *SOFT)
    assert blocksim("run", nominal, *settings, "--out", tmp_path / "run", "--quiet").code == 0
    answer = blocksim("export", tmp_path / "run", "--out", "all.csv")
    assert answer.code == 0
    assert "file: all_contacts.csv (" in answer.err
    with Path("all_contacts.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert {row["body_b"] for row in rows} >= {"", "2", "3"}
    assert "replaces an older file" in blocksim("export", tmp_path / "run", "--out", "all.csv").err
    for told in ("file: all.vtkhdf (", "file: all.vtkhdf (replaces an older file, "):
        answer = blocksim("export", tmp_path / "run", "--format", "vtkhdf", "--out", "all.vtkhdf")
        assert answer.code == 0
        assert told in answer.err
        assert f"file: all_contacts.vtkhdf ({told.partition('(')[2]}{len(rows)} contacts)" in answer.err


def test_file_of_the_run_is_not_overwritten(blocksim: Command, copied: Path) -> None:
    before = (copied / "final.csv").read_bytes()
    answer = blocksim("export", copied, "--out", copied / "final.csv", "--overwrite")
    assert (answer.code, "belongs to the run" in answer.err) == (73, True)
    assert (copied / "final.csv").read_bytes() == before

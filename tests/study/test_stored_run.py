"""Runs as they lie on the disk."""

import json
import os
import shutil
from pathlib import Path

import pytest

from blocksim.errors import InputMissingError, InvalidInputError
from blocksim.scenario import load_scenario
from blocksim.simulation import simulate_into
from blocksim.study.stored_run import stored_run

SCENARIOS = Path(__file__).parents[2] / "scenarios"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Give the folder of a short finished run."""
    brief = {"time.end": 0.002, "contact.stiffness_scale": 0.001}
    simulate_into(load_scenario(SCENARIOS / "bounce.toml", brief), tmp_path / "run")
    return tmp_path / "run"


def test_a_finished_run_needs_no_remark(folder: Path) -> None:
    stored = stored_run(folder)
    assert stored.remark == ""
    assert stored.scenario.name == "bounce"
    assert len(stored.frames) == 5


def test_newest_of_several_runs_is_named(folder: Path) -> None:
    assert stored_run(folder.parent).remark == ""
    shutil.copytree(folder, folder.parent / "older")
    os.utime(folder.parent / "older" / "done.json", (0.0, 0.0))
    assert stored_run(folder.parent).remark == f"{folder.parent}: the newest of 2 runs is taken: {folder}"
    assert stored_run(folder).remark == ""


def test_what_did_not_finish_is_reported(folder: Path) -> None:
    summary = json.loads((folder / "run.json").read_text())
    for status, told in (("failed", "this run has failed (why)"), ("interrupted", "this run was interrupted (why)")):
        (folder / "run.json").write_text(json.dumps({**summary, "status": status, "reason": "why"}))
        assert stored_run(folder).remark == f"{folder}: {told}; its 5 frames end at 0.002002 s"
    (folder / "run.json").write_text("{")
    assert "run.json of this run is damaged" in stored_run(folder).remark
    (folder / "run.json").unlink()
    assert "this run was killed or is still running" in stored_run(folder).remark


def test_missing_and_damaged_frames_are_reported(folder: Path) -> None:
    (folder / "run.h5").write_bytes((folder / "run.h5").read_bytes()[:2000])
    with pytest.raises(InvalidInputError, match=r"run\.h5: not a"):
        stored_run(folder)
    (folder / "run.h5").unlink()
    with pytest.raises(InputMissingError, match=r"no run\.h5"):
        stored_run(folder)

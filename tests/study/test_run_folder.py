"""Runs as they lie on the disk, and what is compared when one is repeated."""

import json
import os
import shutil
from pathlib import Path

import h5py
import pytest

from blocksim.errors import InputMissingError, InvalidInputError
from blocksim.scenario import load_scenario
from blocksim.simulation import simulate_into
from blocksim.study.run_folder import read_run
from blocksim.study.verify import verify_run
from tests.golden import Golden
from tests.simulation.test_probes import PROBES, PULSE, scene
from tests.study.conftest import SCENARIOS


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Give the folder of a short finished run."""
    brief = {"time.end": 0.002, "contact.stiffness_scale": 0.001}
    simulate_into(load_scenario(SCENARIOS / "bounce.toml", brief), tmp_path / "run")
    return tmp_path / "run"


def test_newest_of_several_finished_runs_is_named_and_one_needs_no_remark(folder: Path) -> None:
    stored = read_run(folder.parent)
    assert (stored.remark, stored.scenario.name, len(stored.frames)) == ("", "bounce", 5)
    shutil.copytree(folder, folder.parent / "older")
    os.utime(folder.parent / "older" / "done.json", (0.0, 0.0))
    assert read_run(folder.parent).remark == f"{folder.parent}: the newest of 2 runs is taken: {folder}"
    assert read_run(folder).remark == ""


def test_what_did_not_finish_is_reported(folder: Path, golden: Golden) -> None:
    summary = json.loads((folder / "run.json").read_text())
    for status in ("failed", "interrupted"):
        (folder / "run.json").write_text(json.dumps({**summary, "status": status, "reason": "why"}))
        golden(read_run(folder).remark, status)
    (folder / "run.json").write_text("{")
    golden(read_run(folder).remark, "damaged")
    (folder / "run.json").unlink()
    golden(read_run(folder).remark, "gone")


def test_missing_and_damaged_frames_are_reported(folder: Path) -> None:
    (folder / "run.h5").write_bytes((folder / "run.h5").read_bytes()[:2000])
    with pytest.raises(InvalidInputError, match=r"run\.h5: not a"):
        read_run(folder)
    (folder / "run.h5").unlink()
    with pytest.raises(InputMissingError, match=r"no run\.h5"):
        read_run(folder)


def test_a_changed_sample_is_found_when_a_run_is_verified(tmp_path: Path) -> None:
    result = simulate_into(scene("nonsmooth", PROBES, 0.03, motion=PULSE), tmp_path / "run")
    assert result.folder is not None
    assert verify_run(result.folder).agrees
    with h5py.File(tmp_path / "run" / "run.h5", "r+") as file:
        file["probes/joint4/slip"][2] += 1e-18
    step = result.probes["joint4"].step[2]
    (found,) = verify_run(result.folder).entries
    assert (found.file, found.entry) == ("run.h5", f"probes/joint4/slip at step {step}")

"""verify-run runs stored results again: agreement, every kind of difference, and damage."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import pytest

from blocksim.simulation.files import sha256_of
from blocksim.study.limit import limit
from blocksim.study.manifest import read_entries
from tests.cli.conftest import Command
from tests.study.plans import SQUAT, block_on_a_slope

X = "1.x_mm"
TILT: dict[str, Any] = {"ground.tilt": {"from": "5 deg", "to": "40 deg", "count": 2}}
BRIEF = ("contact.stiffness_scale=0.001", "time.end=0.02")
SHORT = ("--set", BRIEF[0], "--set", BRIEF[1])


def altered(folder: Path, name: str, old: str, new: str) -> None:
    """Change a text in a file of a run."""
    text = (folder / name).read_text()
    assert old in text
    (folder / name).write_text(text.replace(old, new))


def signed_again(folder: Path) -> None:
    """Bring the checksums up to date, as somebody would who hides a change."""
    told = json.loads((folder / "run.json").read_text())
    told["sha256"] = {name: sha256_of(folder / name) for name in told["sha256"]}
    (folder / "run.json").write_text(json.dumps(told))


def test_interrupted_run_is_repeated_as_far_as_it_came(blocksim: Command) -> None:
    blocksim("run", "scenarios/three_blocks_nominal.toml", *SHORT, "--out", "run", "--quiet")
    folder = Path("run")
    altered(folder, "run.json", '"finished"', '"interrupted"')
    altered(folder, "scenario.toml", "end = 0.02", "end = 2.0")
    (folder / "done.json").unlink()
    signed_again(folder)
    answer = blocksim("verify-run", folder, "--json")
    assert json.loads(answer.out)[0]["frames"]["first"] is None
    assert answer.code == 0


def test_other_scenario_is_found_though_its_checksum_fits(blocksim: Command, copied: Path) -> None:
    altered(copied, "scenario.toml", "0.38", "0.37")
    signed_again(copied)
    answer = blocksim("verify-run", copied)
    assert (answer.code, "SHA-256" in answer.out) == (1, False)
    told = ("the final state has another hash than in run.json", "first difference: frame ", "since: scenario: ")
    assert [words for words in told if words not in answer.out] == []


def test_first_difference_is_reported_with_frame_block_and_quantity(blocksim: Command, copied: Path) -> None:
    with h5py.File(copied / "run.h5", "r+") as file:
        x = file["particles/blocks/x"]
        time = file["particles/blocks/time"][7]
        x[7, 1] += 0.002
        x[9, 2] += 0.001
    signed_again(copied)
    answer = blocksim("verify-run", copied, "--json")
    assert answer.code == 1
    (data,) = json.loads(answer.out)
    assert (data["agrees"], data["state"], data["table"], data["changed"]) == (False, True, True, [])
    first = data["frames"]["first"]
    assert (first["frame"], first["time"], first["block"], first["quantity"]) == (7, time, "2", "x_mm")
    assert first["stored"] - first["now"] == pytest.approx(2.0)
    assert data["frames"]["largest_mm"] == pytest.approx(2.0)
    assert data["frames"]["largest_deg"] == 0.0


def other(value: object) -> object:
    """Return another outcome, number, name or truth."""
    if isinstance(value, float):
        return value * (1 + 1e-15)
    return {"fell": "slid", True: False, False: True}.get(value, "7")


def test_every_changed_entry_of_the_summary_is_named(blocksim: Command, copied: Path) -> None:
    told = json.loads((copied / "run.json").read_text())
    others = {name: other(value) for name, value in told["movement"].items()}
    changed = {
        "name": "other",
        "reason": "at rest?",
        "exit_code": 1,
        "run": "0" * 12,
        "scenario_hash": "0" * 12,
        "steps": told["steps"] + 1,
        "time_step_s": told["time_step_s"] * (1 + 1e-15),
        "simulated_time_s": told["simulated_time_s"] * (1 + 1e-15),
        "warnings": ["other"],
        "energy_J": {name: value * (1 + 1e-15) + 1e-300 for name, value in told["energy_J"].items()},
        "movement": others,
        "events": [{"event": 0, "step": 1, "time_s": 0.1, "what": "1 freed", "energy_J": 0.0}],
    }
    (copied / "run.json").write_text(json.dumps({**told, **changed}))
    altered(copied, "done.json", '"status": "finished"', '"status": "failed"')
    answer = blocksim("verify-run", copied, "--json")
    (data,) = json.loads(answer.out)
    assert (answer.code, data["agrees"], data["changed"]) == (1, False, [])
    found = {(one["file"], one["entry"]) for one in data["entries"]}
    energies = {("run.json", f"energy_J.{name}") for name in told["energy_J"]}
    assert found == {
        *(("run.json", name) for name in changed if name not in {"energy_J", "movement", "warnings"}),
        *energies,
        *(("run.json", f"movement.{name}") for name in others),
        ("run.json", "warnings"),
        ("done.json", "run"),
        ("done.json", "status"),
    }


def test_other_versions_and_processors_are_reported(blocksim: Command, copied: Path) -> None:
    told = json.loads((copied / "run.json").read_text())
    told["environment"] |= {"numba": "0.1", "code_kernels": "old", "cpu_features": "avx9"}
    told["final_state_sha256"] = "other"
    (copied / "run.json").write_text(json.dumps(told))
    answer = blocksim("verify-run", copied)
    assert answer.code == 1
    assert "changed since: numba: 0.1 -> " in answer.out
    assert "changed since: code_kernels: old -> " in answer.out
    assert "changed since: cpu_features: -avx9 +" in answer.out
    assert "command" not in answer.out


def shift_a_run(folder: Path) -> None:
    """Move the block of every run by a nanometre, in the manifest, with sums that fit."""
    entries = [entry for _, entry in read_entries(folder / "manifest.jsonl")]
    shifted = [{name: float(str(value)) + 1e-6 for name, value in one.row.items() if name == X} for one in entries]
    lines = [replace(one, row={**one.row, **moved}) for one, moved in zip(entries, shifted, strict=True)]
    (folder / "manifest.jsonl").write_bytes(b"".join(one.to_line() for one in lines))


def test_runs_of_a_study_that_were_moved_are_told(blocksim: Command, tmp_path: Path) -> None:
    limit(block_on_a_slope(SQUAT), TILT, out=tmp_path / "study", tolerance=0.5)
    shift_a_run(tmp_path / "study")
    answer = blocksim("verify-run", "study", "--sample", 100)
    assert (answer.code, f"{X}: " in answer.out) == (1, True)

"""verify-run runs stored results again, verify the cases: agreement, every kind of difference, and damage."""

import json
from pathlib import Path

import h5py
import pytest

from blocksim.simulation.files import sha256_of
from blocksim.verification import cases
from blocksim.verification.case import Case, Row, Setting
from tests.cli.conftest import Command
from tests.golden import Golden

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


def test_other_versions_and_processors_are_reported_and_another_scenario_though_its_checksum_fits(
    blocksim: Command, copied: Path
) -> None:
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
    altered(copied, "scenario.toml", "0.38", "0.37")
    signed_again(copied)
    answer = blocksim("verify-run", copied)
    assert (answer.code, "SHA-256" in answer.out) == (1, False)
    for told in ("the final state has another hash than in run.json", "first difference: frame ", "since: scenario: "):
        assert told in answer.out


def missed(_: Setting) -> list[Row]:
    return [Row("half", "m", 1.0, 0.5, 0.1), Row("whole", "m", 1.0, 1.0, 0.1)]


def shortened(setting: Setting) -> list[Row]:
    return [Row("quick", "", 1.0, float(setting.quick), 0.0)]


def stopped(_: Setting) -> list[Row]:
    raise KeyboardInterrupt


MADE_UP = {
    "miss": (Case("V2", "made up", "nowhere", missed, remarks={"surface": "it is made up"}),),
    "quick": (Case("V2", "made up", "nowhere", shortened, quick="half of it"),),
    "stop": (Case("V1", "done", "nowhere", missed), Case("V2", "stopped", "nowhere", stopped)),
}


@pytest.mark.parametrize("name", MADE_UP)
def test_misses_shortened_cases_and_a_stop_are_told(
    blocksim: Command, golden: Golden, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.setattr(cases, "CASES", MADE_UP[name])
    answer = blocksim("verify", *(["--quick"] if name == "quick" else []))
    golden(f"exit code {answer.code}\n{answer.out}{answer.err}", rules=["times"])

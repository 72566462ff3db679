"""verify-run runs stored results again: agreement, every kind of difference, and damage."""

import csv
import json
import shutil
from pathlib import Path

import h5py
import pytest
from typer.testing import CliRunner

from blocksim.cli.app import app
from blocksim.simulation.atomic import sha256_of
from tests.cli.conftest import SCENARIOS, SOFT, Command

SHORT = (*SOFT, "--set", "time.end=0.02")
RIGID = ("--set", "time.scheme=nonsmooth", "--set", "time.end=0.05")


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


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Give the folder of a finished sweep; not to be changed."""
    folder = tmp_path_factory.mktemp("swept") / "sweep"
    scenario = SCENARIOS / "three_blocks_nonsmooth.toml"
    vary = "friction.block_block.kinetic=0.2:0.3:5"
    result = CliRunner().invoke(
        app, ["sweep", str(scenario), "--set", "time.end=0.05", "--vary", vary, "--out", str(folder), "--quiet"]
    )
    assert result.exit_code == 0, result.output
    return folder


@pytest.fixture
def copy_of_sweep(swept: Path, tmp_path: Path) -> Path:
    """Give a copy of the sweep, to be damaged."""
    return Path(shutil.copytree(swept, tmp_path / "sweep"))


def test_finished_run_has_the_same_bits(blocksim: Command, finished: Path) -> None:
    answer = blocksim("verify-run", finished)
    assert answer.code == 0
    assert answer.out.startswith(f"{finished}: bit-identical: final state, ")


@pytest.mark.parametrize("settings", [RIGID, (*SHORT, "--set", "contact.law=hertz-mindlin")])
def test_other_schemes_and_laws_have_the_same_bits(blocksim: Command, settings: tuple[str, ...]) -> None:
    blocksim("run", "scenarios/three_blocks_nominal.toml", *settings, "--out", "run", "--quiet")
    assert blocksim("verify-run", "run", "--quiet").code == 0


def test_two_threads_have_the_same_bits(blocksim: Command) -> None:
    wall = ("--set", "structures.0.rows=10", "--set", "structures.0.columns=25", "--set", "time.end=0.002")
    blocksim("run", "scenarios/wall.toml", *wall, "--out", "run", "--quiet")
    assert blocksim("verify-run", "run", "--threads", 2, "--quiet").code == 0


def test_failed_run_fails_again_in_the_same_way(blocksim: Command) -> None:
    failing = ("--set", "contact.max_overlap=1 nm")
    assert blocksim("run", "scenarios/three_blocks_nominal.toml", *SHORT, *failing, "--out", "run", "-q").code == 76
    assert blocksim("verify-run", "run", "--quiet").code == 0


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


def test_changed_file_is_named(blocksim: Command, copied: Path) -> None:
    altered(copied, "final.csv", "\n2,", "\n2,1")
    answer = blocksim("verify-run", copied)
    assert answer.code == 1
    assert "  final.csv was changed after the run (SHA-256 in run.json)\n" in answer.out
    assert "  final.csv differs\n" in answer.out
    assert "  code, versions and processor are unchanged" in answer.out


def test_lost_file_is_named(blocksim: Command, copied: Path) -> None:
    (copied / "experiment.csv").write_text("")
    assert "experiment.csv was changed after the run" in blocksim("verify-run", copied).out


def test_other_scenario_is_found_though_its_checksum_fits(blocksim: Command, copied: Path) -> None:
    altered(copied, "scenario.toml", "0.38", "0.37")
    signed_again(copied)
    answer = blocksim("verify-run", copied)
    assert answer.code == 1
    assert "SHA-256" not in answer.out
    assert "the final state has another hash than in run.json" in answer.out
    assert "first difference: frame " in answer.out
    assert "changed since: scenario: " in answer.out


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


def test_every_changed_entry_of_the_summary_is_named(blocksim: Command, copied: Path) -> None:
    told = json.loads((copied / "run.json").read_text())
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
    }
    (copied / "run.json").write_text(json.dumps({**told, **changed}))
    altered(copied, "done.json", '"status": "finished"', '"status": "failed"')
    answer = blocksim("verify-run", copied, "--json")
    (data,) = json.loads(answer.out)
    assert (answer.code, data["agrees"], data["changed"]) == (1, False, [])
    found = {(one["file"], one["entry"]) for one in data["entries"]}
    energies = {("run.json", f"energy_J.{name}") for name in told["energy_J"]}
    assert found == {
        *(("run.json", name) for name in changed if name not in {"energy_J", "warnings"}),
        *energies,
        ("run.json", "warnings"),
        ("done.json", "run"),
        ("done.json", "status"),
    }


def test_changed_entry_is_reported_with_its_file_and_both_values(blocksim: Command, copied: Path) -> None:
    steps = json.loads((copied / "run.json").read_text())["steps"]
    altered(copied, "run.json", f'"steps": {steps}', f'"steps": {steps + 1}')
    answer = blocksim("verify-run", copied)
    assert answer.code == 1
    assert f"  run.json: steps: {steps + 1} stored, {steps} now\n" in answer.out


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


def test_same_bits_in_spite_of_another_version_are_reported_beside(blocksim: Command, copied: Path) -> None:
    altered(copied, "run.json", '"numba": "', '"numba": "0.')
    answer = blocksim("verify-run", copied)
    assert (answer.code, answer.out.count("\n")) == (0, 1)
    assert "changed since: numba: 0." in answer.err


@pytest.mark.parametrize("name", ["scenario.toml", "run.json", "run.h5", "final.csv"])
def test_damaged_file_is_reported_with_exit_code_65(blocksim: Command, copied: Path, name: str) -> None:
    (copied / name).write_bytes(b"\x89HDF rubbish")
    answer = blocksim("verify-run", copied)
    assert answer.code == 65
    assert answer.out == f"{copied}: damaged\n"
    assert str(copied / name) in answer.err


def test_one_damaged_folder_does_not_hide_the_others(blocksim: Command, finished: Path, copied: Path) -> None:
    (copied / "run.h5").write_bytes(b"")
    answer = blocksim("verify-run", copied, finished, "--quiet")
    assert answer.code == 65
    assert answer.out.splitlines()[0] == f"{copied}: damaged"
    assert answer.out.splitlines()[1].startswith(f"{finished}: bit-identical")


def test_nothing_is_written(blocksim: Command, finished: Path) -> None:
    before = {path: path.stat().st_mtime_ns for path in (finished, *finished.iterdir())}
    blocksim("verify-run", finished, "--quiet")
    assert {path: path.stat().st_mtime_ns for path in (finished, *finished.iterdir())} == before


def test_rows_of_a_sweep_come_out_again(blocksim: Command, swept: Path) -> None:
    assert blocksim("verify-run", swept).out == f"{swept}: identical numbers in 5 of 5 rows\n"
    some = [json.loads(blocksim("verify-run", swept, "--sample", 2, "--seed", s, "--json").out)[0] for s in (1, 1, 2)]
    assert some[0]["checked"] == some[1]["checked"] != some[2]["checked"]
    assert len(some[0]["checked"]) == 2


def test_changed_cell_of_a_sweep_is_reported(blocksim: Command, copy_of_sweep: Path) -> None:
    path = copy_of_sweep / "sweep.csv"
    head, *lines = csv.reader(path.read_text().splitlines())
    place = head.index("3.x_mm")
    lines[3][place] = repr(float(lines[3][place]) + 0.5)
    path.write_text("\n".join(map(",".join, [head, *lines])) + "\n")
    answer = blocksim("verify-run", copy_of_sweep)
    assert answer.code == 1
    assert "differs in 1 of the 5 of 5 rows" in answer.out
    assert f"row 4, case {lines[3][0]}, 3.x_mm: {lines[3][place]} stored, " in answer.out
    assert "largest difference: 0.5 mm, 0°" in answer.out


def test_changed_name_of_a_case_is_reported_in_whatever_row_it_is(blocksim: Command, copy_of_sweep: Path) -> None:
    path = copy_of_sweep / "sweep.csv"
    lines = path.read_text().splitlines()
    name = lines[2].split(",")[0]
    altered(copy_of_sweep, "sweep.csv", f"\n{name},", f"\n{name[:-1]}{'0' if name[-1] != '0' else '1'},")
    answer = blocksim("verify-run", copy_of_sweep, "--sample", 1)
    assert answer.code == 1
    assert f"row 2, case {name[:-1]}" in answer.out
    assert f", case: {name[:-1]}" in answer.out
    assert f" stored, {name} now" in answer.out


def test_values_of_a_sweep_are_compared_too(blocksim: Command, copy_of_sweep: Path) -> None:
    altered(copy_of_sweep, "sweep.csv", ",0.225,", ",0.224,")
    assert "friction.block_block.kinetic: 0.224 stored, 0.225 now" in blocksim("verify-run", copy_of_sweep).out


def test_table_that_does_not_go_with_the_manifest_is_refused(blocksim: Command, copy_of_sweep: Path) -> None:
    path = copy_of_sweep / "sweep.csv"
    path.write_text("".join(path.read_text().splitlines(keepends=True)[:-1]))
    answer = blocksim("verify-run", copy_of_sweep)
    assert answer.code == 65
    assert "4 rows of 5 cases, but the manifest has 5" in answer.err


def test_rows_of_a_sweep_that_was_stopped_find_their_cases(blocksim: Command, copy_of_sweep: Path) -> None:
    for name in ("sweep.csv", "manifest.jsonl"):
        lines = (copy_of_sweep / name).read_text().splitlines(keepends=True)
        del lines[2 if name == "sweep.csv" else 1]
        (copy_of_sweep / name).write_text("".join(lines))
    assert blocksim("verify-run", copy_of_sweep).out.endswith("identical numbers in 4 of 4 rows\n")


def test_kept_cases_are_verified_as_runs(blocksim: Command) -> None:
    scenario = ("scenarios/three_blocks_nonsmooth.toml", "--set", "time.end=0.01")
    blocksim("sweep", *scenario, "--vary", "gravity=9,10", "--keep-cases", "--jobs", 1, "--out", "kept", "--quiet")
    assert blocksim("verify-run", "kept").out.endswith("2 of 2 rows, bit-identical in 2 kept runs\n")
    one = next(Path("kept/cases").iterdir())
    altered(one, "final.csv", "block,", "blocks,")
    assert blocksim("verify-run", "kept").code == 65


def test_sweep_keeps_what_it_came_from(swept: Path) -> None:
    told = json.loads((swept / "sweep.json").read_text())
    assert (told["mode"], told["seed"]) == ("grid", None)
    assert {"numba", "llvmlite", "cpu_features", "code_kernels"} <= set(told["environment"])

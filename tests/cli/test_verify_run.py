"""verify-run runs stored results again: agreement, every kind of difference, and damage."""

import csv
import json
import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import pytest
from typer.testing import CliRunner

from blocksim.cli.commands import app
from blocksim.simulation.files import sha256_of
from blocksim.study.fragility import fragility
from blocksim.study.limit import limit, limit_curve
from blocksim.study.manifest import read_entries
from tests.cli.conftest import SCENARIOS, Command
from tests.cli.test_limit import on_soft_springs
from tests.golden import Golden
from tests.study.test_fragility import SLOPE

STATIC = "friction.block_ground.static"
X = "1.x_mm"
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


WALL = ("structures.0.rows=10", "structures.0.columns=25", "time.end=0.002")


@pytest.mark.parametrize(
    ("scenario", "settings", "code", "options"),
    [
        ("three_blocks_nominal", ("time.scheme=nonsmooth", "time.end=0.05"), 0, ()),
        ("three_blocks_nominal", (*BRIEF, "contact.law=hertz-mindlin"), 0, ()),
        ("three_blocks_nominal", (*BRIEF, "contact.max_overlap=1 nm"), 76, ()),
        ("wall", WALL, 0, ("--threads", 2)),
    ],
    ids=["rigid contacts", "Hertz", "a run that fails again in the same way", "two threads"],
)
def test_runs_have_the_same_bits(
    blocksim: Command, scenario: str, settings: tuple[str, ...], code: int, options: tuple[object, ...]
) -> None:
    given = [word for setting in settings for word in ("--set", setting)]
    assert blocksim("run", f"scenarios/{scenario}.toml", *given, "--out", "run", "--quiet").code == code
    assert blocksim("verify-run", "run", *options, "--quiet").code == 0


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


def rubbish(name: str) -> Callable[[Path], object]:
    return lambda folder: (folder / name).write_bytes(b"\x89HDF rubbish")


CHANGES: dict[str, Callable[[Path], object]] = {
    "final state": lambda folder: altered(folder, "final.csv", "\n2,", "\n2,1"),
    "lost table": lambda folder: (folder / "experiment.csv").write_text(""),
    "number of steps": lambda folder: altered(folder, "run.json", '"steps": ', '"steps": 9'),
    **{f"damaged {name}": rubbish(name) for name in ("scenario.toml", "run.json", "run.h5", "final.csv")},
}


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
def test_changed_run_is_told_and_does_not_hide_others(
    blocksim: Command, finished: Path, copied: Path, golden: Golden, change: Callable[[Path], object]
) -> None:
    change(copied)
    answer = blocksim("verify-run", copied, finished, "--quiet")
    *told, last = answer.out.splitlines()
    assert last.startswith(f"{finished}: bit-identical")
    golden("\n".join([f"exit code {answer.code}", *told, answer.err]), rules=["numbers", "counts"])


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


def test_rows_of_a_sweep_come_out_again(blocksim: Command, swept: Path) -> None:
    assert blocksim("verify-run", swept).out == f"{swept}: identical numbers in 5 of 5 rows\n"
    some = [json.loads(blocksim("verify-run", swept, "--sample", 2, "--seed", s, "--json").out)[0] for s in (1, 1, 2)]
    assert some[0]["checked"] == some[1]["checked"] != some[2]["checked"]
    assert len(some[0]["checked"]) == 2


def shift_a_block(folder: Path) -> None:
    """Move block 3 of the fourth case by half a millimetre."""
    head, *lines = csv.reader((folder / "sweep.csv").read_text().splitlines())
    place = head.index("3.x_mm")
    lines[3][place] = repr(float(lines[3][place]) + 0.5)
    (folder / "sweep.csv").write_text("\n".join(map(",".join, [head, *lines])) + "\n")


def rename_a_case(folder: Path) -> None:
    """Replace the last letter of the name of the second case."""
    name = (folder / "sweep.csv").read_text().splitlines()[2].split(",")[0]
    altered(folder, "sweep.csv", f"\n{name},", f"\n{name[:-1]}{'0' if name[-1] != '0' else '1'},")


def without_line(folder: Path, name: str, number: int) -> None:
    """Remove a line of a file."""
    lines = (folder / name).read_text().splitlines(keepends=True)
    del lines[number]
    (folder / name).write_text("".join(lines))


def stop_early(folder: Path) -> None:
    """Remove the second case, as if it had not been run."""
    without_line(folder, "sweep.csv", 2)
    without_line(folder, "manifest.jsonl", 1)


SWEEP_CHANGES: dict[str, Callable[[Path], object]] = {
    "cell": shift_a_block,
    "name of a case": rename_a_case,
    "value of a key": lambda folder: altered(folder, "sweep.csv", ",0.225,", ",0.224,"),
    "lost row": lambda folder: without_line(folder, "sweep.csv", -1),
    "stopped before its second case": stop_early,
}


@pytest.mark.parametrize("change", SWEEP_CHANGES.values(), ids=SWEEP_CHANGES)
def test_changed_sweep_is_told(
    blocksim: Command, copy_of_sweep: Path, golden: Golden, change: Callable[[Path], object]
) -> None:
    change(copy_of_sweep)
    answer = blocksim("verify-run", copy_of_sweep)
    golden(f"exit code {answer.code}\n{answer.out}{answer.err}", rules=["hashes", "numbers"])


def test_renamed_case_is_found_whatever_rows_are_drawn(blocksim: Command, copy_of_sweep: Path) -> None:
    rename_a_case(copy_of_sweep)
    assert blocksim("verify-run", copy_of_sweep, "--sample", 1).code == 1


def test_a_sweep_of_records_comes_out_again_wherever_its_folder_is(blocksim: Command, tmp_path: Path) -> None:
    record = "time_s,acceleration_m_s2\n0,0\n0.1,{0}\n0.2,-{0}\n0.3,0\n"
    (tmp_path / "made" / "records").mkdir(parents=True)
    for name in "ab":
        (tmp_path / "made" / "records" / f"{name}.csv").write_text(record.format(1 + "ab".index(name)))
    text = (SCENARIOS / "three_blocks_nonsmooth.toml").read_text()
    moved = '[motion]\nkind = "table"\ntable = "records/a.csv"\n'
    (tmp_path / "made" / "shaken.toml").write_text(re.sub(r"(?ms)^\[experiment\].*?(?=^\[|\Z)", "", text) + moved)
    varied = ("--set", "time.end=0.02", "--vary", "motion.table=records/a.csv,records/b.csv", "--quiet")
    assert blocksim("sweep", tmp_path / "made" / "shaken.toml", *varied, "--out", tmp_path / "sweep").code == 0
    shutil.rmtree(tmp_path / "made")
    (tmp_path / "sweep").rename(tmp_path / "elsewhere")
    answer = blocksim("verify-run", tmp_path / "elsewhere")
    assert (answer.code, answer.out) == (0, f"{tmp_path / 'elsewhere'}: identical numbers in 2 of 2 rows\n")
    copy = tmp_path / "elsewhere" / "tables" / "records" / "b.csv"
    copy.write_text(record.format(3))
    assert blocksim("verify-run", tmp_path / "elsewhere").code == 1


def test_kept_cases_are_verified_as_runs(blocksim: Command) -> None:
    scenario = ("scenarios/three_blocks_nonsmooth.toml", "--set", "time.end=0.01")
    blocksim("sweep", *scenario, "--vary", "gravity=9,10", "--keep-cases", "--jobs", 1, "--out", "kept", "--quiet")
    assert blocksim("verify-run", "kept").out.endswith("2 of 2 rows, bit-identical in 2 kept runs\n")
    one = next(Path("kept/cases").iterdir())
    altered(one, "final.csv", "block,", "blocks,")
    assert blocksim("verify-run", "kept").code == 65


def write_study(folder: Path, name: str) -> None:
    """Search, or count, in less than a second."""
    slope = {**SLOPE, "friction": {"block_ground": {"static": 0.38}}}  # kinetic friction follows
    few: dict[str, Any] = {"ground.tilt": {"from": "5 deg", "to": "40 deg", "count": 2}}
    if name == "limit":
        limit(slope, few, out=folder, tolerance=0.5)
    elif name == "limits":
        limit_curve(slope, few, {STATIC: [0.05, 0.3]}, out=folder, tolerance=0.5)
    elif name == "stiff":
        limit(on_soft_springs(), {"ground.tilt": {"from": "24.8 deg", "to": "26.6 deg", "count": 2}}, out=folder)
    else:
        scatter: dict[str, Any] = {STATIC: {"mean": 0.38, "sd": 0.06}}
        fragility(slope, {"ground.tilt": ["17 deg", "23 deg"]}, scatter, members=4, fails="outcome = slid", out=folder)


STUDIES = ("limit", "limits", "fragility", pytest.param("stiff", marks=pytest.mark.long))


@pytest.mark.parametrize("name", STUDIES)
def test_studies_come_out_again(blocksim: Command, tmp_path: Path, name: str) -> None:
    write_study(tmp_path / "study", name)
    before = {path: path.read_bytes() for path in (tmp_path / "study").rglob("*") if path.is_file()}
    answer = blocksim("verify-run", "study", "--sample", 100)
    assert (answer.code, answer.err) == (0, "")
    assert "follow from the runs; identical numbers in " in answer.out
    assert "kept runs" in answer.out or name in {"limits", "fragility"}
    assert {path: path.read_bytes() for path in (tmp_path / "study").rglob("*") if path.is_file()} == before


def shift_a_run(folder: Path) -> None:
    """Move the block of every run by a nanometre, in the manifest, with sums that fit."""
    entries = [entry for _, entry in read_entries(folder / "manifest.jsonl")]
    shifted = [{name: float(str(value)) + 1e-6 for name, value in one.row.items() if name == X} for one in entries]
    lines = [replace(one, row={**one.row, **moved}) for one, moved in zip(entries, shifted, strict=True)]
    (folder / "manifest.jsonl").write_bytes(b"".join(one.to_line() for one in lines))


STUDY_CHANGES: dict[str, tuple[str, Callable[[Path], object], str]] = {
    "bracket": (
        "limit",
        lambda folder: altered(folder, "limit.json", '"low": ', '"low": 1'),
        "limit.json: changes.0.low",
    ),
    "verdict": ("limit", lambda folder: altered(folder, "limit.csv", ",falls,", ",stands,"), "verdict: stands stored"),
    "run": ("limit", shift_a_run, f"{X}: "),
    "curve": ("limits", lambda folder: altered(folder, "limits.csv", ",stands,", ",falls,"), "below: falls stored"),
    "point": (
        "limits",
        lambda folder: altered(folder, "limits.json", '"runs": ', '"runs": 9'),
        "limits.json: points.0.runs",
    ),
    "count": (
        "fragility",
        lambda folder: altered(folder, "fragility.json", '"failures": 4', '"failures": 3'),
        "fragility.json: points.1.failures: 3 stored, 4 now",
    ),
    "members": (
        "fragility",
        lambda folder: altered(folder, "members.csv", ",slid,", ",stands,"),
        "outcome: stands stored",
    ),
    "share": (
        "fragility",
        lambda folder: altered(folder, "fragility.csv", ",1.0,", ",0.9,"),
        "share: 0.9 stored, 1.0 now",
    ),
}


@pytest.mark.parametrize("change", STUDY_CHANGES)
def test_a_changed_study_is_told(blocksim: Command, tmp_path: Path, change: str) -> None:
    name, alter, told = STUDY_CHANGES[change]
    write_study(tmp_path / "study", name)
    alter(tmp_path / "study")
    answer = blocksim("verify-run", "study", "--sample", 100)
    assert answer.code == 1
    assert told in answer.out


def test_a_study_whose_manifest_lacks_a_run_is_told(blocksim: Command, tmp_path: Path) -> None:
    write_study(tmp_path / "study", "limit")
    without_line(tmp_path / "study", "manifest.jsonl", 0)
    answer = blocksim("verify-run", "study")
    assert (answer.code, answer.err) == (65, "study: the manifest lacks runs of this search\n")

"""A sweep keeps one row per case, repeats nothing, and continues where a case fails."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from threading import Event, Semaphore

import pandas as pd
import pytest

from blocksim.errors import InputMissingError, InvalidInputError, OutputExistsError, StoppedEarlyError
from blocksim.scenario import Document, load_scenario
from blocksim.simulation.files import is_resolved
from blocksim.simulation.observables import table_columns
from blocksim.study.fragility import read_fragility
from blocksim.study.manifest import Entry, Manifest, Shard, read_sweep
from blocksim.study.plan import Values, with_sweep
from blocksim.study.run import run
from blocksim.study.sweep import merge, sweep
from blocksim.study.sweep_folder import prepare
from tests.study.conftest import SCENARIOS
from tests.study.plans import KINETIC, block_on_a_slope

END = "time.end"
OVERLAP = "contact.max_overlap"
TWO: dict[str, Values] = {KINETIC: [0.2, 0.25]}
ROCKING = block_on_a_slope((0.02, 0.06), scheme="explicit", end=0.4, step="auto") | {
    "bodies": [{"block": "b", "x": 0.0, "y": 0.03, "spin": 0.0}],
    "contact": {"stiffness_scale": 0.001, "restitution": 0.0},
    "friction": {"block_ground": 0.6},
    "output": {"every": 0.01},
}
"""A block of 20 mm by 60 mm that falls back where it starts to turn at 6 rad/s."""


def lines(folder: Path) -> list[str]:
    """Return the lines of the manifest: one for every case that was run."""
    return (folder / "manifest.jsonl").read_text().splitlines()


def test_row_is_what_a_single_run_gives(nominal: Document, tmp_path: Path) -> None:
    row = sweep(nominal, {KINETIC: [0.25]}, out=tmp_path).table.iloc[0]
    single = run(nominal.with_values({KINETIC: 0.25}).build())
    for column in ("x_mm", "y_mm", "rotation_deg", "left_mm", "right_mm"):
        assert row[f"3.{column}"] == single.final[column][2]
    assert row["seconds"] == single.summary.simulated_time_s
    assert row["reason"] == single.reason
    assert not row["inside"]
    movement = single.summary.movement
    assert movement is not None
    assert (row["outcome"], row["first_mover"]) == (movement.outcome, movement.first_mover) == ("fell", "3")
    assert row["first_moved_s"] == movement.first_moved_s


def test_folder_holds_plan_table_and_manifest_and_the_plan_repeats_the_sweep(
    quick: Document, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    result = sweep(quick, TWO)
    folder = result.folder
    files = {"sweep.toml", "sweep.json", "sweep.csv", "manifest.jsonl", "timings.csv", "experiment.csv"}
    assert {path.name for path in folder.iterdir()} == files
    ends = [f"{block}.{name}" for block in "123" for name in ("x_mm", "y_mm", "rotation_deg", "left_mm", "right_mm")]
    heads = ["case", KINETIC, "status", "reason", "seconds", "inside", *table_columns(), *ends]
    assert list(result.table.columns) == heads
    pd.testing.assert_frame_equal(read_sweep(folder).table, result.table, check_exact=True)
    timings = pd.read_csv(folder / "timings.csv")
    assert timings["case"].tolist() == result.table["case"].tolist()
    assert (timings["seconds"] > 0.0).all()
    again = sweep(folder / "sweep.toml", out=folder)
    assert again.table["case"].tolist() == result.table["case"].tolist()
    assert sweep(quick, TWO).folder == folder  # named by what is varied
    assert len(lines(folder)) == 2
    other = sweep(quick, {KINETIC: [0.2]}).folder
    assert other != folder
    assert other.parent == folder.parent == Path("results/three_blocks_nonsmooth")


def test_stopped_or_torn_it_goes_on_with_what_is_missing(quick: Document, tmp_path: Path) -> None:
    def stop(done: int, *_: object) -> None:
        if done == 2:
            raise KeyboardInterrupt

    vary = {KINETIC: [0.1 + 0.001 * k for k in range(120)]}
    sweep(quick, vary, out=tmp_path / "whole")
    table = (tmp_path / "whole" / "sweep.csv").read_bytes()
    with pytest.raises(StoppedEarlyError, match="of 120 cases done; rerun the command to finish"):
        sweep(quick, vary, jobs=1, out=tmp_path / "cut", on_row=stop)
    some = lines(tmp_path / "cut")
    assert len(read_sweep(tmp_path / "cut").table) == len(some) < 120
    (tmp_path / "cut" / "manifest.jsonl").write_text("\n".join(some)[:-20])
    sweep(quick, vary, out=tmp_path / "cut")
    assert len(lines(tmp_path / "cut")) == 121
    assert (tmp_path / "cut" / "sweep.csv").read_bytes() == table


def test_a_record_that_was_edited_since_is_not_taken_for_the_one_that_was_run(tmp_path: Path) -> None:
    for name, peak in (("one.csv", 0.1), ("two.csv", 0.2)):
        (tmp_path / name).write_text(f"time_s,acceleration_g\n0,0\n0.01,{peak}\n0.02,0\n")
    shaken = Document.from_mapping(
        {**ROCKING, "motion": {"kind": "table", "table": "one.csv"}, "time": {"end": 0.001}}, tmp_path
    )
    vary: dict[str, Values] = {"motion.table": ["one.csv", "two.csv"]}
    before = fragility_plan_of(shaken, vary)
    for _ in range(2):
        sweep(shaken, vary, out=tmp_path / "swept")
    assert len(lines(tmp_path / "swept")) == 2
    (tmp_path / "two.csv").write_text("time_s,acceleration_g\n0,0\n0.01,0.3\n0.02,0\n")
    with pytest.raises(OutputExistsError, match="contains another sweep"):
        sweep(shaken, vary, out=tmp_path / "swept")
    assert fragility_plan_of(shaken, vary) != before


def fragility_plan_of(document: Document, records: dict[str, Values]) -> str:
    """Return the name of a fragility study whose members differ by their record."""
    return read_fragility(document, {"motion.scale": [0.5, 1.0]}, records, members=4).name


def test_failed_case_is_run_again_only_when_asked_and_ends_a_sweep_that_is_to_fail_fast(
    quick: Document, tmp_path: Path
) -> None:
    vary = {KINETIC: [0.1], OVERLAP: [1e-2] * 3 + [1e-12] + [1e-2] * 60}
    result = sweep(quick, vary, jobs=1, out=tmp_path, fail_fast=True)
    assert result.failed == 1
    assert result.missing == 64 - len(result.table) > 0
    for retry, count in ((False, 64), (False, 64), (True, 65)):
        result = sweep(quick, vary, jobs=1, out=tmp_path, retry_failed=retry)
        assert (result.failed, result.missing, len(result.table)) == (1, 0, 64)
        assert result.table["status"][3] == "failed"
        assert len(lines(tmp_path)) == count


def content(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.iterdir() if path.is_file()}


def test_running_sweep_and_foreign_folder_are_left_alone(quick: Document, tmp_path: Path) -> None:
    sweep(quick, TWO, out=tmp_path / "sweep")
    running = Manifest(tmp_path / "sweep" / "manifest.jsonl")
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "thesis.tex").write_text("years of work")
    for name, told in (("sweep", "running"), ("thesis", "not a sweep")):
        before = content(tmp_path / name)
        for overwrite in (False, True):
            with pytest.raises(OutputExistsError, match=told):
                sweep(quick, TWO, out=tmp_path / name, overwrite=overwrite)
            assert content(tmp_path / name) == before
    running.close()


MINE = {
    "sweep_notes.csv": "case,remark\n",
    "timings_lab.csv": "mine",
    "manifest_of_samples.jsonl": "{}",
    "cases/notes.txt": "mine",
    "cases/mine/run.h5": "mine",
    ".sweep.csv.swp": "unsaved",
}


def test_overwriting_a_sweep_leaves_all_that_it_did_not_write(quick: Document, tmp_path: Path) -> None:
    vary: dict[str, Values] = {END: [0.01, "10 ms", 0.005]}
    first, same, other = sweep(quick, vary, out=tmp_path, jobs=1, keep_cases=True).table["case"]
    kept_cases = tmp_path / "cases"
    assert first == same
    assert sorted({first, other}) == sorted(path.name for path in kept_cases.iterdir())
    assert (kept_cases / other / "run.h5").is_file()
    scenario = load_scenario(kept_cases / other / "scenario.toml")
    assert (scenario.time.end, scenario.sweep) == (0.005, None)
    (kept_cases / first / "remarks.txt").write_text("this one looks odd")
    kept = content(kept_cases / first)
    (kept_cases / "mine").mkdir()
    for name, text in MINE.items():
        (tmp_path / name).write_text(text)
    again = sweep(quick, {KINETIC: [0.1]}, out=tmp_path, overwrite=True)
    assert again.table[KINETIC].tolist() == [0.1]
    assert {name: (tmp_path / name).read_text() for name in MINE} == MINE
    assert content(kept_cases / first) == kept
    assert not (kept_cases / other).exists()


PLACED = {
    "sweep.toml": "# Sweep of the lab, March\nschema = 1\n",
    "sweep.csv": "sample,mass\n",
    "timings.csv": "sample,time\n",
    "manifest.jsonl": "{}\n",
    "sweep.json": "{}\n",
}


@pytest.mark.parametrize("name", PLACED)
def test_a_file_of_a_person_in_the_place_of_a_result_stays(quick: Document, tmp_path: Path, name: str) -> None:
    base = with_sweep(quick, TWO, None).build()
    prepare(tmp_path, base, "0123", overwrite=False)
    (tmp_path / name).write_text(PLACED[name])
    before = content(tmp_path)
    for overwrite in (False, True):
        with pytest.raises(OutputExistsError, match="not a sweep" if name == "sweep.toml" else name):
            prepare(tmp_path, base, "0123", overwrite=overwrite)
        assert content(tmp_path) == before


def test_who_begins_a_sweep_waits_while_another_one_makes_room_for_it(
    quick: Document, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    base = with_sweep(quick, TWO, None).build()
    prepare(tmp_path / "out", base, "0123", overwrite=False)
    looked, may_go_on = Semaphore(0), Event()

    def slow(plan: Path) -> bool:
        looked.release()
        return may_go_on.wait(10.0) and is_resolved(plan)

    monkeypatch.setattr("blocksim.simulation.files.is_resolved", slow)
    with ThreadPoolExecutor(3) as pool:
        waiting = [pool.submit(prepare, tmp_path / "out", base, "0123", overwrite=True) for _ in range(3)]
        assert looked.acquire(timeout=10.0)
        assert not looked.acquire(timeout=0.3)  # nobody else looks at what is about to go
        may_go_on.set()
        for one in waiting:
            one.result(timeout=10.0)


def test_share_inside_counts_failed_cases_as_outside_and_needs_an_experiment(tmp_path: Path) -> None:
    table = SCENARIOS / "experiments" / "three_blocks.csv"
    calibrated = Document.read(SCENARIOS / "three_blocks.toml")
    result = sweep(calibrated, {OVERLAP: [1e-3, 1e-12]}, out=tmp_path / "measured")
    assert result.table["inside"].tolist()[0] is True
    assert result.share_inside == read_sweep(result.folder).share_inside == result.share_inside_of(table) == 0.5
    unmeasured = Document.read(SCENARIOS / "slide.toml").with_values({END: 0.001})
    result = sweep(unmeasured, {"contact.stiffness_scale": [0.001, 0.002]}, out=tmp_path / "unmeasured")
    assert result.share_inside is None
    with pytest.raises(InvalidInputError, match="the sweep has no such column"):
        result.share_inside_of(table)


@pytest.mark.parametrize("text", ["", "a,b\n1,2\n", "case,status\n1,2\n1,2,3,4\n"])
def test_rubbish_for_a_sweep_table_and_a_missing_one_are_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(InputMissingError, match="no such file"):
        read_sweep(tmp_path)
    (tmp_path / "sweep.csv").write_text(text)
    with pytest.raises(InvalidInputError, match=r"sweep\.csv: not the table of a sweep"):
        read_sweep(tmp_path)


def test_case_that_was_retried_elsewhere_counts_as_finished(quick: Document, tmp_path: Path) -> None:
    sweep(quick, TWO, out=tmp_path)
    entry = Entry.from_line(lines(tmp_path)[1].encode() + b"\n")
    assert entry is not None
    died = replace(entry, row={"status": "failed", "reason": "died", "seconds": 0.0})
    (tmp_path / "manifest-0-of-2.jsonl").write_bytes(died.to_line())
    assert merge(tmp_path).failed == read_sweep(tmp_path).failed == 0


def test_shards_share_all_cases_out() -> None:
    shards = [Shard.parse(f"{index}/3") for index in range(3)]
    assert sorted(number for shard in shards for number in range(11)[shard.slice]) == list(range(11))

"""blocksim run: answers, notes and exit codes."""

import json
import os
import re
import shutil
from pathlib import Path
from types import SimpleNamespace

import pytest

from blocksim.cli.run import _answer_lines
from blocksim.simulation.files import folder_lock
from tests.cli.conftest import SCENARIOS, SOFT, Command

RUN = ("run", "scenarios/three_blocks_nominal.toml", *SOFT)


def test_without_experiment_the_answer_is_where_the_blocks_end(blocksim: Command) -> None:
    answer = blocksim("run", "scenarios/slide.toml", "--quiet")
    assert answer.out.splitlines()[0].split() == ["block", "x", "mm", "y", "mm", "rotation", "°"]
    assert answer.out.splitlines()[2].split()[:2] == ["block", "33.53"]
    assert answer.err == ""


def test_finished_run_is_shown_again_quietly_and_as_json(blocksim: Command) -> None:
    first, second = blocksim(*RUN), blocksim(*RUN)
    assert "finished (at rest)" in first.err
    assert first.out.splitlines()[-1].startswith("outside: x of block 2 by ")
    assert (second.code, second.out) == (0, first.out)
    assert second.err.startswith("already computed; rerun with --overwrite: results/three_blocks_nominal/")
    for again in ((), ("--overwrite",)):
        quiet = blocksim(*RUN, "--quiet", *again)
        assert (quiet.out, quiet.err) == (first.out, "")
        answer = blocksim(*RUN, "--json", *again)
        data = json.loads(answer.out)
        assert (answer.err, data["summary"]["status"]) == ("", "finished")
        assert [row["block"] for row in data["final"]] == ["1", "2", "3"]
        assert Path(data["folder"], "done.json").is_file()
    assert "already computed" not in blocksim(*RUN, "--overwrite").err


@pytest.mark.parametrize("name", ["run.json", "final.csv", "run.h5"])
@pytest.mark.parametrize("resume", [(), ("--resume",)])
def test_finished_run_that_was_cut_is_no_result(
    blocksim: Command, copied: Path, name: str, resume: tuple[str, ...]
) -> None:
    os.truncate(copied / name, (copied / name).stat().st_size // 2)
    answer = blocksim(*RUN, "--out", "copied", *resume)
    assert (answer.code, answer.out) == (65, "")
    changed = "does not have the checksum in run.json: changed since the run; rerun with --overwrite\n"
    assert answer.err.startswith(f"copied/{name}: {'' if name == 'run.json' else changed}")
    assert blocksim(*RUN, "--out", "copied", "--overwrite").code == 0
    assert blocksim(*RUN, "--out", "copied").code == 0


def test_damaged_copy_of_the_scenario_is_written_anew(blocksim: Command, copied: Path) -> None:
    whole = (copied / "scenario.toml").read_text()
    (copied / "scenario.toml").write_text(whole[:200])
    assert blocksim(*RUN, "--out", copied).code == 0
    assert (copied / "scenario.toml").read_text() == whole


def test_changed_experiment_is_judged_by_and_kept_without_running_again(blocksim: Command, tmp_path: Path) -> None:
    shutil.copytree(SCENARIOS, tmp_path / "mine")
    table = tmp_path / "mine" / "experiments" / "three_blocks.csv"
    scenario = tmp_path / "mine" / "three_blocks_nominal.toml"
    mine = ("run", "mine/three_blocks_nominal.toml", *SOFT, "--out", "out")
    whole = table.read_text()
    table.write_text(whole.replace("\n3,", "\n4,"))
    refused = blocksim(*mine)
    assert (refused.code, "measures block '4'" in refused.err, Path("out").exists()) == (65, True, False)
    table.write_text(whole)
    assert "[71.69, 78.53]" in blocksim(*mine).out
    table.write_text(whole.replace("2,x,mm,1,71.69", "2,x,mm,1,60.00"))
    again = blocksim(*mine)
    assert "[60.00, 78.53]" in again.out
    assert again.err.startswith("already computed")
    assert (tmp_path / "out" / "experiment.csv").read_bytes() == table.read_bytes()
    assert "[60.00, 78.53]" in blocksim("compare", "out").out
    scenario.write_text(scenario.read_text().partition("[experiment]")[0])
    assert "verdict" not in blocksim(*mine).out
    assert not (tmp_path / "out" / "experiment.csv").exists()


def test_failed_run_is_reported_kept_and_76(blocksim: Command) -> None:
    for flag in ("--quiet", "--json"):
        answer = blocksim(*RUN, "--set", "contact.max_overlap=1e-9", "--out", "out", "--overwrite", flag)
        assert answer.code == 76
        assert re.fullmatch(
            r"three_blocks_nominal: failed: an overlap exceeds contact\.max_overlap "
            r"\(block \d and (block \d|the ground) by [\d.e-]+ mm, step \d+\); "
            r"partial results are in out\nno checkpoint saved\n",
            answer.err,
        )
    assert json.loads(Path("out/run.json").read_text())["status"] == "failed"
    assert not Path("out/done.json").exists()
    assert blocksim(*RUN, "--set", "contact.max_overlap=1e-9", "--out", "out").code == 73


def test_more_threads_than_cores_are_a_warning(blocksim: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os.sched_getaffinity", lambda _: {0, 1}, raising=False)
    assert "warning" not in blocksim(*RUN, "--threads", "2", "--out", "two").err
    answer = blocksim(*RUN, "--threads", "3", "--out", "three")
    assert answer.code == 0
    assert answer.err.startswith("warning: 3 threads on 2 cores: oversubscribed, use 2\n")


@pytest.mark.parametrize("how", [(), ("--resume",), ("--overwrite",)])
def test_folder_of_a_run_that_is_going_on_is_left_alone(
    blocksim: Command, tmp_path: Path, how: tuple[str, ...]
) -> None:
    (tmp_path / "out").mkdir()
    with folder_lock(tmp_path / "out"):
        answer = blocksim("run", "scenarios/three_blocks_nominal.toml", *SOFT, "--out", "out", *how)
    assert answer.code == 73
    assert answer.err == "out: a run is in progress here; wait for it, or write elsewhere with --out DIR\n"
    assert not any((tmp_path / "out").iterdir())


def test_block_that_is_fast_at_the_end_is_told(blocksim: Command) -> None:
    answer = blocksim("run", "scenarios/slide.toml", *SOFT, "--set", "time.end=0.02")
    assert "not at rest: block block at 0." in answer.err


def test_long_table_tells_how_many_blocks_it_leaves_out() -> None:
    columns: dict[str, list[object]] = {"block": [*map(str, range(41))]}
    columns |= dict.fromkeys(("x_mm", "y_mm", "rotation_deg"), [0.0] * 41)
    lines = _answer_lines(SimpleNamespace(experiment=None, columns=columns, endings={}))  # type: ignore[arg-type]
    assert (len(lines), lines[-1]) == (2 + 10 + 1, "... and 31 more blocks in final.csv")


def test_frames_closer_than_a_step_are_warned_of(blocksim: Command) -> None:
    answer = blocksim("run", "scenarios/slide.toml", *SOFT, "--set", "output.every=1e-9 s", "--set", "time.end=1e-4")
    assert answer.code == 0
    assert "warning: output.every = 1e-09 s is shorter than a step: a frame at every step" in answer.err


def test_the_end_of_a_run_reads_none_of_its_frames(blocksim: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    """They are as many as the run is long, and a limit of wall time has no room for them."""

    def read(*_: object) -> None:
        pytest.fail("frames are read again")

    monkeypatch.setattr("blocksim.simulation.results.read_frames", read)
    answer = blocksim("run", "scenarios/three_blocks_nonsmooth.toml", "--set", "time.end=0.02", "--out", "run")
    assert answer.code in {0, 1}
    assert "results: run" in answer.err


def test_largest_movement_outcome_and_first_mover_are_reported(blocksim: Command) -> None:
    answer = blocksim("run", "scenarios/slide.toml", *SOFT, "--out", "slid")
    assert "slid: peak displacement 33." in answer.err
    assert "(block block)\nfirst to move: block block at 0.001 s" in answer.err  # 0.5 m/s past a hundredth of 25 mm
    movement = json.loads(Path("slid/run.json").read_text())["movement"]
    assert (movement["outcome"], movement["first_mover"]) == ("slid", "block")

"""blocksim fragility: what it prints, its exit codes, shards, and a kill."""

import json
import signal
import time
from pathlib import Path

import pytest

from tests.cli.conftest import Command, Process
from tests.golden import Golden
from tests.sizes import in_all

AT_REST = ("--set", "time.scheme=nonsmooth", "--set", "time.end=0.5", "--set", "bodies.0.velocity=[0,0]")
SLIDE = ("fragility", "scenarios/slide.toml", *AT_REST)
TILT = ("--intensity", "ground.tilt=14deg:26deg:5")
SLIDES = ("--fails", "outcome == slid")
SCATTER = ("--scatter", "friction.block_ground=0.38+-0.08")
FEW = ("--samples", 6, "--out", "out")


def test_counts_limits_and_curve_are_shown_on_80_columns(blocksim: Command, golden: Golden) -> None:
    answer = blocksim(*SLIDE, *TILT, *SLIDES, *SCATTER, *FEW)
    assert answer.code == 0
    assert max(map(len, answer.out.splitlines())) <= 80
    golden(answer.out)
    assert answer.err.endswith("30 runs, 30 of them now: out\n")
    data = json.loads(blocksim(*SLIDE, *TILT, *SLIDES, *SCATTER, *FEW, "--json").out)
    assert [point["members"] for point in data["points"]] == [6] * 5
    low, high = data["curve"]["median_interval"]
    assert low < data["curve"]["median"] < high


def test_without_a_curve_it_says_why_and_where_the_median_is(blocksim: Command, golden: Golden) -> None:
    nothing = blocksim(*SLIDE, *TILT, *SCATTER, *FEW, "--quiet")
    assert (nothing.code, nothing.err) == (1, "")
    step = blocksim(*SLIDE, *TILT, "--scatter", "friction.block_ground=0.38+-0.001", *SLIDES, "--out", "step", "-q")
    assert step.code == 1
    golden("\n\n".join(answer.out.partition("\n\n")[2].partition("\n\n")[2] for answer in (nothing, step)))


def test_a_median_beyond_what_was_run_is_warned_of_and_shared_records_are_named(blocksim: Command) -> None:
    records = ("--stripes", "friction.block_ground=0.2,0.26,0.33,0.37,0.41,0.45,0.5", "--out", "out")
    answer = blocksim(*SLIDE, "--intensity", "ground.tilt=14deg:20deg:3", *SLIDES, *records)
    assert answer.code == 0
    assert "warning: the median lies above 20 deg, beyond all intensities that were run" in answer.err
    assert "times as wide as those of independent draws: 7 records shared" in answer.out
    assert "deviance" not in answer.out  # of counts that are not independent
    assert max(map(len, answer.out.splitlines())) <= 80


def test_shards_wait_for_one_another(blocksim: Command) -> None:
    first = blocksim(*SLIDE, *TILT, *SLIDES, *SCATTER, *FEW, "--shard", "0/2")
    assert first.code == 0
    assert "15 samples have not run; after all shards, rerun without --shard" in first.err
    assert blocksim(*SLIDE, *TILT, *SLIDES, *SCATTER, *FEW, "--shard", "1/2").code == 0
    last = blocksim(*SLIDE, *TILT, *SLIDES, *SCATTER, *FEW)
    assert (last.code, last.err.splitlines()[-1]) == (0, "30 runs, 0 of them now: out")


def test_members_without_a_result_are_exit_code_77(blocksim: Command) -> None:
    broken = ("--scatter", "contact.max_overlap=0.01,1e-12", "--set", "time.scheme=explicit")
    soft = ("--set", "contact.stiffness_scale=0.001", "--set", "time.end=0.01")
    answer = blocksim(*SLIDE, *broken, *soft, "--intensity", "gravity=5,10", *FEW)
    assert answer.code == 77
    assert "no result" in answer.out.splitlines()[2]
    assert "samples have no result, see members.csv" in answer.err


@pytest.mark.long
def test_a_study_killed_again_and_again_ends_as_one_that_was_not(
    blocksim: Command, process: Process, tmp_path: Path
) -> None:
    wall = ("fragility", "scenarios/tilting_wall.toml", "--intensity", "ground.tilt=31deg:34deg:4", "--samples", 40)
    study = (*wall, "--scatter", "friction.block_block=0.65+-0.03", "--set", "time.stop_at_rest=false", "--jobs", 1)
    assert blocksim(*study, "--out", "whole").code == 0
    for _ in range(in_all(10)):
        running = process(*study, "--out", "killed")
        time.sleep(2.5)
        running.send_signal(signal.SIGKILL)
        running.communicate()
    assert blocksim(*study, "--out", "killed").code == 0
    for name in ("fragility.csv", "members.csv"):
        assert (tmp_path / "killed" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()
    numbers = [json.loads(line)["number"] for line in (tmp_path / "killed" / "manifest.jsonl").read_text().splitlines()]
    assert sorted(numbers) == list(range(160))

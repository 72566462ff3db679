"""Studies that are stopped and killed: they continue where they were, and end as those that were left alone."""

import json
import signal
import time
from functools import partial
from pathlib import Path

import pytest

from tests.cli.conftest import PATIENCE, SOFT, Command, Process, wait_for, wait_until
from tests.sizes import in_all

WALL = ("scenarios/tilting_wall.toml", "--set", "time.stop_at_rest=false", "--jobs", 1)
LIMIT = ("limit", *WALL, "--vary", "ground.tilt=20deg:40deg", "--stands", "outcome != fell")
SAMPLES = ("--samples", 40, "--scatter", "friction.block_block=0.65+-0.03")
FRAGILITY = ("fragility", *WALL, "--intensity", "ground.tilt=31deg:34deg:4", *SAMPLES)


@pytest.mark.long
@pytest.mark.parametrize(
    ("study", "kills", "seconds"), [(LIMIT, 20, 1.2), (FRAGILITY, 10, 2.5)], ids=["limit", "fragility"]
)
def test_a_study_killed_again_and_again_ends_as_one_that_was_not(
    blocksim: Command, process: Process, tmp_path: Path, study: tuple[object, ...], kills: int, seconds: float
) -> None:
    assert blocksim(*study, "--out", "whole").code == 0
    for _ in range(in_all(kills)):
        running = process(*study, "--out", "killed")
        time.sleep(seconds)
        running.send_signal(signal.SIGKILL)
        running.communicate()
    assert blocksim(*study, "--out", "killed").code == 0
    whole, killed = tmp_path / "whole", tmp_path / "killed"
    rows = [json.loads(line) for line in (killed / "manifest.jsonl").read_text().splitlines()]
    if study == LIMIT:
        one, other = (json.loads((folder / "limit.json").read_text()) for folder in (whole, killed))
        assert one["changes"] == other["changes"]
        assert len({str(row["values"]) for row in rows}) == len(rows) == one["runs"]
        return
    for name in ("fragility.csv", "members.csv"):
        assert (killed / name).read_bytes() == (whole / name).read_bytes()
    assert sorted(row["number"] for row in rows) == list(range(160))


def has_lines(path: Path, count: int) -> bool:
    return path.read_text().count("\n") >= count


@pytest.mark.long
def test_calibration_stopped_killed_and_resumed_finds_the_same(
    blocksim: Command, process: Process, tmp_path: Path
) -> None:
    (tmp_path / "measured.csv").write_text("block,quantity,unit,replicate,value\nblock,x,mm,1,41\nblock,x,mm,2,43\n")
    fit = ("--fit", "friction.block_ground=0.2:0.5", "--scatter", "bodies.0.velocity.0=0.5 m/s+-0.01 m/s")
    few = ("--trials", 22, "--samples", 4, "--fresh", 4)
    given = ("calibrate", "scenarios/slide.toml", *SOFT, "--experiment", "measured.csv", *fit, *few)
    assert blocksim(*given, "--out", "whole.toml", "--quiet").code == 0
    journal = tmp_path / "cut.trials.jsonl"
    for number, lines in ((signal.SIGTERM, 5), (signal.SIGKILL, 20)):
        running = process(*given, "--out", "cut.toml", "--resume")
        wait_for(journal, running)
        wait_until(partial(has_lines, journal, lines), running)
        running.send_signal(number)
        _, told = running.communicate()
        assert not (tmp_path / "cut.toml").exists()
        if number == signal.SIGTERM:
            assert running.returncode == 75
            assert "of 22 trials; --resume runs the rest" in told
    assert blocksim(*given, "--out", "cut.toml", "--resume", "--quiet").code == 0
    assert (tmp_path / "cut.toml").read_text() == (tmp_path / "whole.toml").read_text()


@pytest.mark.parametrize("jobs", [1, pytest.param(2, marks=pytest.mark.long)])
def test_ctrl_c_ends_all_runs_of_a_convergence_with_75(process: Process, tmp_path: Path, jobs: int) -> None:
    endless = ("--set", "time.end=1e4", "--set", "time.stop_at_rest=false", "--set", "output.every=10")
    running = process("converge", "scenarios/three_blocks_nominal.toml", *SOFT, *endless, "--jobs", jobs, "-q")
    wait_until(lambda: any(tmp_path.glob("results/three_blocks_nominal/converge/*/run.h5")), running)
    running.send_signal(signal.SIGINT)
    out, err = running.communicate(timeout=PATIENCE)
    assert (running.returncode, out) == (75, "")
    assert err == "stopped after 0 runs; rerun the command to finish\n"

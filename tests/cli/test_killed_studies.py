"""Sweeps and other studies that are stopped or killed: they end at once, and end as those that were left alone."""

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path

import pytest

from blocksim.study.manifest import read_entries
from tests.cli.conftest import (
    CLUSTER,
    PATIENCE,
    SOFT,
    Answer,
    Command,
    Process,
    Running,
    end_of,
    wait_for,
    wait_until,
)
from tests.sizes import in_all

Sweep = Callable[..., Running]


@pytest.fixture
def start(process: Process) -> Sweep:
    """Start a sweep of rigid blocks, of some milliseconds a case."""

    def begin(out: str, count: int, *options: object) -> Running:
        vary = ("--vary", f"friction.block_block.static=0.25:0.4:{count}")
        return process("sweep", "scenarios/three_blocks_nonsmooth.toml", *vary, "--out", out, "--quiet", *options)

    return begin


def finish(running: Running) -> None:
    _, err = running.communicate(timeout=10 * PATIENCE)
    assert running.returncode == 0, err


def check_kills(start: Sweep, folder: Path, count: int, shares: Iterable[float], *options: object) -> None:
    """Kill a sweep at moments given as shares of its duration; resume, and compare with the one left alone."""
    began = time.monotonic()
    finish(start("whole", count))
    duration = time.monotonic() - began
    for number, share in enumerate(shares):
        place = folder / f"killed-{number}"
        running = start(place.name, count, *options)
        time.sleep(share * duration)
        running.kill()
        running.communicate()
        kept = list(read_entries(place / "manifest.jsonl")) if (place / "manifest.jsonl").exists() else []
        finish(start(place.name, count, *options))
        after = list(read_entries(place / "manifest.jsonl"))
        assert after[: len(kept)] == kept
        assert sorted(entry.number for _, entry in after) == list(range(count))  # none twice, none lost
        assert (place / "sweep.csv").read_bytes() == (folder / "whole" / "sweep.csv").read_bytes()
        shutil.rmtree(place)


@pytest.mark.long
def test_sweep_killed_at_20_moments_continues_to_the_same_table(start: Sweep, tmp_path: Path) -> None:
    moments = random.Random(6)  # noqa: S311 - no secret
    check_kills(start, tmp_path, 500, [moments.random() for _ in range(in_all(20))])
    shutil.rmtree(tmp_path / "whole")
    check_kills(start, tmp_path, 500, (0.5, 0.8, 1.1), "--executor", "processes")


def test_endless_case_is_given_up_at_once(process: Process, tmp_path: Path) -> None:
    endless = ("--vary", "time.end=1e4,2e4", "--set", "time.stop_at_rest=false")
    running = process("sweep", "scenarios/three_blocks_nonsmooth.toml", *endless, "--out", "out")
    wait_for(tmp_path / "out" / "manifest.jsonl", running)
    time.sleep(0.2)
    running.send_signal(signal.SIGINT)
    told = "stopped with 0 of 2 cases done; rerun the command to finish\n"
    assert end_of(running) == Answer(75, "", told)  # the case itself would take longer than that
    assert (tmp_path / "out" / "sweep.csv").read_text().count("\n") == 1


@pytest.mark.long
def test_stopped_sweep_is_75_and_ends_its_workers(process: Process, tmp_path: Path) -> None:
    vary = ("--vary", "time.end=0.001,1e4,2e4", "--set", "time.stop_at_rest=false", "--jobs", 2)
    executor = ("--executor", "processes", "--out", "out")
    running = process("sweep", "scenarios/three_blocks_nominal.toml", *SOFT, *vary, *executor, start_new_session=True)
    assert running.stderr is not None
    line = running.stderr.readline()
    while line and "1/3 finished" not in line:
        line = running.stderr.readline()
    os.killpg(running.pid, signal.SIGHUP)  # to all, as when a terminal is lost
    _, err = running.communicate(timeout=PATIENCE)  # returns when the workers, too, have let go of the pipes
    assert running.returncode == 75
    assert err == "stopped with 1 of 3 cases done; rerun the command to finish\n"
    assert (tmp_path / "out" / "sweep.csv").read_text().count("\n") == 2


SLOWLY = """
import time
from blocksim.simulation import files
look = files.is_resolved
files.is_resolved = lambda plan: time.sleep(2.0) or look(plan)  # until the others are there too
"""


@pytest.mark.long
def test_of_three_sweeps_that_begin_in_a_folder_at_once_two_are_refused(process: Process) -> None:
    sweep = ("sweep", "scenarios/three_blocks_nonsmooth.toml", "--out", "out", "--overwrite")
    finish(process(*sweep, "--vary", "time.end=1e-3,2e-3"))
    endless = ("--vary", "time.end=1e4,2e4", "--set", "time.stop_at_rest=false", "--jobs", 1)
    three = [process(*sweep, *endless, before=SLOWLY) for _ in range(3)]
    began = time.monotonic()
    while sum(one.poll() is None for one in three) > 1:
        assert time.monotonic() - began < PATIENCE
        time.sleep(0.05)
    for one in three:
        one.kill()
    told = [(one.communicate()[1], one.returncode) for one in three]
    assert sorted(code for _, code in told) == [-signal.SIGKILL, 73, 73], told
    assert all("is running here" in err or "is already running" in err for err, code in told if code == 73)


@pytest.mark.long
def test_scheduler_that_dies_in_the_middle_is_reported_in_one_line(start: Sweep, tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    script = tmp_path / "cluster.py"
    script.write_text(CLUSTER)
    with subprocess.Popen(
        [sys.executable, script], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as cluster:
        assert cluster.stdout is not None
        address = cluster.stdout.readline().strip()
        running = start("swept", 20_000, "--scheduler", address)
        wait_for(tmp_path / "swept" / "timings.csv", running)  # written after the first rows
        cluster.kill()
        _, err = running.communicate(timeout=PATIENCE)
    assert err == f"the Dask scheduler at {address} is gone; rerun the command to finish\n"
    assert running.returncode == 69
    assert 0 < len(list(read_entries(tmp_path / "swept" / "manifest.jsonl"))) < 20_000
    assert (tmp_path / "swept" / "sweep.csv").exists()


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


def test_ctrl_c_ends_all_runs_of_a_convergence_with_75(process: Process, tmp_path: Path) -> None:
    endless = ("--set", "time.end=1e4", "--set", "time.stop_at_rest=false", "--set", "output.every=10")
    running = process("converge", "scenarios/three_blocks_nominal.toml", *SOFT, *endless, "--jobs", 2, "-q")
    wait_until(lambda: any(tmp_path.glob("results/three_blocks_nominal/converge/*/run.h5")), running)
    running.send_signal(signal.SIGINT)
    assert end_of(running) == Answer(75, "", "stopped after 0 runs; rerun the command to finish\n")

"""What only a real process shows: signals, kills, full disks, closed pipes, terminals."""

import os
import pty
import select
import signal
import time
from pathlib import Path

import h5py
import pytest

from blocksim.scenario import load_scenario
from blocksim.simulation.stores.hdf5 import read_frames
from tests.cli.conftest import PATIENCE, SOFT, Process, wait_for, wait_for_frames

NOMINAL = "scenarios/three_blocks_nominal.toml"
SLOW = ("run", NOMINAL, *SOFT, "--set", "time.end=500", "--set", "time.stop_at_rest=false")
DENSE = (*SLOW, "--set", "output.every=1e-5", "--set", "time.end=20")
LIMIT = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, ({0}, {0}))"


DELAYS = [0.1, *(pytest.param(delay, marks=pytest.mark.long) for delay in (0.0, 0.003, 0.6, 0.9))]


@pytest.mark.parametrize("delay", DELAYS)
def test_killed_run_leaves_a_readable_file(process: Process, tmp_path: Path, delay: float) -> None:
    running = process(*DENSE, "--out", "out", "--quiet")
    (wait_for if delay < 0.1 else wait_for_frames)(tmp_path / "out" / "run.h5", running)
    time.sleep(delay)
    running.kill()
    running.communicate()
    if delay < 0.1:  # killed in its first milliseconds: the file opens, with or without a frame in it
        with h5py.File(tmp_path / "out" / "run.h5", "r", libver="latest", swmr=True) as file:
            assert int(file["n_committed"][()]) in {0, 1}
        return
    frames = read_frames(tmp_path / "out" / "run.h5", load_scenario(tmp_path / "out" / "scenario.toml"))
    assert frames.time[0] == 0.0
    assert frames.x[0].tolist() == pytest.approx([0.016, 0.038, 0.060], abs=1e-6)
    assert len(frames) > 1 or delay < 0.6


@pytest.mark.parametrize(
    ("limit", "file"),
    [
        (600_000, "run.h5"),
        pytest.param(1000, "scenario.toml", marks=pytest.mark.long),
        pytest.param(100_000, "run.h5", marks=pytest.mark.long),
    ],
)
def test_full_disk_is_74_with_one_line(process: Process, tmp_path: Path, limit: int, file: str) -> None:
    running = process(*DENSE, "--out", "out", "-q", before=LIMIT.format(limit))
    out, err = running.communicate(timeout=PATIENCE)
    assert (running.returncode, out) == (74, "")
    assert err == f"out/{file}: cannot be written: File too large\n"
    folder = tmp_path / "out"  # an empty one is removed again
    assert not folder.exists() or not [path.name for path in folder.iterdir() if path.name.startswith(".")]
    if limit == 600_000:
        assert len(read_frames(folder / "run.h5", load_scenario(folder / "scenario.toml"))) > 0


def test_answer_that_cannot_be_written_is_74(process: Process) -> None:
    with Path("/dev/full").open("w") as full:
        running = process("schema", stdout=full)
        _, err = running.communicate(timeout=PATIENCE)
    assert running.returncode == 74
    assert err == "the answer: cannot be written: No space left on device\n"


def test_reader_that_has_gone_is_no_traceback(process: Process) -> None:
    read_end, write_end = os.pipe()
    os.close(read_end)
    running = process("schema", stdout=write_end)
    os.close(write_end)
    _, err = running.communicate(timeout=PATIENCE)
    assert (running.returncode, err) == (74, "")


def test_internal_error_is_70_with_one_line(process: Process) -> None:
    breaking = "import blocksim.scenario; blocksim.scenario.json_schema = lambda: 1 / 0"
    running = process("schema", before=breaking)
    _, err = running.communicate(timeout=PATIENCE)
    assert running.returncode == 70
    assert err.startswith("internal error: ZeroDivisionError: division by zero; please report it with the file ")
    Path(err.split()[-1]).unlink()


def test_terminal_without_the_signs_gets_an_answer(process: Process) -> None:
    before = "import sys; sys.stdout.reconfigure(encoding='ascii'); sys.stderr.reconfigure(encoding='ascii')"
    running = process("run", NOMINAL, *SOFT, "--out", "out", before=before)
    out, _ = running.communicate(timeout=PATIENCE)
    assert running.returncode == 0
    assert "16.00 ? 0.00" in out


@pytest.mark.long
def test_stopped_sweep_is_75_and_ends_its_workers(process: Process, tmp_path: Path) -> None:
    vary = ("--vary", "time.end=0.001,1e4,2e4", "--set", "time.stop_at_rest=false", "--jobs", 2)
    executor = ("--executor", "processes", "--out", "out")
    running = process("sweep", NOMINAL, *SOFT, *vary, *executor, start_new_session=True)
    assert running.stderr is not None
    line = running.stderr.readline()
    while line and "1/3 finished" not in line:
        line = running.stderr.readline()
    os.killpg(running.pid, signal.SIGHUP)  # to all, as when a terminal is lost
    _, err = running.communicate(timeout=PATIENCE)  # returns when the workers, too, have let go of the pipes
    assert running.returncode == 75
    assert err == "stopped with 1 of 3 cases done; rerun the command to finish\n"
    assert (tmp_path / "out" / "sweep.csv").read_text().count("\n") == 2


def test_terminal_shows_progress_on_one_line_and_clears_it(process: Process) -> None:
    leader, follower = pty.openpty()
    running = process(*SLOW, "--set", "time.end=2", "--out", "out", stderr=follower)
    os.close(follower)
    shown = b""
    while select.select([leader], [], [], PATIENCE)[0]:
        try:
            shown += os.read(leader, 4096)
        except OSError:
            break
    running.communicate(timeout=PATIENCE)
    os.close(leader)
    text = shown.decode()
    assert running.returncode == 0
    assert "of 2 s " in text
    assert "steps/s, relative energy error " in text
    assert "…" not in text

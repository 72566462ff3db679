"""What only a real process shows: Ctrl-C at any moment, full disks, closed pipes, terminals; never a traceback."""

import fcntl
import json
import os
import pty
import re
import select
import signal
import subprocess
import sys
import termios
import time
from pathlib import Path

import pytest

from blocksim.cli.app import STOPPED_EARLY
from blocksim.errors import ExitCode
from blocksim.scenario import Model, load_scenario
from blocksim.simulation.stores.hdf5 import read_frames
from tests.cli.conftest import PATIENCE, SOFT, Process, committed, end_of, wait_for, wait_for_frames, wait_until

NOMINAL = "scenarios/three_blocks_nominal.toml"
ENDLESS = ("run", NOMINAL, *SOFT, "--set", "time.end=500", "--set", "time.stop_at_rest=false", "--out", "out")
DENSE = (*ENDLESS, "--set", "output.every=1e-5", "--set", "time.end=20", "--quiet")
SCHEMA = ("schema",)
IMPORTED = """
import os, signal, sys

class Finder:
    @staticmethod
    def find_spec(name, path=None, target=None):
        if name == "{}":
            os.kill(os.getpid(), signal.SIGINT)

sys.meta_path.insert(0, Finder)
"""
CALLED = """
import ctypes, os, signal, time
import blocksim.scenario as s
call = ctypes.CFUNCTYPE(None)(lambda: os.kill(os.getpid(), signal.SIGINT))  # as functions that the compiler calls are
s.json_schema = lambda: (call(), time.sleep(20))
"""
LATE = "import atexit, os, signal; atexit.register(os.kill, os.getpid(), signal.SIGINT)"
BROKEN = "import blocksim.scenario; blocksim.scenario.json_schema = lambda: 1 / 0"
LIMIT = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, ({0}, {0}))"
FULL = """
import os
from blocksim.simulation.stores.hdf5 import FrameFile
reserve, calls = FrameFile._reserve, []

def fail(self, size):  # as file systems do whose promise of room is worth nothing
    calls.append(size)
    if len(calls) < {}:
        return reserve(self, size)
    handle = self.file.id.get_vfd_handle()
    os.dup2(os.open("/proc/self/fd/%d" % handle, os.O_RDONLY), handle)

FrameFile._reserve = fail
"""
UNWRITTEN = "out/run.h5: cannot be written: Bad file descriptor\n"
TOO_LARGE = "out/{}: cannot be written: File too large\n"
INTERNAL = "internal error: ZeroDivisionError: division by zero; please report it with the file FILE\n"
ENDS = {
    **{f"import of {name}": (ENDLESS, IMPORTED.format(name), 75, "stopped\n") for name in ("typer", "numba")},
    "import of a run": (ENDLESS, IMPORTED.format("blocksim.simulation.run"), 75, "stopped\n"),
    "function that the compiler calls": (SCHEMA, CALLED, 75, "stopped\n"),
    "last moments": (SCHEMA, LATE, 0, ""),
    "internal error": (SCHEMA, BROKEN, 70, INTERNAL),
    "full disk": (DENSE, LIMIT.format(600_000), 74, TOO_LARGE.format("run.h5")),
    "full disk at once": (DENSE, LIMIT.format(1000), 74, TOO_LARGE.format("scenario.toml")),
    "full disk soon": (DENSE, LIMIT.format(100_000), 74, TOO_LARGE.format("run.h5")),
}
LONG = ("full disk at once", "full disk soon", "import of a run")


@pytest.mark.parametrize("name", [pytest.param(one, marks=pytest.mark.long if one in LONG else ()) for one in ENDS])
def test_a_process_ends_with_its_exit_code_and_at_most_a_line(process: Process, tmp_path: Path, name: str) -> None:
    arguments, before, code, told = ENDS[name]
    ended = end_of(process(*arguments, before=before))
    err = ended.err
    for file in re.findall(r"with the file (\S+)", err):
        Path(file).unlink()
        err = err.replace(file, "FILE")
    assert (ended.code, err, bool(ended.out)) == (code, told, name == "last moments")
    assert not list((tmp_path / "out").glob(".*"))
    if name == "full disk":
        assert (
            len(read_frames(tmp_path / "out" / "run.h5", Model(load_scenario(tmp_path / "out" / "scenario.toml")))) > 0
        )


def test_nothing_heavy_is_imported_before_ctrl_c_is_handled() -> None:
    code = "import sys; import blocksim.cli.app; print({'dataclasses', 'inspect', 'typer'} & set(sys.modules))"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "set()"
    assert STOPPED_EARLY == ExitCode.STOPPED_EARLY  # which is the one that is documented


def test_ctrl_c_while_worker_processes_start_prints_no_traceback(process: Process) -> None:
    early = (
        "import multiprocessing.popen_spawn_posix as p, os, signal, time\n"
        "launch = p.Popen._launch\n"
        "interrupt = lambda: (time.sleep(0.3), os.killpg(0, signal.SIGINT), time.sleep(0.7))\n"  # as a terminal does
        "p.Popen._launch = lambda *a: (launch(*a), interrupt())"
    )
    cases = ("--executor", "processes", "--jobs", "2", "--vary", "ground.tilt=0deg:1deg:8", "--out", "out")
    ended = end_of(process("sweep", NOMINAL, *SOFT, *cases, before=early, start_new_session=True))
    assert ended.code == 75, ended.err
    assert "Traceback" not in ended.err
    assert "rerun the command to finish" in ended.err


@pytest.mark.parametrize(
    ("slow", "presses"),
    [
        ("checkpoint.write_checkpoint = lambda *_: (open('slow', 'w').close(), time.sleep(600))", 1),
        ("run.FrameFile.__exit__ = lambda *a: (open('slow', 'w').close(), time.sleep(600), close(*a))", 2),
    ],
    ids=["checkpoint", "file"],
)
def test_ctrl_c_again_stops_a_run_that_is_writing(process: Process, tmp_path: Path, slow: str, presses: int) -> None:
    before = "import time; from blocksim.simulation import checkpoint, run; close = run.FrameFile.__exit__\n"
    running = process(*ENDLESS, "--quiet", before=before + slow)
    wait_for_frames(tmp_path / "out" / "run.h5", running)
    running.send_signal(signal.SIGINT)
    wait_for(tmp_path / "slow", running)
    for press in range(presses):
        time.sleep(0.002 * press)
        running.send_signal(signal.SIGINT)
    ended = end_of(running)  # sooner than it is written
    assert ended.code == 75
    is_short = presses > 1 and ended.err.count("\n") <= 3 and "Traceback" not in ended.err
    assert ended.err == "stopped\n" or is_short


@pytest.mark.parametrize("write", [1, 2, 3])
def test_a_write_that_fails_under_hdf5_is_74_and_no_crash(process: Process, write: int) -> None:
    ended = end_of(process(*DENSE, before=FULL.format(write)))
    assert (ended.code, ended.out) == (74, ""), ended.err
    assert UNWRITTEN in ended.err


SLOW = "import time, {0} as late; late.{1} = lambda *a, **b: (open('slow', 'w').close(), time.sleep(600))"
STATIC = ("limit", "scenarios/tilting_wall.toml", "--vary", "friction.block_block=0.1:0.9", "--static")
PUSHED = "scenarios/walls/pushed_granite_wall.toml"


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
@pytest.mark.parametrize(
    ("command", "module", "function"),
    [
        (STATIC, "blocksim.study.static_limit", "find_static"),
        (("capacity", PUSHED), "blocksim.study.run", "simulate_into"),
        (("check", PUSHED), "blocksim.world.describe", "describe"),
    ],
    ids=lambda one: one[0] if isinstance(one, tuple) else "",
)
def test_signals_that_mean_ctrl_c_end_what_is_no_run_with_75(
    process: Process, tmp_path: Path, command: tuple[str, ...], module: str, function: str, number: signal.Signals
) -> None:
    running = process(*command, before=SLOW.format(module, function))
    wait_for(tmp_path / "slow", running)
    running.send_signal(number)
    ended = end_of(running)
    assert (ended.code, ended.out) == (75, "")
    assert ended.err.splitlines()[-1] == "stopped"
    assert "Traceback" not in ended.err


def test_capacity_continues_a_run_that_was_stopped(process: Process, tmp_path: Path) -> None:
    capacity = ("capacity", Path(__file__).parent / "scenes" / "pushed.toml", "--set", "time.end=2", "-q")
    running = process(*capacity)
    wait_until(lambda: any(committed(one) >= 3 for one in tmp_path.glob("results/*/*/run.h5")), running)
    running.send_signal(signal.SIGTERM)
    ended = end_of(running)
    assert ended.code == 75
    assert "stopped by SIGTERM" in ended.err
    again = end_of(process(*capacity))
    (summary,) = tmp_path.glob("results/*/*/run.json")
    assert again.code == 0, again.err
    assert json.loads(summary.read_text())["resumed_from"] != []


def test_killed_run_leaves_a_readable_file(process: Process, tmp_path: Path) -> None:
    running = process(*DENSE)
    wait_for_frames(tmp_path / "out" / "run.h5", running)
    running.kill()
    running.communicate()
    frames = read_frames(tmp_path / "out" / "run.h5", Model(load_scenario(tmp_path / "out" / "scenario.toml")))
    assert frames.time[0] == 0.0
    assert frames.x[0].tolist() == pytest.approx([0.016, 0.038, 0.060], abs=1e-6)


def test_answer_that_nobody_can_take_is_74_and_a_reader_that_has_gone_ends_as_it_ends_others(process: Process) -> None:
    read_end, write_end = os.pipe()
    os.close(read_end)
    with Path("/dev/full").open("w") as full:
        no_space = "the answer: cannot be written: No space left on device\n"
        for target, code, told in ((full, 74, no_space), (write_end, 128 + signal.SIGPIPE, "")):
            ended = end_of(process("schema", stdout=target))
            assert (ended.code, ended.err) == (code, told)
    os.close(write_end)


def test_terminal_without_the_signs_gets_an_answer(process: Process) -> None:
    before = "import sys; sys.stdout.reconfigure(encoding='ascii'); sys.stderr.reconfigure(encoding='ascii')"
    ended = end_of(process("run", NOMINAL, *SOFT, "--out", "out", before=before))
    assert (ended.code, "16.00 ? 0.00" in ended.out) == (0, True)


def test_terminal_shows_progress_on_one_line_and_clears_it(process: Process) -> None:
    leader, follower = pty.openpty()
    running = process(*ENDLESS, "--set", "time.end=2", stderr=follower)
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


def test_lost_terminal_stops_a_run_with_a_checkpoint(process: Process, tmp_path: Path) -> None:
    leader, follower = pty.openpty()
    own = {"start_new_session": True, "preexec_fn": lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0)}
    running = process(*ENDLESS, stdin=follower, stdout=follower, stderr=follower, **own)
    os.close(follower)
    wait_for_frames(tmp_path / "out" / "run.h5", running)
    os.close(leader)
    running.wait(timeout=PATIENCE)
    assert running.returncode == 75
    told = json.loads((tmp_path / "out" / "run.json").read_text())
    assert (told["status"], told["reason"]) == ("interrupted", "stopped by SIGHUP")
    assert told["last_checkpoint"] == told["steps"]

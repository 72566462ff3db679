"""Ctrl-C and a lost terminal, at any moment of a process: exit code 75, no traceback, and nothing lost."""

import fcntl
import json
import os
import pty
import signal
import subprocess
import sys
import termios
import time
from pathlib import Path

import pytest

from blocksim.cli.app import STOPPED_EARLY
from blocksim.errors import ExitCode
from tests.cli.conftest import PATIENCE, SOFT, Process, wait_for, wait_for_frames

NOMINAL = "scenarios/three_blocks_nominal.toml"
LONG = ("run", NOMINAL, *SOFT, "--set", "time.end=500")
LONGER = (*LONG, "--set", "time.stop_at_rest=false", "--out", "out")
WHILE_IMPORTED = """
import os, signal, sys

class Finder:
    @staticmethod
    def find_spec(name, path=None, target=None):
        if name == "{module}":
            os.kill(os.getpid(), signal.SIGINT)

sys.meta_path.insert(0, Finder)
"""


@pytest.mark.parametrize("module", ["typer", "numba", "blocksim.simulation.run"])
def test_ctrl_c_during_an_import_prints_no_traceback(process: Process, module: str) -> None:
    running = process(*LONGER, before=WHILE_IMPORTED.format(module=module))
    out, err = running.communicate(timeout=PATIENCE)
    assert (running.returncode, out, err) == (75, "", "stopped\n")


def test_ctrl_c_in_a_function_that_the_compiler_calls_is_not_lost(process: Process) -> None:
    called = (
        "import ctypes, os, signal, time\n"
        "import blocksim.scenario as s\n"
        "call = ctypes.CFUNCTYPE(None)(lambda: os.kill(os.getpid(), signal.SIGINT))\n"  # as those of the compiler are
        "s.json_schema = lambda: (call(), time.sleep(20))"
    )
    running = process("schema", before=called)
    out, err = running.communicate(timeout=PATIENCE)
    assert (running.returncode, out, err) == (75, "", "stopped\n")


def test_exit_code_after_ctrl_c_is_the_one_that_is_documented() -> None:
    assert STOPPED_EARLY == ExitCode.STOPPED_EARLY


def test_nothing_heavy_is_imported_before_ctrl_c_is_handled() -> None:
    code = "import sys; import blocksim.cli.app; print({'dataclasses', 'inspect', 'typer'} & set(sys.modules))"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "set()"


def test_ctrl_c_while_worker_processes_start_prints_no_traceback(process: Process) -> None:
    early = (
        "import multiprocessing.popen_spawn_posix as p, os, signal, time\n"
        "launch = p.Popen._launch\n"
        "interrupt = lambda: (time.sleep(0.3), os.killpg(0, signal.SIGINT), time.sleep(0.7))\n"  # as a terminal does
        "p.Popen._launch = lambda *a: (launch(*a), interrupt())"
    )
    cases = ("--executor", "processes", "--jobs", "2", "--vary", "ground.tilt=0deg:1deg:8", "--out", "out")
    running = process("sweep", NOMINAL, *SOFT, *cases, before=early, start_new_session=True)
    _, err = running.communicate(timeout=PATIENCE)
    assert running.returncode == 75, err
    assert "Traceback" not in err
    assert "rerun the command to finish" in err


def test_ctrl_c_during_the_last_moments_keeps_the_exit_code_of_the_command(process: Process) -> None:
    late = "import atexit, os, signal; atexit.register(os.kill, os.getpid(), signal.SIGINT)"
    running = process("schema", before=late)
    _, err = running.communicate(timeout=PATIENCE)
    assert (running.returncode, err) == (0, "")


def test_three_times_ctrl_c_prints_no_traceback(process: Process, tmp_path: Path) -> None:
    slow = (
        "import blocksim.simulation.run as p, time\n"
        "close = p.FrameFile.__exit__\n"
        "p.FrameFile.__exit__ = lambda *a: (open('closing', 'w').close(), time.sleep(600), close(*a))"  # as a slow disk
    )
    running = process(*LONGER, "--quiet", before=slow)
    wait_for_frames(tmp_path / "out" / "run.h5", running)
    running.send_signal(signal.SIGINT)
    wait_for(tmp_path / "closing", running)
    for pause in (0.0, 0.002):  # s
        time.sleep(pause)
        running.send_signal(signal.SIGINT)
    _, err = running.communicate(timeout=PATIENCE)
    assert running.returncode == 75
    assert err.count("\n") <= 3
    assert "Traceback" not in err


def test_lost_terminal_stops_a_run_with_a_checkpoint(process: Process, tmp_path: Path) -> None:
    leader, follower = pty.openpty()
    running = process(
        *LONGER,
        stdin=follower,
        stdout=follower,
        stderr=follower,
        start_new_session=True,
        preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0),
    )
    os.close(follower)
    wait_for_frames(tmp_path / "out" / "run.h5", running)
    os.close(leader)
    running.wait(timeout=PATIENCE)
    assert running.returncode == 75
    told = json.loads((tmp_path / "out" / "run.json").read_text())
    assert (told["status"], told["reason"]) == ("interrupted", "stopped by SIGHUP")
    assert told["last_checkpoint"] == told["steps"]

"""blocksim converge: tables, verdicts, picture and exit codes."""

import signal
import time
from pathlib import Path

import pytest

from tests.cli.conftest import PATIENCE, SOFT, Process


@pytest.mark.parametrize("jobs", [1, pytest.param(2, marks=pytest.mark.long)])
def test_ctrl_c_ends_all_runs_with_75(process: Process, tmp_path: Path, jobs: int) -> None:
    endless = ("--set", "time.end=1e4", "--set", "time.stop_at_rest=false", "--set", "output.every=10")
    running = process("converge", "scenarios/three_blocks_nominal.toml", *SOFT, *endless, "--jobs", jobs, "-q")
    began = time.monotonic()
    while not list(tmp_path.glob("results/three_blocks_nominal/converge/*/run.h5")):
        assert running.poll() is None, running.communicate()
        assert time.monotonic() - began < PATIENCE
        time.sleep(0.01)
    running.send_signal(signal.SIGINT)
    out, err = running.communicate(timeout=PATIENCE)
    assert (running.returncode, out) == (75, "")
    assert err == "stopped after 0 runs; rerun the command to finish\n"

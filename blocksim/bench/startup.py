"""Start of the command: waiting time of the user, in wall time."""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from blocksim.bench.measurement import Findings, Measurement, Setting, repeat
from blocksim.bench.scenes import three_blocks
from blocksim.errors import BlocksimError
from blocksim.scenario import scenario_to_toml

MAIN = "from blocksim.cli.app import main; main()"
COMPILE = "from blocksim.simulation.schemes import compile_kernels; compile_kernels()"


class StartError(BlocksimError):
    """A process that was to be timed failed."""


def measure(setting: Setting) -> Findings:
    """Measure a bare start, a run of the three blocks at full stiffness with the solver compiled, and compiling it."""
    with tempfile.TemporaryDirectory(prefix="blocksim-bench-") as folder:
        scenario = Path(folder) / "three_blocks.toml"
        scenario.write_text(scenario_to_toml(three_blocks()), encoding="utf-8")
        run = ("run", str(scenario), "--out", str(Path(folder) / "run"), "--overwrite", "--quiet")
        numbers = [repeat("blocksim --version", "s", lambda: _seconds(MAIN, "--version"), setting.repeats)]
        _seconds(MAIN, *run)  # warms all caches
        numbers.append(repeat("blocksim run, three blocks", "s", lambda: _seconds(MAIN, *run), setting.repeats))
        if not setting.quick:
            empty = {"BLOCKSIM_CACHE_DIR": str(Path(folder) / "cache")}
            numbers.append(repeat("first compilation", "s", lambda: _seconds(COMPILE, **empty), 1))
    return Findings(tuple(numbers), notes=("wall time of a new process; the first compilation happens once",))


def _seconds(code: str, *arguments: str, **environment: str) -> float:
    """Run Python code in a process of its own and return the seconds it took; raises StartError where it fails."""
    began = time.perf_counter()
    command = [sys.executable, "-c", code, *arguments]
    done = subprocess.run(  # noqa: S603 - our own command
        command, env=os.environ | environment, capture_output=True, text=True, check=False
    )
    seconds = time.perf_counter() - began
    if done.returncode != 0:
        lines = done.stderr.strip().splitlines() or ["no message"]
        raise StartError(f"blocksim {' '.join(arguments)}: exit code {done.returncode}: {lines[-1]}")
    return seconds


START_UP = Measurement("start-up", "starting the command", measure, quick="no compilation into an empty cache")

"""All measurements, one line each, and that of the start of the command: waiting time of the user, in wall time."""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from blocksim.bench import harness, three_blocks, walls
from blocksim.errors import BlocksimError, ExitCode
from blocksim.scenario import scenario_to_toml, spelling

MAIN = "from blocksim.cli.app import main; main()"
COMPILE = "from blocksim.simulation.schemes import compile_kernels; compile_kernels()"


class StartError(BlocksimError):
    """A process that was to be timed failed."""


def measure_start(effort: harness.Effort) -> harness.Readings:
    """Measure a bare start, a run of the three blocks at full stiffness with the solver compiled, and compiling it."""
    with tempfile.TemporaryDirectory(prefix="blocksim-bench-") as folder:
        scenario = Path(folder) / "three_blocks.toml"
        scenario.write_text(scenario_to_toml(harness.three_blocks()), encoding="utf-8")
        run = ("run", str(scenario), "--out", str(Path(folder) / "run"), "--overwrite", "--quiet")
        numbers = [harness.repeat("blocksim --version", "s", lambda: _seconds(MAIN, "--version"), effort.repeats)]
        _seconds(MAIN, *run)  # warms all caches
        numbers.append(harness.repeat("blocksim run, three blocks", "s", lambda: _seconds(MAIN, *run), effort.repeats))
        if not effort.quick:
            empty = {"BLOCKSIM_CACHE_DIR": str(Path(folder) / "cache")}
            numbers.append(harness.repeat("first compilation", "s", lambda: _seconds(COMPILE, **empty), 1))
    return harness.Readings(tuple(numbers), notes=("wall time of a new process; the first compilation happens once",))


def _seconds(code: str, *arguments: str, **environment: str) -> float:
    """Run Python code in a process of its own and return the seconds it took; raises StartError where it fails."""
    began = time.perf_counter()
    command = [sys.executable, "-P", "-c", code, *arguments]
    done = subprocess.run(  # noqa: S603 - our own command
        command, env=os.environ | environment, capture_output=True, text=True, check=False
    )
    seconds = time.perf_counter() - began
    if done.returncode != 0:
        lines = done.stderr.strip().splitlines() or ["no message"]
        raise StartError(f"blocksim {' '.join(arguments)}: exit code {done.returncode}: {lines[-1]}")
    return seconds


START_UP = harness.Benchmark(
    "start-up", "starting the command", measure_start, quick="no compilation into an empty cache"
)


MOST_SLIPS = 3

MEASUREMENTS = (
    three_blocks.EXPLICIT,
    three_blocks.ENSEMBLE,
    walls.EXPLICIT,
    walls.EXPLICIT_THREADS,
    three_blocks.NONSMOOTH,
    walls.NONSMOOTH,
    walls.NONSMOOTH_THREADS,
    walls.SOILS,
    START_UP,
)


class UnknownMeasurementError(BlocksimError):
    """A measurement that is not in the registry."""

    exit_code = ExitCode.USAGE


def choose(names: Sequence[str], table: Sequence[harness.Benchmark] | None = None) -> tuple[harness.Benchmark, ...]:
    """Return the measurements of some names, in the order of a table, by default MEASUREMENTS; all without names.

    Raises UnknownMeasurementError.
    """
    table = MEASUREMENTS if table is None else table
    known = [one.name for one in table]
    unknown = [name for name in dict.fromkeys(names) if name not in known]
    if unknown:
        meant = {name: spelling.nearest(name, known, MOST_SLIPS) for name in unknown}
        hints = {name: f", did you mean '{near}'? Choose" if near else "; choose" for name, near in meant.items()}
        lines = (f"bench: NAME '{name}': no such measurement{hint}: {', '.join(known)}" for name, hint in hints.items())
        raise UnknownMeasurementError("\n".join(lines))
    return tuple(one for one in table if not names or one.name in names)

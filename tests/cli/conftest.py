"""The command line, called in this process; and as a process of its own, where that matters."""

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import h5py
import pytest
from typer.testing import CliRunner

from blocksim.cli.commands import app
from tests.view.report.folders import write_run

SCENARIOS = Path(__file__).parents[2] / "scenarios"
SOFT = ("--set", "contact.stiffness_scale=0.001")
# a Dask cluster in a process of its own, until its input ends
CLUSTER = """
import sys
from distributed import LocalCluster

if __name__ == "__main__":
    with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=":0", silence_logs=50) as cluster:
        print(cluster.scheduler_address, flush=True)
        sys.stdin.read()
"""
START = "from blocksim.cli.app import main; main()"
SMALL_DISK = "import shutil, types; shutil.disk_usage = lambda _: types.SimpleNamespace(free=10**9)"  # on every machine


@dataclass(frozen=True)
class Answer:
    """What a command left: exit code, answer, and what it told beside."""

    code: int
    out: str
    err: str


class Command(Protocol):
    """Call blocksim with arguments."""

    def __call__(self, *arguments: object) -> Answer:
        """Give its answer."""


@pytest.fixture
def blocksim(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Command:
    """Call commands in an empty folder that has `scenarios`, on a screen of 80 columns."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    (tmp_path / "scenarios").symlink_to(SCENARIOS)

    def call(*arguments: object) -> Answer:
        result = CliRunner().invoke(app, [str(argument) for argument in arguments])
        if result.exception is not None and not isinstance(result.exception, SystemExit):
            raise result.exception
        return Answer(result.exit_code, result.stdout, result.stderr)

    return call


Running = subprocess.Popen[str]
Process = Callable[..., Running]
PATIENCE = 300.0  # s with a process, on a machine that does much else; alone it takes ten


def wait_until(is_so: Callable[[], bool], running: Running) -> None:
    """Wait until something is so that a process does."""
    began = time.monotonic()
    while not is_so():
        assert running.poll() is None, running.communicate()
        assert time.monotonic() - began < PATIENCE
        time.sleep(0.005)


def end_of(running: Running) -> Answer:
    """Wait for the end of a process."""
    out, err = running.communicate(timeout=PATIENCE)
    return Answer(running.returncode, out, err)


def wait_for(path: Path, running: Running) -> None:
    """Wait until a process has made a file."""
    wait_until(path.exists, running)


def committed(path: Path) -> int:
    """Return how many frames a file announces while it is written."""
    try:
        with h5py.File(path, "r", libver="latest", swmr=True) as file:
            return int(file["n_committed"][()])
    except FileNotFoundError:
        return 0


def wait_for_frames(path: Path, running: Running) -> None:
    """Wait until a run has stored some."""
    wait_for(path, running)
    wait_until(lambda: committed(path) >= 3, running)


@pytest.fixture
def process(tmp_path: Path) -> Process:
    """Start blocksim as a process."""
    environment = {**os.environ, "COLUMNS": "80"}
    scenarios = tmp_path / "scenarios"
    if not scenarios.exists():
        scenarios.symlink_to(SCENARIOS)

    def start(*arguments: object, before: str = "", **options: object) -> Running:
        command = [sys.executable, "-c", f"{SMALL_DISK}\n{before}\n{START}", *map(str, arguments)]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **options}
        return subprocess.Popen(command, cwd=tmp_path, env=environment, text=True, **pipes)  # type: ignore[call-overload,no-any-return]

    return start


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """Give a disk of 2 MB."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mount = shutil.which("mount")
    if mount is None or subprocess.run([mount, "-t", "tmpfs", "-o", "size=2m", "none", folder], check=False).returncode:
        pytest.skip("a disk can be mounted by root only")
    yield folder
    subprocess.run(["umount", folder], check=True)  # noqa: S607 - where mount was found


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Give the folder of a finished run of the nominal scenario; not to be changed."""
    folder = tmp_path_factory.mktemp("finished") / "run"
    result = CliRunner().invoke(
        app, ["run", str(SCENARIOS / "three_blocks_nominal.toml"), *SOFT, "--out", str(folder), "--quiet"]
    )
    assert result.exit_code == 0, result.output
    return folder


@pytest.fixture(scope="session")
def made_up_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Give the folder of a run with made-up motion, whose numbers no solver decides; not to be changed."""
    folder = tmp_path_factory.mktemp("made_up") / "run"
    write_run(folder)
    return folder


@pytest.fixture(scope="session")
def finished_sweep(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Give the folder of a sweep over three keys, eight short cases; not to be changed."""
    folder = tmp_path_factory.mktemp("swept") / "sweep"
    vary = [word for key in ("gravity", "time.rest_speed", "time.rest_hold") for word in ("--vary", f"{key}=1,2")]
    scenario = str(SCENARIOS / "three_blocks_nominal.toml")
    result = CliRunner().invoke(
        app, ["sweep", scenario, *SOFT, "--set", "time.end=0.01", *vary, "--jobs", "1", "--out", str(folder), "-q"]
    )
    assert result.exit_code == 0, result.output
    return folder


@pytest.fixture
def copied(finished: Path, tmp_path: Path) -> Path:
    """Give a copy of the finished run, to be damaged."""
    return Path(shutil.copytree(finished, tmp_path / "copied"))

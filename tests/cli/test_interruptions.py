"""Runs that are killed, stopped, or run out of disk, as real processes; and how they continue."""

import json
import shutil
import signal
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from typer.testing import CliRunner

from blocksim.cli.commands import app
from blocksim.scenario import Model, load_scenario
from blocksim.simulation.stores.hdf5 import read_frames
from tests.cli.conftest import SCENARIOS, SOFT, Command, Process, committed, end_of, wait_for, wait_for_frames
from tests.sizes import in_all

SCENES = Path(__file__).with_name("scenes")
NOMINAL = "scenarios/three_blocks_nominal.toml"
ENDLESS = ("run", NOMINAL, *SOFT, "--set", "time.stop_at_rest=false", "--quiet")
LONG = (*ENDLESS, "--set", "time.end=10")  # seconds of a process that is killed somewhere
SHORT = (*ENDLESS, "--set", "time.end=2")
OFTEN = ("--checkpoint-every", "50 ms")
OTHERS = [pytest.param(number, marks=pytest.mark.long) for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGUSR1)]


def summary_of(folder: Path) -> dict[str, object]:
    summary: dict[str, object] = json.loads((folder / "run.json").read_text())
    return summary


def in_one_go(run: tuple[str, ...], folder: Path) -> Path:
    arguments = [str(SCENARIOS / Path(word).name) if word == NOMINAL else word for word in run]
    assert CliRunner().invoke(app, [*arguments, "--out", str(folder)]).exit_code == 0
    return folder


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Give the folder of the long run, run in one go; not to be changed."""
    return in_one_go(LONG, tmp_path_factory.mktemp("whole") / "run")


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Give the folder of the short one."""
    return in_one_go(SHORT, tmp_path_factory.mktemp("short") / "run")


def assert_same(folder: Path, whole: Path) -> None:
    """Assert that a run has the bits of the whole one, in its final state and in every frame."""
    assert summary_of(folder)["final_state_sha256"] == summary_of(whole)["final_state_sha256"]
    assert (folder / "final.csv").read_bytes() == (whole / "final.csv").read_bytes()
    one, other = (
        read_frames(path / "run.h5", Model(load_scenario(path / "scenario.toml"))) for path in (folder, whole)
    )
    for name in ("step", "x", "y", "angle", "vx", "vy", "spin", "contact_count", "largest_overlap"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def kill_again_and_again(process: Process, folder: Path, kills: int, most: float, run: tuple[str, ...] = LONG) -> int:
    """Kill a run that continues and on; look at its folder each time; return how many times it was killed."""
    moments = np.random.default_rng(kills)
    killed = 0
    while killed < kills and not (folder / "done.json").exists():
        running = process(*run, *OFTEN, "--out", folder, "--resume")
        wait_for(folder / "scenario.toml", running)
        time.sleep(moments.uniform(0.0, most))
        before = committed(folder / "run.h5")
        if running.poll() is None:
            running.kill()
            killed += 1
        running.communicate()
        assert frames_in(folder) >= before
    return killed


def frames_in(folder: Path) -> int:
    """Return how many frames of a folder can be read, all of them finite and one after the other."""
    if (folder / "done.json").exists():
        assert summary_of(folder)["status"] == "finished"
    if committed(folder / "run.h5") == 0:
        return 0
    frames = read_frames(folder / "run.h5", Model(load_scenario(folder / "scenario.toml")))
    assert np.all(np.diff(frames.step) > 0)
    assert np.isfinite(frames.x).all()
    return len(frames)


@pytest.mark.long
def test_killed_run_with_soil_continues_to_the_same_bits(process: Process, tmp_path: Path) -> None:
    run = ("run", str(SCENARIOS / "soil" / "seawall.toml"), "--set", "time.end=0.2", "--quiet")
    whole = in_one_go(run, tmp_path / "whole")
    folder = tmp_path / "out"
    assert kill_again_and_again(process, folder, in_all(5), 1.5, run) >= 1
    ended = end_of(process(*run, "--out", folder, "--resume"))
    assert ended.code == 0, ended.err
    assert_same(folder, whole)
    assert (folder / "soils.csv").read_bytes() == (whole / "soils.csv").read_bytes()


@pytest.mark.long
def test_hundred_kills_lose_nothing(process: Process, tmp_path: Path, whole: Path) -> None:
    killed = resumed = 0
    kills = in_all(100)
    for number in range(kills):
        folder = tmp_path / str(number)
        killed += kill_again_and_again(process, folder, min(12, kills - killed), 1.5)
        assert end_of(process(*LONG, "--out", folder, "--resume")).code == 0
        assert_same(folder, whole)
        resumed += bool(summary_of(folder)["resumed_from"])
        if killed == kills:
            break
    assert killed == kills
    assert resumed > 0


@pytest.mark.parametrize("number", [signal.SIGINT, *OTHERS])
def test_stopped_run_continues_to_the_same_bits(
    process: Process, tmp_path: Path, short: Path, number: signal.Signals
) -> None:
    running = process(*SHORT, "--out", "out")
    wait_for_frames(tmp_path / "out" / "run.h5", running)
    running.send_signal(number)
    ended = end_of(running)
    assert ended.code == 75, ended.err
    told = f"interrupted: stopped by {number.name}; partial results are in out\ncontinue with --resume (checkpoint"
    assert told in ended.err
    assert "Traceback" not in ended.err
    assert summary_of(tmp_path / "out")["status"] == "interrupted"
    assert frames_in(tmp_path / "out") > 1
    assert not (tmp_path / "out" / "done.json").exists()
    step = summary_of(tmp_path / "out")["steps"]
    end_of(process(*SHORT, "--out", "out", "--resume"))
    assert summary_of(tmp_path / "out")["resumed_from"] == [step]
    assert_same(tmp_path / "out", short)


def test_wall_time_stops_and_resume_tells_where_it_continues(blocksim: Command, tmp_path: Path, short: Path) -> None:
    stopped = blocksim(*SHORT, "--out", "out", "--wall-time", "0.1 s")
    assert stopped.code == 75
    assert "interrupted: wall-time limit of 0.1 s reached" in stopped.err
    step = summary_of(tmp_path / "out")["steps"]
    assert blocksim(*SHORT, "--out", "out").code == 73
    loud = tuple(word for word in SHORT if word != "--quiet")
    again = blocksim(*loud, "--out", "out", "--resume")
    assert again.code == 0
    assert again.err.startswith(f"resuming at step {step} (")
    assert_same(tmp_path / "out", short)
    shown = blocksim(*loud, "--out", "out", "--resume")
    assert shown.err.startswith("already computed; rerun with --overwrite")


def test_the_limit_of_wall_time_counts_from_the_start_of_the_process(process: Process, tmp_path: Path) -> None:
    slow = "import time, blocksim.cli.commands as late; late.app = lambda obj, app=late.app: app(obj=obj - 1000.0)"
    ended = end_of(process(*LONG, "--wall-time", "1000 s", "--out", "out", before=slow))
    assert ended.code == 75, ended.err
    assert "wall-time limit of 1000 s reached while the scene was built; nothing is kept of that" in ended.err
    assert not (tmp_path / "out").exists()


def test_run_of_other_code_or_values_that_waits_is_reported(blocksim: Command) -> None:
    stopped = blocksim(*LONG, "--wall-time", "0.1 s")
    assert stopped.code == 75
    other = ("run", NOMINAL, *SOFT, "--set", "time.end=0.01")
    answer = blocksim(*other, "--resume")
    assert answer.code == 0
    assert "an unfinished run of another scenario or code version is in results/three_blocks_nominal/" in answer.err


@pytest.mark.long
def test_disk_that_fills_is_74_and_keeps_what_was_there(process: Process, small_disk: Path, whole: Path) -> None:
    small_disk.joinpath("others").write_bytes(bytes(1_200_000))
    roomy = "import shutil; shutil.disk_usage = lambda _: type('', (), {'free': 1 << 60})"  # as if others filled it
    ended = end_of(process(*LONG, *OFTEN, "--out", small_disk / "out", before=roomy))
    assert (ended.code, ended.err.count("\n")) == (74, 1)
    assert "No space left on device" in ended.err
    folder = small_disk / "out"
    before = len(read_frames(folder / "run.h5", Model(load_scenario(folder / "scenario.toml"))))
    assert before > 100
    assert not [path for path in folder.iterdir() if path.name.startswith(".")]
    small_disk.joinpath("others").unlink()
    again = end_of(process(*LONG, "--out", small_disk / "out", "--resume", before=roomy))
    assert again.code in {0, 74}  # it may not fit at all
    elsewhere = shutil.copytree(folder, small_disk.parent / "elsewhere")
    if again.code == 74:
        assert end_of(process(*LONG, "--out", elsewhere, "--resume")).err == ""
    assert summary_of(elsewhere)["resumed_from"]
    assert_same(elsewhere, whole)


@pytest.mark.long
@pytest.mark.parametrize("free", [0, 40_000])
@pytest.mark.parametrize(
    ("name", "command"),
    [
        ("a.vtkhdf", ("export", "--format", "vtkhdf")),
        ("a.csv", ("export", "--format", "csv")),
        ("a.png", ("plot", "--times", ",".join(str(0.01 * number) for number in range(40)))),
        ("a.gif", ("animate", "--quiet", "--width", "2000", "--speed", "4", "--fps", "10")),
    ],
)
def test_full_disk_leaves_the_older_picture_or_export(
    process: Process, small_disk: Path, whole: Path, name: str, command: tuple[str, ...], free: int
) -> None:
    calls = (*command, whole, "--out", small_disk / name)
    (small_disk / name).write_bytes(b"older")
    room = shutil.disk_usage(small_disk).free
    (small_disk / "others").write_bytes(bytes(max(0, room - free - 8192)))
    ended = end_of(process(*calls, "--overwrite"))
    assert (ended.code, ended.err.count("\n")) == (74, 1), ended.err
    assert f"{name}: cannot be written: No space left on device" in ended.err
    assert {path.name: path.stat().st_size for path in small_disk.iterdir() if path.name != "others"} == {name: 5}


def test_full_disk_is_74_and_not_a_limit_without_its_runs(
    blocksim: Command, small_disk: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    vary = ("--vary", "ground.tilt=5deg:40deg:2", "--to", "50%")
    search = ("limit", SCENES / "slender.toml", *vary, "--set", "time.step=1e-3", "--out", small_disk / "out")
    room = shutil.disk_usage(small_disk).free
    (small_disk / "others").write_bytes(bytes(room - 200_000))
    roomy = SimpleNamespace(free=10**9)  # as if others filled it while the search runs
    with monkeypatch.context() as patch:
        patch.setattr("shutil.disk_usage", lambda _: roomy)
        answer = blocksim(*search)
    assert answer.code == 74
    assert "No space left on device; the limit is found, its runs are not kept" in answer.err
    (change,) = json.loads((small_disk / "out" / "limit.json").read_text())["changes"]
    (small_disk / "others").unlink()
    answer = blocksim(*search)
    assert answer.code == 0
    assert ", 0 of them now" in answer.err
    (again,) = json.loads((small_disk / "out" / "limit.json").read_text())["changes"]
    assert (again["low"], again["high"]) == (change["low"], change["high"])
    assert (small_disk / "out" / "cases" / again["below"]["case"] / "done.json").is_file()

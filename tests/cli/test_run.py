"""blocksim run and bench: answers, notes, tables and exit codes."""

import json
from pathlib import Path
from types import SimpleNamespace

import pytest

from blocksim.bench import registry
from blocksim.bench.harness import Benchmark, Effort, Number, Readings, single
from blocksim.cli.run import _answer_lines
from blocksim.simulation.files import folder_lock
from tests.cli.conftest import SOFT, Command

RUN = ("run", "scenarios/three_blocks_nominal.toml", *SOFT)


def test_more_threads_than_cores_are_a_warning(blocksim: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os.sched_getaffinity", lambda _: {0, 1}, raising=False)
    assert "warning" not in blocksim(*RUN, "--threads", "2", "--out", "two").err
    answer = blocksim(*RUN, "--threads", "3", "--out", "three")
    assert answer.code == 0
    assert answer.err.startswith("warning: 3 threads on 2 cores: oversubscribed, use 2\n")


def test_folder_of_a_run_that_is_going_on_is_left_alone(blocksim: Command, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    with folder_lock(tmp_path / "out"):
        answers = [blocksim(*RUN, "--out", "out", *how) for how in ((), ("--resume",), ("--overwrite",))]
    told = "out: a run is in progress here; wait for it, or write elsewhere with --out DIR\n"
    assert [(answer.code, answer.err) for answer in answers] == [(73, told)] * 3
    assert not any((tmp_path / "out").iterdir())


def test_a_scene_that_does_not_settle_is_refused_with_the_key_that_lets_it_fall(blocksim: Command) -> None:
    blocksim("new", "wall", "wall")
    answer = blocksim("run", "wall.toml", "--set", "ground.tilt=36 deg")
    assert answer.code == 76
    assert answer.err.endswith("; --set start.settle=false runs it from where it is placed\n")
    held = blocksim("run", "wall.toml", "--set", "ground.tilt=36 deg", "--set", 'start.hold=["1"]')
    assert held.err.endswith('; --set start.settle=false --set "start.hold=[]" runs it from where it is placed\n')


def test_long_table_tells_how_many_blocks_it_leaves_out() -> None:
    columns: dict[str, list[object]] = {"block": [*map(str, range(41))]}
    columns |= dict.fromkeys(("x_mm", "y_mm", "rotation_deg"), [0.0] * 41)
    lines = _answer_lines(SimpleNamespace(experiment=None, columns=columns, endings={}))  # type: ignore[arg-type]
    assert (len(lines), lines[-1]) == (2 + 10 + 1, "... and 31 more blocks in final.csv")


def test_the_end_of_a_run_reads_none_of_its_frames(blocksim: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    """They are as many as the run is long, and a limit of wall time has no room for them."""

    def read(*_: object) -> None:
        pytest.fail("frames are read again")

    monkeypatch.setattr("blocksim.simulation.results.read_frames", read)
    answer = blocksim("run", "scenarios/three_blocks_nonsmooth.toml", "--set", "time.end=0.02", "--out", "run")
    assert answer.code in {0, 1}
    assert "results: run" in answer.err


PLAN = ("sweep", "scenarios/three_blocks_nominal.toml", *SOFT, "--jobs", 2, "--dry-run")


def test_cost_grows_with_cases_and_steps_and_is_shared_by_cores(blocksim: Command) -> None:
    def solving(jobs: int) -> str:
        return blocksim(*PLAN, "--jobs", jobs, "--vary", "time.end=2,4").out.splitlines()[1]

    def seconds(*vary: str) -> float:
        return float(json.loads(blocksim(*PLAN, "--json", *vary).out)["seconds"])

    assert solving(1).endswith(" on 1 core")
    assert solving(1).removesuffix(" on 1 core") != solving(8).removesuffix(" on 8 cores")
    one = seconds("--vary", "friction.block_block.kinetic=0.2")
    assert seconds("--vary", "friction.block_block.kinetic=0.2,0.21,0.22") / one == 3.0
    assert 1.9 < seconds("--vary", "time.end=4") / one < 2.1


def measured(effort: Effort) -> Readings:
    numbers = (Number("a step", "ns", (3.0, 1.0, 2.0)[: effort.repeats]), single("memory", "bytes/block", 5000.0))
    return Readings(numbers, notes=("soft",), details=({"quick": effort.quick},))


def stopped(_: Effort) -> Readings:
    raise KeyboardInterrupt


@pytest.fixture
def table_of_two(monkeypatch: pytest.MonkeyPatch) -> None:
    table = (
        Benchmark("first", "made up", measured, quick="half of it"),
        Benchmark("stop", "stopped", stopped, quick=""),
    )
    monkeypatch.setattr(registry, "MEASUREMENTS", table)


@pytest.mark.usefixtures("table_of_two")
def test_table_fits_80_columns_and_names_the_machine_and_json_and_file_hold_the_same(blocksim: Command) -> None:
    answer = blocksim("bench", "first", "--repeats", 3, "--quick")
    assert answer.code == 0
    lines = answer.out.splitlines()
    assert lines[0].split() == ["quantity", "unit", "median", "smallest", "largest"]
    assert lines[2] == "first: made up"
    assert lines[3].split() == ["a", "step", "ns", "2", "1", "3"]
    assert lines[4].split() == ["memory", "bytes/block", "5000", "–", "–"]
    assert max(map(len, lines)) <= 80
    for told in ("first: soft", "first shortened: half of it", "cores, load", "numba", "blocksim 0"):
        assert told in answer.err
    answer = blocksim("bench", "first", "--json", "--out", "bench.json")
    assert answer.err == ""
    data = json.loads(answer.out)
    assert json.loads(Path("bench.json").read_text(encoding="utf-8")) == data
    machine = {"processor", "cores", "platform", "python", "numba", "numpy", "blocksim", "load", "busy"}
    assert machine <= set(data["machine"])
    assert data["measurements"][0]["numbers"][0]["samples"] == [3.0, 1.0, 2.0]
    assert data["measurements"][0]["details"] == [{"quick": False}]


@pytest.mark.usefixtures("table_of_two")
def test_a_stop_keeps_what_was_measured(blocksim: Command) -> None:
    answer = blocksim("bench", "--out", "bench.json")
    assert answer.code == 75
    assert "a step" in answer.out
    assert "stopped" in answer.err
    assert len(json.loads(Path("bench.json").read_text(encoding="utf-8"))["measurements"]) == 1

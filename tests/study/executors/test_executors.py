"""Every executor gives the same rows, in batches of any size, and in folders; a pool ends with whoever started it."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from multiprocessing import active_children, current_process
from pathlib import Path
from typing import Any

import pytest

from blocksim.errors import InvalidInputError, UnavailableError
from blocksim.scenario import Document, Model
from blocksim.simulation import files, simulate
from blocksim.simulation.checkpoint import CheckpointPolicy
from blocksim.simulation.results import read_summary
from blocksim.study import executors as batches
from blocksim.study.executors import GROWTH, MOST, BatchSize, Execution, RunSetting, Task, load_executor
from blocksim.study.executors.ensemble import rows_of, run_case, run_members
from blocksim.study.manifest import Shard
from blocksim.study.plan import Values
from blocksim.study.run import run
from blocksim.study.sweep import SweepOptions, merge, sweep
from tests.study.conftest import SCENARIOS
from tests.study.plans import KINETIC

# values that finish, fail in the run, fail before it, and do not go together; other shapes and schemes beside them
VARY: dict[str, Values] = {
    KINETIC: [0.1, 0.2, 0.9],
    "contact.max_overlap": [1e-2, 1e-12],
    "structures.0.count": [2, 3],
    "time.end": [0.004, 0.008],
}
COUNT = 400
SCRIPT = f"""
import os, sys
from distributed import LocalCluster
from blocksim.study.sweep import sweep
from blocksim.scenario import Document

if __name__ == "__main__":
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as cluster:
        workers = [worker.process.pid for worker in cluster.workers.values()]

        def on_row(done, total, row):
            if done == 10 and "kill" in sys.argv:
                os.kill(workers[0], 9)

        document = Document.read("{SCENARIOS / "three_blocks_nonsmooth.toml"}").with_values({{"time.end": 0.1}})
        vary = {{"friction.block_ground": {{"from": 0.2, "to": 0.6, "count": {COUNT}}}}}
        sweep(document, vary, out=sys.argv[1], scheduler=cluster.scheduler_address, on_row=on_row)
"""


@pytest.fixture(scope="module")
def whole(quick: Document, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """Give the table of the default executor on one thread."""
    folder = tmp_path_factory.mktemp("whole")
    table = sweep(without_experiment(quick), VARY, out=folder, jobs=1).table
    assert table["status"].value_counts().to_dict() == {"failed": 8, "finished": 8, "invalid": 8}
    return (folder / "sweep.csv").read_bytes()


def without_experiment(document: Document) -> Document:
    """Leave the measured table out: it measures three blocks, and some cases have two."""
    data = {key: value for key, value in document.data.items() if key != "experiment"}
    return Document(data, document.source, document.folder, document.overrides)


@pytest.mark.parametrize(
    ("options", "most"),
    [
        ({"jobs": 3}, 1),
        ({"jobs": 2}, 7),
        ({"executor": "processes", "jobs": 2}, MOST),
        pytest.param({"keep_cases": True, "jobs": 2}, MOST, marks=pytest.mark.long),  # the same processes, with folders
    ],
)
def test_table_is_the_same_from_every_executor_in_batches_of_any_size(
    quick: Document,
    whole: bytes,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    options: dict[str, Any],
    most: int,
) -> None:
    monkeypatch.setattr(batches, "MOST", most)
    sweep(without_experiment(quick), SweepOptions(VARY, out=tmp_path, **options))
    assert (tmp_path / "sweep.csv").read_bytes() == whole


def test_shards_merged_in_any_order_are_the_same_table(quick: Document, whole: bytes, tmp_path: Path) -> None:
    for index in (2, 0, 1):
        result = sweep(without_experiment(quick), VARY, out=tmp_path, shard=Shard(index, 3))
        assert result.name == f"sweep-{index}-of-3.csv"
        assert len(result.table) == 8
    assert not (tmp_path / "sweep.csv").exists()
    merge(tmp_path)
    assert (tmp_path / "sweep.csv").read_bytes() == whole


@pytest.mark.parametrize("name", ["ensemble", "processes"])
def test_stopped_executor_begins_no_batch(quick: Document, name: str) -> None:
    made: list[int] = []

    def tasks() -> Iterator[Task]:
        for number in range(10):
            made.append(number)
            yield Task(number, str(number), {}, Model(quick))

    with load_executor(name).for_rounds() as run:
        assert list(run(tasks(), RunSetting(2, is_stopped=lambda: True))) == []
    assert len(made) <= 1


def test_ctrl_c_ends_the_workers_at_once(nominal: Document, tmp_path: Path) -> None:
    quick = nominal.with_values({"time.end": 0.01}).build()
    # of few frames: a run whose results may not fit on the disk is refused before it starts
    endless = nominal.with_values({"time.end": 1e5, "time.stop_at_rest": False, "output.every": 10.0}).build()
    scenarios = {"quick": quick, "a": endless, "b": endless}
    tasks = (Task(number, name, {}, Model(one)) for number, (name, one) in enumerate(scenarios.items()))
    with load_executor("processes").for_rounds() as run:
        batches = run(tasks, RunSetting(2, folder=tmp_path))
        assert next(batches).tasks[0].name == "quick"
        before = signal.signal(signal.SIGALRM, lambda *_: os.kill(os.getpid(), signal.SIGINT))
        signal.setitimer(signal.ITIMER_REAL, 0.2)
        try:
            with pytest.raises(KeyboardInterrupt):
                next(batches)
        finally:
            signal.signal(signal.SIGALRM, before)
        assert active_children() == []


def test_unreachable_scheduler_is_reported_before_anything_is_written(
    quick: Document, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """So is a missing package."""
    monkeypatch.setattr("blocksim.study.executors.dask.PATIENCE", 0.2)
    for told in (r"no Dask scheduler answers at tcp://127\.0\.0\.1:1 ", r"pip install 'blocksim\[cluster\]'"):
        with pytest.raises(UnavailableError, match=told):
            sweep(quick, {KINETIC: [0.1]}, out=tmp_path / "out", scheduler="tcp://127.0.0.1:1")
        monkeypatch.setitem(sys.modules, "distributed", None)
    assert list(tmp_path.iterdir()) == []


def test_batch_grows_with_the_speed_and_never_without_bounds() -> None:
    size = BatchSize(2, least=2)
    size.adapt(2, 0.25)
    assert size.count == 4
    size.adapt(4, 1e-9)
    assert size.count == 4 * GROWTH
    for _ in range(20):
        size.adapt(size.count, 1e-9)
    assert size.count == MOST
    size.adapt(MOST, 1e9)
    assert size.count == 2


def test_a_script_without_a_main_guard_is_told_so_whatever_study_it_begins(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(current_process(), "_inheriting", True, raising=False)  # as in a worker that imports the script
    with pytest.raises(
        InvalidInputError, match=r'^worker processes import this script: .* below if __name__ == "__main'
    ):
        Execution(executor="processes").ready()


@pytest.mark.long
@pytest.mark.parametrize("kill", [(), ("kill",)])
def test_cluster_gives_the_same_table_also_when_a_worker_dies(tmp_path: Path, kill: tuple[str, ...]) -> None:
    document = Document.read(SCENARIOS / "three_blocks_nonsmooth.toml").with_values({"time.end": 0.1})
    sweep(document, {"friction.block_ground": {"from": 0.2, "to": 0.6, "count": COUNT}}, out=tmp_path / "here")
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    ended = subprocess.run(
        [sys.executable, str(script), str(tmp_path / "cluster"), *kill], check=False, capture_output=True, text=True
    )
    assert ended.returncode == 0, ended.stderr
    assert (tmp_path / "cluster" / "manifest.jsonl").read_text().count("\n") == COUNT
    assert (tmp_path / "cluster" / "sweep.csv").read_bytes() == (tmp_path / "here" / "sweep.csv").read_bytes()


FRICTION = "friction.block_ground"


@pytest.fixture(scope="module")
def slide() -> Document:
    return Document.read(SCENARIOS / "slide.toml").with_values({"contact.stiffness_scale": 0.001, "time.end": 0.05})


def test_members_end_as_runs_of_their_own_whatever_fails_beside_them(slide: Document) -> None:
    values: list[dict[str, object]] = [
        {FRICTION: 0.3},
        {"bodies.0.y": "11 mm"},  # inside the ground
        {"contact.max_overlap": "1e-12 m"},  # fails on the way
        {"time.step": "1 s"},  # cannot be started
        {FRICTION: 0.4},
    ]
    members = list(run_members(slide, values))
    assert [bool(member.problem) for member in members] == [False, True, True, True, False]
    ends = [simulate(slide.with_values(values[i]).build()).columns for i in (0, 4)]
    assert [member.final for member in members] == [ends[0], None, None, None, ends[1]]


def test_blocks_that_settled_have_moved_from_where_they_settled_together_and_in_folders(
    slide: Document, tmp_path: Path
) -> None:
    soft = {"contact.stiffness_scale": 3e-7, "start.settle": True, "bodies.0.velocity": [0.0, 0.0]}
    scenario = slide.with_values({**soft, "ground.tilt": "5 deg"}).build()
    (row,) = rows_of([Model(scenario)], 1, peaks=True)
    assert row["outcome"] == "stands"
    assert abs(float(str(row["displacement_mm"]))) < 1e-3
    assert abs(float(str(row["turn_deg"]))) < 1e-3
    assert 12.5 - float(str(row["block.y_mm"])) > 0.01 * 25.0  # that far a block has moved
    assert run_case(Model(scenario), tmp_path / "case") == row
    assert run_case(Model(scenario), tmp_path / "case") == row  # as the folder has it


@pytest.mark.parametrize("lost", [None, "run.h5", "checkpoint.0"])
def test_interrupted_case_continues_where_it_can(
    nominal: Document, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, lost: str | None
) -> None:
    monkeypatch.setattr("blocksim.simulation.interruption.WallTime.check", lambda _: None)  # it comes later
    scenario = nominal.with_values({"time.end": 0.01}).build()
    whole = run_case(Model(scenario), tmp_path / "whole")
    stopped = run(scenario, out=tmp_path / "case", precautions=CheckpointPolicy(wall_time=0.0))
    assert stopped.status == "interrupted"
    if lost is not None:
        (tmp_path / "case" / lost).unlink()
    assert run_case(Model(scenario), tmp_path / "case") == whole
    parts = read_summary(tmp_path / "case" / files.SUMMARY).resumed_from
    assert parts == (() if lost else (stopped.summary.steps,))
    ends = [(tmp_path / name / files.FINAL).read_bytes() for name in ("whole", "case")]
    assert ends[0] == ends[1]

"""A pool ends with whoever started it, and survives the death of a worker."""

import os
import signal
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import active_children
from pathlib import Path

import pytest

from blocksim.scenario import Document
from blocksim.simulation import folder as files
from blocksim.simulation.checkpoint_policy import CheckpointPolicy
from blocksim.simulation.summary import read_summary
from blocksim.study.executors.ensemble import run_case
from blocksim.study.executors.processes import _outcome, run_all
from blocksim.study.run import run


def test_dead_worker_fails_its_case_and_says_what_to_do() -> None:
    future: Future[dict[str, object]] = Future()
    future.set_exception(BrokenProcessPool())
    row = _outcome(future)
    assert row["status"] == "failed"
    assert "rerun the command to repeat this case" in str(row["reason"])


@pytest.mark.parametrize("lost", [None, "run.h5", "checkpoint.0"])
def test_interrupted_case_continues_where_it_can(nominal: Document, tmp_path: Path, lost: str | None) -> None:
    scenario = nominal.with_values({"time.end": 0.01}).build()
    whole = run_case(scenario, tmp_path / "whole")
    stopped = run(scenario, out=tmp_path / "case", precautions=CheckpointPolicy(wall_time=0.0))
    assert stopped.status == "interrupted"
    if lost is not None:
        (tmp_path / "case" / lost).unlink()
    assert run_case(scenario, tmp_path / "case") == whole
    parts = read_summary(tmp_path / "case" / files.SUMMARY).resumed_from
    assert parts == (() if lost else (stopped.summary.steps,))
    ends = [(tmp_path / name / files.FINAL).read_bytes() for name in ("whole", "case")]
    assert ends[0] == ends[1]


def test_finished_case_whose_frames_were_cut_is_run_again(nominal: Document, tmp_path: Path) -> None:
    scenario = nominal.with_values({"time.end": 0.01}).build()
    row = run_case(scenario, tmp_path)
    frames = (tmp_path / files.FRAMES).read_bytes()
    os.truncate(tmp_path / files.FRAMES, len(frames) // 2)
    assert run_case(scenario, tmp_path) == row
    assert (tmp_path / files.FRAMES).read_bytes() == frames


def test_ctrl_c_ends_the_workers_at_once(nominal: Document, tmp_path: Path) -> None:
    quick = nominal.with_values({"time.end": 0.01}).build()
    endless = nominal.with_values({"time.end": 1e5, "time.stop_at_rest": False}).build()
    tasks = {tmp_path / "quick": quick, tmp_path / "a": endless, tmp_path / "b": endless}
    rows = run_all(tasks, jobs=2)
    assert next(rows)[0] == tmp_path / "quick"
    before = signal.signal(signal.SIGALRM, lambda *_: os.kill(os.getpid(), signal.SIGINT))
    signal.setitimer(signal.ITIMER_REAL, 0.5)
    try:
        with pytest.raises(KeyboardInterrupt):
            next(rows)
    finally:
        signal.signal(signal.SIGALRM, before)
    assert active_children() == []

"""A pool ends with whoever started it."""

import os
import signal
from multiprocessing import active_children
from pathlib import Path

import pytest

from blocksim.scenario import Document
from blocksim.study.executors import RunSetting, Task
from blocksim.study.executors.processes import for_rounds


def test_ctrl_c_ends_the_workers_at_once(nominal: Document, tmp_path: Path) -> None:
    quick = nominal.with_values({"time.end": 0.01}).build()
    # of few frames: a run whose results may not fit on the disk is refused before it starts
    endless = nominal.with_values({"time.end": 1e5, "time.stop_at_rest": False, "output.every": 10.0}).build()
    scenarios = {"quick": quick, "a": endless, "b": endless}
    tasks = (Task(number, name, {}, one) for number, (name, one) in enumerate(scenarios.items()))
    with for_rounds() as run:
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

"""What runs the cases of a sweep. A new executor is one module with `for_rounds`, and one line here."""

import os
import time
from collections.abc import Callable, Generator, Iterator
from contextlib import AbstractContextManager
from dataclasses import KW_ONLY, dataclass
from importlib import import_module
from itertools import takewhile
from multiprocessing import current_process
from pathlib import Path
from typing import Annotated, Any, NamedTuple

from blocksim.errors import InvalidInputError
from blocksim.options import Option, silent
from blocksim.scenario import Model, spelling
from blocksim.study.rows import Row

SECONDS = 0.5  # of work in a batch
MOST = 512  # tasks, so that memory does not depend on how quick they are
GROWTH = 4  # at most, from one batch to the next: the first members may be quicker than the others
EXECUTORS = {
    "ensemble": "blocksim.study.executors.ensemble",
    "processes": "blocksim.study.executors.processes",
    "dask": "blocksim.study.executors.dask",
}
DEFAULT = "ensemble"
WITH_FOLDERS = "processes"
WITH_SCHEDULER = "dask"


class Task(NamedTuple):
    """One case to be run: its number, the name of its run, its varied values."""

    number: int
    name: str
    settings: dict[str, object]
    model: Model


@dataclass(frozen=True)
class Batch:
    """Tasks that have ended together, their rows in the same order, the wall time (s) they took, and where."""

    tasks: tuple[Task, ...]
    rows: tuple[Row, ...]
    seconds: float
    host: str


@dataclass(frozen=True)
class RunSetting:
    """How tasks are to be run; `is_stopped` returns True once the user wants to stop."""

    jobs: int  # threads or processes
    executor: str = DEFAULT
    scheduler: str | None = None  # address of a Dask cluster
    folder: Path | None = None  # where folders of runs are kept
    peaks: bool = False  # whether rows need the largest rotation on the way
    is_stopped: Callable[[], bool] = lambda: False


Run = Callable[[Iterator[Task], RunSetting], Generator[Batch, None, None]]
"""Take tasks one by one, as many as are needed to keep busy, and yield them in batches, in any order.

A task that fails has a row that says so. Once `is_stopped`, no batch is begun, and what has not ended within a second
is given up. Closed before the end, it stops at once.
"""
Rounds = Callable[[], AbstractContextManager[Run]]
"""Give what runs one round of tasks after the other, on the same processes."""


@dataclass
class BatchSize:
    """How many tasks make a batch, from how long the last ones took. Rows do not depend on it."""

    count: int = 1
    least: int = 1

    def adapt(self, count: int, seconds: float) -> None:
        """Go by a batch of `count` tasks that took so long (s of wall time)."""
        wanted = count * SECONDS / max(seconds, 1e-6)
        self.count = int(min(max(wanted, self.least), GROWTH * self.count, MOST))


def take(tasks: Iterator[Task], count: int, is_stopped: Callable[[], bool]) -> tuple[Task, ...]:
    """Take up to `count` tasks; their models are made now, so it gives up after a batch's time or when stopped."""
    latest = time.monotonic() + SECONDS
    numbers = takewhile(lambda _: not is_stopped() and time.monotonic() < latest, range(count))
    return tuple(task for _, task in zip(numbers, tasks, strict=False))


def load_executor(name: str) -> Any:
    """Return the module of an executor, with `for_rounds`. Raises InvalidInputError.

    It may have `check`, which raises UnavailableError where it cannot run, before anything is written.
    """
    if name not in EXECUTORS:
        raise InvalidInputError(f"unknown executor '{name}', {spelling.did_you_mean_or_list(name, EXECUTORS)}")
    return import_module(EXECUTORS[name])


@dataclass(frozen=True)
class Execution:
    """Options of every study: how its runs are executed, which does not change its answer."""

    _: KW_ONLY
    executor: Annotated[
        str | None,
        Option(
            "ensemble: in this process (default); processes: a case that crashes stops no other.",
            choices=tuple(EXECUTORS),
        ),
    ] = None
    jobs: Annotated[int | None, Option("Threads or processes (default: one per core).", metavar="N", least=1)] = None
    scheduler: Annotated[
        str | None, Option("Scheduler of a Dask cluster, such as tcp://host:8786.", metavar="ADDRESS")
    ] = None

    def ready(self, folder: Path | None = None, /) -> tuple[Rounds, RunSetting]:
        """Return what runs tasks, into folders where one for all is given, and its setting.

        Raises InvalidInputError where options contradict one another, UnavailableError.
        """
        executor, scheduler, keeps = self.executor, self.scheduler, folder is not None
        needed = WITH_SCHEDULER if scheduler is not None else WITH_FOLDERS if keeps else executor or DEFAULT
        if keeps and WITH_SCHEDULER in {needed, executor}:
            raise InvalidInputError("folders of cases are kept on this machine only, not with a scheduler")
        if executor is not None and executor != needed:
            why = "a scheduler" if scheduler is not None else "keeping the folders of cases"
            load_executor(executor)
            raise InvalidInputError(f"{why} needs the executor {needed}, not {executor}")
        if needed == WITH_SCHEDULER and scheduler is None:
            raise InvalidInputError("the executor dask needs the address of a scheduler: --scheduler tcp://HOST:PORT")
        if needed == WITH_FOLDERS and getattr(current_process(), "_inheriting", False):  # the script has no main guard
            message = 'worker processes import this script: what starts them belongs below if __name__ == "__main__":'
            raise InvalidInputError(message)
        runner, setting = load_executor(needed), RunSetting(self.jobs or os.cpu_count() or 1, needed, scheduler, folder)
        getattr(runner, "check", silent)(setting)
        return runner.for_rounds, setting

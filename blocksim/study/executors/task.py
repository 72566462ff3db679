"""What an executor is given and what it gives back."""

from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from blocksim.scenario import Scenario
from blocksim.study.rows import Row


class Task(NamedTuple):
    """One case to be run: its number, the name of its run, its varied values."""

    number: int
    name: str
    settings: dict[str, object]
    scenario: Scenario


@dataclass(frozen=True)
class Batch:
    """Tasks that have ended together, their rows in the same order, the wall time (s) they took, and where."""

    tasks: tuple[Task, ...]
    rows: tuple[Row, ...]
    seconds: float
    host: str


@dataclass(frozen=True)
class Setting:
    """How tasks are to be run; `is_stopped` tells whether the user wants to stop."""

    jobs: int  # threads or processes
    is_stopped: Callable[[], bool] = lambda: False
    scheduler: str | None = None  # address of a Dask cluster
    folder: Path | None = None  # where folders of runs are kept

    def folder_of(self, task: Task) -> Path | None:
        """Return where a run is kept, None where it is not."""
        return None if self.folder is None else self.folder / task.name


def needs_nothing(_: Setting) -> None:
    """Check nothing: this executor is always there."""


Run = Callable[[Iterator[Task], Setting], Generator[Batch, None, None]]
"""Take tasks one by one, as many as are needed to keep busy, and yield them in batches, in any order.

A task that fails has a row that says so. Once `is_stopped`, no batch is begun, and what has not ended within a second
is given up. Closed before the end, it stops at once.
"""


class Executor(NamedTuple):
    """What runs tasks; `check` raises UnavailableError where it cannot, before anything is written."""

    run: Run
    check: Callable[[Setting], None]

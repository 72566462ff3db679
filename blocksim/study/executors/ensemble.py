"""Tasks advanced together in compiled code, on all cores of this process: the default.

The next batch is made while the steps of one are under way. A batch has a thread of its own, so that a Ctrl-C is heard
at once, also where a single case takes minutes.
"""

import platform
import threading
import time
from collections.abc import Generator, Iterator, Sequence

from blocksim.scenario import Scenario
from blocksim.simulation import MemberEnd, MemberFailure, run_in_batches
from blocksim.study.executors.batches import BatchSize, take
from blocksim.study.executors.task import Batch, Setting, Task, needs_nothing
from blocksim.study.rows import Course, Row, row_of, row_of_error

PATIENCE = 0.7  # s that a batch has to end once the user wants to stop
POLL = 0.05  # s
THREAD = "blocksim-batch"


check = needs_nothing


def run_tasks(tasks: Iterator[Task], setting: Setting) -> Generator[Batch, None, None]:
    """Run batches one after the other."""
    size = BatchSize(2 * setting.jobs, least=setting.jobs)
    batch = take(tasks, size.count, setting.is_stopped)
    while batch and not setting.is_stopped():
        began = time.monotonic()
        running = Running(batch, setting.jobs)
        following = take(tasks, size.count, setting.is_stopped)
        if not running.wait(setting):
            return
        size.measured(len(batch), time.monotonic() - began)
        yield running.ended()
        batch = following


class Running:
    """A batch that is under way."""

    def __init__(self, tasks: tuple[Task, ...], threads: int) -> None:
        """Begin."""
        self.tasks, self.threads = tasks, threads
        self.rows: list[Row] = []
        self.seconds = 0.0
        self._thread = threading.Thread(target=self._run, name=THREAD, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        began = time.perf_counter()
        self.rows = rows_of([task.scenario for task in self.tasks], self.threads)
        self.seconds = time.perf_counter() - began

    def wait(self, setting: Setting) -> bool:
        """Wait for the end; False when the user did not want to wait that long."""
        while self._thread.is_alive() and not setting.is_stopped():
            self._thread.join(POLL)
        self._thread.join(PATIENCE)
        return not self._thread.is_alive()

    def ended(self) -> Batch:
        """Return what has come of the batch."""
        return Batch(self.tasks, tuple(self.rows), self.seconds, platform.node())


def is_still_running() -> bool:
    """Return True if steps are under way that nobody waits for; only the end of the process stops them."""
    return any(thread.name == THREAD for thread in threading.enumerate())


def rows_of(scenarios: Sequence[Scenario], threads: int) -> list[Row]:
    """Return the row of every scenario; one that ends in an error of ours fails alone, found by halving."""
    if not scenarios:
        return []
    try:
        return [_row_of(one) for batch in run_in_batches(scenarios, threads=threads) for one in batch]
    except Exception as error:  # noqa: BLE001 - one broken case must not end the others
        if len(scenarios) == 1:
            return [row_of_error(error)]
    middle = len(scenarios) // 2
    return rows_of(scenarios[:middle], threads) + rows_of(scenarios[middle:], threads)


def _row_of(member: MemberEnd | MemberFailure) -> Row:
    """Return the row of a member."""
    if isinstance(member, MemberFailure):
        return row_of_error(member.error)
    course = Course(member.outcome.status, member.outcome.reason, member.seconds, member.first_move)
    return row_of(course, member.columns, member.placed)

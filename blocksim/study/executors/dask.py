"""Tasks on the workers of a Dask cluster that is there already, by the address of its scheduler.

A worker runs a batch on one thread; how many batches it runs at a time is its own number of threads. What a worker had
that dies is run by another one: Dask sees to that.
"""

import logging
import queue
import time
from collections import deque
from collections.abc import Generator, Iterator
from contextlib import contextmanager, nullcontext, suppress
from functools import partial
from typing import Any

from blocksim.errors import InvalidInputError, UnavailableError
from blocksim.extras import CLUSTER, load_module
from blocksim.simulation.provenance import code_hash
from blocksim.study.executors import Batch, BatchSize, RunSetting, Task, ensemble, take
from blocksim.study.rows import row_of_error

PATIENCE = 3.0  # s until a scheduler has answered
AHEAD = 2  # batches a thread of a worker
POLL = 0.1  # s
TALKERS = {"asyncio", "dask", "distributed", "tornado"}
COUNT_EVERY = 2.0  # s between two examines how many workers there are


def run_tasks(tasks: Iterator[Task], setting: RunSetting) -> Generator[Batch, None, None]:
    """Run batches on the workers of `setting.scheduler`; on leaving, what is under way is called off."""
    with dask_client(setting.scheduler or "") as client:
        yield from Submission(client, tasks, setting).batches()


for_rounds = partial(nullcontext, run_tasks)


def check(setting: RunSetting) -> None:
    """Check that the scheduler answers, before anything is written. Raises what `connected` raises."""
    with dask_client(setting.scheduler or ""):
        pass


@contextmanager
def dask_client(address: str) -> Iterator[Any]:
    """Give a client of a scheduler. Raises UnavailableError where there is no package, or no answer."""
    distributed = load_module("distributed", "--scheduler", CLUSTER)  # here: a second that other executors do not pay
    with silence():
        try:
            client = distributed.Client(address, timeout=PATIENCE, set_as_default=False)
        except Exception as error:  # noqa: BLE001 - whatever answers there, or does not, is no scheduler
            raise UnavailableError(
                f"no Dask scheduler answers at {address} ({type(error).__name__}); start one or correct --scheduler"
            ) from None
        try:
            yield client
        finally:
            with suppress(OSError, TimeoutError):  # of a scheduler that has gone
                client.close(timeout=PATIENCE)


@contextmanager
def silence() -> Iterator[None]:
    """Keep the loggers of Dask, and of what it is made of, quiet: a lost scheduler is reported in one line, by us.

    Each of them has a level and a handler of its own, so that none can be silenced through its parent.
    """
    names = (name for name in logging.root.manager.loggerDict if name.partition(".")[0] in TALKERS)
    loud = [logger for logger in map(logging.getLogger, names) if not logger.disabled]
    for logger in loud:
        logger.disabled = True
    try:
        yield
    finally:
        for logger in loud:
            logger.disabled = False


class Submission:
    """Batches that are with the cluster, as many as keep its workers busy."""

    def __init__(self, client: Any, tasks: Iterator[Task], setting: RunSetting) -> None:
        """Submit nothing yet."""
        self.client, self.tasks, self.setting = client, tasks, setting
        self.size = BatchSize()
        self.pending: dict[str, tuple[Any, tuple[Task, ...]]] = {}
        self.ended: queue.SimpleQueue[str] = queue.SimpleQueue()
        self.again: deque[tuple[Task, ...]] = deque()
        self.room = AHEAD
        self.counted_at = -COUNT_EVERY
        gone = f"the Dask scheduler at {setting.scheduler} is gone; rerun the command to finish"
        self.scheduler_gone = UnavailableError(gone)

    def batches(self) -> Iterator[Batch]:
        """Yield batches as they end, until there are no more or the user wants to stop."""
        while not self.setting.is_stopped():
            self._fill()
            if not self.pending and not self.again:
                return
            try:
                key = self.ended.get(timeout=POLL)
            except queue.Empty:
                if self.client.status not in {"running", "connecting"}:
                    raise self.scheduler_gone from None
            else:
                yield from self._gathered(*self.pending.pop(key))

    def _fill(self) -> None:
        if time.monotonic() - self.counted_at > COUNT_EVERY:
            try:  # how many batches the workers run at a time, all together
                self.room = AHEAD * max(1, sum(self.client.nthreads().values()))
            except (OSError, TimeoutError):
                raise self.scheduler_gone from None
            self.counted_at = time.monotonic()
        while len(self.pending) < self.room:
            tasks = self.again.popleft() if self.again else take(self.tasks, self.size.count, self.setting.is_stopped)
            if not tasks:
                return
            models, peaks = [task.model for task in tasks], self.setting.peaks
            future = self.client.submit(ensemble.run_batch, models, (), code_hash(), peaks=peaks, pure=False)
            self._await(future, tasks)

    def _await(self, future: Any, tasks: tuple[Task, ...]) -> None:
        self.pending[future.key] = (future, tasks)
        future.add_done_callback(lambda ended: self.ended.put(ended.key))

    def _gathered(self, future: Any, tasks: tuple[Task, ...]) -> Iterator[Batch]:
        """Yield a batch that has ended, unless it has to be run again."""
        if future.status == "cancelled":
            raise self.scheduler_gone
        try:
            rows, seconds, host = future.result(timeout=1.0)  # s until the rows of a batch that has ended are here
        except InvalidInputError:
            raise
        except TimeoutError:  # the worker that had the rows has died: another one is at it
            self._await(future, tasks)
        except Exception as error:  # noqa: BLE001 - workers that died of a batch, one after the other
            if len(tasks) > 1:
                self.again.extend((task,) for task in tasks)
            else:
                reason = f"no worker finished it ({type(error).__name__}); --retry-failed runs it again"
                yield Batch(tasks, ({**row_of_error(error), "reason": reason},), 0.0, "")
        else:
            self.size.adapt(len(tasks), seconds)
            yield Batch(tasks, rows, seconds, host)

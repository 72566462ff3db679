"""Tasks on spawned processes of this machine: a case that takes the memory of all others ends its process only.

The only executor that can keep whole runs, in folders of their own.
"""

import os
import signal
import threading
from collections import deque
from collections.abc import Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, contextmanager, suppress
from multiprocessing import active_children, get_context, parent_process, resource_tracker
from typing import Any, NamedTuple

from blocksim.simulation import interruption, provenance
from blocksim.study.executors import Batch, BatchSize, Run, RunSetting, Task, ensemble, take
from blocksim.study.rows import Row

AHEAD = 2  # batches a process: it need not wait for the next one
POLL = 0.05  # s
SAFE_PATH = "PYTHONSAFEPATH"
DEAD: Row = {
    "status": "failed",
    "reason": "its worker process has died twice (out of memory?); --retry-failed runs it again",
    "seconds": 0.0,
}


@contextmanager
def pool_of(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Give a pool that ends at once when something goes wrong here: what is cut off is run again next time."""
    others = set(active_children())
    with _safe_start():  # Python counts semaphores in a process that has to outlive what a terminal sends to all
        resource_tracker.ensure_running()
    # spawned, not forked: threads of numerical libraries do not survive a fork
    pool = _Pool(workers, mp_context=get_context("spawn"), initializer=_start_worker)
    try:
        yield pool
    except BaseException:
        for process in set(active_children()) - others:
            process.kill()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


class _Pool(ProcessPoolExecutor):
    """A pool whose processes never see what a terminal sends to all: they would be stopped while they import."""

    def submit(self, *task: Any, **named: Any) -> Future[Any]:
        """Submit a task; this is where processes are started."""
        with _safe_start():
            return super().submit(*task, **named)


@contextmanager
def _safe_start() -> Iterator[None]:
    """Keep from processes that are started meanwhile what a terminal sends to all, and modules of the current folder.

    Python starts them with `-c`, which looks for modules in that folder first, before it has the paths of this process.
    """
    before, safe = os.environ.get(SAFE_PATH), hasattr(signal, "pthread_sigmask")
    held = signal.pthread_sigmask(signal.SIG_BLOCK, interruption.FOR_ALL) if safe else None
    os.environ[SAFE_PATH] = "1"
    try:
        yield
    finally:
        del os.environ[SAFE_PATH]
        if before is not None:
            os.environ[SAFE_PATH] = before
        if held is not None:
            signal.pthread_sigmask(signal.SIG_SETMASK, held)


def _start_worker() -> None:
    """Leave to the parent what a terminal sends to all processes, and end with it."""
    for number in interruption.FOR_ALL:
        signal.signal(number, signal.SIG_IGN)

    def end_with_parent() -> None:
        if (parent := parent_process()) is not None:
            parent.join()
        os._exit(0)

    threading.Thread(target=end_with_parent, daemon=True).start()


class Job(NamedTuple):
    """Tasks that go to a process together; `is_suspect` where a process has died that had them."""

    tasks: tuple[Task, ...]
    is_suspect: bool = False


class StoppedError(Exception):
    """The user wants to stop: the pool has to end at once."""


class LastingPool:
    """A pool for several rounds of tasks: starting its processes takes longer than most rounds."""

    def __init__(self, ended: ExitStack) -> None:
        """Start nothing yet; what is started ends with a stack."""
        self._ended = ended
        self._pool: ProcessPoolExecutor | None = None

    @contextmanager
    def of(self, workers: int) -> Iterator[ProcessPoolExecutor]:
        """Give the pool; one that something goes wrong in ends at once, and the next round has a new one."""
        if self._pool is None:
            self._pool = self._ended.enter_context(pool_of(workers))
        try:
            yield self._pool
        except BaseException as error:
            self._pool = None
            self._ended.__exit__(type(error), error, error.__traceback__)
            raise

    def run(self, tasks: Iterator[Task], setting: RunSetting) -> Generator[Batch, None, None]:
        """Run batches on `setting.jobs` processes, each on one thread; a pool that dies is replaced by a new one."""
        rows: dict[str, Row | None] = {}  # by run
        later: list[Task] = []

        def first_of_each() -> Iterator[Task]:
            """Yield the first task of every run: "10 mm" and 0.01 come to one, and its folder has one writer."""
            for task in tasks:
                if task.name in rows:
                    later.append(task)
                else:
                    rows[task.name] = None
                    yield task

        work = Work(tasks if setting.folder is None else first_of_each(), setting)
        with suppress(StoppedError):
            while not work.is_done:
                with suppress(BrokenProcessPool), self.of(setting.jobs) as pool:
                    for batch in work.run_on(pool):
                        if setting.folder is not None:
                            rows |= zip((task.name for task in batch.tasks), batch.rows, strict=True)
                        yield batch
                yield from work.after_death()
            if later:
                yield Batch(tuple(later), tuple(rows[task.name] or DEAD for task in later), 0.0, "")


@contextmanager
def for_rounds() -> Iterator[Run]:
    """Give what runs the tasks of each round, and end the processes."""
    with ExitStack() as ended:
        yield LastingPool(ended).run


def run_here(tasks: Iterable[Task], setting: RunSetting) -> Generator[Batch, None, None]:
    """Run tasks one after the other in this process, as a worker does. Raises KeyboardInterrupt on Ctrl-C."""
    for task in tasks:
        folders = [] if setting.folder is None else [setting.folder / task.name]
        yield Batch((task,), *ensemble.run_batch([task.model], folders, provenance.code_hash(), peaks=setting.peaks))


class Work:
    """Tasks that are still to be run, and those that are under way."""

    def __init__(self, tasks: Iterator[Task], setting: RunSetting) -> None:
        """Begin nothing yet."""
        self.tasks, self.setting = tasks, setting
        self.size = BatchSize()
        self.pending: dict[Future[ensemble.BatchResult], Job] = {}
        self.suspects: deque[Job] = deque()
        self.is_done = False

    def run_on(self, pool: ProcessPoolExecutor) -> Iterator[Batch]:
        """Run until nothing is left. Raises BrokenProcessPool where a process dies, and StoppedError."""
        peaks, place, code = self.setting.peaks, self.setting.folder, provenance.code_hash()
        while True:
            while (job := self._next()) is not None:
                models = [task.model for task in job.tasks]
                folders = [] if place is None else [place / task.name for task in job.tasks]
                try:
                    self.pending[pool.submit(ensemble.run_batch, models, folders, code, peaks=peaks)] = job
                except BrokenProcessPool:  # it died before it got the job
                    self.suspects.append(job)
                    raise
            if self.setting.is_stopped():
                raise StoppedError
            if not self.pending:
                self.is_done = True
                return
            for future in wait(self.pending, POLL, FIRST_COMPLETED).done:
                yield self._ended(future)

    def _next(self) -> Job | None:
        """Return what to begin now; suspects run alone, so that it shows which of them it is."""
        if self.suspects:
            return None if self.pending else self.suspects.popleft()
        alone = any(job.is_suspect for job in self.pending.values())
        if alone or len(self.pending) >= AHEAD * self.setting.jobs:
            return None
        tasks = take(self.tasks, self.size.count, self.setting.is_stopped)
        return Job(tasks) if tasks else None

    def _ended(self, future: Future[ensemble.BatchResult]) -> Batch:
        rows, seconds, host = future.result()
        tasks = self.pending.pop(future).tasks
        self.size.adapt(len(tasks), seconds)
        return Batch(tasks, rows, seconds, host)

    def after_death(self) -> Iterator[Batch]:
        """Yield what ended beside the dead, and what has now died twice; put the rest back, one by one."""
        for future, job in list(self.pending.items()):
            if future.done() and not future.cancelled() and future.exception() is None:
                yield self._ended(future)
            elif job.is_suspect:
                yield Batch(job.tasks, (DEAD,) * len(job.tasks), 0.0, "")
            else:
                self.suspects.extend(Job((task,), is_suspect=True) for task in job.tasks)
        self.pending.clear()

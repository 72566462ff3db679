"""The cases of a sweep on their way through an executor into the manifest and the table."""

from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass, field
from typing import NamedTuple

from blocksim.errors import StoppedEarlyError, UnavailableError
from blocksim.simulation.stopping import stop_requests
from blocksim.study.done import Done
from blocksim.study.executors.task import Batch, Run, Setting, Task
from blocksim.study.manifest import Entry, Manifest, values_hash
from blocksim.study.plan import Cases
from blocksim.study.rows import Row, invalid_row
from blocksim.study.shard import Shard
from blocksim.study.single import FINISHED
from blocksim.study.table import SweepTable
from blocksim.study.timings import Timings

MOST_INVALID = 500  # kept in memory before they are written
AGAIN = "rerun the command to finish"
OnRow = Callable[[int, int, Row], None]


class Ended(NamedTuple):
    """A case that has its row."""

    number: int
    name: str
    settings: dict[str, object]
    row: Row


@dataclass
class Sweeping:
    """One process's share of a sweep."""

    cases: Cases
    shard: Shard
    manifest: Manifest
    done: Done
    table: SweepTable
    timings: Timings
    on_row: OnRow
    invalid: list[Ended] = field(default_factory=list)

    def run(self, executor: Run, setting: Setting, *, fail_fast: bool) -> None:
        """Run what has no row yet. Raises StoppedEarlyError on Ctrl-C; what has ended by then is kept."""
        try:
            with stop_requests() as is_stopped:
                setting = Setting(setting.jobs, is_stopped, setting.scheduler, setting.folder)
                self._run(executor, setting, fail_fast=fail_fast)
                stopped = is_stopped()
        except KeyboardInterrupt:
            stopped = True
        except UnavailableError:
            self.table.write()
            raise
        self.table.write()
        if stopped and self.done.count(self.shard) < self.count:
            message = f"stopped with {self.done.count(self.shard)} of {self.count} cases done; {AGAIN}"
            raise StoppedEarlyError(message)

    @property
    def count(self) -> int:
        """How many cases there are in this share."""
        return len(self.done.state[self.shard.slice])

    def _run(self, executor: Run, setting: Setting, *, fail_fast: bool) -> None:
        # closed here and now: left to the garbage collector, workers would continue
        with closing(executor(self._tasks(), setting)) as batches:
            for batch in batches:
                has_failed = self._keep_batch(batch)
                self.table.write_now_and_then()
                if fail_fast and has_failed:
                    return
        self._keep_invalid()

    def _tasks(self) -> Iterator[Task]:
        """Make one task after the other; cases that cannot be run get their rows on the way."""
        for number in self.shard.numbers(len(self.cases)):
            if self.done.holds(number, self.cases.design[number]):
                continue
            case = self.cases[number]
            if case.scenario is not None:
                yield Task(number, case.name, case.settings, case.scenario)
                continue
            self.invalid.append(Ended(number, case.name, case.settings, invalid_row(case.problem)))
            if len(self.invalid) >= MOST_INVALID:
                self._keep_invalid()

    def _keep_batch(self, batch: Batch) -> bool:
        """Keep rows, and return whether one of them is of a case that failed."""
        ended = [
            Ended(task.number, task.name, task.settings, row) for task, row in zip(batch.tasks, batch.rows, strict=True)
        ]
        has_failed = bool(self.invalid) or any(one.row["status"] != FINISHED for one in ended)
        self._keep(ended)
        self._keep_invalid()
        self.timings.append((one.name for one in ended), batch.seconds, batch.host)
        return has_failed

    def _keep_invalid(self) -> None:
        ended, self.invalid = self.invalid, []
        self._keep(ended)

    def _keep(self, ended: list[Ended]) -> None:
        """Bring rows to the disk, and then tell of them."""
        if not ended:
            return
        entries = [Entry(one.number, one.name, values_hash(one.settings), one.row) for one in ended]
        for start, entry in zip(self.manifest.append(entries), entries, strict=True):
            self.done.note(self.manifest.path, start, entry)
        before = self.done.count(self.shard) - len(ended)
        for position, one in enumerate(ended, start=1):
            self.on_row(before + position, self.count, {"case": one.name, **one.settings, **one.row})

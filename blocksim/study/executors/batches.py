"""Batches of tasks: large enough to cost little apart from the steps, short enough to lose little at a kill."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import takewhile

from blocksim.study.executors.task import Task

SECONDS = 0.5  # of work in a batch
MOST = 512  # tasks, so that memory does not depend on how quick they are
GROWTH = 4  # at most, from one batch to the next: the first members may be quicker than the others


@dataclass
class BatchSize:
    """How many tasks make a batch, from how long the last ones took. Rows do not depend on it."""

    count: int = 1
    least: int = 1

    def measured(self, count: int, seconds: float) -> None:
        """Go by a batch of `count` tasks that took so long (s of wall time)."""
        wanted = count * SECONDS / max(seconds, 1e-6)
        self.count = int(min(max(wanted, self.least), GROWTH * self.count, MOST))


def take(tasks: Iterator[Task], count: int, is_stopped: Callable[[], bool]) -> tuple[Task, ...]:
    """Take up to `count` tasks; their scenarios are made now, so it gives up after a batch's time or when stopped."""
    latest = time.monotonic() + SECONDS
    numbers = takewhile(lambda _: not is_stopped() and time.monotonic() < latest, range(count))
    return tuple(task for _, task in zip(numbers, tasks, strict=False))

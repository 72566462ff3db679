"""Progress of a run or a study: a live line on a terminal, a plain line now and then elsewhere."""

import math
import os
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, TypeVar

from blocksim.cli.output import note
from blocksim.errors import StoppedEarlyError
from blocksim.options import silent

if TYPE_CHECKING:  # stored results are shown without the solver
    from rich.progress import Progress

    from blocksim.simulation import Progress as Where
    from blocksim.study.rows import Head, Row

T = TypeVar("T")
FEW = 40  # cases that get a line each
PLAIN_SECONDS = 2.0


def pace(seconds: float, since: float | None = None) -> Callable[[], bool]:
    """Return a function that returns True where more than so many seconds have passed since it last did.

    The first time counts from `since` (a monotonic time), by default from its first call.
    """
    last = since

    def is_due() -> bool:
        nonlocal last
        now = time.monotonic()
        is_over = now - (now if last is None else last) > seconds
        last = now if is_over or last is None else last
        return is_over

    return is_due


def is_on_terminal() -> bool:
    """Return True if somebody watches the notes."""
    return sys.stderr is not None and sys.stderr.isatty()


@contextmanager
def run_progress(*, quiet: bool) -> "Iterator[Callable[[Where], None]]":
    """Give a function that shows the progress of a run; on a terminal the line disappears at the end."""
    if quiet:
        yield silent
        return
    if not is_on_terminal():
        is_time = pace(PLAIN_SECONDS)

        def show_line(where: "Where") -> None:
            if not is_time():
                return
            done = f"{where.time:.3f} of at most {where.end:g} s simulated, {where.steps} steps"
            note(f"{done}, relative energy error {where.relative_residual:.0e}")

        yield show_line
        return
    rates = "{task.fields[speed]} steps/s, relative energy error {task.fields[residual]}"
    progress = _bar("{task.completed:.3f} of {task.total:g} s", rates)
    task = progress.add_task("", total=1.0, visible=False, speed="", residual="")
    is_due = pace(0.1, 0.0)
    began: tuple[float, int] | None = None  # time and steps when first shown: it compiles before, and may be resumed

    def show(where: "Where") -> None:
        nonlocal began
        if began is None:
            began = time.monotonic(), where.steps
            progress.start()
        if is_due():
            speed = f"{(where.steps - began[1]) / max(time.monotonic() - began[0], 1e-9):.1e}"
            residual = f"{where.relative_residual:.0e}"
            progress.update(task, completed=where.time, total=where.end, visible=True, speed=speed, residual=residual)

    try:
        yield show
    finally:
        if began is not None:
            with suppress(OSError):  # the terminal has gone, and so has its line
                progress.stop()


@contextmanager
def count_progress(what: str, *, quiet: bool) -> Iterator[Callable[[int, int], None]]:
    """Give a function that shows how many of all are done; on a terminal the line disappears at the end."""
    if quiet:
        yield silent
    elif is_on_terminal():
        with _bar("{task.completed} of {task.total} {task.description}") as progress:
            task = progress.add_task(what, total=1, visible=False)
            yield lambda done, total: progress.update(task, completed=done, total=total, visible=True)
    else:
        is_due = pace(PLAIN_SECONDS, time.monotonic())
        yield lambda done, total: note(f"{done} of {total} {what}") if is_due() else None


def _bar(first: str, *others: str) -> "Progress":
    """Return a live line: a text, a bar, other texts and the time that remains."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = TextColumn(first), BarColumn(bar_width=None), *map(TextColumn, others), TimeRemainingColumn()
    return Progress(*columns, console=Console(stderr=True), transient=True)


def one_by_one(items: Sequence[T], told: Callable[[T], str], *, quiet: bool) -> Iterator[T]:
    """Yield items that take long and report which one is under way."""
    for position, item in enumerate(items, start=1):
        if not quiet:
            note(f"{position}/{len(items)} {told(item)} ...")
        yield item


@contextmanager
def exit_on_stop() -> Iterator[None]:
    """End the process at once where a study is stopped early, without waiting for a case that takes minutes."""
    from blocksim.study.executors.ensemble import THREAD

    try:
        yield
    except StoppedEarlyError as error:
        if any(thread.name == THREAD for thread in threading.enumerate()):  # steps that nobody waits for
            note(str(error))
            os._exit(error.exit_code)
        raise


@contextmanager
def case_progress(heads: "Iterable[Head]", *, quiet: bool) -> "Iterator[Callable[[int, int, Row], None]]":
    """Give a function that takes every row of a study of these columns: a bar on a terminal, lines elsewhere.

    It reports each of a few cases with the values of the varied keys, and the pace of many.
    """
    if quiet:
        yield silent
        return
    if is_on_terminal():
        with count_progress("cases", quiet=False) as count:
            yield lambda done, total, _: count(done, total)
        return
    from blocksim.study.rows import FINISHED
    from blocksim.view.sweeps.data import short_names

    heads = list(heads)
    names = short_names([head.key for head in heads])
    began, new, failed = time.monotonic(), 0, 0
    is_due = pace(PLAIN_SECONDS, began)

    def show(done: int, total: int, row: "Row") -> None:
        nonlocal new, failed
        new += 1
        failed += row["status"] != FINISHED
        if total <= FEW:
            cells = (f"{cell_text(head.cell(row[head.key]))} {head.unit}".rstrip() for head in heads)
            values = ", ".join(f"{name} = {cell}" for name, cell in zip(names, cells, strict=True))
            note(f"{done}/{total} {row['status']}: {values}")
        elif is_due() or done == total:
            speed = new / max(time.monotonic() - began, 1e-9)
            left = f", {(total - done) / speed:.0f} s left" if done < total else ""
            failures = f", {failed} failed" if failed else ""
            note(f"{done}/{total} cases{failures}, {speed:.3g} a second{left}")

    yield show


def cell_text(value: object) -> str:
    """Return a cell of the table for people."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}" if math.isfinite(value) else "–"
    return str(value)

"""Progress of a run or a study: a live line on a terminal, a plain line now and then elsewhere."""

import math
import os
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, TypeVar

from rich.console import Console

from blocksim.cli.output import note
from blocksim.errors import StoppedEarlyError

if TYPE_CHECKING:  # stored results are shown without the solver
    from rich.progress import Progress

    from blocksim.simulation import Progress as Where
    from blocksim.study.rows import Head, Row

T = TypeVar("T")
FEW = 40  # cases that get a line each
PLAIN_SECONDS = 2.0
LIVE_SECONDS = 0.1


@contextmanager
def run_progress(*, quiet: bool) -> "Iterator[Callable[[Where], None]]":
    """Give a function that shows the progress of a run; on a terminal the line disappears at the end."""
    console = Console(stderr=True)
    if quiet or not console.is_terminal:
        yield (lambda _: None) if quiet else _plain_lines()
        return
    rates = "{task.fields[speed]} steps/s, relative energy error {task.fields[residual]}"
    progress = _bar(console, "{task.completed:.3f} of {task.total:g} s", rates)
    task = progress.add_task("", total=1.0, visible=False, speed="", residual="")
    began = shown_at = 0.0
    steps: int | None = None  # when first shown: compiling comes before, and a resumed run has done some

    def show(where: "Where") -> None:
        nonlocal began, shown_at, steps
        now = time.monotonic()
        if steps is None:
            began, steps = now, where.steps
            progress.start()
        if now - shown_at > LIVE_SECONDS:
            shown_at = now
            speed = f"{(where.steps - steps) / max(now - began, 1e-9):.1e}"
            residual = f"{where.relative_residual:.0e}"
            progress.update(task, completed=where.time, total=where.end, visible=True, speed=speed, residual=residual)

    try:
        yield show
    finally:
        if steps is not None:
            with suppress(OSError):  # the terminal has gone, and so has its line
                progress.stop()


@contextmanager
def count_progress(what: str, *, quiet: bool) -> Iterator[Callable[[int, int], None]]:
    """Give a function that shows how many of all are done; on a terminal the line disappears at the end."""
    console = Console(stderr=True)
    if quiet or not console.is_terminal:
        yield (lambda *_: None) if quiet else _plain_count(what)
        return
    with _bar(console, "{task.completed} of {task.total} {task.description}") as progress:
        task = progress.add_task(what, total=1, visible=False)
        yield lambda done, total: progress.update(task, completed=done, total=total, visible=True)


def _bar(console: Console, first: str, *others: str) -> "Progress":
    """Return a live line: a text, a bar, other texts and the time that remains."""
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    texts = map(TextColumn, others)
    bar = BarColumn(bar_width=None)
    return Progress(TextColumn(first), bar, *texts, TimeRemainingColumn(), console=console, transient=True)


def one_by_one(items: Sequence[T], told: Callable[[T], str], *, quiet: bool) -> Iterator[T]:
    """Yield items that take long and report which one is under way."""
    for position, item in enumerate(items, start=1):
        if not quiet:
            note(f"{position}/{len(items)} {told(item)} ...")
        yield item


def _plain_count(what: str) -> Callable[[int, int], None]:
    shown_at = time.monotonic()

    def show(done: int, total: int) -> None:
        nonlocal shown_at
        now = time.monotonic()
        if now - shown_at > PLAIN_SECONDS:
            shown_at = now
            note(f"{done} of {total} {what}")

    return show


def _plain_lines() -> "Callable[[Where], None]":
    shown_at: float | None = None

    def show(where: "Where") -> None:
        nonlocal shown_at
        now = time.monotonic()
        shown_at = now if shown_at is None else shown_at
        if now - shown_at > PLAIN_SECONDS:
            shown_at = now
            note(
                f"{where.time:.3f} of at most {where.end:g} s simulated, {where.steps} steps, "
                f"relative energy error {where.relative_residual:.0e}"
            )

    return show


@contextmanager
def exit_when_stopped() -> Iterator[None]:
    """End the process at once where a study is stopped early, without waiting for a case that takes minutes."""
    from blocksim.study.executors.ensemble import is_still_running

    try:
        yield
    except StoppedEarlyError as error:
        if is_still_running():
            note(str(error))
            os._exit(error.exit_code)
        raise


@contextmanager
def case_progress(heads: "Iterable[Head]", *, quiet: bool) -> "Iterator[Callable[[int, int, Row], None]]":
    """Give a function that takes every row of a study of these columns: a bar on a terminal, lines elsewhere."""
    if quiet:
        yield lambda *_: None
    elif Console(stderr=True).is_terminal:
        with count_progress("cases", quiet=False) as show:
            yield lambda done, total, _: show(done, total)
    else:
        yield _case_lines(list(heads))


def _case_lines(heads: "Sequence[Head]") -> "Callable[[int, int, Row], None]":
    """Return a function that reports each of a few cases with the values of the varied keys, and the pace of many."""
    from blocksim.study.rows import FINISHED
    from blocksim.view.sweeps.data import short_names

    names = short_names([head.key for head in heads])
    began = shown_at = time.monotonic()
    new = failed = 0

    def show(done: int, total: int, row: "Row") -> None:
        nonlocal shown_at, new, failed
        new += 1
        failed += row["status"] != FINISHED
        if total <= FEW:
            cells = (f"{cell_text(head.cell(row[head.key]))} {head.unit}".rstrip() for head in heads)
            values = ", ".join(f"{name} = {cell}" for name, cell in zip(names, cells, strict=True))
            note(f"{done}/{total} {row['status']}: {values}")
        elif done == total or time.monotonic() - shown_at > PLAIN_SECONDS:
            shown_at = time.monotonic()
            pace = new / max(shown_at - began, 1e-9)
            left = f", {(total - done) / pace:.0f} s left" if done < total else ""
            failures = f", {failed} failed" if failed else ""
            note(f"{done}/{total} cases{failures}, {pace:.3g} a second{left}")

    return show


def cell_text(value: object) -> str:
    """Return a cell of the table for people."""
    match value:
        case bool():
            return "yes" if value else "no"
        case float():
            return f"{value:.6g}" if math.isfinite(value) else "–"
        case _:
            return str(value)

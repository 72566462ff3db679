"""Progress of a sweep: a line for each case where they are few, else a line now and then."""

import math
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field

from rich.console import Console

from blocksim.cli.output import note
from blocksim.cli.progress import counting
from blocksim.study.rows import FINISHED, Head, Row

OnRow = Callable[[int, int, Row], None]
FEW = 40
EVERY = 2.0  # s


@contextmanager
def reporting(short: Mapping[str, str], heads: Mapping[str, Head], *, quiet: bool) -> Iterator[OnRow]:
    """Give a function that takes every row: a bar on a terminal, lines elsewhere."""
    if quiet or not Console(stderr=True).is_terminal:
        yield (lambda *_: None) if quiet else Reporter(short, heads).tell
        return
    with counting("cases", quiet=False) as show:
        yield lambda done, total, _: show(done, total)


@dataclass
class Reporter:
    """Reports rows as they come; `short` has the varied keys and their names for people."""

    short: Mapping[str, str]
    heads: Mapping[str, Head] = field(default_factory=dict)
    began: float = field(default_factory=time.monotonic)
    told_at: float = field(default_factory=time.monotonic)
    new: int = 0
    failed: int = 0

    def tell(self, done: int, total: int, row: Row) -> None:
        """Report a row, one of `done` so far."""
        self.new += 1
        self.failed += row["status"] != FINISHED
        if total <= FEW:
            values = ", ".join(f"{name} = {self._value(key, row[key])}" for key, name in self.short.items())
            note(f"{done}/{total} {row['status']}: {values}")
        elif done == total or time.monotonic() - self.told_at > EVERY:
            self._tell_pace(done, total)

    def _value(self, key: str, value: object) -> str:
        head = self.heads.get(key, Head(key))
        return f"{shown(head.cell(value))} {head.unit}".rstrip()

    def _tell_pace(self, done: int, total: int) -> None:
        self.told_at = time.monotonic()
        pace = self.new / max(self.told_at - self.began, 1e-9)
        left = f", {(total - done) / pace:.0f} s left" if done < total else ""
        failed = f", {self.failed} failed" if self.failed else ""
        note(f"{done}/{total} cases{failed}, {pace:.3g} a second{left}")


def shown(value: object) -> str:
    """Return a cell of the table for people."""
    match value:
        case bool():
            return "yes" if value else "no"
        case float():
            return f"{value:.6g}" if math.isfinite(value) else "–"
        case _:
            return str(value)

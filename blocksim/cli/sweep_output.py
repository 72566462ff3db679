"""What `blocksim sweep` shows: the estimate of --dry-run, cases as they end, and the table."""

import math
import os
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field

from rich.console import Console

from blocksim.cli.output import GAP, answer, duration, note, show, table_lines, width_of_screen
from blocksim.cli.progress import counting
from blocksim.errors import StoppedEarlyError
from blocksim.scenario import Document
from blocksim.simulation.movement import DISPLACEMENT, END_SPEED, FIRST_MOVED, FIRST_MOVER, MOVES_ON, OUTCOME, TURN
from blocksim.study.executors.ensemble import is_still_running
from blocksim.study.plan import Estimate, estimate
from blocksim.study.rows import FINISHED, Head, Row
from blocksim.study.sweep_table import SweepResult
from blocksim.view.sweeps.data import short_names as names_of_keys
from blocksim.world.free_memory import readable

OnRow = Callable[[int, int, Row], None]
FEW = 40
EVERY = 2.0  # s
MOST_ROWS = 40
MOST_FAILURES = 5
MOST_MOVERS = 3
NOT_SHOWN = {"case", "reason", "seconds", END_SPEED, MOVES_ON}
SHOWN_LAST = (DISPLACEMENT, TURN, FIRST_MOVER, FIRST_MOVED)
POSITION = ".x_mm"
NOT_SHOWN_ENDS = ("rotation_deg", "y_mm", "left_mm", "right_mm")


def show_estimate(document: Document, jobs: int | None, *, keep_cases: bool, as_json: bool) -> None:
    """Print count, cost and size of the sweep of a document. Raises what `estimate` raises."""
    found = estimate(document, keep_cases=keep_cases)
    cores = jobs or os.cpu_count() or 1
    show(_estimate_lines(found, cores), {**asdict(found), "jobs": cores}, as_json=as_json)
    for remark in () if as_json else found.remarks:
        note(remark)


def _estimate_lines(found: Estimate, cores: int) -> list[str]:
    until_rest = "; less if they stop at rest" if found.stop_at_rest else ""
    lines = [
        f"cases      {found.cases}",
        f"solving    at most about {duration(found.seconds / cores)} on {cores} {'core' if cores == 1 else 'cores'}",
        f"results    at most about {readable(found.bytes)}",
        f"memory     about {readable(found.memory)} for a process that runs one case",
        f"from the steps of {found.looked_at} cases at the measured speed{until_rest}",
    ]
    if found.impossible:
        lines.append(f"{found.impossible} of these {found.looked_at} cannot be simulated; the first: {found.reason}")
    return lines


@contextmanager
def leaving_unfinished_cases() -> Iterator[None]:
    """End the process at once where a study is stopped early, without waiting for a case that takes minutes."""
    try:
        yield
    except StoppedEarlyError as error:
        if is_still_running():
            note(str(error))
            os._exit(error.exit_code)
        raise


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


def short_names(keys: Sequence[str]) -> dict[str, str]:
    """Return keys by the names that they have in pictures."""
    return dict(zip(keys, names_of_keys(keys), strict=True))


def show_sweep(result: SweepResult, *, quiet: bool) -> None:
    """Print the columns that vary as far as they fit on the screen, outcomes, failures and what is left to do."""
    table, short = result.table, short_names(result.keys)
    told = [
        name for name in table.columns if name not in (*NOT_SHOWN, *SHOWN_LAST) and not name.endswith(NOT_SHOWN_ENDS)
    ]
    told += [name for name in SHOWN_LAST if name in table]
    names = [name for name in told if name in short or name == "inside" or _varies(table[name])]
    heads, rows, fitting = _texts(result, names, short)
    if fitting < sum(name not in SHOWN_LAST for name in names):  # the first blocks of many may all stay where they are
        heads, rows, fitting = _texts(result, sorted(names, key=_rank), short)
    answer("\n".join(table_lines(heads[:fitting], [row[:fitting] for row in rows], left=0)))
    if quiet:
        return
    counts = {"row": len(table) - len(rows), "column": len(names) - fitting, "constant column": len(told) - len(names)}
    left_out = [f"{count} {what}{'' if count == 1 else 's'}" for what, count in counts.items() if count]
    if left_out:
        note(f"not shown: {', '.join(left_out)}")
    _tell_movement(result)
    if result.share_inside is not None:
        note(f"{result.share_inside:.0%} of {len(table)} cases are inside all measured ranges")
    _tell_failures(result, short)
    if result.left:
        note(f"{result.left} cases have not been run; rerun the command to finish")
    note(f"table: {result.folder / result.name}")


def _texts(result: SweepResult, names: list[str], short: dict[str, str]) -> tuple[list[str], list[list[str]], int]:
    """Return heads and rows of a table of some columns, and how many of these fit on the screen."""
    heads = [short.get(name, name) for name in names]
    rows = [[shown(value) for value in row] for row in result.table[names].head(MOST_ROWS).itertuples(index=False)]
    return heads, rows, _fitting(heads, rows)


def _rank(name: str) -> tuple[bool, bool]:
    """Return a key that sorts columns of single blocks behind others, and last what a note below the table tells."""
    return name in (FIRST_MOVER, FIRST_MOVED), name.endswith(POSITION)


def _tell_movement(result: SweepResult) -> None:
    """Report how often each outcome occurs, and the largest movement of all."""
    table = result.table
    if OUTCOME not in table or table[OUTCOME].isna().all():  # of an earlier version, or all failed
        return
    counts = ", ".join(f"{count} {name}" for name, count in table[OUTCOME].value_counts().items())
    far, turned = table[DISPLACEMENT].max(), table[TURN].max()
    note(f"{counts}; largest displacement {far:.2f} mm, rotation {turned:.2f}° (start to end)")
    moving = int(table[MOVES_ON].isin([True, "True"]).sum()) if MOVES_ON in table else 0
    if moving:
        note(f"{moving} of {len(table)} cases were still moving at the end; increase time.end to see where they end")
    if FIRST_MOVER in table and table[FIRST_MOVER].notna().any():
        movers = table[FIRST_MOVER].value_counts()
        first = ", ".join(f"block {name} in {count}" for name, count in movers.head(MOST_MOVERS).items())
        more = f", {len(movers) - MOST_MOVERS} others" if len(movers) > MOST_MOVERS else ""
        note(f"first to move: {first}{more} of {len(table)} cases")


def _tell_failures(result: SweepResult, short: dict[str, str]) -> None:
    """Name the first cases that failed, with their reasons."""
    if not result.failed:
        return
    failed = result.table[result.table["status"] != FINISHED]
    first = failed.iloc[0]["reason"]
    note(f"{result.failed} of {len(result.table)} cases did not finish; the first: {first}")
    for _, row in failed.head(MOST_FAILURES).iterrows():
        values = ", ".join(f"{name} = {shown(row[key])}" for key, name in short.items())
        note(f"  {row['status']}: {values}: {str(row['reason']).splitlines()[0]}")
    if len(failed) > MOST_FAILURES:
        note(f"  and {len(failed) - MOST_FAILURES} more; --retry-failed runs them again")


def _varies(values: Iterable[object]) -> bool:
    """Return True if a column varies: "finished" in all rows does not, nor does a block that stays."""
    told = [f"{value:.2f}" if isinstance(value, float) else str(value) for value in values]
    return len(told) == 1 or len(set(told)) > 1


def _fitting(heads: list[str], rows: list[list[str]]) -> int:
    """Return how many columns fit on the screen, at least one."""
    width, room = 0, width_of_screen()
    for index, column in enumerate(zip(heads, *rows, strict=True)):
        width += max(map(len, column)) + (len(GAP) if index else 0)
        if width > room:
            return max(index, 1)
    return len(heads)

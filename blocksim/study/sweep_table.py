"""sweep.csv: one row per case, in the order of the plan, whatever the order in which the cases ended."""

import csv
import io
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from blocksim.errors import InvalidInputError, OutputExistsError
from blocksim.scenario.bounded_read import MEGABYTE, read_limited, refuse_large
from blocksim.simulation.atomic import replacing, sync_file
from blocksim.simulation.movement import table_columns
from blocksim.study.plan import Cases
from blocksim.study.progress import WHOLE, CaseIndex, Shard
from blocksim.study.rows import FINISHED, KEPT, TABLE, Ranges, as_cell, varied_cells
from blocksim.study.sweep_folder import SWEEP, FolderKind, note_table

if TYPE_CHECKING:
    import pandas as pd

TEXT_COLUMNS = {"case": str, "status": str, "reason": str, "first_mover": str}
MOST_BYTES = 2000 * MEGABYTE
"""Of sweep.csv: a million cases of a hundred blocks do not fit into most memories."""
OUTCOME = ("status", "reason", "seconds")
NEEDED = {"case", "status"}
NO_TABLE, NO_COLUMNS = "not the table of a sweep", "no columns case and status"
SOONEST = 2.0  # s between two tables while the sweep runs
MOST_ROWS = 20  # that a notebook shows
SHARE = 0.02  # of the time, at most, goes into tables that are soon replaced


@dataclass
class SweepTable:
    """The table of a sweep, to be written whenever it is worth it."""

    path: Path
    cases: Cases
    done: CaseIndex
    ranges: Ranges | None
    shard: Shard = WHOLE
    kind: FolderKind = SWEEP
    next_at: float = field(default_factory=lambda: time.monotonic() + SOONEST)

    def write_now_and_then(self) -> None:
        """Write the table unless it was written a short while ago; the more rows, the longer the while."""
        if time.monotonic() >= self.next_at:
            with suppress(OutputExistsError):  # somebody has changed it: the sweep goes on, and says so at its end
                self.write()

    def write(self) -> None:
        """Write all rows so far, one after the other: none is kept. Raises as `note_table`."""
        began = time.monotonic()
        self.next_at = began + SOONEST
        with replacing(self.path) as temporary:
            with temporary.open("w", encoding="utf-8", newline="") as file:
                csv.writer(file, lineterminator="\n").writerows(self._lines())
            sync_file(temporary)
            note_table(self.path, temporary, self.kind)
        ended = time.monotonic()
        self.next_at = ended + max(SOONEST, (ended - began) / SHARE)

    def _lines(self) -> Iterator[list[object]]:
        verdict = [] if self.ranges is None else ["inside"]
        ends = table_columns() + [f"{block}.{name}" for block in self.done.all_blocks() for name in KEPT]
        yield ["case", *map(str, self.cases.heads), *OUTCOME, *verdict, *ends]
        with self.done.reader() as entry_of:
            for number in self.shard.numbers(len(self.cases)):
                settings = self.cases.design[number]
                entry = entry_of(number) if self.done.holds(number, settings) else None
                if entry is None:
                    continue
                row = entry.row
                if self.ranges is not None:  # judged here and not when the case ended: the measured table may be mended
                    row = {**row, "inside": self.ranges.hold(row) if row.get("status") == FINISHED else None}
                values = varied_cells(self.cases.heads, settings).values()
                yield list(map(as_cell, [entry.case, *values, *map(row.get, (*OUTCOME, *verdict, *ends))]))


@dataclass(frozen=True, repr=False)
class SweepResult:
    """The folder of a sweep and its table, one row per case."""

    folder: Path
    name: str = TABLE
    planned: int | None = None  # how many rows there are to be; None where only the table is known

    @cached_property
    def table(self) -> "pd.DataFrame":
        """The rows of the table (pandas 3 reads every bit). Raises InputMissingError or InvalidInputError."""
        return _read(self.folder / self.name)

    def to_frame(self) -> "pd.DataFrame":
        """Return the table, one row per case."""
        return self.table

    def __repr__(self) -> str:
        """Return a line: folder, cases and what varies."""
        failed = f", {self.failed} failed" if self.failed else ""
        return f"<SweepResult {self.folder}: {len(self.table)} cases{failed}; varied: {', '.join(self.keys)}>"

    def _repr_html_(self) -> str:
        """Return the same line above the table, for notebooks."""
        return f"<p>{escape(repr(self)[1:-1])}</p>{self.table.to_html(index=False, max_rows=MOST_ROWS)}"

    @property
    def keys(self) -> tuple[str, ...]:
        """The columns of the dotted keys that vary, with the units of their numbers: "ground.tilt [deg]"."""
        names = [str(name) for name in self.table.columns]
        return tuple(names[names.index("case") + 1 : names.index("status")])

    @property
    def failed(self) -> int:
        """How many cases did not finish."""
        return int((self.table["status"] != FINISHED).sum())

    @property
    def left(self) -> int:
        """How many cases were not run, where the first failure was to end the sweep."""
        return 0 if self.planned is None else self.planned - len(self.table)

    @property
    def share_inside(self) -> float | None:
        """Share of all cases that lie inside all measured ranges; None without an experiment."""
        if "inside" not in self.table or self.table["inside"].isna().all():
            return None
        return float((self.table["inside"] == True).mean())  # noqa: E712 - the column has True, False and missing values

    def share_inside_of(self, experiment: Path | str) -> float:
        """Share of all cases that lie inside all ranges of another table. Raises what reading it raises."""
        finished = self.table[self.table["status"] == FINISHED]
        return float(Ranges.read(experiment).inside(finished).sum()) / len(self.table)


def is_sweep(place: Path | str) -> bool:
    """Return True if a place is the folder of a sweep."""
    return (Path(place) / TABLE).is_file()


def read_sweep(folder: Path | str) -> SweepResult:
    """Return the sweep that a folder holds. Raises InputMissingError or InvalidInputError."""
    result = SweepResult(Path(folder))
    _ = result.table
    return result


def lines_in(path: Path, most_bytes: int = MOST_BYTES) -> list[list[str]]:
    """Return the cells of all lines as the texts that stand there. Raises InputMissingError or InvalidInputError."""
    try:
        return list(csv.reader(io.StringIO(read_limited(path, most_bytes).decode(), newline="")))
    except (ValueError, csv.Error) as error:
        raise InvalidInputError(f"{path}: {NO_TABLE}: {error}") from error


def _read(path: Path) -> "pd.DataFrame":
    import pandas as pd

    try:
        refuse_large(path, MOST_BYTES)
        table = pd.read_csv(path, dtype=TEXT_COLUMNS)
    except (OSError, ValueError) as error:
        raise InvalidInputError(f"{path}: {NO_TABLE}: {str(error).strip()}") from error
    if not set(table.columns) >= NEEDED or table.columns[0] != "case":
        raise InvalidInputError(f"{path}: {NO_TABLE}: {NO_COLUMNS}")
    return table

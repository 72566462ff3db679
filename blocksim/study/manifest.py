"""The state of a sweep on the disk: manifest, shards and timings, and sweep.csv made from them."""

import csv
import hashlib
import io
import itertools
import json
import math
import os
import re
import zlib
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from functools import cached_property
from html import escape
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any, Self, cast

import numpy as np

from blocksim.errors import BlocksimError, InvalidInputError, OutputError, OutputExistsError
from blocksim.notebook import Shown
from blocksim.scenario import Model
from blocksim.scenario.input_files import MEGABYTE, open_regular, read_limited, refuse_large
from blocksim.simulation import files, observables, provenance
from blocksim.study import plan, rows, sweep_folder
from blocksim.study.executors import Batch

if TYPE_CHECKING:
    import pandas as pd


SHARD_FORM = re.compile(r"(\d{1,6})/(\d{1,6})")
MANIFEST = "manifest.jsonl"
PATTERN = "manifest*.jsonl"
SUM = b',"sum":"'
NEWLINE = b"\n"
LONGEST = 1 << 30  # bytes of a line that are read at once; a row of a million blocks has 200 million
MISSING, ENDED_WELL, ENDED_BADLY = range(3)


@dataclass(frozen=True)
class Shard:
    """Every `of`-th case, beginning with number `index`; both count from 0 as job arrays do."""

    index: int = 0
    of: int = 1

    @classmethod
    def parse(cls, text: str) -> Self:
        """Read "i/n". Raises InvalidInputError unless 0 <= i < n."""
        match = SHARD_FORM.fullmatch(text.strip())
        shard = None if match is None else cls(int(match[1]), int(match[2]))
        if shard is None or shard.index >= shard.of:
            message = f"--shard {text}: write I/N with I from 0 to N - 1, such as 0/8 for the first of eight"
            raise InvalidInputError(message)
        return shard

    def __str__(self) -> str:
        """Return "i/n"."""
        return f"{self.index}/{self.of}"

    @property
    def slice(self) -> slice:
        """The numbers of its cases, among those of all cases."""
        return slice(self.index, None, self.of)

    def file(self, name: str) -> str:
        """Return the name of its own file: sweep.csv, or sweep-0-of-8.csv."""
        path = PurePath(name)
        return name if self.of == 1 else f"{path.stem}-{self.index}-of-{self.of}{path.suffix}"


WHOLE = Shard()


@dataclass(frozen=True)
class Entry:
    """One case that has ended: its number, the name of its run, the hash of its values, its row."""

    number: int
    case: str
    values: str
    row: rows.Row

    def to_line(self) -> bytes:
        """Return the line of the manifest; numbers that are not finite become null."""
        row = {
            name: None if isinstance(value, float) and not math.isfinite(value) else value
            for name, value in self.row.items()
        }
        data = {"number": self.number, "case": self.case, "values": self.values, "row": row}
        head = json.dumps(data, separators=(",", ":")).encode()[:-1]
        return b'%s%s%08x"}\n' % (head, SUM, zlib.crc32(head))

    @classmethod
    def from_line(cls, line: bytes) -> Self | None:
        """Return the entry of a line, or None where the line is not whole, or not of a sweep."""
        head, _, end = line.rpartition(SUM)
        if end != b'%08x"}\n' % zlib.crc32(head):
            return None
        try:
            data = json.loads(head + b"}")
            number, case, values, row = data["number"], data["case"], data["values"], data["row"]
        except (ValueError, KeyError, TypeError, RecursionError):  # a right sum below what no sweep writes
            return None
        is_hash = isinstance(values, str) and re.fullmatch("[0-9a-f]{1,15}", values) is not None
        is_ours = type(number) is int and isinstance(case, str) and is_hash and isinstance(row, dict)
        return cls(number, case, values, row) if is_ours else None


def short_hash(data: object) -> str:
    """Return a hash of varied values, in the form in which they were given, or of all that a study is named by."""
    return hashlib.sha256(json.dumps(data, default=str).encode()).hexdigest()[: provenance.HASH_DIGITS]


class Manifest:
    """A manifest that this process, and no other, appends to."""

    def __init__(self, path: Path, what: str = "sweep") -> None:
        """Open the file and keep others out. Raises OutputExistsError where another process has it, and OutputError."""
        self.path = path
        with files.brief_lock(path.parent):  # who empties the folder sees the file locked, or not at all
            try:
                self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_NOFOLLOW, files.PERMISSIONS)
            except OSError as error:
                raise OutputError(f"{path}: cannot be written: {error.strerror}") from error
            is_free = files.takes_lock(self._file)
        if not is_free:
            os.close(self._file)
            message = f"{path.parent}: this {what} is already running; wait for it, or write elsewhere with --out DIR"
            raise OutputExistsError(message)
        self.size = os.fstat(self._file).st_size
        if self.size and os.pread(self._file, 1, self.size - 1) != NEWLINE:
            self._write(NEWLINE)  # a line torn by a kill must not take the next one with it

    def append(self, entries: Iterable[Entry]) -> list[int]:
        """Bring entries to the disk and return where each begins. Raises OutputError (disk full)."""
        lines = [entry.to_line() for entry in entries]
        starts = list(itertools.accumulate(map(len, lines), initial=self.size))[:-1]
        self._write(b"".join(lines))
        return starts

    def _write(self, content: bytes) -> None:
        try:
            left = memoryview(content)
            while left:
                left = left[os.write(self._file, left) :]
            os.fsync(self._file)
        except OSError as error:
            raise OutputError(f"{self.path}: cannot be written: {error.strerror}") from error
        self.size += len(content)

    def close(self) -> None:
        """Let others have the file."""
        os.close(self._file)


def read_entries(path: Path) -> Iterator[tuple[int, Entry]]:
    """Yield where each whole line of a manifest begins, and its entry."""
    start = 0
    with open_regular(path) as file:
        while line := file.readline(LONGEST):
            entry = Entry.from_line(line)
            if entry is not None:
                yield start, entry
            start += len(line)


class CaseIndex:
    """Where in the manifests the row of each of n cases is: some bytes a case, whatever its row holds."""

    def __init__(self, folder: Path, count: int) -> None:
        """Read all manifests of a folder; torn lines are passed over."""
        self.folder = folder
        self.state = np.zeros(count, dtype=np.int8)
        self.starts = np.zeros(count, dtype=np.int64)  # bytes from the begin of the manifest
        self.values = np.zeros(count, dtype=np.int64)  # hash of the varied values
        self.sources = np.zeros(count, dtype=np.int16)  # number of the manifest in `paths`
        self.paths: list[Path] = []
        self.blocks: dict[tuple[str, ...], int] = {}  # blocks of a row: first case that has such a row
        for path in sorted(folder.glob(PATTERN)):
            for start, entry in read_entries(path):
                self.note(path, start, entry)

    def note(self, path: Path, start: int, entry: Entry) -> None:
        """Remember where an entry is; one that ended well is not given up for another."""
        number = entry.number
        if not 0 <= number < len(self.state) or self.state[number] == ENDED_WELL:
            return
        if path not in self.paths:
            self.paths.append(path)
        self.state[number] = ENDED_WELL if entry.row.get("status") == rows.FINISHED else ENDED_BADLY
        self.starts[number], self.sources[number] = start, self.paths.index(path)
        self.values[number] = int(entry.values, 16)
        blocks = tuple(name.removesuffix(rows.X) for name in entry.row if name.endswith(rows.X))
        self.blocks[blocks] = min(number, self.blocks.get(blocks, number))

    def holds(self, number: int, settings: dict[str, object]) -> bool:
        """Return True if a case has a row, and that with these values: other code may have numbered the cases again."""
        if self.state[number] != MISSING and self.values[number] != int(short_hash(settings), 16):
            self.state[number] = MISSING
        return bool(self.state[number] != MISSING)

    def count(self, shard: Shard = WHOLE) -> int:
        """Return how many cases of a shard have a row."""
        return int(np.count_nonzero(self.state[shard.slice]))

    def entries(self, cases: plan.Cases, shard: Shard = WHOLE) -> Iterator[tuple[int, plan.Settings, Entry]]:
        """Yield number, values and entry of every case that has a row; not where the file has changed since."""
        with ExitStack() as stack:
            opened = [stack.enter_context(open_regular(path)) for path in self.paths]
            for number in range(len(cases))[shard.slice]:
                settings = cases.design[number]
                if self.holds(number, settings):
                    file = opened[int(self.sources[number])]
                    file.seek(int(self.starts[number]))
                    if (entry := Entry.from_line(file.readline())) is not None:
                        yield number, settings, entry


def note_timings(path: Path, executor: str, batch: Batch) -> None:
    """Add a line a case to a table: its share (s) of the wall time of the batch that it was run in.

    Raises OutputError.
    """
    share = f"{batch.seconds / max(len(batch.tasks), 1):.6f}"
    lines = [(task.name, executor, share, rows.as_cell(batch.host)) for task in batch.tasks]
    try:
        with path.open("a+b") as file:
            size, text = file.seek(0, os.SEEK_END), io.StringIO()
            if size:  # a last line that was torn by a kill must not take the next one with it
                file.seek(size - 1)
                text.write("" if file.read() == NEWLINE else "\n")
            heads = [] if size else [("case", "executor", "seconds", "host")]
            csv.writer(text, lineterminator="\n").writerows([*heads, *lines])
            file.write(text.getvalue().encode())
    except OSError as error:
        raise OutputError(f"{path}: cannot be written: {error.strerror}") from error


TEXT_COLUMNS = {"case": str, "status": str, "reason": str, "first_mover": str}
MOST_BYTES = 2000 * MEGABYTE  # of sweep.csv: a million cases of a hundred blocks do not fit into most memories
OUTCOME = ("status", "reason", "seconds")
NEEDED = {"case", "status"}
NO_TABLE, NO_COLUMNS = "not the table of a sweep", "no columns case and status"
MOST_ROWS = 20  # that a notebook shows


def table_rows(
    cases: plan.Cases, done: CaseIndex, ranges: rows.Ranges | None, shard: Shard = WHOLE
) -> Iterator[Sequence[object]]:
    """Yield the heads and all rows so far, one after the other: none is kept."""
    verdict = [] if ranges is None else ["inside"]
    blocks = dict.fromkeys(block for names in sorted(done.blocks, key=done.blocks.__getitem__) for block in names)
    ends = observables.table_columns() + [f"{block}.{name}" for block in blocks for name in rows.KEPT]
    yield ["case", *map(str, cases.heads), *OUTCOME, *verdict, *ends]
    for _, settings, entry in done.entries(cases, shard):
        row = entry.row
        if ranges is not None:  # judged here and not when the case ended: the measured table may be mended
            row = {**row, "inside": ranges.hold(row) if row.get("status") == rows.FINISHED else None}
        values = [head.cell(settings[head.key]) for head in cases.heads]
        yield list(map(rows.as_cell, [entry.case, *values, *map(row.get, (*OUTCOME, *verdict, *ends))]))


@dataclass(frozen=True, repr=False)
class SweepResult(Shown):
    """The folder of a sweep and its table, one row per case."""

    folder: Path
    name: str = rows.TABLE
    planned: int | None = None  # how many rows there are to be; None where only the table is known

    @cached_property
    def table(self) -> "pd.DataFrame":
        """The rows of the table, to the last bit. Raises InputMissingError or InvalidInputError."""
        import pandas as pd

        path = self.folder / self.name
        exact: dict[str, Any] = {"float_precision": "round_trip"} if pd.__version__.startswith("2.") else {}
        try:
            refuse_large(path, MOST_BYTES)
            table: pd.DataFrame = cast("Any", pd.read_csv)(path, dtype=TEXT_COLUMNS, **exact)
        except (OSError, ValueError) as error:
            raise InvalidInputError(f"{path}: {NO_TABLE}: {str(error).strip()}") from error
        if not set(table.columns) >= NEEDED or table.columns[0] != "case":
            raise InvalidInputError(f"{path}: {NO_TABLE}: {NO_COLUMNS}")
        if self.planned is not None:
            table.attrs |= {"planned": self.planned, "missing": self.planned - len(table)}
        return table

    def to_frame(self) -> "pd.DataFrame":
        """Return the table, one row per case; its `attrs` have how many are planned and missing."""
        return self.table

    def __repr__(self) -> str:
        """Return a line: folder, cases and what varies."""
        failed = f", {self.failed} failed" if self.failed else ""
        return f"<SweepResult {self.folder}: {self.progress} cases{failed}; varied: {', '.join(self.keys)}>"

    def _repr_html_(self) -> str:
        """Return the same line above the table and the picture that suits it, for notebooks."""
        table = self.table.to_html(index=False, max_rows=MOST_ROWS)
        return f"<p>{escape(repr(self)[1:-1])}</p>{table}{super()._repr_html_()}"

    @property
    def keys(self) -> tuple[str, ...]:
        """The columns of the dotted keys that vary, with the units of their numbers: "ground.tilt [deg]"."""
        names = [str(name) for name in self.table.columns]
        return tuple(names[names.index("case") + 1 : names.index("status")])

    @property
    def failed(self) -> int:
        """How many cases did not finish."""
        return int((self.table["status"] != rows.FINISHED).sum())

    @property
    def missing(self) -> int:
        """How many cases were not run, as the sweep was interrupted or the first failure was to end it."""
        return 0 if self.planned is None else self.planned - len(self.table)

    @property
    def progress(self) -> str:
        """How many cases there are, and of how many that are planned where some are missing."""
        return f"{len(self.table)} of {self.planned}" if self.missing else str(len(self.table))

    @property
    def share_inside(self) -> float | None:
        """Share of all cases that lie inside all measured ranges; None without an experiment."""
        if "inside" not in self.table or self.table["inside"].isna().all():
            return None
        return float(self.table["inside"].isin([True]).mean())  # the column has True, False and missing values

    def share_inside_of(self, experiment: Path | str) -> float:
        """Share of all cases that lie inside all ranges of another table. Raises what reading it raises."""
        finished = self.table[self.table["status"] == rows.FINISHED]
        return float(rows.Ranges.read(experiment).inside(finished).sum()) / len(self.table)


def is_sweep(place: Path | str) -> bool:
    """Return True if a place is the folder of a sweep."""
    return (Path(place) / rows.TABLE).is_file()


def read_sweep(folder: Path | str) -> SweepResult:
    """Return the sweep that a folder holds. Raises InputMissingError or InvalidInputError.

    >>> blocks, friction = "scenarios/three_blocks_nonsmooth.toml", {"friction.block_block": [0.1, 0.3]}
    >>> swept = sweep(blocks, friction, out="results/swept")
    >>> len(open_sweep("results/swept").table)
    2
    """
    result = SweepResult(Path(folder), planned=planned_in(Path(folder)))
    _ = result.table
    return result


def planned_in(folder: Path) -> int | None:
    """Return how many cases the plan in a folder has; None where no plan is there that this version reads."""
    with suppress(BlocksimError):
        sweep = Model.stored(folder / sweep_folder.PLAN).scenario.sweep
        if sweep is not None:
            return sweep.samples if sweep.is_sampled else len(plan.design_of(sweep))  # without drawing them
    return None


def lines_in(path: Path, most_bytes: int = MOST_BYTES) -> list[list[str]]:
    """Return the cells of all lines as the texts that stand there. Raises InputMissingError or InvalidInputError."""
    try:
        return list(csv.reader(io.StringIO(read_limited(path, most_bytes).decode(), newline="")))
    except (ValueError, csv.Error) as error:
        raise InvalidInputError(f"{path}: {NO_TABLE}: {error}") from error

"""manifest.jsonl: what has been run of a sweep, a line a case, so written that a kill at any moment loses no line.

A line is one JSON object: `number` (of the case in the plan), `case` (hash of its run), `values` (hash of its varied
values), `row` (what sweep.csv tells of it), and last `sum`, the CRC-32 of all before. A line whose sum is wrong (torn
by a kill, or by a full disk) counts as not written.
"""

import hashlib
import itertools
import json
import math
import os
import re
import zlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

from blocksim.errors import OutputError, OutputExistsError
from blocksim.scenario.limited import open_regular
from blocksim.simulation.folder import takes_lock
from blocksim.study.rows import Row

NAME = "manifest.jsonl"
PATTERN = "manifest*.jsonl"
DIGITS = 12
SUM = b',"sum":"'
NEWLINE = b"\n"
NO_LINK = getattr(os, "O_NOFOLLOW", 0)
LONGEST = 1 << 30
"""Bytes of a line that are read at once; a row of a million blocks has 200 million."""


@dataclass(frozen=True)
class Entry:
    """One case that has ended: its number, the name of its run, the hash of its values, its row."""

    number: int
    case: str
    values: str
    row: Row

    def to_line(self) -> bytes:
        """Return the line of the manifest; numbers that are not finite become null."""
        row = {name: None if _is_not_finite(value) else value for name, value in self.row.items()}
        data = {"number": self.number, "case": self.case, "values": self.values, "row": row}
        head = json.dumps(data, separators=(",", ":")).encode()[:-1]
        return b'%s%s%08x"}\n' % (head, SUM, zlib.crc32(head))

    @classmethod
    def from_line(cls, line: bytes) -> Self | None:
        """Return the entry of a line, or None where the line is not whole."""
        head, _, end = line.rpartition(SUM)
        if end != b'%08x"}\n' % zlib.crc32(head):
            return None
        try:
            data = json.loads(head + b"}")
            parts = (data["number"], data["case"], data["values"], data["row"])
        except (ValueError, KeyError, TypeError, RecursionError):  # a right sum below what no sweep writes
            return None
        return cls(*parts) if _are_parts(*parts) else None


def _are_parts(number: Any, case: Any, values: Any, row: Any) -> bool:
    """Return True if a line holds what a sweep writes, in its types."""
    is_hash = isinstance(values, str) and re.fullmatch("[0-9a-f]{1,15}", values) is not None
    return type(number) is int and isinstance(case, str) and is_hash and isinstance(row, dict)


def _is_not_finite(value: object) -> bool:
    return isinstance(value, float) and not math.isfinite(value)


def values_hash(settings: dict[str, object]) -> str:
    """Return a hash of the varied values of a case, in the form in which they were given."""
    return hashlib.sha256(json.dumps(settings, default=str).encode()).hexdigest()[:DIGITS]


class Manifest:
    """A manifest that this process, and no other, appends to."""

    def __init__(self, path: Path) -> None:
        """Open the file and keep others out. Raises OutputExistsError where another process has it, and OutputError."""
        self.path = path
        try:
            self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND | NO_LINK, 0o644)
        except OSError as error:
            message = f"{path}: cannot be written: {error.strerror}"
            raise OutputError(message) from error
        if not takes_lock(self._file):
            os.close(self._file)
            message = f"{path.parent}: this sweep is running already; wait for it, or write elsewhere with --out DIR"
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
            message = f"{self.path}: cannot be written: {error.strerror}"
            raise OutputError(message) from error
        self.size += len(content)

    def close(self) -> None:
        """Let others have the file."""
        os.close(self._file)


def is_in_use(path: Path) -> bool:
    """Return True if another process appends to a manifest."""
    with open_regular(path) as file:
        return not takes_lock(file.fileno())


def read_entries(path: Path) -> Iterator[tuple[int, Entry]]:
    """Yield where each whole line of a manifest begins, and its entry."""
    start = 0
    with open_regular(path) as file:
        while line := file.readline(LONGEST):
            entry = Entry.from_line(line)
            if entry is not None:
                yield start, entry
            start += len(line)

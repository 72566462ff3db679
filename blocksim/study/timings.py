"""timings.csv: what the cases cost, apart from what they came to, which is the same on every machine."""

import csv
import io
import os
from collections.abc import Iterable
from pathlib import Path

from blocksim.errors import OutputError
from blocksim.study.spreadsheet import as_cell

COLUMNS = ("case", "executor", "seconds", "host")


class Timings:
    """A table that grows by a line a case: its share (s) of the wall time of the batch that it was run in."""

    def __init__(self, path: Path, executor: str) -> None:
        """Begin, or continue with, a table."""
        self.path, self.executor = path, executor

    def append(self, cases: Iterable[str], seconds: float, host: str) -> None:
        """Add the cases of a batch that took so long (s). Raises OutputError."""
        names = list(cases)
        share = f"{seconds / max(len(names), 1):.6f}"
        try:
            is_new = not self.path.exists() or not self.path.stat().st_size
            text = io.StringIO()
            writer = csv.writer(text, lineterminator="\n")
            writer.writerows([COLUMNS] if is_new else [])
            writer.writerows((name, self.executor, share, as_cell(host)) for name in names)
            with self.path.open("a", encoding="utf-8", newline="") as file:
                file.write(("" if is_new or self._is_whole() else "\n") + text.getvalue())
        except OSError as error:
            message = f"{self.path}: cannot be written: {error.strerror}"
            raise OutputError(message) from error

    def _is_whole(self) -> bool:
        """Return True if the last line was not torn by a kill."""
        with self.path.open("rb") as file:
            file.seek(-1, os.SEEK_END)
            return file.read() == b"\n"

"""Which cases of a sweep have been run, by all processes that share its folder, and where their rows stand."""

from pathlib import Path
from typing import BinaryIO

import numpy as np

from blocksim.scenario.limited import open_regular
from blocksim.study.manifest import PATTERN, Entry, read_entries, values_hash
from blocksim.study.places import FINISHED
from blocksim.study.rows import blocks_in
from blocksim.study.shard import WHOLE, Shard

MISSING, ENDED_WELL, ENDED_BADLY = range(3)


class Done:
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
        self.state[number] = ENDED_WELL if entry.row.get("status") == FINISHED else ENDED_BADLY
        self.starts[number], self.sources[number] = start, self.paths.index(path)
        self.values[number] = int(entry.values, 16)
        blocks = blocks_in(entry.row)
        self.blocks[blocks] = min(number, self.blocks.get(blocks, number))

    def forget(self, number: int) -> None:
        """Have a case run again."""
        self.state[number] = MISSING

    def forget_failed(self, shard: Shard) -> None:
        """Have those cases of a shard run again that did not end well."""
        state = self.state[shard.slice]
        state[state == ENDED_BADLY] = MISSING

    def holds(self, number: int, settings: dict[str, object]) -> bool:
        """Return True if a case has a row, and that with these values: other code may have numbered the cases again."""
        if self.state[number] != MISSING and self.values[number] != int(values_hash(settings), 16):
            self.forget(number)
        return bool(self.state[number] != MISSING)

    def count(self, shard: Shard = WHOLE) -> int:
        """Return how many cases of a shard have a row."""
        return int(np.count_nonzero(self.state[shard.slice]))

    def all_blocks(self) -> tuple[str, ...]:
        """Return the blocks of all rows, in the order of the cases in which they first appear."""
        first = sorted(self.blocks, key=self.blocks.__getitem__)
        return tuple(dict.fromkeys(block for blocks in first for block in blocks))

    def reader(self) -> "Reader":
        """Return what reads entries back."""
        return Reader(self)


class Reader:
    """The manifests, open for reading."""

    def __init__(self, done: Done) -> None:
        """Open no file yet."""
        self.done = done
        self.files: dict[int, BinaryIO] = {}

    def entry(self, number: int) -> Entry | None:
        """Return the entry of a case that has a row, or None where the file has changed since."""
        source = int(self.done.sources[number])
        if source not in self.files:
            self.files[source] = open_regular(self.done.paths[source])
        file = self.files[source]
        file.seek(int(self.done.starts[number]))
        return Entry.from_line(file.readline())

    def close(self) -> None:
        """Close all files."""
        for file in self.files.values():
            file.close()

"""The part of a sweep that one job of an array does."""

import re
from dataclasses import dataclass
from pathlib import PurePath
from typing import Self

from blocksim.errors import InvalidInputError

FORM = re.compile(r"(\d{1,6})/(\d{1,6})")


@dataclass(frozen=True)
class Shard:
    """Every `of`-th case, beginning with number `index`; both count from 0 as job arrays do."""

    index: int = 0
    of: int = 1

    @classmethod
    def parse(cls, text: str) -> Self:
        """Read "i/n". Raises InvalidInputError unless 0 <= i < n."""
        match = FORM.fullmatch(text.strip())
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

    def numbers(self, count: int) -> range:
        """Return the numbers of its cases where there are `count` in all."""
        return range(count)[self.slice]

    def file(self, name: str) -> str:
        """Return the name of its own file: sweep.csv, or sweep-0-of-8.csv."""
        path = PurePath(name)
        return name if self.of == 1 else f"{path.stem}-{self.index}-of-{self.of}{path.suffix}"


WHOLE = Shard()

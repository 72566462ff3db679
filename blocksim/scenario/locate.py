"""Positions of all keys and values in a TOML text.

tomllib returns values without positions, so this small scanner walks over a text that tomllib has accepted and
records them.
"""

import bisect
import re
from collections.abc import Iterator
from dataclasses import dataclass

from blocksim.scenario.keys import KeyPath, read_key, skip_blank

_SPACE = re.compile(r"(?:[ \t\n]|#[^\n]*)*")
_SCALAR = re.compile(r"[^,\]}#\n]*")
_STRINGS = (
    re.compile(r'"""(?:[^\\"]|\\.|"{1,2}(?!"))*"{3,5}', re.DOTALL),
    re.compile(r"'''(?:[^']|'{1,2}(?!'))*'{3,5}"),
    re.compile(r'"(?:[^"\\\n]|\\.)*"'),
    re.compile(r"'[^'\n]*'"),
)


@dataclass(frozen=True, slots=True)
class Span:
    """Part of one line: line from 1, column from 0, length in characters."""

    line: int
    column: int
    length: int


@dataclass(frozen=True, slots=True)
class Place:
    """Positions of a key and its value; for a [table] both are the name in its header."""

    key: Span
    value: Span


def locate(text: str) -> dict[KeyPath, Place]:
    """Map every path of a valid TOML text (lines end with a line feed) to its place."""
    return _Scanner(text).run()


class _Scanner:
    """One walk over a text; the first mention of a table counts."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.line_starts = [0, *(match.end() for match in re.finditer("\n", text))]
        self.after = 0
        self.places: dict[KeyPath, Place] = {}
        self.list_sizes: dict[KeyPath, int] = {}

    def run(self) -> dict[KeyPath, Place]:
        table: KeyPath = ()
        at = self.skip(0)
        while at < len(self.text):
            if self.text[at] == "[":
                table, at = self.header(at)
            else:
                at = self.pair(table, at)
            at = self.skip(at)
        return self.places

    def skip(self, at: int) -> int:
        """Pass white space, line ends and comments."""
        found = _SPACE.match(self.text, at)
        return at if found is None else found.end()

    def header(self, at: int) -> tuple[KeyPath, int]:
        """Read [a.b] or [[a.b]]: the path of the table that starts here, and the end of the header."""
        brackets = 2 if self.text.startswith("[[", at) else 1
        start = skip_blank(self.text, at + brackets)
        parts, end = read_key(self.text, start)
        span = self.span(start, end)
        path: KeyPath = ()
        for part in parts[:-1]:
            path = self.latest((*path, part))
            self.places.setdefault(path, Place(span, span))
        path = (*path, parts[-1])
        self.places.setdefault(path, Place(span, span))
        if brackets == 2:  # noqa: PLR2004 - [[ ]]
            self.list_sizes[path] = self.list_sizes.get(path, 0) + 1
            path = self.latest(path)
            self.places[path] = Place(span, span)
        return path, skip_blank(self.text, end) + brackets

    def latest(self, path: KeyPath) -> KeyPath:
        """Step into the newest element where the path is an array of tables."""
        size = self.list_sizes.get(path, 0)
        return (*path, size - 1) if size else path

    def pair(self, table: KeyPath, at: int) -> int:
        """Read key = value below a table."""
        parts, end = read_key(self.text, at)
        key = self.span(at, end)
        start = skip_blank(self.text, skip_blank(self.text, end) + 1)
        path = (*table, *parts)
        after = self.value(path, start)
        place = Place(key, self.span(start, after))
        for size in range(len(table) + 1, len(path)):
            self.places.setdefault(path[:size], place)
        self.places[path] = place
        return after

    def value(self, path: KeyPath, at: int) -> int:
        """Pass one value and record what is inside it; return its end."""
        opening = self.text[at : at + 1]
        if opening == "[":
            return self.array(path, at)
        if opening == "{":
            return self.inline_table(path, at)
        found = next((m for p in _STRINGS if (m := p.match(self.text, at))), None)
        if found is not None:
            return found.end()
        scalar = _SCALAR.match(self.text, at)
        return at if scalar is None else at + len(scalar[0].rstrip())

    def array(self, path: KeyPath, at: int) -> int:
        """Pass a list and record every element."""
        for index, start in enumerate(self.elements(at, "]")):
            element = (*path, index)
            self.after = self.value(element, start)
            span = self.span(start, self.after)
            self.places[element] = Place(span, span)
        return self.after

    def inline_table(self, path: KeyPath, at: int) -> int:
        """Pass { key = value, … } and record every key."""
        for start in self.elements(at, "}"):
            self.after = self.pair(path, start)
        return self.after

    def elements(self, at: int, closing: str) -> Iterator[int]:
        """Yield the start of each element; the caller sets `after` to its end, and finally to that of the list."""
        at = self.skip(at + 1)
        while at < len(self.text) and self.text[at] != closing:
            yield at
            at = self.skip(self.after)
            if self.text.startswith(",", at):
                at = self.skip(at + 1)
        self.after = at + 1

    def span(self, start: int, end: int) -> Span:
        """Return line and column of a part, cut at the end of its first line."""
        line = bisect.bisect_right(self.line_starts, start)
        first = self.line_starts[line - 1]
        newline = self.text.find("\n", start, end)
        return Span(line, start - first, (end if newline < 0 else newline) - start)

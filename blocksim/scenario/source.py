"""Text of a scenario: where its keys and values stand, and mistakes shown in it with line, line number and caret.

tomllib returns values without positions, so a small scanner walks over a text that tomllib has accepted and records
them.
"""

import bisect
import functools
import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass

from blocksim.errors import Problem
from blocksim.scenario.keys import KeyPath, format_key, read_key, skip_blank
from blocksim.scenario.overrides import Override

MAX_SHOWN = 110
"""Characters of a line that a message shows; a longer line is cut on both sides of the caret."""

_SYNTAX_PLACE = re.compile(r" \(at (?:line (?P<line>\d+), column (?P<column>\d+)|end of document)\)$")
_TWICE = (
    "Cannot overwrite a value",
    "Cannot declare",
    "Duplicate inline table key",
    "Cannot mutate",
    "Cannot redefine",
)
_CLEARER = {
    "Illegal character '\\n'": "a string in quotes must end on its line",
    "Expected newline or end of document after a statement": "this cannot follow here; strings need quotes",
}
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


@dataclass(frozen=True)
class ScenarioText:
    """A named text; the name is used in messages. Scenarios made in Python have no text."""

    where: str
    text: str = ""

    @functools.cached_property
    def lines(self) -> list[str]:
        """The lines of the text."""
        return self.text.split("\n")

    @functools.cached_property
    def places(self) -> dict[KeyPath, Place]:
        """Every key and value of the text; only located once a mistake must be shown."""
        return locate(self.text)

    def problem(self, path: KeyPath, message: str, at: str) -> Problem:
        """Show a mistake at its key or value, or at the nearest table around it."""
        prefix = next((path[:size] for size in range(len(path), 0, -1) if path[:size] in self.places), ())
        key = format_key(path)
        if not prefix:
            first = Span(1, 0, len(self.lines[0])) if self.text else None
            return self.shown(message, key, first)
        place = self.places[prefix]
        return self.shown(message, key, place.key if at == "key" else place.value)

    def span_at(self, index: int) -> Span:
        """Return the place of one character of the text."""
        before = self.text[:index]
        return Span(before.count("\n") + 1, index - (before.rfind("\n") + 1), 1)

    def shown(self, message: str, key: str, span: Span | None) -> Problem:
        """Make the problem with its line."""
        if span is None:
            return Problem(self.where, message, key)
        line, start = clipped(self.lines[span.line - 1], span.column)
        length = max(1, min(span.length, len(line) - start))
        return Problem(self.where, message, key, span.line, line, start, length)

    def syntax_problem(self, error: tomllib.TOMLDecodeError) -> Problem:
        """Show where tomllib stopped."""
        text = str(error)
        found = _SYNTAX_PLACE.search(text)
        message = text if found is None else text[: found.start()]
        at_end = found is None or found["line"] is None
        number = len(self.text.rstrip("\n").split("\n")) if at_end else int(found["line"])  # type: ignore[index]
        line = self.lines[number - 1]
        column = len(line) if at_end else int(found["column"]) - 1  # type: ignore[index]
        if message.startswith(_TWICE):
            head = re.match(r"\s*(\[*)([^=\]]*[^=\]\s])?", line)
            start, end = (head.start(2), head.end(2)) if head is not None and head[2] else (0, len(line))
            return self.shown("this key or table is defined further up", "", Span(number, start, end - start))
        message = _CLEARER.get(message) or f"not valid TOML: {message[:1].lower()}{message[1:]}"
        return self.shown(message, "", Span(number, column, 1))


def override_problem(override: Override, path: KeyPath, message: str, at: str) -> Problem:
    """Show a mistake in a value that was set from outside."""
    text, end = override.text, override.key_length
    equals = text.find("=", end)
    value = len(text) - len(text[equals + 1 :].lstrip())
    in_key = equals < 0 or (at == "key" and len(path) <= len(override.path))
    start, stop = (0, end) if in_key else (value, len(text))
    line, shift = clipped(text, start)
    length = max(1, min(stop - start, len(line) - shift))
    depth, key = len(override.path), format_key(path)
    if path == override.path:
        key = ""  # it stands in the text
    elif path[0] == "sweep" and path[:depth] == override.path:  # what lies below a key that a study varies
        key = "" if isinstance(path[depth], int) else format_key(path[depth:])
    return Problem(override.label, message, key, None, line, shift, length)


def clipped(line: str, start: int) -> tuple[str, int]:
    """Return a line for the screen and the place of the caret: no control characters, no endless lines."""
    clean = "".join(c if c.isprintable() else " " if c == "\t" else "\ufffd" for c in line)
    if len(clean) <= MAX_SHOWN:
        return clean, start
    first = max(0, min(start - MAX_SHOWN // 3, len(clean) - MAX_SHOWN))
    left = "…" if first else ""
    right = "…" if first + MAX_SHOWN < len(clean) else ""
    return left + clean[first : first + MAX_SHOWN] + right, start - first + len(left)


def locate(text: str) -> dict[KeyPath, Place]:
    """Map every path of a valid TOML text (lines end with a line feed) to its place; the first one of a table."""
    scanner = _Scanner(text)
    table: KeyPath = ()
    at = scanner.skip(0)
    while at < len(text):
        if text[at] == "[":
            table, at = scanner.header(at)
        else:
            at = scanner.pair(table, at)
        at = scanner.skip(at)
    return scanner.places


class _Scanner:
    """One walk over a text; the first mention of a table counts."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.line_starts = [0, *(match.end() for match in re.finditer("\n", text))]
        self.after = 0
        self.places: dict[KeyPath, Place] = {}
        self.list_sizes: dict[KeyPath, int] = {}

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
        if brackets == 2:
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
            for index, start in enumerate(self.elements(at, "]")):
                element = (*path, index)
                self.after = self.value(element, start)
                span = self.span(start, self.after)
                self.places[element] = Place(span, span)
            return self.after
        if opening == "{":
            for start in self.elements(at, "}"):
                self.after = self.pair(path, start)
            return self.after
        found = next((m for p in _STRINGS if (m := p.match(self.text, at))), None)
        if found is not None:
            return found.end()
        scalar = _SCALAR.match(self.text, at)
        return at if scalar is None else at + len(scalar[0].rstrip())

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

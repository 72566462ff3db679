"""Text of a scenario, and mistakes shown in it: line, line number and caret."""

import functools
import re
import tomllib
from dataclasses import dataclass

from blocksim.errors import Problem
from blocksim.scenario.keys import KeyPath, format_key
from blocksim.scenario.locate import Place, Span, locate
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


@dataclass(frozen=True)
class Source:
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
    key = "" if path == override.path else format_key(path)
    line, shift = clipped(text, start)
    length = max(1, min(stop - start, len(line) - shift))
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

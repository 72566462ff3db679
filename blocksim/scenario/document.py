"""Loading: the text of a scenario with the places of its keys, the values set over it, and the scenario in it."""

import bisect
import difflib
import functools
import re
import tomllib
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple, Protocol, Self, cast, runtime_checkable

from blocksim.errors import InputMissingError, Problem, ScenarioError
from blocksim.scenario import check, input_files, mistakes, overrides as keys, resolution, units
from blocksim.scenario.models.scenario import Scenario
from blocksim.scenario.placement import Placement

MAX_SHOWN = 110
"""Characters of a line that a message shows; a longer line is cut on both sides of the caret."""

_SYNTAX_PLACE = re.compile(r" \(at (?:line (?P<line>\d+), column (?P<column>\d+)|end of document)\)$")
_TWICE = re.compile("Cannot (overwrite a value|declare|mutate|redefine)|Duplicate inline table key")
UNENDED = ("Illegal character '\\n'", "Unterminated string")
_CLEARER = {
    UNENDED[0]: "a string in quotes must end on its line",
    "Expected newline or end of document after a statement": "this cannot follow here; strings need quotes",
}
_CURLY = re.compile("[\u201c-\u201f\u2018-\u201b\u00ab\u00bb`]")  # quotes of word processors, backticks
_SLIPS = (  # habits from elsewhere, by what stands where tomllib stops
    (_CURLY, "straight quotes are needed, \" or '"),
    (re.compile(r"//|/\*"), "a comment begins with #"),
    (re.compile(r";"), "a line ends without a semicolon; a comment begins with #"),
    (re.compile(r"%"), "write a share, such as 0.2 for 20 per cent"),
    (re.compile(r"(?i:true|false|yes|no|on|off)\b"), "write true or false, in lower case"),
    (re.compile(r"(?i:none|null|nil)\b"), "no such value; leave the key out"),
    (re.compile(r"(?<=[0-9]),[0-9]"), "write decimals with a point"),
    (re.compile(r"(?<=[A-Za-z0-9_\"']):"), "write KEY = VALUE, with an equals sign"),
    (re.compile(r"(?<== )[A-Za-z]"), "strings need quotes"),
)
_SPACE = re.compile(r"(?:[ \t\n]|#[^\n]*)*")
_VALUE = re.compile(
    r'"""(?:[^\\"]|\\[\s\S]|"{1,2}(?!"))*"{3,5}'
    r"|'''(?:[^']|'{1,2}(?!'))*'{3,5}"
    r'|"(?:[^"\\\n]|\\.)*"'
    r"|'[^'\n]*'"
    r"|[^,\]}#\n]*[^,\]}#\s]"
)
"""A string, or else anything up to what separates values."""


class Span(NamedTuple):
    """Part of one line: line from 1, column from 0, length in characters."""

    line: int
    column: int
    length: int


class Place(NamedTuple):
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
    def places(self) -> dict[keys.KeyPath, Place]:
        """Every key and value of the text; only located once a mistake must be shown."""
        return locate(self.text)

    def problem(self, path: keys.KeyPath, message: str, at: str) -> Problem:
        """Show a mistake at its key or value, or at the nearest table around it."""
        around = (self.places.get(path[:size]) for size in range(len(path), 0, -1))
        place, span = next((one for one in around if one), None), None
        if place is not None:
            span = place.key if at == "key" else place.value
        elif self.text:
            span = Span(1, 0, len(self.lines[0]))
        return self.problem_in(message, keys.format_key(path), span)

    def problem_in(self, message: str, key: str, span: Span | None) -> Problem:
        """Make the problem with its line."""
        if span is None:
            return Problem(self.where, message, key)
        return Problem(self.where, message, key, span.line, *clip_line(self.lines[span.line - 1], *span[1:]))

    def syntax_problem(self, error: tomllib.TOMLDecodeError) -> Problem:
        """Show where tomllib stopped."""
        text = str(error)
        found = _SYNTAX_PLACE.search(text)
        message = text if found is None else text[: found.start()]
        at_end = found is None or found["line"] is None
        number = len(self.text.rstrip("\n").split("\n")) if at_end else int(found["line"])  # type: ignore[index]
        line = self.lines[number - 1]
        column = len(line) if at_end else int(found["column"]) - 1  # type: ignore[index]
        if _TWICE.match(message):
            head = re.match(r"\s*(\[*)([^=\]]*[^=\]\s])?", line)
            start, end = (head.start(2), head.end(2)) if head is not None and head[2] else (0, len(line))
            return self.problem_in("this key or table is defined further up", "", Span(number, start, end - start))
        curly = _CURLY.search(line) if message in UNENDED else None
        column = column if curly is None else curly.start()
        slip = next((text for pattern, text in _SLIPS if pattern.match(line, column)), None)
        message = slip or _CLEARER.get(message) or f"not valid TOML: {message[:1].lower()}{message[1:]}"
        return self.problem_in(message, "", Span(number, column, 1))


def override_problem(override: keys.Override, path: keys.KeyPath, message: str, at: str) -> Problem:
    """Show a mistake in a value that was set from outside."""
    text = override.text
    try:
        end = keys.read_key(text)[1]
    except ValueError:
        end = max(1, len(text.partition("=")[0]))
    equals = text.find("=", end)
    value = len(text) - len(text[equals + 1 :].lstrip())
    in_key = equals < 0 or (at == "key" and len(path) <= len(override.path))
    start, stop = (0, end) if in_key else (value, len(text))
    depth, key = len(override.path), keys.format_key(path)
    if path == override.path:
        key = ""  # it stands in the text
    elif path[0] == "sweep" and path[:depth] == override.path:  # what lies below a key that a study varies
        key = "" if isinstance(path[depth], int) else keys.format_key(path[depth:])
    return Problem(override.label, message, key, None, *clip_line(text, start, stop - start))


def clip_line(line: str, start: int, length: int = 1) -> tuple[str, int, int]:
    """Return a line for the screen, place and length of what is marked: no control characters, no endless lines."""
    clean = "".join(c if c.isprintable() else " " if c == "\t" else "\ufffd" for c in line)
    if len(clean) > MAX_SHOWN:
        first = max(0, min(start - MAX_SHOWN // 3, len(clean) - MAX_SHOWN))
        left, right = "…" if first else "", "…" if first + MAX_SHOWN < len(clean) else ""
        clean, start = left + clean[first : first + MAX_SHOWN] + right, start - first + len(left)
    return clean, start, max(1, min(length, len(clean) - start))


def locate(text: str) -> dict[keys.KeyPath, Place]:
    """Map every path of a valid TOML text (lines end with a line feed) to its place; the first one of a table."""
    scanner = _Scanner(text)
    table: keys.KeyPath = ()
    at = keys.skip(text, 0, _SPACE)
    while at < len(text):
        if text[at] == "[":
            table, at = scanner.header(at)
        else:
            at = scanner.pair(table, at)
        at = keys.skip(text, at, _SPACE)
    return scanner.places


class _Scanner:
    """One walk over a text; the first mention of a table counts."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.line_starts = [0, *(match.end() for match in re.finditer("\n", text))]
        self.places: dict[keys.KeyPath, Place] = {}
        self.list_sizes: dict[keys.KeyPath, int] = {}

    def header(self, at: int) -> tuple[keys.KeyPath, int]:
        """Read [a.b] or [[a.b]]: the path of the table that starts here, and the end of the header."""
        brackets = 2 if self.text.startswith("[[", at) else 1
        start = keys.skip(self.text, at + brackets)
        parts, end = keys.read_key(self.text, start)
        span = self.span(start, end)
        path: keys.KeyPath = ()
        for part in parts[:-1]:
            path = self.latest((*path, part))
            self.places.setdefault(path, Place(span, span))
        path = (*path, parts[-1])
        self.places.setdefault(path, Place(span, span))
        if brackets == 2:
            self.list_sizes[path] = self.list_sizes.get(path, 0) + 1
            path = self.latest(path)
            self.places[path] = Place(span, span)
        return path, keys.skip(self.text, end) + brackets

    def latest(self, path: keys.KeyPath) -> keys.KeyPath:
        """Step into the newest element where the path is an array of tables."""
        size = self.list_sizes.get(path, 0)
        return (*path, size - 1) if size else path

    def pair(self, table: keys.KeyPath, at: int) -> int:
        """Read key = value below a table."""
        parts, end = keys.read_key(self.text, at)
        start = keys.skip(self.text, keys.skip(self.text, end) + 1)
        path = (*table, *parts)
        after = self.value(path, start)
        place = Place(self.span(at, end), self.span(start, after))
        for size in range(len(table) + 1, len(path)):
            self.places.setdefault(path[:size], place)
        self.places[path] = place
        return after

    def value(self, path: keys.KeyPath, at: int) -> int:
        """Pass one value and record what is inside it; return its end."""
        opening, number = self.text[at : at + 1], 0
        if opening not in ("[", "{"):
            return keys.skip(self.text, at, _VALUE)
        closing = "]" if opening == "[" else "}"
        at = keys.skip(self.text, at + 1, _SPACE)
        while at < len(self.text) and self.text[at] != closing:
            if opening == "{":
                at = self.pair(path, at)
            else:
                start, at = at, self.value((*path, number), at)
                span = self.span(start, at)
                self.places[*path, number] = Place(span, span)
                number += 1
            at = keys.skip(self.text, at, _SPACE)
            if self.text.startswith(",", at):
                at = keys.skip(self.text, at + 1, _SPACE)
        return at + 1

    def span(self, start: int, end: int) -> Span:
        """Return line and column of a part, cut at the end of its first line."""
        line = bisect.bisect_right(self.line_starts, start)
        first = self.line_starts[line - 1]
        newline = self.text.find("\n", start, end)
        return Span(line, start - first, (end if newline < 0 else newline) - start)


MAX_BYTES = 1_000_000
MAX_PROBLEMS = 50
Pair = tuple[str | Sequence[str], object]
TOO_DEEP = "tables or lists are nested too deeply for a scenario"
_PART = r"(?:[A-Za-z0-9_-]++|\"[^\"\n]*+\"|'[^'\n]*+')"
ENDLESS_KEY = re.compile(rf"(?<![A-Za-z0-9_-]){_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{{keys.MAX_PARTS}}}")
"""A dotted key (or a text like one) that would keep tomllib busy for minutes; it takes the square of the parts."""


@dataclass(frozen=True)
class Document:
    """Raw data of one scenario with its text, so that mistakes can be shown in their line.

    Relative paths inside are resolved against `folder`; with `allow_outside` they may lead anywhere. In a
    folder of results (`is_stored`) no link is followed: it may come from somebody else and lead to a private file.
    """

    data: keys.Data
    source: ScenarioText
    folder: Path = Path()
    overrides: tuple[keys.Override, ...] = ()
    allow_outside: bool = field(default_factory=lambda: input_files.access.get()[0])
    is_stored: bool = False

    @classmethod
    def read(cls, path: Path | str, *, is_stored: bool = False) -> Self:
        """Read a TOML file, `is_stored` in a folder of results.

        Raises InputMissingError where it cannot be read, ScenarioError where it is not TOML, InvalidInputError where it
        is not a regular file.
        """
        path = Path(path)
        if input_files.is_folder(path):
            similar = _similar_file(path / path.name)
            raise InputMissingError(f"{path}: this is a folder; a scenario file is needed{similar}")
        try:
            content = input_files.read_head(path, MAX_BYTES + 1, links=not is_stored)
        except input_files.NoSuchFileError as error:
            raise InputMissingError(f"{error}{_similar_file(path)}") from None
        message = f"larger than {MAX_BYTES // 1_000_000} MB; this is not a scenario" if len(content) > MAX_BYTES else ""
        try:
            text = content.decode("utf-8-sig")
        except UnicodeDecodeError:
            text, message = "", message or "not a text file in UTF-8"
        if message or "\0" in text:
            raise ScenarioError([Problem(str(path), message or "not a text file")])
        return replace(cls.parse(text, str(path), path.parent), is_stored=is_stored)

    @classmethod
    def parse(cls, text: str, where: str = "scenario", folder: Path = Path()) -> Self:
        """Take the text of a TOML file, named `where` in messages.

        Raises ScenarioError where it is not TOML.
        """
        source = ScenarioText(where, text.replace("\r\n", "\n"))
        endless = ENDLESS_KEY.search(source.text)
        if endless is not None:
            before = source.text[: endless.start()]
            span = Span(before.count("\n") + 1, len(before) - (before.rfind("\n") + 1), 1)
            raise ScenarioError([source.problem_in(TOO_DEEP, "", span)])
        try:
            data = cast("keys.Data", keys.freeze(tomllib.loads(source.text)))
        except tomllib.TOMLDecodeError as error:
            raise ScenarioError([source.syntax_problem(error)]) from None
        except (RecursionError, keys.TooDeepError):
            raise ScenarioError([Problem(where, TOO_DEEP)]) from None
        except ValueError as error:  # whole numbers with thousands of digits
            raise ScenarioError([Problem(where, f"not valid TOML: {error}")]) from None
        if not data:
            raise ScenarioError([Problem(where, "the file is empty; a scenario starts with schema = 1 and a name")])
        return cls(data, source, folder)

    @classmethod
    def from_mapping(cls, data: Mapping[str, object], folder: Path = Path()) -> Self:
        """Take data from Python in the form of a file; raises ScenarioError where it is nested too deeply."""
        try:
            return cls(cast("keys.Data", keys.freeze(data)), ScenarioText("scenario"), folder)
        except keys.TooDeepError:
            raise ScenarioError([Problem("scenario", TOO_DEEP)]) from None

    def with_values(self, values: Mapping[str, object]) -> Self:
        """Set values by dotted key; raises ScenarioError where a key leads nowhere."""
        pairs = [*values.items()]
        return self._with([(f"value {key}", f"{key} = {units.toml(value)}", (key, value)) for key, value in pairs])

    def with_settings(self, settings: Sequence[str]) -> Self:
        """Set values as --set takes them ("contact.stiffness_scale=0.1"); raises ScenarioError."""
        return self._with([(f"--set {clip_line(text, 0)[0]}", text, None) for text in settings])

    def without_sweep(self) -> Self:
        """Leave out the table [sweep]: what a study varies itself."""
        return replace(self, data={key: entry for key, entry in self.data.items() if key != "sweep"})

    def _with(self, settings: Sequence[tuple[str, str, Pair | None]]) -> Self:
        """Set one value after the other, of which each has a name, a text, and key and value if these are known.

        Raises ScenarioError with all that cannot be set.
        """
        data, overrides, problems = self.data, list(self.overrides), []
        for label, text, pair in settings:
            try:
                key, value = keys.parse_override(text) if pair is None else pair
                data, path = keys.with_value(data, key, input_files.user_value(key, value) if pair is None else value)
                overrides.append(keys.Override(label, text, path))
            except (keys.UnfitOverrideError, keys.TooDeepError) as error:
                problems.append(override_problem(keys.Override(label, text, ()), (), str(error), "key"))
        if problems:
            raise ScenarioError(problems)
        return replace(self, data=data, overrides=tuple(overrides))

    def file_access(self) -> AbstractContextManager[None]:
        """Allow the tables to be read that this document may name."""
        return input_files.file_access(anywhere=self.allow_outside, links=not self.is_stored)

    def build(self) -> Scenario:
        """Validate; raises ScenarioError with every mistake, those in the file first and by line."""
        return self.examined()[0]

    def examined(self) -> tuple[Scenario, Placement]:
        """Return the same with all blocks as they were placed to validate it."""
        with self.file_access():
            scenario, findings, placed = check.examine(self.data, self.folder)
        if scenario is not None:
            return scenario, placed()
        problems = list(dict.fromkeys(self.problem(finding) for finding in findings))
        problems.sort(key=lambda p: (p.line_number is None, p.line_number or 0, p.caret_start))
        more = [Problem(self.source.where, "more mistakes follow")] if len(problems) > MAX_PROBLEMS else []
        raise ScenarioError([*problems[:MAX_PROBLEMS], *more])

    def problem(self, finding: mistakes.Mistake) -> Problem:
        """Show a finding where it can be corrected: in a value set from outside, or else in the text."""
        causes = [one for one in reversed(self.overrides) if self._is_cause(one, finding)]
        # what set the value itself, before what is only beside it
        override = max(causes, key=lambda one: finding.path[: len(one.path)] == one.path, default=None)
        if override is None:  # something may be missing in a table that is not in the text but was created from outside
            table = finding.path[:-1]
            created = reversed(self.overrides) if table and table not in self.source.places else ()
            override = next((one for one in created if one.path[: len(table)] == table), None)
        if override is not None:
            return override_problem(override, finding.path, finding.message, finding.at)
        return self.source.problem(finding.path, finding.message, finding.at)

    def _is_cause(self, override: keys.Override, finding: mistakes.Mistake) -> bool:
        path, found = override.path, finding.path
        inside = found[: len(path)] == path
        on_the_way = path[: len(found)] == found and found not in self.source.places
        beside = finding.relation and path[:-1] == found[:-1]
        return inside or (bool(found) and on_the_way) or beside


@runtime_checkable
class HasDocument(Protocol):
    """A model, with the text of its scenario."""

    document: Document


Source = Path | str | Mapping[str, object] | Scenario | Document | HasDocument
"""What a scenario can be loaded from."""


def load_scenario(
    source: Source, overrides: Mapping[str, object] | Sequence[str] = (), *, allow_outside: bool = False
) -> Scenario:
    """Read and check a scenario: a file, nested dictionaries in the form of the file, or an existing scenario.

    `overrides` are "key=value" texts as given to --set, or dotted keys with Python values. Tables that the file names
    must lie below its folder or below the current one, unless `allow_outside` is given or an override names them.
    Raises ScenarioError with all mistakes together, and InputMissingError where the file itself cannot be read.

    >>> load("scenarios/slide.toml", {"gravity": "1.62 m/s^2"}).gravity.magnitude
    1.62
    """
    document = document_of(source)
    document = replace(document, allow_outside=allow_outside or document.allow_outside)
    if not isinstance(overrides, Mapping):
        return document.with_settings(overrides).build()
    return document.with_values({key: input_files.user_value(key, value) for key, value in overrides.items()}).build()


def scenario_from_mapping(
    data: Mapping[str, object], base_folder: Path = Path(), *, allow_outside: bool = False
) -> Scenario:
    """Check a scenario given as nested dicts and lists in the form of the file; raises ScenarioError.

    Tables as in `load_scenario`.
    """
    document = Document.from_mapping(data, base_folder)
    return replace(document, allow_outside=allow_outside or document.allow_outside).build()


def replace_values(scenario: Scenario, changes: Mapping[str, object]) -> Scenario:
    """Return a scenario with some keys changed, validated as a file would be.

    `changes` are dotted keys with Python values or strings with a unit: {"ground.tilt": "10 deg"}. The given
    scenario is unchanged. Raises ScenarioError with all mistakes together.

    >>> replace(load("scenarios/slide.toml"), {"friction.block_ground": 0.5}).friction.block_ground.kinetic
    0.5
    """
    return load_scenario(scenario, changes)


def document_of(source: Source) -> Document:
    """Return the document of a file, of nested dictionaries, or of a scenario.

    Tables of an existing scenario may lie anywhere. Raises what reading raises.
    """
    if isinstance(source, Document):
        return source
    if isinstance(source, HasDocument):
        return source.document
    if isinstance(source, Scenario):
        return replace(Document.parse(resolution.scenario_to_toml(source), source.name), allow_outside=True)
    return Document.from_mapping(source) if isinstance(source, Mapping) else Document.read(source)


def _similar_file(path: Path) -> str:
    """Suggest the scenario in the same folder with the most similar name."""
    try:
        names = sorted(entry.name for entry in path.parent.glob("*.toml"))
    except OSError:
        names = []
    by_stem = {Path(name).stem: name for name in names}  # the ending that all share makes any two names similar
    similar = difflib.get_close_matches(path.stem, by_stem, n=1)
    return f", did you mean '{path.parent / by_stem[similar[0]]}'?" if similar else ""

"""Text that users read, kept in golden files beside the tests: the fixture `golden` compares, `make golden` rewrites.

tests/cli/golden/new.txt has what tests/cli/test_new.py expects: a section for every text, headed by the name of its
test, with parameters, and after a slash by the name of the text where a test has several:

    === test_help[run]
    === test_full_disk / stderr

A test only ever compares. It fails where its section is missing, where it did not use one of its sections, and, the
first of a file, where there are sections of no test. `make golden` writes what all tests print; read its difference.
"""

import difflib
import re
from collections import defaultdict
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

import pytest

ROOT = Path(__file__).parents[1]
HEAD = "=== "
SLASH = " / "

# What differs from run to run and may be left out of a text, by the names that tests ask for it with. The last one
# keeps nine digits of numbers, as mathematical functions may end in other bits elsewhere.
RULES: dict[str, tuple[re.Pattern[str], str | Callable[[re.Match[str]], str]]] = {
    "times": (re.compile(r"\b\d+(?:\.\d+)?(?:e-?\d+)? (?:us|ms|s|min|h)\b"), "TIME"),
    "sizes": (re.compile(r"\b\d+(?:\.\d+)? (?:B|kB|KB|KiB|MB|MiB|GB|GiB)\b"), "SIZE"),
    "hashes": (re.compile(r"(?<!\.)\b[0-9a-f]{12,64}\b"), "HASH"),
    "counts": (re.compile(r"\b\d+(?= (?:frames|steps|stored|now)\b)"), "COUNT"),
    "numbers": (re.compile(r"\b\d+\.\d+(?:e[+-]?\d+)?\b"), "NUMBER"),
    "digits": (re.compile(r"\b\d+\.\d+(?:e[+-]?\d+)?\b"), lambda found: f"{float(found[0]):.9g}"),
}

Sections = dict[str, str]  # texts by the headings of their sections


class Golden(Protocol):
    """Compare a text with its section of the golden file: the signature of the fixture `golden`."""

    def __call__(self, text: str, name: str = "", *, rules: Sequence[str] = ()) -> None:
        """`name` tells several texts of a test apart; `rules` are those of RULES that apply besides paths."""


def normalised(text: str, rules: Sequence[str] = (), folders: Mapping[str, Path] | None = None) -> str:
    """Return a text without blank ends of lines, with folders and what rules say replaced by words."""
    for word, folder in (folders or {}).items():
        text = text.replace(str(folder), word)
    for pattern, instead in (RULES[rule] for rule in rules):
        text = pattern.sub(instead, text)
    return "\n".join(line.rstrip() for line in text.split("\n")).strip("\n")


def parsed(content: str) -> Sections:
    """Return the sections of a golden file."""
    sections: Sections = {}
    for part in f"\n{content}".split(f"\n{HEAD}")[1:]:
        heading, _, text = part.partition("\n")
        if heading in sections:
            raise ValueError(f"two sections are called {heading!r}")
        sections[heading] = text.strip("\n")
    return sections


def rendered(sections: Sections) -> str:
    """Return the content of a golden file."""
    for heading, text in sections.items():
        if f"\n{HEAD}" in f"\n{text}":
            raise ValueError(f"{heading}: a line begins as headings of golden files do")
    return "\n\n".join(f"{HEAD}{heading}\n{text}" for heading, text in sections.items()) + "\n"


def difference(expected: str, text: str) -> str:
    """Return what has changed, line by line, with all that has not."""
    lines = difflib.unified_diff(expected.split("\n"), text.split("\n"), "golden", "printed", lineterm="", n=1000)
    return "\n".join(lines)


def test_of(heading: str) -> str:
    """Return the name of the test that a section belongs to."""
    return heading.partition(SLASH)[0]


@dataclass
class Book:
    """The golden files of a session."""

    updating: bool
    collected: dict[Path, list[str]] = field(default_factory=dict)  # tests of every file, in their order
    first: dict[Path, str] = field(default_factory=dict)  # the test that looks for sections of no test
    printed: dict[Path, dict[str, Sections]] = field(default_factory=lambda: defaultdict(dict))  # by test
    written: list[str] = field(default_factory=list)
    files: dict[Path, Sections] = field(default_factory=dict)

    def collect(self, items: Sequence[pytest.Item], *, whole_files: bool) -> None:
        """Learn what tests there are, before any is deselected."""
        for item in items:
            if whole_files:
                self.collected.setdefault(item.path, []).append(item.name)
            if _uses_golden(item):
                self.first.setdefault(item.path, item.nodeid)

    def read_once(self, file: Path) -> Sections:
        """Return the sections of a golden file, for all tests that compare with it."""
        if file not in self.files:
            self.files[file] = read(file)
        return self.files[file]

    def without_test(self, path: Path, headings: Sequence[str]) -> list[str]:
        """Return the headings of sections that no test of a file has; none where not all tests were collected."""
        tests = self.collected.get(path)
        return [] if tests is None else [heading for heading in headings if test_of(heading) not in tests]

    def write(self) -> None:
        """Write what tests printed; sections of tests that did not run or did not pass stay."""
        for path, printed in self.printed.items():
            file = file_of(path)
            before = read(file)
            gone = self.without_test(path, list(before))
            sections = {key: text for key, text in before.items() if test_of(key) not in printed and key not in gone}
            sections |= {key: text for of_test in printed.values() for key, text in of_test.items()}
            place = {name: number for number, name in enumerate(self.collected.get(path, ()))}
            ordered = dict(sorted(sections.items(), key=lambda item: place.get(test_of(item[0]), len(place))))
            if ordered != before:
                file.parent.mkdir(exist_ok=True)
                file.write_bytes(rendered(ordered).encode())
                self.written.append(f"{len(sections.items() ^ before.items())} differences written: {file}")


def file_of(path: Path) -> Path:
    """Return the golden file of a file of tests."""
    return path.parent / "golden" / f"{path.stem.removeprefix('test_')}.txt"


def read(file: Path) -> Sections:
    """Return the sections of a golden file; none where it is not there."""
    return parsed(file.read_bytes().decode()) if file.exists() else {}


BOOK = pytest.StashKey[Book]()
PASSED = pytest.StashKey[bool]()


def _uses_golden(item: pytest.Item) -> bool:
    return "golden" in getattr(item, "fixturenames", ())


class Page:
    """What one test compares."""

    def __init__(self, book: Book, node: pytest.Item, folders: Callable[[], Mapping[str, Path]]) -> None:
        self.book = book
        self.node = node
        self.folders = folders
        self.file = file_of(node.path)
        self.sections = book.read_once(self.file)
        self.printed: Sections = {}
        if SLASH in node.name:
            pytest.fail(f"the name of a test with golden texts must not contain {SLASH!r}", pytrace=False)

    def fail(self, problem: str) -> None:
        """Fail the test in its own words, without a traceback."""
        pytest.fail(f"{self.file.relative_to(self.node.config.rootpath)}: {problem}", pytrace=False)

    def compare(self, text: str, name: str = "", *, rules: Sequence[str] = ()) -> None:
        """Compare one text, or keep it where golden files are updated."""
        heading = f"{self.node.name}{SLASH}{name}" if name else self.node.name
        if heading in self.printed:
            self.fail(f"the test has two texts for {heading!r}; give them names")
        text = self.printed[heading] = normalised(text, rules, self.folders())
        if self.book.updating:
            return
        if heading not in self.sections:
            self.fail(f"no section {heading!r}; `make golden` would write\n{text}")
        if text != self.sections[heading]:
            self.fail(f"{heading}\n{difference(self.sections[heading], text)}\n`make golden` accepts what was printed")

    def check_headings(self) -> None:
        """Fail where there are sections that no test has; one test of a file says so."""
        if self.book.updating or self.book.first[self.node.path] != self.node.nodeid:
            return
        gone = self.book.without_test(self.node.path, list(self.sections))
        if gone:
            self.fail(f"sections of no test, which `make golden` removes: {', '.join(gone)}")

    def close(self) -> None:
        """Fail where the test, which has passed, left one of its sections unused."""
        if self.book.updating:
            self.book.printed[self.node.path][self.node.name] = self.printed
            return
        own = [heading for heading in self.sections if test_of(heading) == self.node.name]
        unused = [heading for heading in own if heading not in self.printed]
        if unused:
            self.fail(f"unused sections, which `make golden` removes: {', '.join(unused)}")


@pytest.fixture
def golden(request: pytest.FixtureRequest) -> Iterator[Golden]:
    """Compare texts with the golden file of the test, with the test's folder and the checkout replaced by words."""

    def folders() -> Mapping[str, Path]:
        of_test = {"TMP": request.getfixturevalue("tmp_path")} if "tmp_path" in request.fixturenames else {}
        return of_test | {"CHECKOUT": ROOT}

    page = Page(request.config.stash[BOOK], request.node, folders)
    page.check_headings()
    yield page.compare
    if request.node.stash.get(PASSED, False):
        page.close()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option that `make golden` has."""
    parser.addoption("--update-golden", action="store_true", help="write golden files instead of comparing with them")


def pytest_configure(config: pytest.Config) -> None:
    """Start a book."""
    updating = bool(config.getoption("update_golden"))
    if updating and config.getoption("numprocesses", None):
        raise pytest.UsageError("--update-golden writes files: one process only (-n 0)")
    config.stash[BOOK] = Book(updating)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Learn which tests there are; an update runs those alone that have golden texts."""
    book = config.stash[BOOK]
    in_part = any("::" in argument for argument in config.args) or config.getoption("lf", default=False)
    book.collect(items, whole_files=not in_part)
    if book.updating:
        config.hook.pytest_deselected(items=[item for item in items if not _uses_golden(item)])
        items[:] = [item for item in items if _uses_golden(item)]


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Tell the fixture, which ends later, whether its test has passed."""
    report = yield
    if call.when == "call":
        item.stash[PASSED] = call.excinfo is None
    return report


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Write what an update has kept."""
    session.config.stash[BOOK].write()


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """Say which files an update has written."""
    book = config.stash[BOOK]
    for line in book.written or (["all golden files are as the tests print"] if book.updating else []):
        terminalreporter.write_line(line)

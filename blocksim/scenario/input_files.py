"""Files and tables that others may have made: what a scenario may name, how much is read, where cells are."""

import errno
import os
import re
import stat
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO, NoReturn

from blocksim.errors import InputMissingError, InvalidInputError, Problem
from blocksim.scenario.spelling import did_you_mean_or_list, nearest
from blocksim.scenario.units import toml

MEGABYTE = 1_000_000
IS_LINK = "a link; links in result folders are not followed"
KINDS = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a pipe; save its content in a file first"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISSOCK, "a socket"),
)


class NoSuchFileError(InputMissingError):
    """Nothing of this name exists."""


def is_folder(path: Path) -> bool:
    """Return True for a folder, or a link to one; False also for a name that no file can have."""
    try:
        return path.is_dir()
    except (OSError, ValueError):
        return False


def open_regular(path: Path, *, links: bool = False) -> BinaryIO:
    """Open a regular file for reading, without waiting for the other end of a pipe.

    Raises InputMissingError where there is no file or it cannot be read, InvalidInputError where it is a folder, a pipe
    or a device, or, without `links`, where its last part is a link.
    """
    extra = getattr(os, "O_NONBLOCK", 0) | (0 if links else getattr(os, "O_NOFOLLOW", 0))
    try:
        check_regular(path, links=links)
        descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0) | extra)
    except (OSError, ValueError) as error:  # ValueError: a null character in the name
        raise read_error(path, error) from None
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):  # replaced in the meantime
        os.close(descriptor)
        raise InvalidInputError(f"{path}: not a file")
    return os.fdopen(descriptor, "rb")


def check_regular(path: Path, *, links: bool = False) -> int:
    """Return the size (bytes) of a regular file that a library will open by itself. Raises as `open_regular`."""
    try:
        found = path.stat(follow_symlinks=links)
    except (OSError, ValueError) as error:
        raise read_error(path, error) from None
    if stat.S_ISLNK(found.st_mode):
        raise InvalidInputError(f"{path}: {IS_LINK}")
    if not stat.S_ISREG(found.st_mode):
        kind = next((what for is_kind, what in KINDS if is_kind(found.st_mode)), "")
        raise InvalidInputError(f"{path}: not a file{kind and ', but '}{kind}")
    return found.st_size


def read_limited(path: Path, limit: int, *, links: bool = False) -> bytes:
    """Return what a file holds, at most `limit` bytes. Raises as `open_regular`, InvalidInputError for a larger one."""
    content = read_head(path, limit + 1, links=links)
    refuse_large(path, limit, len(content))
    return content


def read_head(path: Path, count: int, *, links: bool = False) -> bytes:
    """Return the first bytes of a file, at most `count`. Raises as `open_regular`."""
    with open_regular(path, links=links) as file:
        try:
            return file.read(count)
        except OSError as error:
            raise read_error(path, error) from None


def refuse_large(path: Path, limit: int, size: int | None = None) -> None:
    """Check a size, or that of a file that a library will open by itself. Raises as `read_limited`."""
    if (check_regular(path) if size is None else size) > limit:
        raise InvalidInputError(f"{path}: larger than {limit / MEGABYTE:g} MB, the limit for this file")


def read_error(path: Path, error: OSError | ValueError) -> InputMissingError | InvalidInputError:
    """Return the error to raise for a file that cannot be opened or read."""
    number = getattr(error, "errno", None)
    if number == errno.ENOENT:
        return NoSuchFileError(f"{path}: no such file")
    if number == errno.EISDIR:
        return InvalidInputError(f"{path}: not a file, but a folder")
    reason = getattr(error, "strerror", None) or str(error)
    return InputMissingError(f"{path}: cannot be read: {reason}")


access = ContextVar("access", default=(False, True))  # whether any file may be named, whether links are followed


class UserPath(str):
    """A path that the user gave in addition to the scenario; it may lead anywhere."""

    __slots__ = ()


class OutOfReachError(ValueError):
    """A path that leads outside, or to no file; the text has the reason."""


@contextmanager
def file_access(*, anywhere: bool, links: bool = True) -> Iterator[None]:
    """Let scenarios that are read meanwhile name any file, or only those within reach; and links or not."""
    before = access.set((anywhere, links))
    try:
        yield
    finally:
        access.reset(before)


def user_value(key: str | Sequence[str | int], value: object) -> object:
    """Mark a value that the user sets, if it is the path of a table."""
    last = key.rpartition(".")[2] if isinstance(key, str) else key[-1]
    return UserPath(value) if last == "table" and isinstance(value, str) else value


def table_in(folder: Path | str, text: str) -> Path:
    """Return the file that a scenario in `folder` names, all links followed. Raises OutOfReachError."""
    is_by_hand = isinstance(text, UserPath)
    is_anything_allowed, follows_links = access.get()
    if not follows_links and not is_by_hand and Path(folder, text).is_symlink():
        raise OutOfReachError(f"{toml(text)}: {IS_LINK}")
    try:
        table = Path(folder, text).resolve()
        here = Path.cwd()
        roots = [Path(folder).resolve()]
        if not Path.home().resolve().is_relative_to(here):  # else the current folder is the home folder, or above it
            roots.append(here)
        if not (is_anything_allowed or is_by_hand or any(table.is_relative_to(root) for root in roots)):
            where = "leads outside the scenario's folder and the current folder"
            raise OutOfReachError(f"{toml(text)}: {where}; --allow-outside (in Python allow_outside=True) to override")
        what = "" if table.is_file() else "no such file" if not table.exists() else "is a pipe or a device, not a file"
        if table.is_dir():
            what = "is a folder, not a table"
    except (OSError, RuntimeError) as error:  # a name that is too long; links in a circle
        reason = getattr(error, "strerror", None) or str(error)
        raise OutOfReachError(f"{toml(text)}: cannot be read: {reason}") from None
    if what:
        raise OutOfReachError(f"{toml(text)}: {what} (paths are relative to the scenario file)")
    return table


def relative_path(path: str) -> str:
    """Return a path as seen from the current folder, where it lies below."""
    here = Path.cwd()
    return str(Path(path).relative_to(here)) if Path(path).is_relative_to(here) else path


LARGEST_FILE = 1_000_000  # bytes
LONGEST_LINE = 1_000  # characters

CELLS = {sign: re.compile(rf'[ ]*("(?:[^"]|"")*"|[^"{sign}]*)[ ]*({sign}|$)') for sign in (",", ";")}
EMPTY = "the table is empty"
QUOTED = re.compile(r'^"([^"]*)"$')
NUMBER = re.compile(r"[+-]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][+-]?[0-9]+)?")


@dataclass(frozen=True)
class Line:
    """One line of the file, counted from 1, with its text for a terminal."""

    where: str
    number: int
    text: str

    def problem(self, message: str, key: str = "", start: int = 0, length: int | None = None) -> Problem:
        """Locate a mistake in this line; without `length` the whole line is marked."""
        shown = self.text if len(self.text) <= LONGEST_LINE else self.text[:80] + " ..."
        return Problem(self.where, message, key, self.number, shown, start, len(shown) if length is None else length)


@dataclass(frozen=True)
class TableCell:
    """One cell: its text without quotes and surrounding blanks, and its place."""

    column: str
    text: str
    line: Line
    start: int
    length: int
    separator: str = ","

    def problem(self, message: str) -> Problem:
        """Locate a mistake in this cell."""
        return self.line.problem(message, self.column, self.start, self.length)

    def number(self) -> float:
        """Return the finite number in this cell; raises ValueError with a message for the user."""
        text = plain_number(self.text, self.separator)
        if not NUMBER.fullmatch(text):
            raise ValueError(f"'{self.text}' is not a number, write it as 71.69 or 7.169e1")
        value = float(text)
        if abs(value) == float("inf"):
            raise ValueError(f"'{self.text}' is too large")
        return value


def separator_of(header: str) -> str:
    """Return what separates the columns of a table: semicolons as of spreadsheets where decimals have a comma."""
    return ";" if ";" in header and "," not in header else ","


def plain_number(text: str, separator: str) -> str:
    """Return a number with its decimal point, for which a table with semicolons may have a comma."""
    return text.replace(",", ".") if separator == ";" and text.count(",") == 1 and "." not in text else text


@dataclass
class CsvTable:
    """The rows of one file, its comment lines, and the mistakes found so far."""

    where: str
    notes: tuple[str, ...]
    header: Line
    heads: tuple[TableCell, ...]  # of the header; their own column is empty where any columns may be there
    rows: list[dict[str, TableCell]] = field(default_factory=list)
    problems: list[Problem] = field(default_factory=list)


def read_table(path: Path, columns: Sequence[str] = (), limit: int = LARGEST_FILE) -> CsvTable:
    """Read a table that has exactly these columns, in any order; or any, if none are given, each with a name.

    Columns are separated by commas; or by semicolons, and then decimals may have a comma.
    `limit` is the largest size in bytes. Rows of the wrong shape are left out and recorded in `problems`, and so are
    misspelt columns. Raises InputMissingError when the file cannot be read and InvalidInputError when it is not a text
    file or its header is wrong.
    """
    lines = _lines(path, limit)
    content = [line for line in lines if line.text.strip() and not line.text.lstrip().startswith("#")]
    needed = f"its first line must be {','.join(columns)}"
    if not content:
        raise_problems([Problem(str(path), EMPTY + (f", {needed}" if columns else ""))])
    line, separator = content[0], separator_of(content[0].text)
    places = _cells(line, separator)
    if places is None:
        raise_problems([line.problem(_shape_complaint(line, places, 0, separator))])
    heads = tuple(TableCell(place[0] if columns else "", *place) for place in places)
    names = [head.text for head in heads]
    problems = []
    for index, head in enumerate(heads):
        if head.text in names[:index] and (head.text or columns):
            problems.append(head.problem("column given twice"))
        elif columns and head.text not in columns:
            problems.append(head.problem(f"unknown column, {did_you_mean_or_list(head.text, columns, 'allowed')}"))
        elif not head.text:
            problems.append(head.problem("this column has no name"))
    missing = [column for column in columns if column not in names]
    if missing:
        plural = "s" if len(missing) > 1 else ""
        problems.append(line.problem(f"missing column{plural} {', '.join(missing)}; {needed}"))
    meant = [name if name in columns else nearest(name, missing, most=len(name)) or name for name in names]
    if problems and sorted(meant) != sorted(columns):
        raise_problems(problems)
    notes = tuple(line.text.strip()[1:].strip() for line in lines if line.text.lstrip().startswith("#"))
    table = CsvTable(str(path), notes, line, heads, problems=problems)
    for row in content[1:]:
        cells = _cells(row, separator)
        complaint = _shape_complaint(row, cells, len(names), separator)
        if complaint or cells is None:
            table.problems.append(row.problem(complaint))
        else:
            named = zip(meant, cells, strict=True)
            table.rows.append({name: TableCell(name, *place, separator) for name, place in named})
    return table


def raise_problems(problems: Sequence[Problem]) -> NoReturn:
    """Raise one InvalidInputError that shows the problems by line; many are cut and counted."""
    by_line = sorted(problems, key=lambda problem: (problem.line_number or 0, problem.caret_start))
    shown = [problem.render() for problem in by_line[:20]]
    if len(by_line) > len(shown):
        shown.append(f"... and {len(by_line) - len(shown)} more problems")
    raise InvalidInputError("\n".join(shown))


def _lines(path: Path, limit: int) -> list[Line]:
    """Return all lines; tabs and control characters, which shift a caret or steer a terminal, become blanks."""
    if is_folder(path):
        raise InputMissingError(Problem(str(path), "is a folder, not a table").render())
    raw = read_head(path, limit + 1, links=True)
    if len(raw) > limit:
        raise_problems([Problem(str(path), f"the file is too large for a table; the limit is {limit} bytes")])
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = "\0"
    if "\0" in text:
        raise_problems([Problem(str(path), "not a text file (a table is UTF-8 text)")])
    return [
        Line(str(path), number, "".join(letter if letter.isprintable() else " " for letter in line))
        for number, line in numbered_lines(text)
    ]


def numbered_lines(text: str) -> Iterator[tuple[int, str]]:
    """Yield number (from 1) and text of every line, whatever system wrote it."""
    return enumerate(text.replace("\r\n", "\n").replace("\r", "\n").split("\n"), start=1)


def _cells(line: Line, separator: str) -> list[tuple[str, Line, int, int]] | None:
    """Split a line into its cells; None when its quotes do not match."""
    cells = []
    position = 0
    while len(line.text) <= LONGEST_LINE:
        match = CELLS[separator].match(line.text, position)
        if match is None:
            return None
        content = match[1].strip()
        text = content[1:-1].replace('""', '"').strip() if content.startswith('"') else content
        cells.append((text, line, match.start(1), len(content)))
        position = match.end()
        if match[2] == "":
            return cells
    return None


def _shape_complaint(line: Line, cells: list[tuple[str, Line, int, int]] | None, count: int, separator: str) -> str:
    """Return the error in the shape of a row, or nothing."""
    if len(line.text) > LONGEST_LINE:
        return f"the line has {len(line.text)} characters, at most {LONGEST_LINE} are read"
    if cells is None:
        return "quotes do not match"
    hint = " (decimals with a comma need semicolons between columns)" if len(cells) > count and separator == "," else ""
    return f"{len(cells)} cells where the header has {count} columns{hint}" if len(cells) != count else ""

"""Comma-separated tables that users write, with `#` comment lines: read up to a size, every cell with its place.

Tables of measurements, properties, cases and runs are read with the place of each cell; tables of motion, which may
have half a million lines, as bare rows. Tables that blocksim itself has written are read where they are written.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn

from blocksim.errors import InputMissingError, InvalidInputError, Problem
from blocksim.scenario.bounded_read import is_folder, read_head
from blocksim.scenario.spelling import nearest, suggestion

LARGEST_FILE = 1_000_000  # bytes
LONGEST_LINE = 1_000  # characters
MOST_PROBLEMS_SHOWN = 20

CELL = re.compile(r'[ ]*("(?:[^"]|"")*"|[^",]*)[ ]*(,|$)')
DIALECT = "separate them by commas, and write decimals with a point"
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
        return Problem(
            where=self.where,
            message=message,
            key=key,
            line_number=self.number,
            line_text=shown,
            caret_start=start,
            caret_length=len(shown) if length is None else length,
        )


@dataclass(frozen=True)
class Cell:
    """One cell: its text without quotes and surrounding blanks, and its place."""

    column: str
    text: str
    line: Line
    start: int
    length: int

    def problem(self, message: str) -> Problem:
        """Locate a mistake in this cell."""
        return self.line.problem(message, self.column, self.start, self.length)

    def number(self) -> float:
        """Return the finite number in this cell; raises ValueError with a message for the user."""
        if not NUMBER.fullmatch(self.text):
            raise ValueError(f"'{self.text}' is not a number, write it as 71.69 or 7.169e1")
        value = float(self.text)
        if abs(value) == float("inf"):
            raise ValueError(f"'{self.text}' is too large")
        return value


@dataclass
class Table:
    """The rows of one file, its comment lines, and the mistakes found so far."""

    where: str
    notes: tuple[str, ...]
    header: Line
    rows: list[dict[str, Cell]] = field(default_factory=list)
    problems: list[Problem] = field(default_factory=list)


def read_table(path: Path, columns: Sequence[str]) -> Table:
    """Read a table that has exactly these columns, in any order.

    Rows of the wrong shape are left out and recorded in `problems`, and so are misspelt columns. Raises
    InputMissingError when the file cannot be read and InvalidInputError when it is not a text file or its header is
    wrong.
    """
    notes, content = _content(_lines(path))
    needed = f"its first line must be {','.join(columns)}"
    if not content:
        raise_problems([Problem(where=str(path), message=f"the table is empty, {needed}")])
    line, heads = content[0], _header(content[0])
    names = [head.text for head in heads]
    problems = []
    for index, head in enumerate(heads):
        if head.text in names[:index]:
            problems.append(line.problem("column given twice", head.text, head.start, head.length))
        elif head.text not in columns:
            message = f"unknown column, {suggestion(head.text, columns)}"
            problems.append(line.problem(message, head.text, head.start, head.length))
    missing = [column for column in columns if column not in names]
    if missing:
        plural = "s" if len(missing) > 1 else ""
        problems.append(line.problem(f"missing column{plural} {', '.join(missing)}; {needed}"))
    meant = [name if name in columns else nearest(name, missing, most=len(name)) or name for name in names]
    if sorted(meant) != sorted(columns):
        raise_problems(problems)
    return _filled(Table(where=str(path), notes=notes, header=line, problems=problems), meant, content[1:])


def read_open_table(path: Path, limit: int) -> tuple[tuple[Cell, ...], Table]:
    """Read a table whose columns are its own choice: the cells of its header, and the rest as `read_table`.

    `limit` is the largest size in bytes. Raises as `read_table`; a header needs names, each once.
    """
    notes, content = _content(_lines(path, limit))
    if not content:
        raise_problems([Problem(where=str(path), message="the table is empty")])
    heads = _header(content[0])
    names = [head.text for head in heads]
    problems = [
        head.problem("column given twice" if head.text else "this column has no name")
        for index, head in enumerate(heads)
        if not head.text or head.text in names[:index]
    ]
    if problems:
        raise_problems(problems)
    return heads, _filled(Table(where=str(path), notes=notes, header=content[0]), names, content[1:])


def bare_rows(content: bytes) -> list[tuple[int, list[str]]]:
    """Return number (from 1) and cells of every line of a table that is neither empty nor a comment; no quotes.

    Raises UnicodeDecodeError where the content is not UTF-8 text.
    """
    lines = _numbered(content.decode("utf-8-sig"))
    kept = [(number, line) for number, line in lines if line.strip() and not _is_comment(line)]
    return [(number, [cell.strip() for cell in line.split(",")]) for number, line in kept]


def _content(lines: Sequence[Line]) -> tuple[tuple[str, ...], list[Line]]:
    """Return the texts of the comments, and the lines that are neither comments nor empty."""
    notes = tuple(line.text.strip()[1:].strip() for line in lines if _is_comment(line.text))
    return notes, [line for line in lines if line.text.strip() and not _is_comment(line.text)]


def _filled(table: Table, names: Sequence[str], lines: Sequence[Line]) -> Table:
    """Add the rows, or the errors in their shape."""
    for line in lines:
        cells = _cells(line)
        complaint = _shape_complaint(line, cells, len(names))
        if complaint or cells is None:
            table.problems.append(line.problem(complaint))
        else:
            named = zip(names, cells, strict=True)
            table.rows.append({name: Cell(name, *place) for name, place in named})
    return table


def raise_problems(problems: Sequence[Problem]) -> NoReturn:
    """Raise one InvalidInputError that shows the problems by line; many are cut and counted."""
    by_line = sorted(problems, key=lambda problem: (problem.line_number or 0, problem.caret_start))
    shown = [problem.render() for problem in by_line[:MOST_PROBLEMS_SHOWN]]
    if len(by_line) > len(shown):
        shown.append(f"... and {len(by_line) - len(shown)} more problems")
    raise InvalidInputError("\n".join(shown))


def _lines(path: Path, limit: int = LARGEST_FILE) -> list[Line]:
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
        for number, line in _numbered(text)
    ]


def _numbered(text: str) -> Iterator[tuple[int, str]]:
    """Yield number (from 1) and text of every line, whatever system wrote it."""
    return enumerate(text.replace("\r\n", "\n").replace("\r", "\n").split("\n"), start=1)


def _is_comment(line: str) -> bool:
    return line.lstrip().startswith("#")


def _cells(line: Line) -> list[tuple[str, Line, int, int]] | None:
    """Split a line at its commas; None when its quotes do not match."""
    cells = []
    position = 0
    while len(line.text) <= LONGEST_LINE:
        match = CELL.match(line.text, position)
        if match is None:
            return None
        content = match[1].strip()
        text = content[1:-1].replace('""', '"').strip() if content.startswith('"') else content
        cells.append((text, line, match.start(1), len(content)))
        position = match.end()
        if match[2] == "":
            return cells
    return None


def _shape_complaint(line: Line, cells: list[tuple[str, Line, int, int]] | None, count: int) -> str:
    """Return the error in the shape of a row, or nothing."""
    if len(line.text) > LONGEST_LINE:
        return f"the line has {len(line.text)} characters, at most {LONGEST_LINE} are read"
    if cells is None:
        return "quotes do not match"
    if len(cells) > count:
        return f"{len(cells)} cells where the header has {count} columns (decimals are written with a point)"
    if len(cells) < count:
        return f"{len(cells)} cells where the header has {count} columns"
    return ""


def _header(line: Line) -> tuple[Cell, ...]:
    """Return the cells of the line with the names of columns.

    Raises InvalidInputError where they cannot be told apart, as in spreadsheets' tables where decimals have a comma.
    """
    if ";" in line.text and "," not in line.text:
        raise_problems([line.problem(f"columns are separated by semicolons; {DIALECT}")])
    places = _cells(line)
    if places is None:
        raise_problems([line.problem(_shape_complaint(line, places, 0))])
    return tuple(Cell("", *place) for place in places)

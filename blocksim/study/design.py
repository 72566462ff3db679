"""The values of all cases of a sweep whose values are given: as lists, or in a table. Each case is made when asked for.

In mode "table" every row of a CSV file is a case:

    # overlaps measured with a feeler gauge
    structures.0.overlap [mm],friction.block_block.kinetic,time.scheme
    10.1,0.19,explicit
    9.8,0.21,nonsmooth

The header names keys of the scenario; a unit in brackets holds for its whole column, otherwise a cell is written as
in a scenario ("10.1 mm"). Lines that begin with `#` are notes.
"""

import functools
import math
import re
from abc import abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar, overload

from blocksim.errors import Problem
from blocksim.scenario import Document, Sweep
from blocksim.scenario import quantities as q
from blocksim.scenario.check import MAX_VARIED, mistakes_of_value, unfit_to_vary
from blocksim.scenario.csv_table import NUMBER, Cell, raise_problems, read_open_table
from blocksim.scenario.models.variation import Variation
from blocksim.scenario.overrides import parse_value

T_co = TypeVar("T_co", covariant=True)
Settings = dict[str, object]
"""Dotted key and value of everything that one case sets."""
LARGEST_FILE = 20_000_000  # bytes
MOST_TRIED = 50
"""Different values of a column that are tried by themselves, beside its least and its greatest number."""
HEAD = re.compile(r"(?P<key>.*?)\s*(?:\[(?P<unit>[^\]]*)\])?")
WHOLE = re.compile(r"[+-]?[0-9]{1,18}")


class MadeOnDemand(Sequence[T_co]):
    """A sequence that keeps none of its entries: each is made when it is asked for."""

    @abstractmethod
    def row(self, number: int) -> T_co:
        """Return an entry, 0 <= number < len."""

    @overload
    def __getitem__(self, number: int) -> T_co: ...
    @overload
    def __getitem__(self, number: slice) -> Sequence[T_co]: ...
    def __getitem__(self, number: int | slice) -> T_co | Sequence[T_co]:
        if isinstance(number, slice):
            return [self.row(index) for index in range(len(self))[number]]
        return self.row(range(len(self))[number])


@dataclass(frozen=True)
class Design(MadeOnDemand[Settings]):
    """The settings of cases, made from one column of values a key."""

    columns: Mapping[str, Sequence[object]]


class Together(Design):
    """The k-th case has the k-th value of every key; all columns are equally long."""

    def __len__(self) -> int:
        """Return the length of any column."""
        return len(next(iter(self.columns.values())))

    def row(self, number: int) -> Settings:
        """Return the values of one row."""
        return {key: column[number] for key, column in self.columns.items()}


class Combinations(Design):
    """Every value of every key with all values of the others; the last key changes fastest."""

    def __len__(self) -> int:
        """Return the product of the lengths."""
        return math.prod(len(column) for column in self.columns.values())

    def row(self, number: int) -> Settings:
        """Return one combination, from the digits of its number."""
        settings: Settings = {}
        for key, column in reversed(list(self.columns.items())):
            number, place = divmod(number, len(column))
            settings[key] = column[place]
        return {key: settings[key] for key in self.columns}


def levels_of(values: Variation) -> tuple[object, ...]:
    """Return the values of a list; a distribution, which no mode without samples accepts, has none to list."""
    return values if isinstance(values, tuple) else ()


def grid(sweep: Sweep) -> Design:
    """Return all combinations; the last key changes fastest."""
    return Combinations({key: levels_of(values) for key, values in sweep.vary.items()})


def listed(sweep: Sweep) -> Design:
    """Return one case for every place in the lists, which are equally long."""
    return Together({key: levels_of(values) for key, values in sweep.vary.items()})


@dataclass(frozen=True)
class Column:
    """One column: the key that it varies, its head, and cell and value of every row."""

    key: str
    head: Cell
    cells: Sequence[Cell]
    values: Sequence[object]


def table(sweep: Sweep) -> Design:
    """Return one case a row. Raises InputMissingError or InvalidInputError with the lines of all mistakes."""
    return Together({column.key: column.values for column in read_columns(sweep.table or Path())})


def read_columns(path: Path) -> list[Column]:
    """Read the columns of a table. Raises InputMissingError or InvalidInputError with the lines of all mistakes."""
    heads, rows = read_open_table(path, LARGEST_FILE)
    problems = list(rows.problems)
    if not rows.rows and not problems:
        problems.append(rows.header.problem("no row follows the header; every row is one case"))
    if len(heads) > MAX_VARIED:
        problems.append(rows.header.problem(f"{len(heads)} columns are too many; at most {MAX_VARIED} can be varied"))
    columns = [_column(head, [row[head.text] for row in rows.rows], problems) for head in heads]
    keys = [column.key for column in columns]
    problems += [c.head.problem("key given twice") for i, c in enumerate(columns) if c.key in keys[:i]]
    if problems:
        raise_problems(problems)
    return columns


def _column(head: Cell, cells: Sequence[Cell], problems: list[Problem]) -> Column:
    found = HEAD.fullmatch(head.text)
    key, unit = (head.text, None) if found is None else (found["key"], found["unit"])
    complaint = unfit_to_vary(key)
    if unit is not None and not complaint:
        try:
            q.parse_quantity(f"1 {unit}", q.LENGTH)
        except ValueError as error:
            complaint = str(error)
    if complaint:
        problems.append(head.problem(complaint))
        return Column(key, head, cells, ())
    values = []
    for cell in cells:
        try:
            values.append(_value(cell, unit))
        except ValueError as error:
            problems.append(cell.problem(str(error)))
    return Column(key, head, cells, values)


def _value(cell: Cell, unit: str | None) -> object:
    """Return a cell as a scenario takes it; raises ValueError with a message for the user."""
    if not cell.text:
        message = "this cell is empty"
        raise ValueError(message)
    if unit is not None:
        cell.number()
        return f"{cell.text} {unit}"
    if WHOLE.fullmatch(cell.text):
        return int(cell.text)
    return cell.number() if NUMBER.fullmatch(cell.text) else _word(cell.text)


@functools.lru_cache(maxsize=1024)
def _word(text: str) -> object:
    value = parse_value(text)
    if isinstance(value, list | dict):
        message = f"a cell holds one value, not a {'list' if isinstance(value, list) else 'table'}"
        raise ValueError(message)  # noqa: TRY004 - a mistake of the user's, reported with its cell
    return value


def refuse_wrong_values(document: Document, columns: Iterable[Column]) -> None:
    """Try the values of each column by themselves; raises InvalidInputError with the cells of all wrong ones.

    Tried are the first different values, and the ends of all numbers.
    """
    problems: list[Problem] = []
    for column in columns:
        places = {value: index for index, value in reversed(list(enumerate(column.values)))}
        numbers = [(cell.number(), index) for index, cell in enumerate(column.cells) if NUMBER.fullmatch(cell.text)]
        ends = [min(numbers)[1], max(numbers)[1]] if numbers else []
        findings = [
            (index, finding)
            for index in dict.fromkeys((*sorted(places.values())[:MOST_TRIED], *ends))
            for finding in mistakes_of_value(document.data, document.folder, column.key, column.values[index])
        ]
        of_key = next((column.head.problem(one.message) for _, one in findings if one.at == "key"), None)
        problems += [of_key] if of_key else [column.cells[index].problem(one.message) for index, one in findings]
    if problems:
        raise_problems(list(dict.fromkeys(problems)))

"""Tables of prescribed motion: CSV with the columns `time_s` and one of displacement or acceleration.

    # shaking table, run 7
    time_s,acceleration_g
    0.00,0
    0.01,0.12

Lines that begin with `#` are notes. Times increase and are not negative; the motion begins with the first of them.
"""

import hashlib
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from blocksim.errors import BlocksimError
from blocksim.scenario.bounded_read import read_limited
from blocksim.scenario.quantities import shown

STANDARD_GRAVITY = 9.80665
"""m/s²; the g of accelerograms."""
TIME = "time_s"
COLUMNS: dict[str, tuple[Literal["displacement", "acceleration"], float]] = {
    "displacement_m": ("displacement", 1.0),
    "displacement_mm": ("displacement", 1e-3),
    "acceleration_m_s2": ("acceleration", 1.0),
    "acceleration_g": ("acceleration", STANDARD_GRAVITY),
}
"""Possible names of the second column: the quantity, and its unit in SI."""
MAX_BYTES = 20_000_000
MAX_ROWS = 500_000
LEAST_ROWS = 2


class MotionTableError(ValueError):
    """Invalid table; the text has the place and the reason."""


@dataclass(frozen=True)
class MotionTable:
    """Samples of one quantity over time, SI (s; m or m/s²); two tables are equal if their samples are."""

    path: Path = field(compare=False)
    quantity: Literal["displacement", "acceleration"]
    times: tuple[float, ...] = field(repr=False)
    values: tuple[float, ...] = field(repr=False)
    content: bytes = field(repr=False, compare=False)

    @property
    def digest(self) -> str:
        """SHA-256 (hex) of the samples."""
        return hashlib.sha256(repr((self.quantity, self.times, self.values)).encode()).hexdigest()


def read_motion_table(path: Path) -> MotionTable:
    """Read a table of motion; raises MotionTableError with the line of the first mistake."""
    try:
        content = read_limited(path, MAX_BYTES, links=True)
    except BlocksimError as error:
        message = str(error).removeprefix(f"{path}: ")
        raise MotionTableError(message) from None
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        message = "not a text file in UTF-8"
        raise MotionTableError(message) from None
    lines = _lines(text)
    column = _columns(lines)
    quantity, unit = COLUMNS[column[1 - column.index(TIME)]]
    rows = list(_samples(lines[1:], column.index(TIME)))
    if len(rows) < LEAST_ROWS or len(rows) > MAX_ROWS:
        message = f"{len(rows)} lines with samples; {LEAST_ROWS} to {MAX_ROWS} are allowed"
        raise MotionTableError(message)
    times, values = zip(*rows, strict=True)
    return MotionTable(path, quantity, times, tuple(unit * value for value in values), content)


def _lines(text: str) -> list[tuple[int, list[str]]]:
    """Return number and cells of every line that is neither empty nor a note."""
    numbered = enumerate(text.splitlines(), start=1)
    kept = [(number, line) for number, line in numbered if line.strip() and not line.lstrip().startswith("#")]
    return [(number, [cell.strip() for cell in line.split(",")]) for number, line in kept]


def _columns(lines: Sequence[tuple[int, list[str]]]) -> list[str]:
    number, names = lines[0] if lines else (1, [])
    others = [name for name in names if name != TIME]
    if len(names) != 2 or len(others) != 1 or others[0] not in COLUMNS:  # noqa: PLR2004 - two columns
        found = ",".join(names)
        message = f"line {number}: the columns are {shown(found)}; {TIME} and one of {', '.join(COLUMNS)} are needed"
        raise MotionTableError(message)
    return names


def _samples(lines: Sequence[tuple[int, list[str]]], first: int) -> Iterator[tuple[float, float]]:
    """Yield time and value of every line; `first` is the column of the time."""
    before = -math.inf
    for number, cells in lines:
        if len(cells) != 2:  # noqa: PLR2004 - two columns
            message = f"line {number}: a time and a value are needed"
            raise MotionTableError(message)
        time, value = (_number(number, cells[place]) for place in (first, 1 - first))
        if time < 0.0 or time <= before:
            why = "times must not be negative" if time < 0.0 else f"times must increase, the one before is {before:g} s"
            message = f"line {number}: time {time:g} s: {why}"
            raise MotionTableError(message)
        before = time
        yield time, value


def _number(line: int, text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        message = f"line {line}: {shown(text)} is not a finite number"
        raise MotionTableError(message)
    return number

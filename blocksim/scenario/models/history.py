"""How a number goes with time: constant, a ramp, steps, or samples that straight lines join, given or from a table.

A table is CSV with the columns `time_s` and that of the number, `factor` for loads:

    # test 3, jack
    time_s,factor
    0.0,0
    2.5,1

Lines that begin with `#` are notes. Times increase and are not negative. The number is that of the first line before it
and that of the last line after it. The resolved scenario holds the samples, so that it needs no copy of the table.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, Self

from pydantic import Field, ValidationInfo, model_validator

from blocksim.errors import BlocksimError
from blocksim.scenario import quantities as q
from blocksim.scenario.csv_table import read_open_table
from blocksim.scenario.models.base import Table, by_kind, table_path

MAX_BYTES = 1_000_000
MAX_ROWS = 10_000
TIME = "time_s"
Times = tuple[q.NonNegativeTime, ...]


class Stretch(NamedTuple):
    """From `start` (s) on, until the next one: value + rate (t - start)."""

    start: float
    value: float
    rate: float


class Constant(Table):
    """The whole load from the beginning to the end."""

    kind: Literal["constant"] = Field(description="kind of history")

    def stretches(self) -> tuple[Stretch, ...]:
        """Return the factor over time."""
        return (Stretch(0.0, 1.0, 0.0),)


class Ramp(Table):
    """A factor that changes evenly from one time to another, and stays."""

    kind: Literal["ramp"] = Field(description="kind of history")
    start: q.NonNegativeTime = Field(default=0.0, description="begin of the ramp")
    end: q.PositiveTime = Field(description="end of the ramp")
    first: q.Number = Field(default=0.0, alias="from", description="factor until the ramp begins")
    last: q.Number = Field(default=1.0, alias="to", description="factor once it has ended")

    @model_validator(mode="after")
    def _takes_time(self) -> Self:
        if not self.end > self.start:
            message = f"a ramp that begins at {self.start:g} s cannot end at {self.end:g} s; use steps for a jump"
            raise q.invalid(message, "end")
        return self

    def stretches(self) -> tuple[Stretch, ...]:
        """Return the factor over time."""
        return joined((self.start, self.end), (self.first, self.last))


class Steps(Table):
    """Factors that hold from their time on; none before the first."""

    kind: Literal["steps"] = Field(description="kind of history")
    times: Times = Field(description="times at which the factor changes")
    factors: tuple[q.Number, ...] = Field(description="factor from each of these times on; 0 before")

    @model_validator(mode="after")
    def _fit(self) -> Self:
        refuse_unfit(self.times, self.factors, "factors", least=1)
        return self

    def stretches(self) -> tuple[Stretch, ...]:
        """Return the factor over time."""
        steps = tuple(Stretch(time, factor, 0.0) for time, factor in zip(self.times, self.factors, strict=True))
        return steps if self.times[0] == 0.0 else (Stretch(0.0, 0.0, 0.0), *steps)


class Samples(Table):
    """Factors at some times, joined by straight lines: of a CSV table, or `times` and `factors`."""

    kind: Literal["table"] = Field(description="kind of history")
    table: str | None = Field(
        default=None, description="CSV table with the columns time_s and factor, relative to the scenario file"
    )
    times: Times = Field(default=(), description="times of the factors, instead of a table")
    factors: tuple[q.Number, ...] = Field(default=(), description="factors at these times, instead of a table")

    @model_validator(mode="before")
    @classmethod
    def _read(cls, value: object, info: ValidationInfo) -> object:
        return with_samples(value, info, "factor", "factors")

    @model_validator(mode="after")
    def _fit(self) -> Self:
        refuse_unfit(self.times, self.factors, "factors", least=2)
        return self

    def stretches(self) -> tuple[Stretch, ...]:
        """Return the factor over time."""
        return joined(self.times, self.factors)


AnyHistory = Annotated[Constant | Ramp | Steps | Samples, Field(discriminator="kind")]
"""Any history, distinguished by its `kind`."""
HISTORIES: dict[str, type[Table]] = by_kind(AnyHistory)
"""Class by kind, as written in a scenario."""


def joined(times: Sequence[float], values: Sequence[float]) -> tuple[Stretch, ...]:
    """Return the straight lines that join samples, with the first value before them and the last one after them."""
    rows = [Stretch(0.0, values[0], 0.0)] if times[0] > 0.0 else []
    for (begin, one), (end, other) in pairwise(zip(times, values, strict=True)):
        rows.append(Stretch(begin, one, (other - one) / (end - begin)))
    return (*rows, Stretch(times[-1], values[-1], 0.0))


def refuse_unfit(times: Sequence[float], values: Sequence[float], name: str, *, least: int) -> None:
    """Raise pydantic's error where times do not increase, or do not go with the values of the key `name`."""
    if len(times) < least:
        message = f"{len(times)} times are too few; at least {least} {'is' if least == 1 else 'are'} needed"
        raise q.invalid(message, "times")
    if len(times) != len(values):
        raise q.invalid(f"{len(values)} {name} for {len(times)} times; every time needs one", name)
    for number, (one, other) in enumerate(pairwise(times), start=1):
        if other <= one:
            raise q.invalid(f"{other:g} s comes after {one:g} s; times must increase", "times", number)


def with_samples(value: object, info: ValidationInfo, column: str, key: str) -> object:
    """Return data with the samples of the CSV table that it names under `times` and `key`, where it names one."""
    if not isinstance(value, Mapping) or value.get("table") is None:
        return value
    for other in ("times", key):
        if other in value:
            raise q.invalid(f"table and {other} are both given; keep one of them", other)
    path = table_path(value["table"], (info.context or {}).get("folder", ""), "load.csv")
    rows: Any = tuple(zip(*_rows(path, column), strict=True))
    kept = {name: entry for name, entry in value.items() if name != "table"}
    return {**kept, "times": rows[0], key: rows[1]}


def _rows(path: Path, column: str) -> list[tuple[float, float]]:
    """Read time (s) and value of every line; raises pydantic's error with the line of the first mistake."""

    def mistake(line: int, message: str) -> Exception:
        return q.invalid(f"{path.name}: line {line}: {message}", "table")

    try:
        heads, table = read_open_table(path, MAX_BYTES)
    except BlocksimError as error:
        raise q.invalid(str(error).splitlines()[0], "table") from None
    names = [head.text for head in heads]
    if sorted(names) != sorted((TIME, column)):
        raise mistake(table.header.number, f"the columns are {','.join(names)}; {TIME},{column} are needed")
    if table.problems:
        first = min(table.problems, key=lambda problem: problem.line_number or 0)
        raise mistake(first.line_number or 1, first.message)
    if not 2 <= len(table.rows) <= MAX_ROWS:
        message = f"{len(table.rows)} lines with samples; 2 to {MAX_ROWS} are allowed"
        raise q.invalid(f"{path.name}: {message}", "table")
    rows: list[tuple[float, float]] = []
    for row in table.rows:
        line, numbers = row[TIME].line.number, []
        for cell in (row[TIME], row[column]):
            if not cell.text:
                raise mistake(line, f"the {cell.column} is missing")
            try:
                numbers.append(cell.number())
            except ValueError as error:
                raise mistake(line, str(error)) from None
        time, value = numbers
        before = rows[-1][0] if rows else -1.0
        if time < 0.0 or time <= before:
            why = "times must not be negative" if time < 0.0 else f"times must increase, the one before is {before:g} s"
            raise mistake(line, f"time {time:g} s: {why}")
        rows.append((time, value))
    return rows

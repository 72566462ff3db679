"""How varied values stand in the table of a sweep: as numbers, with the unit that the user typed in the head.

A column is a number column where every value is one, and has a unit where some value was typed with one; its head is
then `ground.tilt [deg]`, as in a table of cases. All other values stand as they were given. Tables that were written
before have the bare key in their heads, and are read anyway.
"""

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from blocksim.scenario import Sweep
from blocksim.scenario import quantities as q
from blocksim.scenario.units import parse_unit

DIGITS = 12  # of a number in the table: more show the rounding of the unit
HEAD = re.compile(r"(?P<key>.*?) \[(?P<unit>[^\[\]]+)\]")


@dataclass(frozen=True)
class Head:
    """A column of varied values; `unit` is empty where they stand as they were given."""

    key: str
    unit: str = ""

    @classmethod
    def read(cls, name: str) -> "Head":
        """Take the name of a column apart."""
        found = HEAD.fullmatch(name)
        return cls(name) if found is None else cls(found["key"], found["unit"])

    def __str__(self) -> str:
        """Return the name of the column."""
        return f"{self.key} [{self.unit}]" if self.unit else self.key

    def cell(self, value: object) -> object:
        """Return a value as it stands in the column."""
        if not self.unit:
            return value
        return float(f"{_si(value) / float(parse_unit(self.unit).factor):.{DIGITS}g}")

    def si(self, cell: float) -> float:
        """Return a number of the column in SI."""
        return cell * float(parse_unit(self.unit).factor) if self.unit else cell


def heads_of(sweep: Sweep) -> tuple[Head, ...]:
    """Return the columns of the keys that a sweep varies, in their order."""
    return tuple(Head(key, _unit(values)) for key, values in sweep.vary.items())


def told(heads: Iterable[Head], settings: Mapping[str, object]) -> dict[str, object]:
    """Return the varied values of a case by the names of their columns."""
    return {str(head): head.cell(settings[head.key]) for head in heads}


def _unit(values: object) -> str:
    """Return the unit of a column: the first that was typed, where all values are numbers."""
    if not isinstance(values, tuple):
        return str(getattr(values, "unit", ""))
    typed = next((unit for value in values if isinstance(value, str) and (unit := q.unit_in(value))), "")
    return typed if typed and all(_is_number(value) for value in values) else ""


def _is_number(value: object) -> bool:
    if isinstance(value, bool):
        return False
    return isinstance(value, int | float) or (isinstance(value, str) and bool(q.unit_in(value)))


def _si(value: object) -> float:
    """Return a value of a number column in SI; NaN for what is none."""
    if isinstance(value, str):
        return q.parse_quantity(value)[0]
    return float(value) if isinstance(value, int | float) else math.nan

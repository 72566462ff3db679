"""What counts as standing, or as failure: conditions on the end of a run, such as "moved < 5 mm, outcome != fell".

Conditions are joined by commas, and all of them must hold. They name observables by their words: `moved` is the largest
displacement of a centre from start to end, `turned` the largest rotation; `outcome` is one of stands, rocked back,
rocking, slid, fell, several of them with "|" between.

A run that meets all conditions but moves on at its end is undecided. A scene that does not come to rest before time
zero (`start.settle`) falls.
"""

import math
import operator
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum

from blocksim.errors import InvalidInputError
from blocksim.scenario import units as q
from blocksim.scenario.spelling import did_you_mean_or_list
from blocksim.simulation.observables import MOVES_ON, OBSERVABLES, Observable
from blocksim.simulation.result import NOT_AT_REST
from blocksim.study.rows import FINISHED

STANDS = "--stands"
DEFAULT = "outcome = stands | rocked back"
FORM = re.compile(r"\s*([a-z]+)\s*(<=|>=|!=|==?|<|>)\s*(.*?)\s*")
MOVED = "moved"
UNITS = {  # of observables: kind, units in one of SI
    "mm": (q.LENGTH, 1e3),
    "deg": (q.ANGLE, math.degrees(1.0)),
    "mm/s": (q.SPEED, 1e3),
    "m/s": (q.SPEED, 1.0),
    "s": (q.TIME, 1.0),
    "": (q.NUMBER, 1.0),
}
BELOW: dict[str, Callable[[float, float], bool]] = {"<": operator.lt, "<=": operator.le}
ABOVE: dict[str, Callable[[float, float], bool]] = {">": operator.gt, ">=": operator.ge}


class Verdict(StrEnum):
    """What a run says about the structure."""

    STANDS = "stands"
    FALLS = "falls"
    UNDECIDED = "undecided"
    FAILED = "failed"


@dataclass(frozen=True)
class Criterion:
    """All conditions; `text` is how they were written."""

    text: str
    conditions: tuple[Callable[[Mapping[str, object]], bool], ...]
    least_moved: float | None = None  # m, the least displacement that any of them names

    def holds(self, row: Mapping[str, object]) -> bool:
        """Return True if a row of a finished run meets all conditions."""
        return all(holds(row) for holds in self.conditions)

    def verdict(self, row: Mapping[str, object]) -> Verdict:
        """Judge a row of a sweep."""
        if falls_before_zero(row):
            return Verdict.FALLS
        if row["status"] != FINISHED:
            return Verdict.FAILED
        if not self.holds(row):
            return Verdict.FALLS
        return Verdict.UNDECIDED if row.get(MOVES_ON) else Verdict.STANDS


def falls_before_zero(row: Mapping[str, object]) -> bool:
    """Return True for the row of a run that did not come to rest before time zero (`start.settle`)."""
    return NOT_AT_REST in str(row.get("reason", ""))


def read_criterion(text: str, option: str = STANDS) -> Criterion:
    """Read conditions given to an option. Raises InvalidInputError for anything else, with what may be written."""
    parts = text.split(",")
    try:
        return Criterion(text, tuple(_condition(part) for part in parts), _least_moved(parts))
    except InvalidInputError as error:
        message = f"{option} {error}"
        raise InvalidInputError(message) from None


def _least_moved(parts: Iterable[str]) -> float | None:
    """Return the least displacement (m) that conditions name which have been read."""
    found = (FORM.fullmatch(part) for part in parts)
    ways = (q.parse_quantity(one[3], q.LENGTH)[0] for one in found if one is not None and one[1] == MOVED)
    return min(ways, default=None)


def _condition(text: str) -> Callable[[Mapping[str, object]], bool]:
    found = FORM.fullmatch(text)
    if found is None:
        raise _mistake(text, 'write for example "moved < 5 mm" or "outcome != fell"')
    word, sign, value = found[1], found[2].replace("==", "="), found[3]
    known = {one.word: one for one in OBSERVABLES.values() if one.word}
    if word not in known:
        raise _mistake(text, f"unknown quantity '{word}', {did_you_mean_or_list(word, known)}")
    return (_choice if known[word].choices else _number)(text, known[word], sign, value)


def _choice(text: str, of: Observable, sign: str, value: str) -> Callable[[Mapping[str, object]], bool]:
    named, known = {part.strip() for part in value.split("|")}, set(of.choices)
    unknown = sorted(named - known)
    if unknown:
        raise _mistake(text, f"unknown {of.word} '{unknown[0]}', {did_you_mean_or_list(unknown[0], sorted(known))}")
    if sign not in ("=", "!="):
        raise _mistake(text, f"an {of.word} is compared with = or !=")
    allowed = named if sign == "=" else known - named
    return lambda row: row[of.name] in allowed


def _number(text: str, of: Observable, sign: str, value: str) -> Callable[[Mapping[str, object]], bool]:
    kind, units = UNITS[of.unit]
    compare = {**BELOW, **ABOVE}.get(sign)
    if compare is None:
        raise _mistake(text, f"{of.word} is compared with <, <=, > or >=")
    try:
        number, dimension = q.parse_quantity(value, kind)
    except ValueError as error:
        raise _mistake(text, str(error)) from None
    if dimension != kind.dimension:
        raise _mistake(text, f'{kind.name} is needed, such as "{kind.example}"')
    limit = number * units
    return lambda row: compare(float(str(row[of.name])), limit)


def _mistake(text: str, why: str) -> InvalidInputError:
    return InvalidInputError(f"{text.strip() or '(empty)'}: {why}")

"""What counts as standing, or as failure: conditions on the end of a run, such as "moved < 5 mm, outcome != fell".

Conditions are joined by commas, and all of them must hold. `moved` is the largest displacement of a centre from start
to end, `turned` the largest rotation; `outcome` is one of stands, rocked back, rocking, slid,
fell (see `blocksim.simulation.movement`), several of them with "|" between.

A run that meets all conditions but moves on at its end (as `blocksim.simulation.movement` has it) is undecided. A scene
that does not come to rest before time zero (`start.settle`) falls.
"""

import math
import operator
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from enum import StrEnum

from blocksim.errors import InvalidInputError
from blocksim.scenario import quantities as q
from blocksim.scenario.spelling import did_you_mean_or_list
from blocksim.simulation.movement import Manner
from blocksim.simulation.settled import NOT_AT_REST
from blocksim.study.rows import FINISHED, MOVEMENT

STANDS = "--stands"
DEFAULT = "outcome = stands | rocked back"
FORM = re.compile(r"\s*([a-z]+)\s*(<=|>=|!=|==?|<|>)\s*(.*?)\s*")
OUTCOME, _, _, DISPLACEMENT, TURN, _, MOVES_ON = MOVEMENT
MOVED = "moved"
NUMBERS: dict[str, tuple[str, q.Kind, float]] = {  # word: column of a row, kind, units of the column in one of SI
    MOVED: (DISPLACEMENT, q.LENGTH, 1e3),
    "turned": (TURN, q.ANGLE, math.degrees(1.0)),
}
BELOW: dict[str, Callable[[float, float], bool]] = {"<": operator.lt, "<=": operator.le}
ABOVE: dict[str, Callable[[float, float], bool]] = {">": operator.gt, ">=": operator.ge}
WORDS = (*NUMBERS, OUTCOME)


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
    if word == OUTCOME:
        return _outcome(text, sign, value)
    if word not in NUMBERS:
        raise _mistake(text, f"unknown quantity '{word}', {did_you_mean_or_list(word, WORDS)}")
    return _number(text, word, sign, value)


def _outcome(text: str, sign: str, value: str) -> Callable[[Mapping[str, object]], bool]:
    named = {part.strip() for part in value.split("|")}
    known = {manner.value for manner in Manner}
    unknown = sorted(named - known)
    if unknown:
        raise _mistake(text, f"unknown outcome '{unknown[0]}', {did_you_mean_or_list(unknown[0], sorted(known))}")
    if sign not in ("=", "!="):
        raise _mistake(text, "an outcome is compared with = or !=")
    allowed = named if sign == "=" else known - named
    return lambda row: row[OUTCOME] in allowed


def _number(text: str, word: str, sign: str, value: str) -> Callable[[Mapping[str, object]], bool]:
    column, kind, units = NUMBERS[word]
    compare = {**BELOW, **ABOVE}.get(sign)
    if compare is None:
        raise _mistake(text, f"{word} is compared with <, <=, > or >=")
    try:
        number, dimension = q.parse_quantity(value, kind)
    except ValueError as error:
        raise _mistake(text, str(error)) from None
    if dimension != kind.dimension:
        raise _mistake(text, f'{kind.name} is needed, such as "{kind.example}"')
    limit = number * units
    return lambda row: compare(float(str(row[column])), limit)


def _mistake(text: str, why: str) -> InvalidInputError:
    return InvalidInputError(f"{text.strip() or '(empty)'}: {why}")

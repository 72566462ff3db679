"""What counts as standing, or as failure: conditions on the end of a run, such as "moved < 5 mm, outcome != fell".

Conditions are joined by commas, and all of them must hold. They name observables by their words: `moved` is the largest
displacement of a centre from start to end, `turned` the largest rotation; `outcome` is one of stands, rocked back,
rocking, slid, fell, several of them with "|" between.

A run that meets all conditions but moves on at its end is undecided. So is what still rocks at its end, whatever the
conditions, where a motion, a pulse or a velocity at the start has passed, as it may come to rest yet. A scene that does
not come to rest before time zero (`start.settle`) falls.
"""

import math
import operator
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum

from blocksim.errors import InvalidInputError
from blocksim.scenario import spelling, units as q
from blocksim.simulation import loop, observables, results
from blocksim.study.rows import FINISHED

STANDS = "--stands"
DEFAULT = "outcome = stands | rocked back"
OF_MOVING_SUPPORTS = "outcome != fell"
FORM = re.compile(r"\s*([a-z]+)\s*(<=|>=|!=|==?|<|>)\s*(.*?)\s*")
UNITS = {  # of observables: kind, units in one of SI
    "mm": (q.LENGTH, 1e3),
    "deg": (q.ANGLE, math.degrees(1.0)),
    "mm/s": (q.SPEED, 1e3),
    "m/s": (q.SPEED, 1.0),
    "s": (q.TIME, 1.0),
    "": (q.NUMBER, 1.0),
}
COMPARISONS: dict[str, Callable[[float, float], bool]] = {
    "<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge
}  # fmt: skip


class Stability(StrEnum):
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
    has_passed: bool = False  # what acts on blocks, so that those that rock at the end may come to rest yet
    stops_at_rest: bool = False  # a run that did not has not come to rest

    def holds(self, row: Mapping[str, object]) -> bool:
        """Return True if a row of a finished run meets all conditions."""
        return all(holds(row) for holds in self.conditions)

    def verdict(self, row: Mapping[str, object]) -> Stability:
        """Judge a row of a sweep."""
        if falls_before_zero(row):
            return Stability.FALLS
        if row["status"] != FINISHED:
            return Stability.FAILED
        outcome = row.get(observables.OUTCOME)
        is_slow = self.stops_at_rest and row["reason"] != loop.REST.reason  # as rocking blocks are where they turn back
        rocks = outcome == observables.Response.ROCKING or (outcome == observables.Response.SLID and is_slow)
        if self.has_passed and rocks:
            return Stability.UNDECIDED
        if not self.holds(row):
            return Stability.FALLS
        return Stability.UNDECIDED if row.get(observables.MOVES_ON) else Stability.STANDS


def falls_before_zero(row: Mapping[str, object]) -> bool:
    """Return True for the row of a run that did not come to rest before time zero (`start.settle`)."""
    return results.NOT_AT_REST in str(row.get("reason", ""))


def read_criterion(text: str, option: str = STANDS) -> Criterion:
    """Read conditions given to an option. Raises InvalidInputError for anything else, with what may be written."""
    conditions, ways = [], []
    for part in text.split(","):
        try:
            condition, way = _condition(part)
        except ValueError as error:
            raise InvalidInputError(f"{option} {part.strip() or '(empty)'}: {error}") from None
        conditions.append(condition)
        ways += way
    return Criterion(text, tuple(conditions), min(ways, default=None))


def _condition(text: str) -> tuple[Callable[[Mapping[str, object]], bool], list[float]]:
    """Return a condition, and the displacement (m) that it names if it does. Raises ValueError."""
    match = FORM.fullmatch(text)
    if match is None:
        raise ValueError('write for example "moved < 5 mm" or "outcome != fell"')
    word, sign, value = match[1], match[2].replace("==", "="), match[3]
    known = {one.word: one for one in observables.OBSERVABLES.values() if one.word}
    if word not in known:
        raise ValueError(f"unknown quantity '{word}', {spelling.did_you_mean_or_list(word, known)}")
    name = known[word].name
    if choices := set(known[word].choices):
        named = {part.strip() for part in value.split("|")}
        if unknown := sorted(named - choices):
            hint = spelling.did_you_mean_or_list(unknown[0], sorted(choices))
            raise ValueError(f"unknown {word} '{unknown[0]}', {hint}")
        if sign not in ("=", "!="):
            raise ValueError(f"an {word} is compared with = or !=")
        allowed = named if sign == "=" else choices - named
        return lambda row: row[name] in allowed, []
    kind, units = UNITS[known[word].unit]
    compare = COMPARISONS.get(sign)
    if compare is None:
        raise ValueError(f"{word} is compared with <, <=, > or >=")
    number, dimension = q.parse_quantity(value, kind)
    if dimension != kind.dimension:
        raise ValueError(f'{kind.name} is needed, such as "{kind.example}"')
    limit = number * units
    return lambda row: compare(float(str(row[name])), limit), [number] if word == "moved" else []

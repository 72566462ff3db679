"""What a search for a limit needs: key, range and criterion, and which values to try next from those known.

First a scan of evenly spaced values, as there may be more than one change. What rocks under a moving support may fall
in an island between two of them: so the scan is denser, down to a quarter of its spacing, beside values at which the
largest rotation is larger than at both neighbours. Narrower islands are not seen. Then every pair of neighbours with
different verdicts is divided in three, until it is as narrow as wanted: two values a round run side by side, and four
rounds narrow a bracket 81 times. What is tried depends on the answers of whole rounds alone, so neither on the number
of threads nor on when a search was stopped and resumed.

Gravity that comes at once is an impact: contacts that slip or open under it shift limits of arches and walls by 0.2 to
4 %. What is searched along a load that is there from the beginning on is the limit of a structure that carries it, so
it comes to rest before time zero (`start.settle`), unless the scenario says whether it does.
"""

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Any, Generic, TypeVar

import numpy as np

from blocksim.errors import BlocksimError, InvalidInputError
from blocksim.scenario import Document, Scenario, place_bodies, place_segments, scenario_hash
from blocksim.scenario.models.loads import AnyLoad, stretches_of
from blocksim.scenario.models.stepping import SCHEMES, SPRINGS
from blocksim.scenario.models.study import Uniform, is_descending
from blocksim.scenario.overlap import Outlines, penetration
from blocksim.scenario.overrides import field_of, options
from blocksim.scenario.placement import smallest_width
from blocksim.scenario.units import parse_unit
from blocksim.simulation.provenance import HASH_DIGITS, code_hash
from blocksim.study.criterion import Criterion, Verdict, read_criterion
from blocksim.study.plan import Values, Variations, build_distributions, levels_of
from blocksim.study.rows import Head, Row, heads_of

Kind = TypeVar("Kind")
DIGITS = 12  # of a value that is tried: what people read is what was run
PARTS = 3
HALVINGS = 2  # of the spacing of a scan, beside a peak
OUTWARD = 2.0  # widths of what is known, by which a search near a value goes on beyond it
FLOOR = 1e-6  # of the range: brackets about zero get no narrower
Number = float  # in the unit of the range


@dataclass(frozen=True)
class Span:
    """The range of a key in the unit in which it was typed, and how many values are scanned first."""

    low: float
    high: float
    count: int
    is_log: bool = False
    is_whole: bool = False

    def scanned(self) -> list[Number]:
        """Return the values of the first round, ends included; whole numbers each once."""
        return list(dict.fromkeys(self._at(i / (self.count - 1)) for i in range(self.count)))

    def between(self, low: Number, high: Number) -> list[Number]:
        """Return the values that divide a bracket, without its ends."""
        inner = Span(low, high, PARTS + 1, self.is_log, self.is_whole).scanned()
        return [value for value in inner if low < value < high]

    def middle(self, low: Number, high: Number) -> Number:
        """Return the value half way between two."""
        return Span(low, high, 3, self.is_log, self.is_whole).scanned()[1]

    def is_scanned_enough(self, low: Number, high: Number) -> bool:
        """Return True if two values are so near each other that no other is tried beside a peak."""
        if self.is_whole and high - low <= 1.0:
            return True
        share = math.log(high / low) / math.log(self.high / self.low) if self.is_log else (high - low) / self.width
        return share * (self.count - 1) < 1.5 * 0.5**HALVINGS

    @property
    def spacing(self) -> float:
        """Distance of two values of the first round."""
        return self.width / (self.count - 1)

    @property
    def width(self) -> float:
        """Length of the range."""
        return self.high - self.low

    def _at(self, share: float) -> Number:
        if share in (0.0, 1.0):
            value = self.high if share else self.low
        elif self.is_log:
            value = self.low * (self.high / self.low) ** share
        else:
            value = self.low + (self.high - self.low) * share
        return float(round(value)) if self.is_whole else float(f"{value:.{DIGITS}g}")

    def fitted(self, value: float) -> Number:
        """Return a value as it is tried, the nearest within the range."""
        return float(f"{min(max(value, self.low), self.high):.{DIGITS}g}")

    def is_narrow(self, low: Number, high: Number, tolerance: float) -> bool:
        """Return True if a bracket is as narrow as wanted, relative to its ends; of whole numbers: neighbours."""
        if self.is_whole:
            return high - low <= 1.0
        size = max(abs(low), abs(high), FLOOR * (self.high - self.low) / tolerance)
        return high - low <= tolerance * size or not self.between(low, high)


@dataclass(frozen=True)
class Change(Generic[Kind]):
    """Two neighbours among the values that were tried, with different answers."""

    low: Number
    high: Number
    below: Kind
    above: Kind


def changes_in(known: Mapping[Number, Kind]) -> list[Change[Kind]]:
    """Return all changes between neighbours, from the smallest value up."""
    return [
        Change(low, high, known[low], known[high]) for low, high in pairwise(sorted(known)) if known[low] != known[high]
    ]


def next_values(
    span: Span, known: Mapping[Number, Kind], tolerance: float, peaks: Mapping[Number, float] | None = None
) -> list[Number]:
    """Return the values to try next; none when every change is as narrow as wanted.

    `peaks` are the largest rotations at those known values at which the scan may have to be denser.
    """
    scan = [value for value in span.scanned() if value not in known]
    scan = scan or _beside_peaks(span, known, peaks or {})
    if scan:
        return scan
    wide = (one for one in changes_in(known) if not span.is_narrow(one.low, one.high, tolerance))
    return [value for one in wide for value in span.between(one.low, one.high)]


def _beside_peaks(span: Span, known: Mapping[Number, Kind], peaks: Mapping[Number, float]) -> list[Number]:
    """Return the values half way to both neighbours of those with a larger peak, and the same answer."""
    values = sorted(known)
    found: list[Number] = []
    for low, here, high in zip(values, values[1:], values[2:], strict=False):
        is_alike = known[low] == known[here] == known[high] and {low, here, high} <= peaks.keys()
        if is_alike and peaks[low] < peaks[here] > peaks[high]:
            wide = (pair for pair in ((low, here), (here, high)) if not span.is_scanned_enough(*pair))
            found += [span.middle(*pair) for pair in wide]
    return [value for value in dict.fromkeys(found) if value not in known]


def next_near(span: Span, known: Mapping[Number, Kind], near: Change[Kind], tolerance: float) -> list[Number]:
    """Return the values to try next where a change is expected near a bracket, that of `near`, and nothing is scanned.

    First its ends, then on in the direction in which the change must be until it is passed, by more every time, and
    then as `next_values`. None when the change is as narrow as wanted, and where there is no such change in the range.
    """
    if not known:
        return list(dict.fromkeys(span.fitted(value) for value in (near.low, near.high)))
    changes = changes_in(known)
    if not changes:
        return [value for value in _beyond(span, known, near, tolerance) if value not in known]
    (first, *others) = changes
    if others or (first.below, first.above) != (near.below, near.above):
        return []
    return [] if span.is_narrow(first.low, first.high, tolerance) else span.between(first.low, first.high)


def _beyond(span: Span, known: Mapping[Number, Kind], near: Change[Kind], tolerance: float) -> list[Number]:
    """Return the next value outwards of values with the same answer, on the side where the other one must be."""
    low, high = min(known), max(known)
    width = OUTWARD * ((high - low) or tolerance * abs(high))
    if known[low] == near.below:
        return [span.fitted(high + width)]
    return [span.fitted(low - width)] if known[low] == near.above else []


NEAR = 0.01  # of the smallest side of a block: what is farther from all others is to drop
SETTLE = "start.settle"


def at_rest(document: Document, *scenarios: Scenario) -> Document:
    """Return a document whose runs begin at rest, if all these scenarios of it bear sustained loads."""
    if says_whether_it_settles(document) or not all(map(is_sustained, scenarios)):
        return document
    return document.with_values({SETTLE: True})


def says_whether_it_settles(document: Document) -> bool:
    """Return True for a document that has `start.settle`."""
    start = document.data.get("start")
    return isinstance(start, Mapping) and "settle" in start


def comes_at_once(scenario: Scenario) -> bool:
    """Return True for a scenario with sustained loads that does not begin at rest."""
    return not scenario.start.settle and is_sustained(scenario)


def is_sustained(scenario: Scenario) -> bool:
    """Return True where loads are the same from time zero on, nothing moves then, and no block is to drop."""
    if scenario.motion is not None or scenario.events or scenario.systems:
        return False
    placed = place_bodies(scenario)
    if any(body.driven or body.vx or body.vy or body.spin for body in placed):
        return False
    return all(_is_constant(scenario, load) for load in scenario.loads) and not _drops(scenario)


def _is_constant(scenario: Scenario, load: AnyLoad) -> bool:
    stretches = stretches_of(load, scenario.ground.tilt)
    return all(stretch.rate == 0.0 and stretch.value == stretches[0].value for stretch in stretches)


def _drops(scenario: Scenario) -> bool:
    """Return True where some free block has no other, no wall and not the ground near it."""
    placed, segments = place_bodies(scenario), place_segments(scenario)
    outlines = Outlines.of(placed)
    if segments:
        outlines = outlines.and_pieces(Outlines.along(segments))
    near = NEAR * smallest_width(placed)
    free = [number for number, body in enumerate(placed) if not body.fixed]
    for number in free:
        others = np.delete(np.arange(outlines.kinds.size), number)
        depth = penetration(outlines.some(np.full(others.size, number)), outlines.some(others))
        if not (depth > -near).any() and outlines.bottom[number] > near:
            return True
    return False


def typed_levels(document: Document, given: Variations, option: str) -> tuple[Head, dict[float, object]]:
    """Return the column of the only key, and its values by their numbers in its unit, from the smallest up.

    Raises ScenarioError for values that the scenario cannot have, InvalidInputError for a range without a count, values
    that are not numbers, and one that is given twice.
    """
    text, table = next((given.texts[key], table) for key, table in given.tables.items())
    if isinstance(table, Mapping) and "count" not in table:
        message = f"{option} {text}: single values are needed, as in KEY=a,b,c or KEY=FROM:TO:COUNT"
        raise InvalidInputError(message)
    sweep = build_distributions(document, given, option, "grid")
    (head,), (values,) = heads_of(sweep), sweep.vary.values()
    levels: dict[float, object] = {}
    for value in levels_of(values):
        number = _number(head.cell(value))
        if not math.isfinite(number) or number in levels:
            why = "is given twice" if number in levels else "is not a number"
            message = f"{option} {text}: {value} {why}"
            raise InvalidInputError(message)
        levels[number] = value
    return head, dict(sorted(levels.items()))


def _number(cell: object) -> float:
    """Return a number to the digits that are typed, NaN for anything else."""
    is_number = isinstance(cell, int | float) and not isinstance(cell, bool)
    return float(f"{cell:.12g}") if is_number else math.nan


SCANNED = 9
MOST_SCANNED = MOST_VALUES = 1000
TOLERANCE = 1e-3
LEAST_TOLERANCE = 1e-9
OPTION, OVER = "--vary", "--over"
NAMES = {name: time.contacts for name, time in SCHEMES.items()}


@dataclass(frozen=True)
class LimitPlan:
    """One search."""

    document: Document  # without what varies
    key: str
    unit: str  # as typed; empty for plain numbers
    span: Span
    criterion: Criterion
    tolerance: float  # of a bracket, relative to its ends
    apart: Mapping[str, object] = field(default_factory=dict)  # settings in which its runs differ from the document

    def value(self, number: Number) -> object:
        """Return a value of the range as a scenario takes it."""
        if self.span.is_whole:
            return int(number)
        return f"{number:.12g} {self.unit}" if self.unit else number

    def shown(self, number: Number) -> str:
        """Return a value for people."""
        return f"{number:.7g} {self.unit}".rstrip()

    def scenario_at(self, number: Number) -> Scenario:
        """Return the scenario at a value. Raises ScenarioError where the value does not go with the others."""
        return self.document.with_values(self.settings(number)).build()

    @cached_property
    def scheme(self) -> str:
        """The stepping scheme of its runs."""
        return self.document.build().time.scheme

    @cached_property
    def has_springs(self) -> bool:
        """True where contacts are springs."""
        return self.document.build().time.has_springs

    def verdicts(self, rows: Mapping[Number, Row]) -> dict[Number, Verdict]:
        """Return what runs came to, from the smallest value up."""
        return {value: self.criterion.verdict(rows[value]) for value in sorted(rows)}

    @property
    def comes_at_once(self) -> bool:
        """True where sustained loads come at once, as the scenario says that it does not begin at rest."""
        return all(comes_at_once(self.scenario_at(number)) for number in (self.span.low, self.span.high))

    @property
    def has_islands(self) -> bool:
        """True where a value may fall between others that stand: supports move."""
        return self.document.build().motion is not None

    def settings(self, number: Number) -> dict[str, object]:
        """Return what distinguishes the run of a value from the document."""
        return {self.key: self.value(number), **self.apart}

    @property
    def name(self) -> str:
        """A hash of everything that decides the answer."""
        ends = [self.key, self.unit, *vars(self.span).values(), self.criterion.text, self.tolerance]
        text = json.dumps([scenario_hash(self.document.build()), ends, code_hash()])
        return hashlib.sha256(text.encode()).hexdigest()[:HASH_DIGITS]


@dataclass(frozen=True)
class CurvePlan:
    """A search at each number of another key."""

    head: Head  # that key, and its unit
    searches: Mapping[float, LimitPlan]

    @property
    def one(self) -> LimitPlan:
        """Any of the searches: key, unit, range and criterion are those of all."""
        return next(iter(self.searches.values()))

    @property
    def name(self) -> str:
        """A hash of everything that decides the answer."""
        text = json.dumps([self.head.key, *(plan.name for plan in self.searches.values())])
        return hashlib.sha256(text.encode()).hexdigest()[:HASH_DIGITS]


def read_curve(
    document: Document,
    vary: Mapping[str, Values] | Variations,
    over: Mapping[str, Values] | Variations,
    *,
    stands: str,
    tolerance: float,
    scan: int = SCANNED,
) -> CurvePlan:
    """Return the plan of a curve of limits. Raises as `read_limit`, for every value of the other key."""
    given = over if isinstance(over, Variations) else Variations.of(over)
    if len(given.tables) != 1:
        message = f"limits are searched over one key, not {len(given.tables)}: give {OVER} KEY=a,b,c once"
        raise InvalidInputError(message)
    bare = document.without_sweep()
    head, levels = typed_levels(bare, given, OVER)
    if len(levels) > MOST_VALUES:
        message = f"{len(levels)} values are too many; at most {MOST_VALUES} are searched"
        raise InvalidInputError(message)
    at = {number: bare.with_values({head.key: value}) for number, value in levels.items()}
    read = {number: read_limit(one, vary, stands=stands, tolerance=tolerance, scan=scan) for number, one in at.items()}
    return CurvePlan(head, read)


def read_limit(
    document: Document,
    vary: Mapping[str, Values] | Variations,
    *,
    stands: str,
    tolerance: float = TOLERANCE,
    scan: int = SCANNED,
) -> LimitPlan:
    """Return the plan of a search.

    Raises ScenarioError for a key or range that the scenario cannot have, InvalidInputError for a wrong criterion or
    tolerance, and where more or less than one key is given.
    """
    criterion = read_criterion(stands)
    if not LEAST_TOLERANCE <= tolerance < 1.0:
        message = f"a bracket of {tolerance:g} of the value cannot be reached; give {LEAST_TOLERANCE:g} up to below 1"
        raise InvalidInputError(message)
    given = vary if isinstance(vary, Variations) else Variations.of(vary)
    if len(given.tables) != 1:
        message = f"a limit is searched along one key, not {len(given.tables)}: give {OPTION} KEY=FROM:TO once"
        raise InvalidInputError(message)
    key, table = next(iter(given.tables.items()))
    bare = document.without_sweep()
    if not isinstance(table, Mapping) or not {"from", "to"} <= set(table):
        message = f"{OPTION} {given.texts[key]}: a range is needed, as in {key}=FROM:TO or {key}=FROM:TO:COUNT"
        raise InvalidInputError(message)
    count = table.get("count", scan)
    if isinstance(count, bool) or not isinstance(count, int) or not 2 <= count <= MOST_SCANNED:
        message = f"{count} values cannot be scanned; a whole number from 2 to {MOST_SCANNED} is needed"
        raise InvalidInputError(message)
    ends: dict[str, Any] = {name: table[name] for name in table if name != "count"}
    if is_descending(ends):
        ends |= {"from": ends["to"], "to": ends["from"]}
    values = build_distributions(bare, Variations({key: ends}, given.texts), OPTION, "sobol").vary[key]
    assert isinstance(values, Uniform)  # noqa: S101 - it has two ends
    unit = values.unit or ("rad" if values.angle else "")
    plan = LimitPlan(bare, key, unit, _span(bare, key, values, unit, ends, count), criterion, tolerance)
    found = []
    for number in (plan.span.low, plan.span.high):
        try:
            found.append(plan.scenario_at(number))
        except BlocksimError as error:
            message = f"{key} = {plan.shown(number)}: {str(error).splitlines()[0]}"
            raise InvalidInputError(message) from error
    return replace(plan, document=at_rest(bare, *found))


def _span(document: Document, key: str, values: Uniform, unit: str, table: Mapping[str, Any], count: int) -> Span:
    """Return the range in the typed unit; of a key that takes whole numbers only, every one of them that fits."""
    factor = float(parse_unit(unit).factor) if unit else 1.0
    low, high = (float(f"{end / factor:.12g}") for end in (values.low, values.high))
    is_whole = takes_whole(document, key) and all(type(table[end]) is int for end in ("from", "to"))
    scanned = min(count, int(high - low) + 1) if is_whole else count
    return Span(low, high, scanned, is_log=values.scale == "log", is_whole=is_whole)


def takes_whole(document: Document, key: str) -> bool:
    """Return True for a key whose values are whole numbers."""
    field = field_of(key, document.build())
    return field is not None and int in options(field.annotation) and float not in options(field.annotation)


def variants(document: Document, *, both_laws: bool = False) -> dict[str, Document]:
    """Return the scenarios whose limits are compared, by what distinguishes them: both laws, or the present one."""
    if both_laws:
        return {time.contacts: with_scheme(document, name) for name, time in SCHEMES.items()}
    return {document.build().time.contacts: document}


def with_scheme(document: Document, scheme: str) -> Document:
    """Return the document with a stepping scheme; of [time], what the present one alone knows is left out.

    So is the step, where the scheme is another one: its scale is that of the scheme.
    """
    table = document.data.get("time")
    present = dict(table) if isinstance(table, Mapping) else {}
    others = set() if present.get("scheme", SPRINGS) == scheme else {"step", "force_step"}
    known = set(SCHEMES[scheme].model_fields) - others
    kept = {key: value for key, value in present.items() if key in known}
    return replace(document, data={**document.data, "time": {**kept, "scheme": scheme}})

"""What `limit` searches: one key between two values, the criterion, and the scenario at each value."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from blocksim.errors import BlocksimError, InvalidInputError
from blocksim.scenario import Document, Scenario, scenario_hash
from blocksim.scenario.keys import field_of, options
from blocksim.scenario.models.stepping import SCHEMES, SPRINGS
from blocksim.scenario.models.variation import Uniform, is_descending
from blocksim.scenario.units import parse_unit
from blocksim.simulation.provenance import HASH_DIGITS, code_hash
from blocksim.study.criterion import Criterion, Verdict, read_criterion
from blocksim.study.limit_search import Number, Span
from blocksim.study.limit_start import at_rest, comes_at_once
from blocksim.study.plan import Values, Variations, varied
from blocksim.study.rows import Head, Row
from blocksim.study.typed_levels import typed_levels

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
    values = varied(bare, Variations({key: ends}, given.texts), OPTION, "sobol").vary[key]
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

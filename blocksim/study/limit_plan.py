"""What a search for a limit needs: key, range and criterion, and which values to try next from those known.

Where statics bounds what a structure can carry (static_limit.py), the search begins there. Else, and where a scan is
asked for, it begins with evenly spaced values, as there may be more than one change. What rocks under a moving support
may fall in an island between two of them: so the scan is denser, down to a quarter of its spacing, beside values at
which the largest rotation is larger than at both neighbours. Narrower islands are not seen. Then every pair of
neighbours with different verdicts is divided in three, until it is as narrow as wanted: two values a round run side by
side, and four rounds narrow a bracket 81 times. What is tried depends on the answers of whole rounds alone, so neither
on the number of threads nor on when a search was stopped and resumed.

Gravity that comes at once is an impact: contacts that slip or open under it shift limits of arches and walls by 0.2 to
4 %. What is searched along a load that is there from the beginning on is the limit of a structure that carries it, so
it comes to rest before time zero (`start.settle`), unless the scenario says whether it does.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY, dataclass, field, fields, replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Generic, NamedTuple, TypeVar

from blocksim.errors import BlocksimError, InvalidInputError
from blocksim.options import Option, Overwrite, silent, takes
from blocksim.scenario import Document, Model, overlap, overrides, units
from blocksim.scenario.models import study, timeline
from blocksim.scenario.models.loads import stretches_of
from blocksim.scenario.placement import smallest_width
from blocksim.simulation.provenance import code_hash
from blocksim.statics.blockwork import why_not_sustained
from blocksim.study import answer, criterion, executors, manifest
from blocksim.study.criterion import Criterion, Stability
from blocksim.study.plan import (
    RANGE,
    Cases,
    Design,
    Values,
    Variations,
    build_distributions,
    levels_of,
    variations_option,
)
from blocksim.study.rows import Head, Row, heads_of

Kind = TypeVar("Kind")
DIGITS = 12  # of a value that is tried: what people read is what was run
PARTS = 3
HALVINGS = 2  # of the spacing of a scan, beside a peak
OUTWARD = 2.0  # widths of what is known, by which a search near a value goes on beyond it
FLOOR = 1e-6  # of the range: brackets about zero get no narrower
NEAR = 0.01  # of the smallest side of a block: what is farther from all that carries it is to drop
MOST_SCANNED = MOST_VALUES = 1000
MOST_RUNS = 100  # of a search; a round more may cost minutes
TOLERANCE = 1e-3
LEAST_TOLERANCE = 1e-9
OPTION, OVER = "--vary", "--over"
NAMES = {name: time.contacts for name, time in timeline.SCHEMES.items()}
Number = float  # in the unit of the range
OnRun = Callable[[Number, Stability, Row], None]


def read_share(text: str) -> float:
    """Return a share that is written as 0.1% or 0.001. Raises ValueError."""
    number = text.strip().removesuffix("%")
    try:
        return float(number) / (100.0 if "%" in text else 1.0)
    except ValueError:
        raise ValueError(f"{text[:40]!r} is not a share; write it as in 0.1% or 0.001") from None


OtherKey = Annotated[
    Mapping[str, Values] | None,
    variations_option(
        "Another key, KEY=a,b,c or KEY=FROM:TO:COUNT: search the limit at each of its values.",
        "KEY=VALUES",
        'Another key and its values, {"friction.block_block": [0.3, 0.5]}.',
        OVER,
        is_repeatable=False,
    ),
]


@dataclass(frozen=True)
class SearchOptions(executors.Execution):
    """Which limits are searched, how narrowly, and where the runs are kept."""

    vary: Annotated[
        Mapping[str, Values],
        variations_option(
            "The key and its range. KEY=FROM:TO:COUNT scans COUNT values first (default: those of --scan); :log "
            "at the end spaces them logarithmically.",
            "KEY=FROM:TO",
            'The key and its range, {"ground.tilt": {"from": "20 deg", "to": "40 deg"}}, with the number of values '
            "that are scanned first as `count` (default: `scan`).",
            OPTION,
            RANGE,
        ),
    ]
    _: KW_ONLY
    stands: Annotated[
        str | None,
        Option(
            'What counts as standing, such as "moved < 5 mm", "turned < 10 deg" or "outcome != fell". '
            f'Separated by commas: all must hold (default: "{criterion.DEFAULT}"; where supports move '
            f'"{criterion.OF_MOVING_SUPPORTS}").',
            metavar="CONDITIONS",
        ),
    ] = None
    tolerance: Annotated[
        float,
        Option(
            "Relative width of the bracket at which to stop, such as 0.1%.",
            ("--to",),
            "SHARE",
            "Width of a bracket at which to stop, relative to its ends, without what rest speed and stiffness cannot "
            "decide.",
            read_share,
        ),
    ] = TOLERANCE
    scan: Annotated[
        int | None,
        Option(
            "How many values are scanned first (default: 9; none where statics says where to begin). An island between "
            "two of them, in which other things happen, is not seen.",
            metavar="N",
        ),
    ] = None
    stiffer: Annotated[
        bool | None,
        Option(
            "Search once more with springs ten times as stiff and extrapolate to stiff contacts, always or never "
            "(default: where supports rest and springs shift a limit by more than 0.25 %). --as-given also leaves the "
            "time step of rigid contacts as it is, which is halved once otherwise.",
            ("--stiffer/--as-given",),
            python="Search once more with springs ten times as stiff and extrapolate to stiff contacts: True always, "
            "False never (limits are then those of the springs, and of the time step, as given), None where supports "
            "rest and springs shift them by more than 0.25 %.",
        ),
    ] = None
    most_runs: Annotated[
        int,
        Option(
            "Stop before a round of runs that would make them more than N; brackets are then as wide as they are, and "
            "the same command with more continues.",
            metavar="N",
            least=2,
        ),
    ] = MOST_RUNS
    out: Annotated[Path | str | None, Option("Folder to write (default: results/NAME/limit-HASH).", metavar="DIR")] = (
        None
    )
    overwrite: Overwrite = False

    @property
    def search_options(self) -> dict[str, Any]:
        """What a single search and a curve of limits have in common, by name."""
        return {field.name: getattr(self, field.name) for field in fields(SearchOptions)}


@dataclass(frozen=True)
class LimitOptions(SearchOptions):
    """The same, and what is kept and reported of a single search."""

    _: KW_ONLY
    keep_runs: bool = True
    on_run: OnRun = silent


@dataclass(frozen=True)
class CurveOptions(SearchOptions):
    """The same at each value of another key."""

    over: OtherKey


@dataclass(frozen=True)
class SearchRange:
    """The range of a key in the unit in which it was typed, and how many values are scanned first."""

    low: float
    high: float
    count: int
    is_log: bool = False
    is_whole: bool = False

    def grid(self) -> list[Number]:
        """Return the values of the first round, ends included; whole numbers each once."""
        values = []
        for share in (i / (self.count - 1) for i in range(self.count)):
            value = (
                self.low * (self.high / self.low) ** share if self.is_log else self.low + (self.high - self.low) * share
            )
            value = {0.0: self.low, 1.0: self.high}.get(share, value)
            values.append(float(round(value)) if self.is_whole else float(f"{value:.{DIGITS}g}"))
        return list(dict.fromkeys(values))

    def between(self, low: Number, high: Number, parts: int = PARTS) -> list[Number]:
        """Return the values that divide a bracket, without its ends."""
        return [value for value in replace(self, low=low, high=high, count=parts + 1).grid() if low < value < high]

    def clip(self, value: float) -> Number:
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
    span: SearchRange,
    known: Mapping[Number, Kind],
    tolerance: float,
    peaks: Mapping[Number, Any] | None = None,
    halvings: int = HALVINGS,
) -> list[Number]:
    """Return the values to try next; none when every change is as narrow as wanted.

    `peaks` are the largest rotations, or whatever else, at those known values at which the scan may have to be denser:
    half way to both neighbours of one that is larger than theirs, where all three come to the same, `halvings` times.
    """
    peaks = peaks or {}
    scan = [value for value in span.grid() if value not in known]
    if scan:
        return scan
    values = sorted(known)
    for low, here, high in zip(values, values[1:], values[2:], strict=False):
        is_alike = known[low] == known[here] == known[high] and {low, here, high} <= peaks.keys()
        if is_alike and peaks[low] < peaks[here] > peaks[high]:
            for ends in ((low, here), (here, high)):
                length = math.log(ends[1] / ends[0]) if span.is_log else ends[1] - ends[0]
                whole = math.log(span.high / span.low) if span.is_log else (span.high - span.low)
                is_near = length / whole * (span.count - 1) < 1.5 * 0.5**halvings
                if not (is_near or (span.is_whole and ends[1] - ends[0] <= 1.0)):
                    scan += span.between(*ends, parts=2)
    if scan:
        return list(dict.fromkeys(scan))
    wide = (one for one in changes_in(known) if not span.is_narrow(one.low, one.high, tolerance))
    return [value for one in wide for value in span.between(one.low, one.high)]


def next_near(span: SearchRange, known: Mapping[Number, Kind], near: Change[Kind], tolerance: float) -> list[Number]:
    """Return the values to try next where a change is expected near a bracket, that of `near`, and nothing is scanned.

    First its ends, then on in the direction in which the change must be until it is passed, by more every time, and
    then as `next_values`. None when the change is as narrow as wanted, and where there is no such change in the range.
    """
    if not known:
        return list(dict.fromkeys(span.clip(value) for value in (near.low, near.high)))
    changes = changes_in(known)
    if changes:
        (first, *others) = changes
        if others or (first.below, first.above) != (near.below, near.above):
            return []
        return [] if span.is_narrow(first.low, first.high, tolerance) else span.between(first.low, first.high)
    low, high = min(known), max(known)
    width = OUTWARD * ((high - low) or tolerance * abs(high))
    beyond = span.clip(high + width if known[low] == near.below else low - width)
    return [] if known[low] not in (near.below, near.above) or beyond in known else [beyond]


def has_passed(model: Model) -> bool:
    """Return True where less acts on blocks at the end than before, so that what rocks then may come to rest yet."""
    scenario = model.scenario
    if moves_supports(model) or any(body.vx or body.vy or body.spin for body in model.bodies):
        return True
    values = ([abs(one.value) for one in stretches_of(load, scenario.ground.tilt)] for load in scenario.loads)
    return any(max(of_load) > of_load[-1] for of_load in values)


def moves_supports(model: Model) -> bool:
    """Return True where the ground or driven bodies move, so that what falls may stand at a value beyond."""
    return model.scenario.motion is not None or any(body.motion is not None for body in model.scenario.bodies)


def is_sustained(model: Model) -> bool:
    """Return True where loads are the same from time zero on, nothing moves then, and no block is to drop."""
    if why_not_sustained(model):
        return False
    dropped, _ = overlap.unsupported(model.scenario, model.bodies, NEAR * smallest_width(model.bodies))
    return not dropped


def numeric_levels(document: Document, given: Variations, option: str) -> tuple[Head, dict[float, object]]:
    """Return the column of the only key, and its values by their numbers in its unit, from the smallest up.

    Raises ScenarioError for values that the scenario cannot have, InvalidInputError for a range without a count, values
    that are not numbers, and one that is given twice.
    """
    text, table = next((given.texts[key], table) for key, table in given.items())
    if isinstance(table, Mapping) and "count" not in table:
        raise InvalidInputError(f"{option} {text}: single values are needed, as in KEY=a,b,c or KEY=FROM:TO:COUNT")
    sweep = build_distributions(document, given, option, "grid")
    (head,), (values,) = heads_of(sweep), sweep.vary.values()
    levels: dict[float, object] = {}
    for value in levels_of(values):
        cell = head.cell(value)
        is_number = isinstance(cell, int | float) and not isinstance(cell, bool)
        number = float(f"{cell:.12g}") if is_number else math.nan
        if not math.isfinite(number) or number in levels:
            why = "is given twice" if number in levels else "is not a number"
            raise InvalidInputError(f"{option} {text}: {value} {why}")
        levels[number] = value
    return head, dict(sorted(levels.items()))


def setting(key: str, number: Number, unit: str, *, is_whole: bool) -> dict[str, object]:
    """Return a value of a key as it is set in a document."""
    return {key: int(number) if is_whole else f"{number:.12g} {unit}" if unit else number}


@dataclass(frozen=True)
class LimitPlan:
    """One search."""

    document: Document  # without what varies
    key: str
    unit: str  # as typed; empty for plain numbers
    span: SearchRange
    criterion: Criterion
    tolerance: float  # of a bracket, relative to its ends
    has_scan: bool = True  # all values of the range are scanned; if not, statics says where to begin
    most_runs: int = MOST_RUNS
    apart: Mapping[str, object] = field(default_factory=dict)  # settings in which its runs differ from the document

    @cached_property
    def model(self) -> Model:
        """What the document describes."""
        return Model(self.document)

    @property
    def usual_runs(self) -> int:
        """How many runs a scan and one change within it take."""
        grid, count = self.span.grid(), 0
        low, high = grid[len(grid) // 2 - 1 : len(grid) // 2 + 1]
        while not self.span.is_narrow(low, high, self.tolerance):
            inner = self.span.between(low, high)
            count, high = count + len(inner), inner[0]
        return len(grid) + count

    def settings(self, number: Number) -> dict[str, object]:
        """Return what distinguishes the run of a value from the document."""
        return {**setting(self.key, number, self.unit, is_whole=self.span.is_whole), **self.apart}

    def model_at(self, number: Number) -> Model:
        """Return what is run at a value. Raises ScenarioError where the value does not go with the others."""
        return self.model.varied(self.settings(number))

    def verdicts(
        self, rows: Mapping[Number, Row], undecided: Stability = Stability.UNDECIDED
    ) -> dict[Number, Stability]:
        """Return what runs came to, from the smallest value up; `undecided` is what those count as that move on."""
        found = {value: self.criterion.verdict(rows[value]) for value in sorted(rows)}
        return {value: undecided if one is Stability.UNDECIDED else one for value, one in found.items()}

    def cases_of_one_change(self) -> Cases:
        """Return the runs of a search that scans its range and finds one change in the middle."""
        known, middle = dict[Number, bool](), self.span.grid()[self.span.count // 2]
        while values := next_values(self.span, known, self.tolerance):
            known |= {value: value < middle for value in values}
        settings = [self.settings(value) for value in sorted(known)]
        return Cases(self.model, Design({key: [one[key] for one in settings] for key in settings[0]}), ())

    @property
    def name(self) -> str:
        """A hash of everything that decides the answer."""
        ends = [self.key, self.unit, *vars(self.span).values(), self.criterion.text, self.tolerance]
        return manifest.short_hash([self.model.hash, ends, code_hash()])


class CurvePlan(NamedTuple):
    """A search at each number of another key."""

    head: Head  # that key, and its unit
    searches: Mapping[float, LimitPlan]


@takes(CurveOptions)
def read_curve(document: Document, options: CurveOptions) -> CurvePlan:
    """Return the plan of a curve of limits. Raises as `read_limit`, for every value of the other key."""
    given = Variations.of(options.over or {})
    if len(given) != 1:
        raise InvalidInputError(f"limits are searched over one key, not {len(given)}: give {OVER} KEY=a,b,c once")
    bare = document.without_sweep()
    head, levels = numeric_levels(bare, given, OVER)
    if len(levels) > MOST_VALUES:
        raise InvalidInputError(f"{len(levels)} values are too many; at most {MOST_VALUES} are searched")
    one = LimitOptions(**options.search_options)
    return CurvePlan(head, {at: read_limit(bare.with_values({head.key: value}), one) for at, value in levels.items()})


@takes(LimitOptions)
def read_limit(document: Document, options: LimitOptions) -> LimitPlan:
    """Return the plan of a search.

    Its runs begin at rest where loads are sustained at both ends of the range, unless the document says whether they
    do. Raises ScenarioError for a key or range that the scenario cannot have, InvalidInputError for a wrong criterion
    or tolerance, and where more or less than one key is given.
    """
    stands, tolerance = criterion.read_criterion(options.stands or criterion.DEFAULT), options.tolerance
    if not LEAST_TOLERANCE <= tolerance < 1.0:
        message = f"a bracket of {tolerance:g} of the value cannot be reached; give {LEAST_TOLERANCE:g} up to below 1"
        raise InvalidInputError(message)
    given = Variations.of(options.vary)
    if len(given) != 1:
        raise InvalidInputError(f"a limit is searched along one key, not {len(given)}: give {OPTION} KEY=FROM:TO once")
    key, table = next(iter(given.items()))
    bare = document.without_sweep()
    if not isinstance(table, Mapping) or not {"from", "to"} <= set(table):
        message = f"{OPTION} {given.texts[key]}: a range is needed, as in {key}=FROM:TO or {key}=FROM:TO:COUNT"
        raise InvalidInputError(message)
    count = table.get("count", 9 if options.scan is None else options.scan)
    if isinstance(count, bool) or not isinstance(count, int) or not 2 <= count <= MOST_SCANNED:
        raise InvalidInputError(f"{count} values cannot be scanned; a whole number from 2 to {MOST_SCANNED} is needed")
    ends: dict[str, Any] = {name: table[name] for name in table if name != "count"}
    if study.is_descending(ends):
        ends |= {"from": ends["to"], "to": ends["from"]}
    values: Any = build_distributions(bare, Variations({key: ends}, given.texts), OPTION, "sobol").vary[key]
    unit = values.unit or ("rad" if values.angle else "")
    factor = float(units.parse_unit(unit).factor) if unit else 1.0
    low, high = (float(f"{end / factor:.{DIGITS}g}") for end in (values.low, values.high))
    is_whole = takes_whole(bare, key) and all(type(ends[end]) is int for end in ("from", "to"))
    count = min(count, int(high - low) + 1) if is_whole else count  # every whole number that fits
    span = SearchRange(low, high, count, is_log=values.scale == "log", is_whole=is_whole)
    has_scan = "count" in table or options.scan is not None
    plan = LimitPlan(bare, key, unit, span, stands, tolerance, has_scan, options.most_runs)
    at_ends = []
    for number in (low, high):
        try:
            at_ends.append(plan.model_at(number))
        except BlocksimError as error:
            message = f"{key} = {answer.with_unit(number, unit)}: {str(error).splitlines()[0]}"
            raise InvalidInputError(message) from error
    if options.stands is None and moves_supports(plan.model):
        stands = criterion.read_criterion(criterion.OF_MOVING_SUPPORTS)
    stops_at_rest = plan.model.scenario.time.stop_at_rest and not moves_supports(plan.model)
    judge = replace(stands, has_passed=any(map(has_passed, at_ends)), stops_at_rest=stops_at_rest)
    plan = replace(plan, criterion=judge)
    start = bare.data.get("start")
    if (isinstance(start, Mapping) and "settle" in start) or not all(map(is_sustained, at_ends)):
        return plan
    return replace(plan, document=bare.with_values({"start.settle": True}))


def takes_whole(document: Document, key: str) -> bool:
    """Return True for a key whose values are whole numbers."""
    field = overrides.field_of(key, document.build())
    kinds = () if field is None else overrides.options(field.annotation)
    return int in kinds and float not in kinds

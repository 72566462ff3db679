"""At which value of a key a structure falls: scan and narrowing; and the same at each value of another key.

Where springs shift a limit by more than SHIFT, the same limit is searched with springs ten times as stiff, near where
it is foretold, and the answer is that of stiff contacts. Where they may shift it, but nothing says by how much, two
runs with stiffer springs tell, one beyond either side of the bracket.

Steps of rigid contacts are chosen before a run, and what they take away from a limit goes with the step, as blocks turn
about edges that move on by v h in a step h. So both sides of a bracket are run with half of it. Where they come to the
same, the limit is that of any shorter step, within its bracket; where they do not, it is searched again, and the answer
holds both brackets, and beyond the second one as much as lies between them.

**Springs.** What topples on springs has turned before, as its toe sinks in, and needs so much less tilt: the critical
tilt of a block is atan(b/h) less the angle F/(k b) that it has turned by when all its weight F is on one corner of
stiffness k. In a wall the part that topples turns as a whole, as the load leaves the heel. So the largest turn on the
standing side of a bracket is the shift. A structure that has moved, or rocked back, has turned otherwise too. Of that
only a bound is known, if everything rests on one corner of the softest contact; and none where supports move: what
impacts of a rocking block leave depends on the springs too, and a pulse that begins at its peak while springs carry
none of it makes it slip too far, with the root of 1/stiffness (simulation/run.py). There every run is long and no limit
need be one of stiff contacts, so stiffer springs are searched when asked for alone.

**Stiff contacts.** All that is linear in 1/k where it is small, and so is what it takes away from a limit: L(k) = L -
a/k. Of two stiffnesses, one r times the other, L = (r L(r k) - L(k))/(r - 1). With a force k d^n a contact gives way as
k^(-1/n), so that r is 10^(1/n) for a ratio of 10: with the law of Hertz 10^(2/3). What is left out is of second order:
for L(k) = L (1 - s - c s^2) it is c s^2/r of L, and c is about one for a block that topples about its toe. That much is
added to both sides of the bracket. Where gravity comes at once, a scene falls on its springs by F/k, and with the
velocity that it has then, which goes as 1/k^(1/2), it rocks. Without a start at rest the answer is therefore a bracket
that holds the extrapolations of both powers.

**Rest.** What falls under a load a little above its limit begins with a small acceleration a. A run takes it for rest
where it is slower than `time.rest_speed` for `time.rest_hold`, so for a < rest_speed/rest_hold; and to its end T it
comes no farther than a T^2/2, so that it stands where that is less than what the criterion names, and less than a tenth
of the time more would take it beyond. Over gravity, that acceleration is the part of a horizontal load, of the tangent
of a tilt or of a coefficient of friction that is not decided (a block that slides), and about that part of a ratio of
lengths (one that topples). Limits are reported too far on the falling side by it. What has settled before time zero
rests within 1e-8 of gravity, and where supports move a limit is none of rest.
"""

import math
import shutil
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from blocksim.errors import InvalidInputError, OutputError, StoppedEarlyError
from blocksim.options import silent, takes
from blocksim.scenario import Document, Model, PlacedBody, Source, document_of, laws, placement
from blocksim.scenario.models import timeline
from blocksim.simulation import observables, provenance, rest_state, schemes
from blocksim.study import limit_answer, limit_plan, manifest, sweep, sweep_folder
from blocksim.study.answer import Study, without_cases
from blocksim.study.criterion import Stability, falls_before_zero
from blocksim.study.executors import Execution, ensemble
from blocksim.study.limit_plan import Change, LimitPlan, Number, moves_supports
from blocksim.study.rows import FINISHED, Head, Row
from blocksim.world.interactions import contact_classes, interactions_of

SHIFT = 2.5e-3  # share of a limit by which springs may shift it unasked: half of what is warned of, as it is foretold
MOST_PICTURED = 3  # brackets whose sides are kept
SHARPER = 0.8  # of the tolerance: what is extrapolated from two brackets is wider than the narrower one
HALF = 0.5
ASIDE = 0.49  # of the tolerance: how far from a static bound runs are expected to stand and to fall
SLIDES = 0.01  # calibrated: of a bound, how far below it the estimate of joints that slip is where runs fall there
BEYOND_ESTIMATE = 0.1  # calibrated: of the way from there to the bound, up to which they stand
NO_STIFFER = "with springs {ratio:g} times as stiff there is no such limit in the range"
NO_FINER = "with half the time step there is no such limit in the range"
CUT = "not searched to the end, as that takes more than --most-runs"
STILL_FAR = "limits of the last two stiffnesses are too far apart to be extrapolated well; give stiffer springs"
STANDS = observables.Response.STANDS.value
OnOther = Callable[[LimitPlan], None]
OnLimit = Callable[[float, limit_answer.LimitAnswer], None]
Rows = Mapping[Number, Row]
STOOD = {True: Stability.STANDS, False: Stability.FALLS}
RATIO = 10.0  # of stiffness between a search and the next one
BEYOND = 10.0 / 9.0  # of the way to stiff contacts over that to springs ten times as stiff
FAR = 0.08  # of a limit: two of them that are no farther apart are extrapolated
AIM = 0.07  # of the way to the next limit, by which that may be elsewhere
TILT = "ground.tilt"
COEFFICIENTS = ("friction.", ".friction", "gravity.horizontal")
STIFFNESS = "contact.stiffness_scale"
OF_STIFFNESS = ("stiffness", "young_modulus", "poisson_ratio", "contact_radius", "time.")


@takes(limit_plan.LimitOptions)
def limit(scenario: Source, options: limit_plan.LimitOptions) -> limit_answer.LimitAnswer:
    """Find the values of a key at which a structure stops, or begins, to stand.

    There may be several changes, but those of an island between two scanned values are not seen. `stands`: see
    `blocksim.study.criterion`. Runs are kept, with `keep_runs` those of both sides of a bracket with frames and
    contacts, for `plot` and `report`; the same call again does only what is missing. Under sustained loads runs begin
    at rest, unless the scenario has `start.settle = false`. The executor does not change the answer. `on_run` is called
    with each value, verdict and row. Raises ScenarioError, InvalidInputError, OutputExistsError where the folder is not
    free, UnavailableError, StoppedEarlyError on Ctrl-C.

    >>> blocks = "scenarios/three_blocks_nonsmooth.toml"
    >>> found = limit(blocks, {"structures.0.overlap": {"from": "12 mm", "to": "28 mm"}}, out="results/limit")
    >>> round(found.changes[0].low, 1)  # mm: two thirds of a side
    21.3
    """
    return find_limit(limit_plan.read_limit(document_of(scenario), options), options)


@takes(limit_plan.CurveOptions)
def limit_curve(scenario: Source, options: limit_plan.CurveOptions) -> limit_answer.CurveAnswer:
    """Find the limits of a key at each value of another one: `limit` with `over`, {"friction.block_block": [0.3, 0.5]}.

    Searches are kept in `out` (default: results/NAME/limits-HASH). Raises as `limit`.

    >>> blocks, gravity = "scenarios/three_blocks_nonsmooth.toml", {"gravity": [1.62, 9.81]}
    >>> overlap = {"structures.0.overlap": {"from": "12 mm", "to": "28 mm"}}
    >>> len(limit_curve(blocks, overlap, gravity, tolerance=0.05, out="results/curve").points)
    2
    """
    return find_curve(limit_plan.read_curve(document_of(scenario), options), options)


def find_limit(
    plan: LimitPlan,
    options: limit_plan.LimitOptions,
    execution: Execution | None = None,
    on_other: OnOther = silent,
) -> limit_answer.LimitAnswer:
    """Search as planned, with the executor of the options unless there is another; see `limit`.

    `on_other` is called before the first run of another stiffness or step.
    """
    if options.stiffer:
        refuse_without_springs(plan)
    base, kind, execution = plan.model_at(plan.span.low), limit_answer.LimitAnswer.files, execution or options
    overwrite = options.overwrite
    with sweep.runs_of(
        plan.model, base, options.out, kind, plan.name, execution, overwrite=overwrite, peaks=True
    ) as runs:
        answer = _Search(plan, runs, options.stiffer, options.on_run, on_other).answer()
        answer.write()  # first: the runs beside it may not fit on the disk
        if options.keep_runs:
            answer = with_sides(answer)
            answer.write()
    return answer


def find_curve(
    plan: limit_plan.CurvePlan, options: limit_plan.CurveOptions, on_limit: OnLimit = silent
) -> limit_answer.CurveAnswer:
    """Search as planned, one value after the other, each in a folder of its own; see `limit_curve`."""
    options.ready()
    if options.stiffer:
        refuse_without_springs(*plan.searches.values())
    one = next(iter(plan.searches.values()))
    base, kind = one.model_at(one.span.low), limit_answer.CurveAnswer.files
    name = manifest.short_hash([plan.head.key, *(search.name for search in plan.searches.values())])
    folder = sweep.make_folder(options.out, base, kind, name, overwrite=options.overwrite)
    found: dict[float, limit_answer.LimitAnswer] = {}
    for number, search in plan.searches.items():
        place = folder / limit_answer.place_of(number, plan.head.unit)
        found[number] = find_limit(
            search, limit_plan.LimitOptions(**{**options.search_options, "out": place, "keep_runs": False})
        )
        on_limit(number, found[number])
    answer = limit_answer.CurveAnswer.of(plan.head, folder, found)
    answer.write()
    return answer


@dataclass(frozen=True)
class Levels:
    """One limit at the stiffness given, then at RATIO times the one before; why there are no more, if some lack."""

    levels: tuple[limit_answer.StiffnessLevel, ...]
    ratio: float  # by which springs of the next stiffness give way less
    is_at_rest: bool = True  # at the start
    problem: str = ""

    @property
    def is_far(self) -> bool:
        """True where the last two are too far apart to be extrapolated, or there is only one."""
        if len(self.levels) == 1:
            return True
        before, last = (level.middle for level in self.levels[-2:])
        return abs(last - before) > FAR * abs(last)

    @property
    def stiff(self) -> tuple[float, float] | None:
        """The bracket of stiff contacts, from the last two; None where there is only one."""
        if len(self.levels) == 1:
            return None
        before, last = self.levels[-2:]
        ratios = (self.ratio,) if self.is_at_rest else (self.ratio, math.sqrt(self.ratio))
        low = min(extrapolate_limit(before.high, last.low, ratio) for ratio in ratios)
        high = max(extrapolate_limit(before.low, last.high, ratio) for ratio in ratios)
        middle = extrapolate_limit(before.middle, last.middle, self.ratio)
        unknown = (middle - before.middle) ** 2 / self.ratio / abs(middle) if middle else 0.0
        return low - unknown, high + unknown

    def aim(self, share: float, tolerance: float) -> tuple[float, float]:
        """Return between which values to look for the limit of the next stiffness.

        `share` of the limit is by how much stiff contacts have another one, where only one stiffness is known.
        """
        last = self.levels[-1].middle
        if len(self.levels) > 1:
            share = extrapolate_limit(self.levels[-2].middle, last, self.ratio) / last - 1.0 if last else 0.0
        way = last * share * (1.0 - 1.0 / self.ratio)
        margin = max(AIM * abs(way), tolerance * abs(last))
        return last + way - margin, last + way + margin


def extrapolate_limit(softer: float, stiffer: float, ratio: float) -> float:
    """Return the value of stiff contacts from two that springs are off by, the second `ratio` times less."""
    return (ratio * stiffer - softer) / (ratio - 1.0)


def can_be_stiffer(plan: LimitPlan) -> bool:
    """Return True for springs, unless the key is one of stiffness or a system has its own, or whole numbers only."""
    has_springs = plan.model.scenario.time.has_springs and not plan.model.scenario.systems
    return has_springs and not plan.span.is_whole and not any(part in plan.key for part in OF_STIFFNESS)


def refuse_without_springs(*plans: LimitPlan) -> None:
    """Raise InvalidInputError where none of the plans can be searched with stiffer springs."""
    if any(can_be_stiffer(plan) for plan in plans):
        return
    if not any(plan.model.scenario.time.has_springs for plan in plans):
        scheme = f"time.scheme {timeline.SPRINGS}"
        raise InvalidInputError(f"rigid contacts have no stiffness: --stiffer is for springs ({scheme})")
    springs = limit_plan.NAMES[timeline.SPRINGS]
    raise InvalidInputError(f"--stiffer: {springs} are not made stiffer for a limit of {plans[0].key}, or beside soil")


class StandingSide:
    """The end of a bracket at which nothing has fallen."""

    def __init__(self, plan: LimitPlan, change: Change[Stability], rows: Mapping[Number, Row]) -> None:
        """Take a change of a search and all its rows."""
        self.plan, self.change = plan, change
        self.value = change.high if change.below is Stability.FALLS else change.low
        self.model, row = plan.model_at(self.value), rows[self.value]
        self.give: limit_answer.Give | None = None  # how far springs have given way, where what stands there says so
        if plan.model.scenario.time.has_springs and row.get("outcome") == STANDS:  # what rocked back has turned too
            turn = max(abs(float(str(row[name]))) for name in row if name.endswith(".rotation_deg"))
            # of the load k that topples a block by k g along the ground, atan k = a, a turn d takes away 2 d/sin(2 a) k
            slope = (float(self.model.scenario.ground.tilt) or math.inf) if plan.key == TILT else 0.5
            self.give = limit_answer.Give(self.value, turn, math.radians(turn) / slope)

    @property
    def most_shift(self) -> float:
        """A bound of the share of a limit that springs take away, by their load and how slender blocks are."""
        scenario, placed = self.model.scenario, self.model.bodies
        slender = slenderness(placed)
        if self.give is not None:
            return max(self.give.share, 2.0 * math.radians(self.give.turn) / slender)
        # the softest contact gives way under the weight of all free blocks
        weight = scenario.gravity.size * sum(body.mass for body in placed if not body.fixed)
        table = interactions_of(scenario, contact_classes(self.model))
        springs = (pair for row in table for pair in row if pair.normal_stiffness > 0.0)
        stiffness = min(pair.normal_stiffness * min(1.0, pair.shear_ratio) for pair in springs)  # in shear if softer
        sink = laws.LAWS[scenario.contact.law].compression(stiffness, weight)
        width = min(min(body.size_x, body.size_y) for body in placed)
        moved = self.plan.criterion.least_moved
        return max(2.0 * sink / (width * slender), sink / moved if moved else 0.0)

    def margin(self, levels: Levels | None, probed: float, *, as_given: bool) -> limit_answer.Margin:
        """Return the shares of the limit that are not decided.

        `probed` is the share within which stiffer springs were searched; with `as_given` the limit is that of springs.
        """
        plan, scenario = self.plan, self.model.scenario
        rest = rest_acceleration(self.model, plan.criterion.least_moved)
        if rest:  # over gravity it is a share of a tilt (rad), of a coefficient; of one for other keys
            is_coefficient = any(part in plan.key for part in COEFFICIENTS) or plan.key.startswith("loads.")
            load = 1.0
            if plan.key == TILT:
                load = min(abs(float(scenario.ground.tilt)), 1.0) or 1.0
            elif is_coefficient and not plan.unit:
                load = min(abs(self.value), 1.0) or 1.0
            rest = rest / scenario.gravity.magnitude / load
        if as_given or not plan.model.scenario.time.has_springs:
            return limit_answer.Margin(rest=rest, springs=0.0)
        if levels is not None:
            is_known = levels.stiff is not None or levels.problem
            return limit_answer.Margin(rest=rest, springs=0.0 if is_known else BEYOND * probed)
        if moves_supports(plan.model):  # nothing says by how much
            return limit_answer.Margin(rest=rest, springs=0.0)
        return limit_answer.Margin(rest=rest, springs=self.most_shift if self.give is None else self.give.share)


def slenderness(bodies: Iterable[PlacedBody]) -> float:
    """Return sin(2 a) of the most slender block or of all of them together, tan a = width/height; 1 for squat ones."""
    placed = [body for body in bodies if not body.fixed]
    sizes = [(body.size_x, body.size_y) for body in placed]
    xs = [body.x + side * body.size_x for body in placed for side in (-0.5, 0.5)]
    ys = [body.y + side * body.size_y for body in placed for side in (-0.5, 0.5)]
    sizes.append((max(xs) - min(xs), max(ys) - min(ys)))
    return min(math.sin(2.0 * math.atan2(min(width, height), height)) for width, height in sizes)


def rest_acceleration(model: Model, least_moved: float | None) -> float:
    """Return the acceleration (m/s2) below which a run cannot be told from rest; `least_moved` (m) is the criterion's.

    Zero where blocks settle before time zero, supports move, or nothing pulls.
    """
    scenario, time = model.scenario, model.scenario.time
    if model.settles or scenario.motion is not None or not scenario.gravity.size > 0.0:
        return 0.0
    moved = observables.MOVED_SHARE * placement.smallest_width(body for body in model.bodies if not body.fixed)
    way = moved if least_moved is None else least_moved
    of_end = min(2.0 * way, moved / observables.FURTHER) / time.end**2
    hold = max(time.rest_hold, 0.0)
    of_rest = time.rest_speed / hold if time.stop_at_rest and hold > 0.0 else 0.0
    return max(of_end, of_rest)


@dataclass
class _Search:
    """The runs of a search, as planned and with other stiffnesses or steps."""

    plan: LimitPlan
    runs: sweep.Runs
    stiffer: bool | None
    on_run: limit_plan.OnRun
    on_other: OnOther
    count: int = 0  # of the values that were run
    is_cut: bool = False  # by the most runs of the plan
    stiff_rows: dict[float, dict[Number, Row]] = field(default_factory=dict)  # by stiffness scale
    step_rows: dict[float, dict[Number, Row]] = field(default_factory=dict)  # by time step (s)

    def answer(self) -> limit_answer.LimitAnswer:
        """Return the answer, after all runs that it takes."""
        plan, folder = self.plan, self.runs.manifest.path.parent
        statics, near = (None, None) if plan.has_scan else self._foretold()

        def choose(rows: Rows) -> list[Number]:
            if near is not None:
                verdicts = plan.verdicts(rows)
                values = limit_plan.next_near(plan.span, verdicts, near, plan.tolerance)
                changes = [(one.below, one.above) for one in limit_plan.changes_in(verdicts)]
                if values or changes == [(near.below, near.above)]:
                    return values
            known = rows.items() if moves_supports(plan.model) else ()  # a value may fall between others that stand
            peaks = {at: float(str(row[observables.PEAK])) for at, row in known if observables.PEAK in row}
            return limit_plan.next_values(plan.span, plan.verdicts(rows), plan.tolerance, peaks)

        rows = self._searched(plan, choose)
        brackets = [self._bracket(change, rows) for change in limit_plan.changes_in(plan.verdicts(rows))]
        others, is_as_given = (self.stiff_rows, self.step_rows), self.stiffer is False
        return limit_answer.LimitAnswer.of(
            plan, folder, rows, brackets, *others, run=self.runs.new, is_as_given=is_as_given, statics=statics
        ).model_copy(update={"is_cut": self.is_cut})

    def _foretold(self) -> tuple[dict[str, object] | None, Change[Stability] | None]:
        """Return the only value beyond which statics knows no equilibrium, and the side; and a bracket about it."""
        from blocksim.study import static_limit  # noqa: PLC0415 - scipy takes a third of a second

        plan, limit = self.plan, static_limit.bound_of(self.plan)
        if limit is None or plan.span.is_whole:
            return None, None
        sides = {static_limit.NONE: Stability.FALLS, static_limit.POSSIBLE: Stability.STANDS}
        ends = [limit.bound + side * ASIDE * plan.tolerance * abs(limit.bound) for side in (-1.0, 1.0)]
        if limit.estimate is not None and abs(limit.estimate - limit.bound) > SLIDES * abs(limit.bound):
            way = BEYOND_ESTIMATE * (limit.bound - limit.estimate)
            ends = sorted([limit.estimate - HALF * way, limit.estimate + way])
        low, high = map(plan.span.clip, ends)
        statics = {"static_bound": limit.bound, "static_side": limit.side}
        return statics, self._on_springs(Change(low, high, sides[limit.below], sides[limit.above]))

    def _on_springs(self, near: Change[Stability]) -> Change[Stability]:
        """Return a bracket of equilibria on springs, found without time and as narrow as can be; if none, that given.

        Two runs confirm one as narrow as wanted; where an equilibrium is not certain, runs go on from the last bracket.
        """
        plan, verdicts = self.plan, dict[Number, Stability]()
        while values := limit_plan.next_near(plan.span, verdicts, near, plan.tolerance):
            models = {value: plan.model_at(value) for value in values}
            rests = {at: rest_state.rests(one) if one.settles else None for at, one in models.items()}
            verdicts |= {at: STOOD[one] for at, one in rests.items() if one is not None}
            if None in rests.values():
                break
        changes = limit_plan.changes_in(verdicts)
        return changes[0] if len(changes) == 1 else near

    def _searched(self, plan: LimitPlan, choose: Callable[[Rows], list[Number]]) -> dict[Number, Row]:
        """Go from round to round and return what it needed; rows of an earlier search are taken as they are.

        The first round of all is run however many values it has.
        """
        rows: dict[Number, Row] = {}
        while not self.is_cut and (values := choose(rows)):
            if self.count and self.count + len(values) > plan.most_runs:
                self.is_cut = True
                break
            self.count += len(values)
            wanted = {value: plan.settings(value) for value in values}
            rows |= self.runs.rows_of(wanted, lambda at, row: self.on_run(at, plan.criterion.verdict(row), row))
        return rows

    def _bracket(self, change: Change[Stability], rows: Rows) -> limit_answer.Bracket:
        """Return a change as it is with stiff contacts and short steps, as far as known, and as wide as is unknown."""
        plan, is_corrected = self.plan, self.stiffer is not False
        below = limit_answer.Side.of(change.low, change.below, rows[change.low])
        above = limit_answer.Side.of(change.high, change.above, rows[change.high])
        given = limit_answer.Bracket(low=change.low, high=change.high, below=below, above=above)
        if not limit_answer.LIMIT | {Stability.UNDECIDED} >= {change.below, change.above} > {Stability.FALLS}:
            return given
        side = StandingSide(plan, change, rows)
        least, levels, half = max(SHIFT, plan.tolerance), None, None
        if is_corrected and can_be_stiffer(plan):
            is_needed = self.stiffer or (not moves_supports(plan.model) and side.most_shift > least)
            levels = self._levels(side, least) if is_needed else None
        elif is_corrected and not plan.model.scenario.time.has_springs and not plan.key.startswith("time."):
            half = self._half(change)
        margin = side.margin(levels, least, as_given=not is_corrected)
        give = side.give if {change.below, change.above} == limit_answer.LIMIT else None
        fields: dict[str, Any] = {"undecided": margin, "give": give}
        low, high = given.low, given.high
        if levels is not None:
            stiff = levels.stiff
            fields |= {"extrapolated": stiff is not None, "levels": levels.levels, "problem": levels.problem}
            fields["stiff"] = stiff
            low, high = stiff or (low, high)
        if half is not None:
            fields["half_step"] = half
            if (half.low, half.high) != (low, high):
                on = max(half.low - high, 0.0) + min(half.high - low, 0.0)  # what lies between both
                low, high = min(low, half.low + min(on, 0.0)), max(high, half.high + max(on, 0.0))
        ends = (margin.rest, margin.springs) if change.above is Stability.FALLS else (margin.springs, margin.rest)
        fields |= {"low": low - ends[0] * abs(low), "high": high + ends[1] * abs(high)}
        return given.model_copy(update=fields)

    def _again(
        self,
        plan: LimitPlan,
        near: Change[Stability],
        known: dict[float, dict[Number, Row]],
        place: float,
        *,
        may_stay: bool = False,
    ) -> Change[Stability] | None:
        """Search the limit once more near a bracket with other settings, and return it if there is one.

        Its rows are kept as `known[place]`. With `may_stay` nothing more is run where both ends came to the same again.
        """
        stands = Stability.STANDS  # what moves on at the end without having fallen counts as standing here
        below, above = (stands if end is Stability.UNDECIDED else end for end in (near.below, near.above))
        near = replace(near, below=below, above=above)
        if place not in known and not self.is_cut:
            self.on_other(plan)

        def choose(rows: Rows) -> list[Number]:
            verdicts = plan.verdicts(rows, stands)
            is_same = may_stay and limit_plan.changes_in(verdicts) == [near]
            return [] if is_same else limit_plan.next_near(plan.span, verdicts, near, plan.tolerance)

        rows = self._searched(plan, choose)
        known.setdefault(place, {}).update(rows)
        changes = [] if self.problem else limit_plan.changes_in(self.plan.verdicts(rows, stands))
        return changes[0] if len(changes) == 1 and {changes[0].below, changes[0].above} == limit_answer.LIMIT else None

    @property
    def problem(self) -> str:
        """Why another search has no answer, where that is the limit of runs."""
        return CUT if self.is_cut else ""

    def _half(self, change: Change[Stability]) -> limit_answer.HalfStep:
        """Search a limit with half the time step."""
        ends = (change.low, change.high)
        steps = (schemes.build(self.plan.model_at(value)).world.controls[0].step for value in ends)
        step = HALF * float(min(steps))
        found = self._again(replace(self.plan, apart={limit_answer.STEP: step}), change, self.step_rows, step)
        if found is None:
            return limit_answer.HalfStep(step=step, low=change.low, high=change.high, problem=self.problem or NO_FINER)
        return limit_answer.HalfStep(step=step, low=found.low, high=found.high)

    def _levels(self, side: StandingSide, least: float) -> Levels:
        """Search one limit at one stiffness after the other, until two are near enough to be extrapolated.

        A step given by hand is shorter with stiffer springs, in proportion.
        """
        change, model = side.change, self.plan.model_at(side.change.low)
        scenario = model.scenario
        first = scale = scenario.contact.stiffness_scale
        given = limit_answer.StiffnessLevel(stiffness_scale=scale, low=change.low, high=change.high)
        compression = laws.LAWS[scenario.contact.law].compression(1.0, RATIO)
        levels = Levels((given,), compression, is_at_rest=model.settles)
        share = side.give.share if side.give is not None else 0.0
        while levels.is_far and len(levels.levels) < 4:  # stiffnesses
            scale *= RATIO
            is_foretold = len(levels.levels) > 1 or share > least
            if is_foretold:
                low, high = levels.aim(-share if change.below is Stability.FALLS else share, self.plan.tolerance)
            else:
                beyond = least * max(abs(change.low), abs(change.high))
                low, high = change.low - beyond, change.high + beyond
            near = replace(change, low=self.plan.span.clip(low), high=self.plan.span.clip(high))
            apart: dict[str, object] = {STIFFNESS: scale}
            if scenario.time.step != "auto":
                apart[limit_answer.STEP] = scenario.time.step * (first / scale) ** 0.5
            plan = replace(self.plan, tolerance=SHARPER * self.plan.tolerance, apart=apart)
            may_stay = not (is_foretold or self.stiffer)
            found = self._again(plan, near, self.stiff_rows, scale, may_stay=may_stay)
            if found is None:
                return replace(levels, problem=self.problem or NO_STIFFER.format(ratio=scale / first))
            if may_stay and (found.low, found.high) == (near.low, near.high):
                return levels
            level = limit_answer.StiffnessLevel(stiffness_scale=scale, low=found.low, high=found.high)
            levels = replace(levels, levels=(*levels.levels, level))
        return replace(levels, problem=STILL_FAR) if levels.is_far else levels


def with_sides(answer: limit_answer.LimitAnswer) -> limit_answer.LimitAnswer:
    """Run both sides of the first brackets once more, into folders of their own, unless they are there.

    Returns the answer with the names of these folders; what pictures of mechanisms show lies there. The motion is that
    of the search, so a run that ends otherwise could not be written; what does not come to rest before time zero is
    released then, so that there is a run that shows how it falls. Raises OutputError, and StoppedEarlyError on Ctrl-C.
    """
    plan = answer.plan
    assert plan is not None  # noqa: S101 - it was just searched
    sides: dict[float, limit_answer.Side] = {}
    for side in [one for bracket in answer.falls[:MOST_PICTURED] for one in (bracket.below, bracket.above)]:
        falls = falls_before_zero(side.model_dump())
        if side.value in sides or not (falls or side.status == FINISHED):
            continue
        scenario = plan.model_at(side.value).scenario
        release = {"release": "always" if falls else "at rest"}
        changed = {"output": {"contacts": True}, "start": release, "time": {"stop_at_rest": False} if falls else {}}
        tables = {name: getattr(scenario, name).model_copy(update=update) for name, update in changed.items()}
        model = Model(scenario.model_copy(update=tables))  # not stopped where it is slow: so it may begin
        name = provenance.run_hash(model)
        row = ensemble.run_case(model, answer.folder / sweep_folder.CASES / name)
        if row["status"] == ensemble.INTERRUPTED:
            raise StoppedEarlyError("stopped while the runs beside a limit were kept; rerun the command to finish")
        if row["status"] != FINISHED and not (falls and "outcome" in row):
            message = f"{row['reason']}; the limit is found, its runs are not kept: rerun the command, or --no-runs"
            raise OutputError(message)
        if row["status"] == FINISHED:
            is_seen = falls and row["outcome"] != STANDS  # of one that was released to be seen to fall
            update = (
                {name: row.get(name) for name in (*observables.table_columns(), observables.PEAK)} if is_seen else {}
            )
            sides[side.value] = side.model_copy(update={**update, "case": name})
    brackets = []
    for one in answer.brackets:
        below, above = (sides.get(side.value, side) for side in (one.below, one.above))
        brackets.append(one.model_copy(update={"below": below, "above": above}))
    return answer.model_copy(update={"brackets": tuple(brackets)})


def repeat_limit(answer: limit_answer.LimitAnswer, execution: sweep.Replay, out: Path) -> limit_answer.LimitAnswer:
    """Search again, with stiffer springs or not as in the first way that leads to the answer, or to any."""
    document = Document.read(answer.folder / answer.files.plan, is_stored=True)
    vary = answer.vary
    if answer.static_bound is not None:  # nothing was scanned
        del vary[answer.key]["count"]
    options = limit_plan.LimitOptions(vary, stands=answer.stands, tolerance=answer.tolerance, keep_runs=False)
    options = replace(options, most_runs=answer.most_runs)
    plan = limit_plan.read_limit(document, options)
    tried: list[limit_answer.LimitAnswer] = []
    for stiffer in (None, True, False):  # what was asked for is not kept
        with suppress(InvalidInputError):
            place = out / f"limit-{stiffer}"
            execution.runs.clear()  # what another way has asked for
            again = find_limit(plan, replace(options, out=place, stiffer=stiffer), execution)
            if (answer.folder / sweep_folder.CASES).is_dir():  # what these runs show; they are not run again
                shutil.copytree(answer.folder / sweep_folder.CASES, place / sweep_folder.CASES)
                again = with_sides(again)
                again.write()
            tried.append(again)
            if without_cases(again.to_dict()) == without_cases(answer.to_dict()):
                return again
    if not tried:
        raise InvalidInputError(f"{answer.folder}: the manifest lacks runs of this search")
    return tried[0]


def repeat_curve(answer: limit_answer.CurveAnswer, _: sweep.Replay, out: Path) -> limit_answer.CurveAnswer:
    """Repeat all searches of a curve, and put their answers together."""
    searches = {
        over: repeat_limit(limit_answer.LimitAnswer.read(place), sweep.Replay.of(place), out / f"{number}")
        for number, (over, place) in enumerate(answer.places().items())
    }
    again = limit_answer.CurveAnswer.of(Head(answer.over, answer.over_unit), out, searches)
    again.write()
    return again


LIMIT = Study(limit_answer.LimitAnswer, repeat_limit)
CURVE = Study(limit_answer.CurveAnswer, repeat_curve, parts=lambda answer: list(answer.places().values()))

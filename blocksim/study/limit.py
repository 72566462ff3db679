"""At which value of a key a structure falls: scan and narrowing; and the same at each value of another key.

Where springs shift a limit by more than SHIFT, the same limit is searched with springs ten times as stiff, near where
it is foretold, and the answer is that of stiff contacts (limit_margin.py). Where they may shift it, but nothing says by
how much, two runs with stiffer springs tell, one beyond either side of the bracket.

Steps of rigid contacts are chosen before a run, and what they take away from a limit goes with the step, as blocks turn
about edges that move on by v h in a step h. So both sides of a bracket are run with half of it. Where they come to the
same, the limit is that of any shorter step, within its bracket; where they do not, it is searched again, and the answer
holds both brackets, and beyond the second one as much as lies between them.
"""

import shutil
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

from blocksim.errors import InvalidInputError, OutputError, StoppedEarlyError
from blocksim.scenario import Document, Scenario, Source, document_of
from blocksim.scenario.motion import settles
from blocksim.silence import silent
from blocksim.simulation.observables import PEAK, Manner
from blocksim.simulation.provenance import run_hash
from blocksim.simulation.schemes import build
from blocksim.study import criterion
from blocksim.study.criterion import Verdict, falls_before_zero
from blocksim.study.executors import Execution
from blocksim.study.executors.ensemble import INTERRUPTED, run_case
from blocksim.study.limit_answer import Bracket, CurveAnswer, HalfStep, LimitAnswer, Side, place_of
from blocksim.study.limit_margin import (
    RATIO,
    STIFFNESS,
    Level,
    Levels,
    StandingSide,
    can_be_stiffer,
    ratio_of,
    refuse_without_springs,
)
from blocksim.study.limit_plan import (
    SCANNED,
    TOLERANCE,
    Change,
    CurvePlan,
    LimitPlan,
    Number,
    changes_in,
    next_near,
    next_values,
    read_curve,
    read_limit,
)
from blocksim.study.plan import Values
from blocksim.study.rows import FINISHED, Head, Row
from blocksim.study.runs import Replay, Runs, folder_for, runs_of
from blocksim.study.study import Study
from blocksim.study.sweep_folder import CASES, prepare

SHIFT = 2.5e-3  # share of a limit by which springs may shift it unasked: half of what is warned of, as it is foretold
MOST_LEVELS = 4  # stiffnesses
MOST_PICTURED = 3  # brackets whose sides are kept
SHARPER = 0.8  # of the tolerance: what is extrapolated from two brackets is wider than the narrower one
HALF = 0.5
STEP = "time.step"
NO_STIFFER = "with springs {ratio:g} times as stiff there is no such limit in the range"
NO_FINER = "with half the time step there is no such limit in the range"
STILL_FAR = "limits of the last two stiffnesses are too far apart to be extrapolated well; give stiffer springs"
BOTH = {Verdict.STANDS, Verdict.FALLS}
OnRun = Callable[[Number, Verdict, Row], None]
OnOther = Callable[[LimitPlan], None]
OnLimit = Callable[[float, LimitAnswer], None]
Rows = Mapping[Number, Row]


def limit(  # noqa: PLR0913 - one argument for each option of the command
    scenario: Source,
    vary: Mapping[str, Values],
    *,
    stands: str = criterion.DEFAULT,
    tolerance: float = TOLERANCE,
    scan: int = SCANNED,
    executor: str | None = None,
    jobs: int | None = None,
    scheduler: str | None = None,
    out: Path | str | None = None,
    overwrite: bool = False,
    keep_runs: bool = True,
    stiffer: bool | None = None,
    on_run: OnRun = silent,
) -> LimitAnswer:
    """Find the values of a key at which a structure stops, or begins, to stand.

    `vary` has one key and its range, {"ground.tilt": {"from": "20 deg", "to": "40 deg"}}, with the number of values
    that are scanned as `count` (default: `scan`); there may be several changes, but those of an island between two of
    them are not seen. `stands` says what counts as standing (see `blocksim.study.criterion`), `tolerance` how narrow a
    bracket gets relative to its ends, without what rest speed and stiffness cannot decide. Runs are kept in `out`
    (default: results/NAME/limit-HASH), with `keep_runs` those of both sides of a bracket with frames and contacts, for
    `plot` and `report`; the same call again does only what is missing. `stiffer` says whether limits of springs are
    searched again with springs ten times as stiff, and extrapolated to stiff contacts: True always, False never
    (`limits` are then those of the springs, and of the time step, as given), None where springs shift them by more than
    0.25 %. Under sustained loads runs begin at rest, unless the scenario has `start.settle = false`. `executor`,
    `jobs` and `scheduler` are those of `sweep`, and do not change the answer. Raises ScenarioError, InvalidInputError,
    OutputExistsError where the folder is not free, UnavailableError, StoppedEarlyError on Ctrl-C.
    """
    plan = read_limit(document_of(scenario), vary, stands=stands, tolerance=tolerance, scan=scan)
    execution = Execution(executor=executor, jobs=jobs, scheduler=scheduler)
    return find_limit(
        plan, execution, out=out, overwrite=overwrite, keep_runs=keep_runs, stiffer=stiffer, on_run=on_run
    )


def limit_curve(  # noqa: PLR0913 - one argument for each option of the command
    scenario: Source,
    vary: Mapping[str, Values],
    over: Mapping[str, Values],
    *,
    stands: str = criterion.DEFAULT,
    tolerance: float = TOLERANCE,
    scan: int = SCANNED,
    executor: str | None = None,
    jobs: int | None = None,
    scheduler: str | None = None,
    out: Path | str | None = None,
    overwrite: bool = False,
    stiffer: bool | None = None,
) -> CurveAnswer:
    """Find the limits of a key at each value of another one: `limit` with `over`, {"friction.block_block": [0.3, 0.5]}.

    Searches are kept in `out` (default: results/NAME/limits-HASH). Raises as `limit`.
    """
    plan = read_curve(document_of(scenario), vary, over, stands=stands, tolerance=tolerance, scan=scan)
    return find_curve(
        plan,
        Execution(executor=executor, jobs=jobs, scheduler=scheduler),
        out=out,
        overwrite=overwrite,
        stiffer=stiffer,
    )


def find_limit(
    plan: LimitPlan,
    execution: Execution,
    *,
    out: Path | str | None = None,
    overwrite: bool = False,
    keep_runs: bool = True,
    stiffer: bool | None = None,
    on_run: OnRun = silent,
    on_other: OnOther = silent,
) -> LimitAnswer:
    """Search as planned; see `limit`. `on_other` is called before the first run of another stiffness or step."""
    if stiffer:
        refuse_without_springs(plan)
    base = plan.scenario_at(plan.span.low)
    folder = folder_for(out, base, LimitAnswer.files, plan.name)
    kind = LimitAnswer.files
    with runs_of(plan.document, base, folder, kind, plan.name, execution, overwrite=overwrite, peaks=True) as runs:
        answer = _Search(plan, runs, stiffer, on_run, on_other).answer(folder)
        answer.write()  # first: the runs beside it may not fit on the disk
        if keep_runs:
            answer = with_sides(answer)
            answer.write()
    return answer


def find_curve(
    plan: CurvePlan,
    execution: Execution,
    *,
    out: Path | str | None = None,
    overwrite: bool = False,
    stiffer: bool | None = None,
    on_limit: OnLimit = silent,
) -> CurveAnswer:
    """Search as planned, one value after the other, each in a folder of its own; see `limit_curve`."""
    execution.ready()
    if stiffer:
        refuse_without_springs(*plan.searches.values())
    base = plan.one.scenario_at(plan.one.span.low)
    folder = folder_for(out, base, CurveAnswer.files, plan.name)
    prepare(folder, base, plan.name, overwrite=overwrite, kind=CurveAnswer.files)
    found: dict[float, LimitAnswer] = {}
    for number, search in plan.searches.items():
        place = folder / place_of(number, plan.head.unit)
        found[number] = find_limit(search, execution, out=place, overwrite=overwrite, keep_runs=False, stiffer=stiffer)
        on_limit(number, found[number])
    answer = CurveAnswer.of(plan.head, folder, found)
    answer.write()
    return answer


@dataclass
class _Search:
    """The runs of a search, as planned and with other stiffnesses or steps."""

    plan: LimitPlan
    runs: Runs
    stiffer: bool | None
    on_run: OnRun
    on_other: OnOther
    stiff_rows: dict[float, dict[Number, Row]] = field(default_factory=dict)  # by stiffness scale
    step_rows: dict[float, dict[Number, Row]] = field(default_factory=dict)  # by time step (s)

    def answer(self, folder: Path) -> LimitAnswer:
        """Return the answer, after all runs that it takes."""
        plan = self.plan

        def choose(rows: Rows) -> list[Number]:
            peaks = {at: float(str(row[PEAK])) for at, row in rows.items() if plan.has_islands and PEAK in row}
            return next_values(plan.span, plan.verdicts(rows), plan.tolerance, peaks)

        rows = self._searched(plan, choose)
        verdicts = plan.verdicts(rows)
        brackets = [self._bracket(change, rows) for change in changes_in(verdicts)]
        others, is_as_given = (self.stiff_rows, self.step_rows), self.stiffer is False
        return LimitAnswer.of(plan, folder, rows, brackets, *others, run=self.runs.new, is_as_given=is_as_given)

    def _bracket(self, change: Change[Verdict], rows: Rows) -> Bracket:
        """Return a change as it is with stiff contacts and short steps, as far as known, and as wide as is unknown."""
        below, above = (Side.of(value, verdict, rows[value]) for value, verdict in
                        ((change.low, change.below), (change.high, change.above)))  # fmt: skip
        given = Bracket(low=change.low, high=change.high, below=below, above=above)
        if not BOTH | {Verdict.UNDECIDED} >= {change.below, change.above} > {Verdict.FALLS}:
            return given
        side = StandingSide(self.plan, change, rows[StandingSide.value_of(change)])
        least, levels, half = max(SHIFT, self.plan.tolerance), None, None
        if self.stiffer is not False and can_be_stiffer(self.plan):
            levels = self._levels(side, least) if self.stiffer or side.most_shift > least else None
        elif self.stiffer is not False and not self.plan.has_springs and not self.plan.key.startswith("time."):
            half = self._half(change)
        margin = side.margin(levels, least, as_given=self.stiffer is False)
        give = side.give if {change.below, change.above} == BOTH else None
        return given.corrected(levels, half, margin, give)

    def _searched(self, plan: LimitPlan, choose: Callable[[Rows], list[Number]]) -> dict[Number, Row]:
        """Go from round to round and return what it needed; rows of an earlier search are taken as they are."""
        rows: dict[Number, Row] = {}
        while values := choose(rows):
            wanted = {value: plan.settings(value) for value in values}
            rows |= self.runs.rows(wanted, lambda at, row: self.on_run(at, plan.criterion.verdict(row), row))
        return rows

    def _only_change(self, rows: Rows) -> Change[Verdict] | None:
        """Return the limit of rows that have one."""
        changes = changes_in(_fallen(self.plan.verdicts(rows)))
        return changes[0] if len(changes) == 1 and {changes[0].below, changes[0].above} == BOTH else None

    def _half(self, change: Change[Verdict]) -> HalfStep:
        """Search a limit with half the time step."""
        near = _fallen_change(change)
        steps = (
            build(self.plan.scenario_at(value)).scene.world.controls[0].step for value in (change.low, change.high)
        )
        step = HALF * float(min(steps))
        plan = replace(self.plan, apart={STEP: step})
        if step not in self.step_rows:
            self.on_other(plan)
        rows = self._searched(
            plan, lambda rows: next_near(plan.span, _fallen(plan.verdicts(rows)), near, plan.tolerance)
        )
        self.step_rows.setdefault(step, {}).update(rows)
        found = self._only_change(rows)
        ends = (change.low, change.high) if found is None else (found.low, found.high)
        return HalfStep(step=step, low=ends[0], high=ends[1], problem=NO_FINER if found is None else "")

    def _levels(self, side: StandingSide, least: float) -> Levels:
        """Search one limit at one stiffness after the other, until two are near enough to be extrapolated."""
        change, scenario = side.change, self.plan.scenario_at(side.change.low)
        scale = scenario.contact.stiffness_scale
        given = Level(stiffness_scale=scale, low=change.low, high=change.high)
        levels = Levels((given,), ratio_of(scenario), is_at_rest=settles(scenario))
        share = side.give.share if side.give is not None else 0.0
        while levels.is_far and len(levels.levels) < MOST_LEVELS:
            scale *= RATIO
            is_foretold = len(levels.levels) > 1 or share > least
            if is_foretold:
                low, high = levels.aim(-share if change.below is Verdict.FALLS else share, self.plan.tolerance)
            else:
                beyond = least * max(abs(change.low), abs(change.high))
                low, high = change.low - beyond, change.high + beyond
            near = replace(_fallen_change(change), low=self.plan.span.fitted(low), high=self.plan.span.fitted(high))
            found = self._only_change(self._stiffer(side, scale, near, may_stay=not is_foretold))
            if found is None:
                return replace(levels, problem=NO_STIFFER.format(ratio=scale / given.stiffness_scale))
            if not (is_foretold or self.stiffer) and (found.low, found.high) == (near.low, near.high):
                return levels
            level = Level(stiffness_scale=scale, low=found.low, high=found.high)
            levels = replace(levels, levels=(*levels.levels, level))
        return replace(levels, problem=STILL_FAR) if levels.is_far else levels

    def _stiffer(self, side: StandingSide, scale: float, near: Change[Verdict], *, may_stay: bool) -> dict[Number, Row]:
        """Search near a bracket with other springs; a step given by hand is shorter in proportion."""
        scenario = self.plan.scenario_at(side.change.low)
        apart: dict[str, object] = {STIFFNESS: scale}
        if scenario.time.step != "auto":
            apart[STEP] = scenario.time.step * (scenario.contact.stiffness_scale / scale) ** 0.5
        plan = replace(self.plan, tolerance=SHARPER * self.plan.tolerance, apart=apart)
        if scale not in self.stiff_rows:
            self.on_other(plan)

        def choose(rows: Rows) -> list[Number]:
            known = _fallen(plan.verdicts(rows))
            if may_stay and not self.stiffer and changes_in(known) == [near]:
                return []
            return next_near(plan.span, known, near, plan.tolerance)

        rows = self._searched(plan, choose)
        self.stiff_rows.setdefault(scale, {}).update(rows)
        return rows


def _fallen(verdicts: Mapping[Number, Verdict]) -> dict[Number, Verdict]:
    """Return what runs came to, those that move on at the end without having fallen among those that stand."""
    return {value: Verdict.STANDS if verdict is Verdict.UNDECIDED else verdict for value, verdict in verdicts.items()}


def _fallen_change(change: Change[Verdict]) -> Change[Verdict]:
    below, above = _fallen({0: change.below, 1: change.above}).values()
    return replace(change, below=below, above=above)


def with_sides(answer: LimitAnswer) -> LimitAnswer:
    """Run both sides of the first brackets once more, into folders of their own, unless they are there.

    Returns the answer with the names of these folders; what pictures of mechanisms show lies there. The motion is that
    of the search, so a run that ends otherwise could not be written; what does not come to rest before time zero is
    released then, so that there is a run that shows how it falls. Raises OutputError, and StoppedEarlyError on Ctrl-C.
    """
    plan = answer.plan
    assert plan is not None  # noqa: S101 - it was just searched
    sides: dict[float, Side] = {}
    for side in [one for bracket in answer.falls[:MOST_PICTURED] for one in (bracket.below, bracket.above)]:
        falls = falls_before_zero(side.model_dump())
        if side.value in sides or not (falls or side.status == FINISHED):
            continue
        scenario = _recorded(plan.scenario_at(side.value), is_released=falls)
        name = run_hash(scenario)
        row = run_case(scenario, answer.folder / CASES / name)
        if row["status"] == INTERRUPTED:
            raise StoppedEarlyError("stopped while the runs beside a limit were kept; rerun the command to finish")
        if row["status"] != FINISHED and not (falls and "outcome" in row):
            message = f"{row['reason']}; the limit is found, its runs are not kept: rerun the command, or --no-runs"
            raise OutputError(message)
        if row["status"] == FINISHED:
            seen = row if falls and row["outcome"] != Manner.STANDS.value else None
            sides[side.value] = side.kept(name, seen)
    return answer.with_sides(sides)


def _recorded(scenario: Scenario, *, is_released: bool) -> Scenario:
    output = scenario.output.model_copy(update={"contacts": True})
    start = scenario.start.model_copy(update={"release": "always" if is_released else "at rest"})
    time = scenario.time.model_copy(update={"stop_at_rest": False} if is_released else {})  # slow as it may begin
    return scenario.model_copy(update={"output": output, "start": start, "time": time})


def repeat_limit(answer: LimitAnswer, execution: Replay, out: Path) -> LimitAnswer:
    """Search again, with stiffer springs or not as in the first way that leads to the answer, or to any."""
    ends: dict[str, object] = {"from": answer.low, "to": answer.high}
    if answer.is_whole:
        ends = {"from": int(answer.low), "to": int(answer.high)}
    elif answer.unit:
        ends = {name: f"{value:.12g} {answer.unit}" for name, value in ends.items()}
    span = {**ends, "count": answer.count, **({"scale": "log"} if answer.is_log else {})}
    document = Document.read(answer.folder / answer.files.plan, is_stored=True)
    plan = read_limit(document, {answer.key: span}, stands=answer.stands, tolerance=answer.tolerance)
    tried: list[LimitAnswer] = []
    for stiffer in (None, True, False):  # what was asked for is not kept
        with suppress(InvalidInputError):
            place = out / f"limit-{stiffer}"
            again = find_limit(plan, execution.anew(), out=place, keep_runs=False, stiffer=stiffer)
            if (answer.folder / CASES).is_dir():  # what these runs show; they are not run again
                shutil.copytree(answer.folder / CASES, place / CASES)
                again = with_sides(again)
                again.write()
            tried.append(again)
            if again.comparable() == answer.comparable():
                return again
    if not tried:
        message = f"{answer.folder}: the manifest lacks runs of this search"
        raise InvalidInputError(message)
    return tried[0]


def repeat_curve(answer: CurveAnswer, _: Replay, out: Path) -> CurveAnswer:
    """Repeat all searches of a curve, and put their answers together."""
    searches = {
        over: repeat_limit(LimitAnswer.read(place), Replay.of(place), out / f"{number}")
        for number, (over, place) in enumerate(answer.places().items())
    }
    again = CurveAnswer.of(Head(answer.over, answer.over_unit), out, searches)
    again.write()
    return again


LIMIT = Study(LimitAnswer, repeat_limit)
CURVE = Study(CurveAnswer, repeat_curve, parts=lambda answer: list(answer.places().values()))

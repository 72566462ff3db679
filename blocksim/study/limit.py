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
from blocksim.options import takes
from blocksim.scenario import Document, Source, document_of, motion
from blocksim.silence import silent
from blocksim.simulation.observables import PEAK, Response, table_columns
from blocksim.simulation.provenance import run_hash
from blocksim.simulation.schemes import build
from blocksim.study import limit_answer, limit_margin, limit_plan, sweep_folder
from blocksim.study.answer import Study
from blocksim.study.criterion import Verdict, falls_before_zero
from blocksim.study.executors import Execution, ensemble
from blocksim.study.limit_plan import Change, LimitPlan, Number
from blocksim.study.rows import FINISHED, Head, Row
from blocksim.study.runs import Replay, Runs, make_folder, runs_of, short_hash

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
OnOther = Callable[[LimitPlan], None]
OnLimit = Callable[[float, limit_answer.LimitAnswer], None]
Rows = Mapping[Number, Row]


@takes(limit_plan.LimitOptions)
def limit(scenario: Source, options: limit_plan.LimitOptions) -> limit_answer.LimitAnswer:
    """Find the values of a key at which a structure stops, or begins, to stand.

    There may be several changes, but those of an island between two scanned values are not seen. `stands`: see
    `blocksim.study.criterion`. Runs are kept, with `keep_runs` those of both sides of a bracket with frames and
    contacts, for `plot` and `report`; the same call again does only what is missing. Under sustained loads runs begin
    at rest, unless the scenario has `start.settle = false`. The executor does not change the answer. `on_run` is called
    with each value, verdict and row. Raises ScenarioError, InvalidInputError, OutputExistsError where the folder is not
    free, UnavailableError, StoppedEarlyError on Ctrl-C.
    """
    return find_limit(limit_plan.read_limit(document_of(scenario), options), options)


@takes(limit_plan.CurveOptions)
def limit_curve(scenario: Source, options: limit_plan.CurveOptions) -> limit_answer.CurveAnswer:
    """Find the limits of a key at each value of another one: `limit` with `over`, {"friction.block_block": [0.3, 0.5]}.

    Searches are kept in `out` (default: results/NAME/limits-HASH). Raises as `limit`.
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
        limit_margin.refuse_without_springs(plan)
    base, kind, execution = plan.scenario_at(plan.span.low), limit_answer.LimitAnswer.files, execution or options
    overwrite = options.overwrite
    with runs_of(plan.document, base, options.out, kind, plan.name, execution, overwrite=overwrite, peaks=True) as runs:
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
        limit_margin.refuse_without_springs(*plan.searches.values())
    one = next(iter(plan.searches.values()))
    base, kind = one.scenario_at(one.span.low), limit_answer.CurveAnswer.files
    name = short_hash([plan.head.key, *(search.name for search in plan.searches.values())])
    folder = make_folder(options.out, base, kind, name, overwrite=options.overwrite)
    found: dict[float, limit_answer.LimitAnswer] = {}
    for number, search in plan.searches.items():
        place = folder / limit_answer.place_of(number, plan.head.unit)
        found[number] = find_limit(
            search, limit_plan.LimitOptions(**{**options.shared, "out": place, "keep_runs": False})
        )
        on_limit(number, found[number])
    answer = limit_answer.CurveAnswer.of(plan.head, folder, found)
    answer.write()
    return answer


@dataclass
class _Search:
    """The runs of a search, as planned and with other stiffnesses or steps."""

    plan: LimitPlan
    runs: Runs
    stiffer: bool | None
    on_run: limit_plan.OnRun
    on_other: OnOther
    stiff_rows: dict[float, dict[Number, Row]] = field(default_factory=dict)  # by stiffness scale
    step_rows: dict[float, dict[Number, Row]] = field(default_factory=dict)  # by time step (s)

    def answer(self) -> limit_answer.LimitAnswer:
        """Return the answer, after all runs that it takes."""
        plan, folder = self.plan, self.runs.manifest.path.parent
        has_islands = plan.scenario.motion is not None  # a value may fall between others that stand: supports move

        def choose(rows: Rows) -> list[Number]:
            peaks = {at: float(str(row[PEAK])) for at, row in rows.items() if has_islands and PEAK in row}
            return limit_plan.next_values(plan.span, plan.verdicts(rows), plan.tolerance, peaks)

        rows = self._searched(plan, choose)
        brackets = [self._bracket(change, rows) for change in limit_plan.changes_in(plan.verdicts(rows))]
        others, is_as_given = (self.stiff_rows, self.step_rows), self.stiffer is False
        return limit_answer.LimitAnswer.of(
            plan, folder, rows, brackets, *others, run=self.runs.new, is_as_given=is_as_given
        )

    def _searched(self, plan: LimitPlan, choose: Callable[[Rows], list[Number]]) -> dict[Number, Row]:
        """Go from round to round and return what it needed; rows of an earlier search are taken as they are."""
        rows: dict[Number, Row] = {}
        while values := choose(rows):
            wanted = {value: plan.settings(value) for value in values}
            rows |= self.runs.rows(wanted, lambda at, row: self.on_run(at, plan.criterion.verdict(row), row))
        return rows

    def _bracket(self, change: Change[Verdict], rows: Rows) -> limit_answer.Bracket:
        """Return a change as it is with stiff contacts and short steps, as far as known, and as wide as is unknown."""
        plan, is_corrected = self.plan, self.stiffer is not False
        below, above = (limit_answer.Side.of(value, verdict, rows[value]) for value, verdict in
                        ((change.low, change.below), (change.high, change.above)))  # fmt: skip
        given = limit_answer.Bracket(low=change.low, high=change.high, below=below, above=above)
        if not BOTH | {Verdict.UNDECIDED} >= {change.below, change.above} > {Verdict.FALLS}:
            return given
        side = limit_margin.StandingSide(plan, change, rows)
        least, levels, half = max(SHIFT, plan.tolerance), None, None
        if is_corrected and limit_margin.can_be_stiffer(plan):
            levels = self._levels(side, least) if self.stiffer or side.most_shift > least else None
        elif is_corrected and not plan.scenario.time.has_springs and not plan.key.startswith("time."):
            half = self._half(change)
        margin = side.margin(levels, least, as_given=not is_corrected)
        give = side.give if {change.below, change.above} == BOTH else None
        return given.corrected(levels, half, margin, give)

    def _again(
        self,
        plan: LimitPlan,
        near: Change[Verdict],
        known: dict[float, dict[Number, Row]],
        place: float,
        *,
        may_stay: bool = False,
    ) -> Change[Verdict] | None:
        """Search the limit once more near a bracket with other settings, and return it if there is one.

        Its rows are kept as `known[place]`. With `may_stay` nothing more is run where both ends came to the same again.
        """
        below, above = _fallen({0: near.below, 1: near.above}).values()
        near = replace(near, below=below, above=above)
        if place not in known:
            self.on_other(plan)

        def choose(rows: Rows) -> list[Number]:
            verdicts = _fallen(plan.verdicts(rows))
            is_same = may_stay and limit_plan.changes_in(verdicts) == [near]
            return [] if is_same else limit_plan.next_near(plan.span, verdicts, near, plan.tolerance)

        rows = self._searched(plan, choose)
        known.setdefault(place, {}).update(rows)
        changes = limit_plan.changes_in(_fallen(self.plan.verdicts(rows)))
        return changes[0] if len(changes) == 1 and {changes[0].below, changes[0].above} == BOTH else None

    def _half(self, change: Change[Verdict]) -> limit_answer.HalfStep:
        """Search a limit with half the time step."""
        ends = (change.low, change.high)
        steps = (build(self.plan.scenario_at(value)).scene.world.controls[0].step for value in ends)
        step = HALF * float(min(steps))
        found = self._again(replace(self.plan, apart={STEP: step}), change, self.step_rows, step)
        if found is None:
            return limit_answer.HalfStep(step=step, low=change.low, high=change.high, problem=NO_FINER)
        return limit_answer.HalfStep(step=step, low=found.low, high=found.high)

    def _levels(self, side: limit_margin.StandingSide, least: float) -> limit_margin.Levels:
        """Search one limit at one stiffness after the other, until two are near enough to be extrapolated.

        A step given by hand is shorter with stiffer springs, in proportion.
        """
        change, scenario = side.change, self.plan.scenario_at(side.change.low)
        first = scale = scenario.contact.stiffness_scale
        given = limit_margin.Level(stiffness_scale=scale, low=change.low, high=change.high)
        levels = limit_margin.Levels((given,), limit_margin.ratio_of(scenario), is_at_rest=motion.settles(scenario))
        share = side.give.share if side.give is not None else 0.0
        while levels.is_far and len(levels.levels) < MOST_LEVELS:
            scale *= limit_margin.RATIO
            is_foretold = len(levels.levels) > 1 or share > least
            if is_foretold:
                low, high = levels.aim(-share if change.below is Verdict.FALLS else share, self.plan.tolerance)
            else:
                beyond = least * max(abs(change.low), abs(change.high))
                low, high = change.low - beyond, change.high + beyond
            near = replace(change, low=self.plan.span.fitted(low), high=self.plan.span.fitted(high))
            apart: dict[str, object] = {limit_margin.STIFFNESS: scale}
            if scenario.time.step != "auto":
                apart[STEP] = scenario.time.step * (first / scale) ** 0.5
            plan = replace(self.plan, tolerance=SHARPER * self.plan.tolerance, apart=apart)
            may_stay = not (is_foretold or self.stiffer)
            found = self._again(plan, near, self.stiff_rows, scale, may_stay=may_stay)
            if found is None:
                return replace(levels, problem=NO_STIFFER.format(ratio=scale / first))
            if may_stay and (found.low, found.high) == (near.low, near.high):
                return levels
            level = limit_margin.Level(stiffness_scale=scale, low=found.low, high=found.high)
            levels = replace(levels, levels=(*levels.levels, level))
        return replace(levels, problem=STILL_FAR) if levels.is_far else levels


def _fallen(verdicts: Mapping[Number, Verdict]) -> dict[Number, Verdict]:
    """Return what runs came to, those that move on at the end without having fallen among those that stand."""
    return {value: Verdict.STANDS if verdict is Verdict.UNDECIDED else verdict for value, verdict in verdicts.items()}


def with_sides(answer: limit_answer.LimitAnswer) -> limit_answer.LimitAnswer:
    """Run both sides of the first brackets once more, into folders of their own, unless they are there.

    Returns the answer with the names of these folders; what pictures of mechanisms show lies there. The motion is that
    of the search, so a run that ends otherwise could not be written; what does not come to rest before time zero is
    released then, so that there is a run that shows how it falls. Raises OutputError, and StoppedEarlyError on Ctrl-C.
    """
    plan = answer.plan
    assert plan is not None  # noqa: S101 - it was just searched
    sides: dict[float, limit_answer.Side] = {}
    for side in [one for bracket in answer.falls[:MOST_PICTURED] for one in bracket.sides.values()]:
        falls = falls_before_zero(side.model_dump())
        if side.value in sides or not (falls or side.status == FINISHED):
            continue
        scenario = plan.scenario_at(side.value)
        release = {"release": "always" if falls else "at rest"}
        changed = {"output": {"contacts": True}, "start": release, "time": {"stop_at_rest": False} if falls else {}}
        tables = {name: getattr(scenario, name).model_copy(update=update) for name, update in changed.items()}
        scenario = scenario.model_copy(update=tables)  # not stopped where it is slow: so it may begin
        name = run_hash(scenario)
        row = ensemble.run_case(scenario, answer.folder / sweep_folder.CASES / name)
        if row["status"] == ensemble.INTERRUPTED:
            raise StoppedEarlyError("stopped while the runs beside a limit were kept; rerun the command to finish")
        if row["status"] != FINISHED and not (falls and "outcome" in row):
            message = f"{row['reason']}; the limit is found, its runs are not kept: rerun the command, or --no-runs"
            raise OutputError(message)
        if row["status"] == FINISHED:
            is_seen = falls and row["outcome"] != Response.STANDS.value  # of one that was released to be seen to fall
            update = {name: row.get(name) for name in (*table_columns(), PEAK)} if is_seen else {}
            sides[side.value] = side.model_copy(update={**update, "case": name})
    brackets = [
        one.model_copy(update={name: sides.get(side.value, side) for name, side in one.sides.items()})
        for one in answer.brackets
    ]
    return answer.model_copy(update={"brackets": tuple(brackets)})


def repeat_limit(answer: limit_answer.LimitAnswer, execution: Replay, out: Path) -> limit_answer.LimitAnswer:
    """Search again, with stiffer springs or not as in the first way that leads to the answer, or to any."""
    ends: dict[str, object] = {"from": answer.low, "to": answer.high}
    if answer.is_whole:
        ends = {"from": int(answer.low), "to": int(answer.high)}
    elif answer.unit:
        ends = {name: f"{value:.12g} {answer.unit}" for name, value in ends.items()}
    span = {**ends, "count": answer.count, **({"scale": "log"} if answer.is_log else {})}
    document = Document.read(answer.folder / answer.files.plan, is_stored=True)
    options = limit_plan.LimitOptions(
        {answer.key: span}, stands=answer.stands, tolerance=answer.tolerance, keep_runs=False
    )
    plan = limit_plan.read_limit(document, options)
    tried: list[limit_answer.LimitAnswer] = []
    for stiffer in (None, True, False):  # what was asked for is not kept
        with suppress(InvalidInputError):
            place = out / f"limit-{stiffer}"
            again = find_limit(plan, replace(options, out=place, stiffer=stiffer), execution.anew())
            if (answer.folder / sweep_folder.CASES).is_dir():  # what these runs show; they are not run again
                shutil.copytree(answer.folder / sweep_folder.CASES, place / sweep_folder.CASES)
                again = with_sides(again)
                again.write()
            tried.append(again)
            if again.comparable() == answer.comparable():
                return again
    if not tried:
        raise InvalidInputError(f"{answer.folder}: the manifest lacks runs of this search")
    return tried[0]


def repeat_curve(answer: limit_answer.CurveAnswer, _: Replay, out: Path) -> limit_answer.CurveAnswer:
    """Repeat all searches of a curve, and put their answers together."""
    searches = {
        over: repeat_limit(limit_answer.LimitAnswer.read(place), Replay.of(place), out / f"{number}")
        for number, (over, place) in enumerate(answer.places().items())
    }
    again = limit_answer.CurveAnswer.of(Head(answer.over, answer.over_unit), out, searches)
    again.write()
    return again


LIMIT = Study(limit_answer.LimitAnswer, repeat_limit)
CURVE = Study(limit_answer.CurveAnswer, repeat_curve, parts=lambda answer: list(answer.places().values()))

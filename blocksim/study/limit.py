"""At which value of a key a structure falls: scan and narrowing, on the executors of a sweep, kept run by run.

Every run that has ended is in manifest.jsonl, so that a search that was stopped, or killed, does no run twice when it
is called again; it comes to the same answer.

Where springs shift a limit by more than SHIFT, the same limit is searched with springs ten times as stiff, near where
it is foretold, and the answer is that of stiff contacts (limit_stiff.py). Where they may shift it, but nothing says by
how much, two runs with stiffer springs tell, one beyond either side of the bracket. Limits of rigid contacts are
verified with half the time step (limit_step.py).
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import closing
from dataclasses import replace
from pathlib import Path

from blocksim.errors import BlocksimError, StoppedEarlyError
from blocksim.scenario import Source, document_of
from blocksim.scenario.motion import settles
from blocksim.silence import silent
from blocksim.simulation import folder as files
from blocksim.simulation.compilation import compile_kernels, kernels_of
from blocksim.simulation.movement import PEAK
from blocksim.simulation.provenance import run_hash
from blocksim.simulation.stopping import stop_requests
from blocksim.study import criterion
from blocksim.study.criterion import Verdict
from blocksim.study.executors import Execution, Run, Setting, Task
from blocksim.study.limit_give import give_at, most_shift
from blocksim.study.limit_margin import with_margins
from blocksim.study.limit_plan import SCANNED, TOLERANCE, LimitPlan, read_limit
from blocksim.study.limit_result import BOTH, LimitResult, fallen, write_result
from blocksim.study.limit_search import Change, Number, changes_in, next_near, next_values
from blocksim.study.limit_sides import keep_sides
from blocksim.study.limit_step import Choose, Halving
from blocksim.study.limit_stiff import (
    MOST,
    RATIO,
    Level,
    Levels,
    can_be_stiffer,
    ratio_of,
    refuse_without_springs,
    stiffer_plan,
)
from blocksim.study.plan import Values
from blocksim.study.progress import MANIFEST, Entry, Manifest, read_entries, values_hash
from blocksim.study.rows import Row, check_experiment, invalid_row
from blocksim.study.sweep_folder import LIMIT, prepare

AGAIN = "rerun the command to finish"
SHIFT = 2.5e-3  # share of a limit by which springs may shift it unasked: half of what is warned of, as it is foretold
NOT_FOUND = "with springs {ratio:g} times as stiff there is no such limit in the range"
STILL_FAR = "limits of the last two stiffnesses are too far apart to be extrapolated well; give stiffer springs"
OnRun = Callable[[Number, Verdict, Row], None]
OnStiffer = Callable[[LimitPlan], None]


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
) -> LimitResult:
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
    return find_limit(
        plan,
        Execution(executor=executor, jobs=jobs, scheduler=scheduler),
        out=out,
        overwrite=overwrite,
        keep_runs=keep_runs,
        stiffer=stiffer,
        on_run=on_run,
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
    on_stiffer: OnStiffer = lambda _: None,
) -> LimitResult:
    """Search as planned; see `limit`. `on_stiffer` is called before the first run of every other stiffness."""
    if stiffer:
        refuse_without_springs(plan)
    _, setting = execution.ready()
    base = plan.scenario_at(plan.span.low)
    check_experiment(base)
    folder = Path(out) if out is not None else files.RESULTS / base.name / f"limit-{plan.name}"
    prepare(folder, base, plan.name, overwrite=overwrite, kind=LIMIT)
    compile_kernels(kernels_of(base))
    with closing(Manifest(folder / MANIFEST, "limit")) as manifest, execution.for_rounds() as run:
        runs = _Runs(manifest, run, on_run)
        try:
            with stop_requests() as is_stopped:
                runs.setting = replace(setting, is_stopped=is_stopped, peaks=True)
                rows = runs.searched(
                    plan, lambda known: next_values(plan.span, known, plan.tolerance, runs.peaks(plan, known))
                )
                found = LimitResult(plan, folder, rows, runs.ran)
                if stiffer is not False:
                    if can_be_stiffer(plan):
                        found = _Stiffening(found, runs, on_stiffer, is_asked=bool(stiffer)).complete()
                    found = Halving(found, runs.searched, on_stiffer).complete()
                found = with_margins(found, max(SHIFT, plan.tolerance), as_given=stiffer is False)
        except KeyboardInterrupt:
            raise _stopped(len(runs.known)) from None
        result = replace(found, run=runs.ran)
        write_result(result)  # first: the runs beside it may not fit on the disk
        if keep_runs:
            result = with_sides(result)
            write_result(result)
    return result


def with_sides(found: LimitResult) -> LimitResult:
    """Return a result with the runs beside its limits, kept in its folder. Raises as `keep_sides`."""
    kept = keep_sides(found.folder, found.plan, found.falls_as_given, found.rows)
    released = {value: one.row for value, one in kept.items() if one.is_fall}
    return replace(found, kept={value: one.case for value, one in kept.items()}, released=released)


def _stopped(runs: int) -> StoppedEarlyError:
    return StoppedEarlyError(f"stopped after {runs} runs; {AGAIN}")


class _Runs:
    """All rows that are known of a folder, by the hash of their values, and what makes others."""

    setting: Setting

    def __init__(self, manifest: Manifest, run: Run, on_run: OnRun) -> None:
        self.manifest, self.run, self.on_run = manifest, run, on_run
        entries = (entry for _, entry in read_entries(manifest.path))
        self.known = {entry.values: entry.row for entry in entries}
        self.ran = 0

    def searched(self, plan: LimitPlan, choose: Choose) -> dict[Number, Row]:
        """Go from round to round and return what it needed; rows of an earlier search are taken as they are.

        Raises StoppedEarlyError.
        """
        rows: dict[Number, Row] = {}
        while values := choose({value: plan.criterion.verdict(row) for value, row in rows.items()}):
            hashes = {value: values_hash(plan.settings(value)) for value in values}
            missing = {name: value for value, name in hashes.items() if name not in self.known}
            with closing(self.run(self._tasks(plan, missing.values()), self.setting)) as batches:
                for batch in batches:
                    for task, row in zip(batch.tasks, batch.rows, strict=True):
                        self._keep(plan, missing[values_hash(task.settings)], task.name, row)
            if not missing.keys() <= self.known.keys():
                raise _stopped(len(self.known))
            rows |= {value: self.known[name] for value, name in hashes.items()}
        return rows

    def peaks(self, plan: LimitPlan, values: Iterable[Number]) -> dict[Number, float]:
        """Return the largest rotation (degrees) at those values at which supports move and nothing has failed."""
        if not plan.has_islands:
            return {}
        rows = {value: self.known[values_hash(plan.settings(value))] for value in values}
        return {value: float(str(row[PEAK])) for value, row in rows.items() if PEAK in row}

    def _tasks(self, plan: LimitPlan, values: Iterable[Number]) -> Iterator[Task]:
        """Make the tasks of a round; a value that does not go with the others has its row at once."""
        for number, value in enumerate(values, start=len(self.known)):
            try:
                scenario = plan.scenario_at(value)
            except BlocksimError as error:
                self._keep(plan, value, "", invalid_row(str(error).splitlines()[0]))
                continue
            yield Task(number, run_hash(scenario), plan.settings(value), scenario)

    def _keep(self, plan: LimitPlan, value: Number, name: str, row: Row) -> None:
        """Bring a row to the disk, and then report it."""
        values = values_hash(plan.settings(value))
        self.manifest.append([Entry(len(self.known), name, values, row)])
        self.known[values] = row
        self.ran += 1
        self.on_run(value, plan.criterion.verdict(row), row)


class _Stiffening:
    """The limits of a search once more with stiffer springs, as far as these shift them."""

    def __init__(self, found: LimitResult, runs: _Runs, on_stiffer: OnStiffer, *, is_asked: bool) -> None:
        self.found, self.runs, self.on_stiffer, self.is_asked = found, runs, on_stiffer, is_asked
        self.plan = found.plan
        self.least = max(SHIFT, self.plan.tolerance)
        self.rows: dict[float, dict[Number, Row]] = {}

    def complete(self) -> LimitResult:
        """Return the result with limits of stiff contacts."""
        found = self.found
        levels = {one: self._levels(one) for one in found.falls_as_given if self._is_worth_it(one)}
        return replace(found, stiffer=self.rows, levels=levels)

    def _is_worth_it(self, change: Change[Verdict]) -> bool:
        return self.is_asked or most_shift(self.found, change) > self.least

    def _levels(self, change: Change[Verdict]) -> Levels:
        """Search one limit at one stiffness after the other, until two are near enough to be extrapolated."""
        scenario = self.plan.scenario_at(change.low)
        given = Level(scenario.contact.stiffness_scale, change.low, change.high)
        levels = Levels((given,), ratio_of(scenario), is_at_rest=settles(scenario))
        while levels.is_far and len(levels.found) < MOST:
            scale = RATIO * levels.found[-1].scale
            near, is_foretold = self._near(change, levels)
            rows = self._searched(change, scale, near, is_foretold=is_foretold)
            changes = changes_in(fallen({value: self.plan.criterion.verdict(row) for value, row in rows.items()}))
            (first, *others) = changes or [near]
            if others or not changes or {first.below, first.above} != BOTH:
                return replace(levels, problem=NOT_FOUND.format(ratio=scale / levels.found[0].scale))
            if not (is_foretold or self.is_asked) and (first.low, first.high) == (near.low, near.high):
                return levels
            levels = replace(levels, found=(*levels.found, Level(scale, first.low, first.high)))
        return replace(levels, problem=STILL_FAR) if levels.is_far else levels

    def _near(self, change: Change[Verdict], levels: Levels) -> tuple[Change[Verdict], bool]:
        """Return where to look for the limit of the next stiffness, and whether that was foretold."""
        give = give_at(self.found, change)
        share = 0.0 if give is None else give.share
        if len(levels.found) == 1 and share <= self.least:
            beyond = self.least * max(abs(change.low), abs(change.high))
            return self._between(change, change.low - beyond, change.high + beyond), False
        aim = levels.aim(-share if change.below is Verdict.FALLS else share, self.plan.tolerance)
        return self._between(change, *aim), True

    def _between(self, change: Change[Verdict], low: float, high: float) -> Change[Verdict]:
        span, sides = self.plan.span, fallen({0: change.below, 1: change.above})
        return Change(span.fitted(low), span.fitted(high), sides[0], sides[1])

    def _searched(
        self, change: Change[Verdict], scale: float, near: Change[Verdict], *, is_foretold: bool
    ) -> dict[Number, Row]:
        plan = stiffer_plan(self.plan, change, scale)
        if scale not in self.rows:
            self.on_stiffer(plan)

        def choose(known: Mapping[Number, Verdict]) -> list[Number]:
            is_as_it_was = changes_in(fallen(known)) == [near] and not (is_foretold or self.is_asked)
            return [] if is_as_it_was else next_near(plan.span, fallen(known), near, plan.tolerance)

        rows = self.runs.searched(plan, choose)
        self.rows.setdefault(scale, {}).update(rows)
        return rows

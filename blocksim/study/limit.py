"""At which value of a key a structure falls: scan and narrowing, on the executors of a sweep, kept run by run.

Every run that has ended is in manifest.jsonl, so that a search that was stopped, or killed, does no run twice when it
is called again; it comes to the same answer.
"""

import csv
import io
import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from blocksim.errors import BlocksimError, StoppedEarlyError
from blocksim.scenario import Source, document_of
from blocksim.simulation import folder as files
from blocksim.simulation.atomic import write_text
from blocksim.simulation.compilation import compile_kernels, kernels_of
from blocksim.simulation.provenance import run_hash
from blocksim.simulation.stopping import stop_requests
from blocksim.study import criterion
from blocksim.study.criterion import Verdict
from blocksim.study.executors import Execution, Run, Setting, Task
from blocksim.study.limit_plan import TOLERANCE, LimitPlan, read_limit
from blocksim.study.limit_search import Change, Number, changes_in, next_values
from blocksim.study.limit_sides import keep_sides
from blocksim.study.plan import Values
from blocksim.study.progress import MANIFEST, Entry, Manifest, read_entries, values_hash
from blocksim.study.rows import MOVEMENT, Row, as_cell, check_experiment, invalid_row
from blocksim.study.sweep_folder import LIMIT, prepare, read_origin

if TYPE_CHECKING:
    import pandas as pd

TABLE = "limit.csv"
VALUE, VERDICT = "value", "verdict"
COLUMNS = (VERDICT, *MOVEMENT, "status", "reason", "seconds")
AGAIN = "rerun the command to finish"
OnRun = Callable[[Number, Verdict, Row], None]


@dataclass(frozen=True)
class LimitResult:
    """All runs of a search by value, and where the answer changes."""

    plan: LimitPlan = field(repr=False)
    folder: Path
    rows: Mapping[Number, Row] = field(repr=False)
    run: int  # runs of this call; the others were known
    kept: Mapping[Number, str] = field(default_factory=dict, repr=False)  # folders in `cases`, with frames, by value

    @property
    def verdicts(self) -> dict[Number, Verdict]:
        """What each value came to, from the smallest up."""
        return {value: self.plan.criterion.verdict(self.rows[value]) for value in sorted(self.rows)}

    @property
    def changes(self) -> list[Change[Verdict]]:
        """Brackets between neighbours that differ, from the smallest value up; empty where nothing changes."""
        return changes_in(self.verdicts)

    @property
    def limits(self) -> list[Change[Verdict]]:
        """Those brackets between standing and falling."""
        both = {Verdict.STANDS, Verdict.FALLS}
        return [change for change in self.changes if {change.below, change.above} == both]

    @property
    def pictured(self) -> list[Change[Verdict]]:
        """The limits of which both sides are kept as runs: a side that does not settle has none."""
        return [one for one in self.limits if {one.low, one.high} <= self.kept.keys()]

    @property
    def table(self) -> "pd.DataFrame":
        """All runs as limit.csv has them."""
        import pandas as pd  # noqa: PLC0415 - a third of a second that a run does not pay

        return pd.DataFrame(list(_records(self)), columns=[_head(self.plan), *COLUMNS])

    def to_dict(self) -> dict[str, object]:
        """Return plain values for JSON."""
        plan = self.plan
        return {
            "key": plan.key,
            "unit": plan.unit,
            "from": plan.span.low,
            "to": plan.span.high,
            "stands": plan.criterion.text,
            "tolerance": plan.tolerance,
            "scheme": plan.document.build().time.scheme,
            "runs": len(self.rows),
            "changes": [
                {
                    "low": change.low,
                    "high": change.high,
                    "below": self._side(change.low, change.below),
                    "above": self._side(change.high, change.above),
                }
                for change in self.changes
            ],
        }

    def _side(self, value: Number, verdict: Verdict) -> dict[str, object]:
        row = self.rows[value]
        told = {name: row.get(name) for name in (*MOVEMENT, "status", "reason")}
        return {VERDICT: verdict.value, **told, "case": self.kept.get(value)}

    def __repr__(self) -> str:
        """Return a line: key, brackets, runs, folder."""
        shown = self.plan.shown
        found = ", ".join(f"{shown(one.low)} {one.below} / {shown(one.high)} {one.above}" for one in self.changes)
        return f"<LimitResult {self.plan.key}: {found or 'no change'}; {len(self.rows)} runs, {self.folder}>"


def limit(  # noqa: PLR0913 - one argument for each option of the command
    scenario: Source,
    vary: Mapping[str, Values],
    *,
    stands: str = criterion.DEFAULT,
    tolerance: float = TOLERANCE,
    executor: str | None = None,
    jobs: int | None = None,
    scheduler: str | None = None,
    out: Path | str | None = None,
    overwrite: bool = False,
    keep_runs: bool = True,
    on_run: OnRun = lambda *_: None,
) -> LimitResult:
    """Find the values of a key at which a structure stops, or begins, to stand.

    `vary` has one key and its range, {"ground.tilt": {"from": "20 deg", "to": "40 deg"}}, with the number of values
    that are scanned as `count` (default 9); there may be several changes. `stands` says what counts as standing (see
    `blocksim.study.criterion`), `tolerance` how narrow a bracket gets relative to its ends. Runs are kept in `out`
    (default: results/NAME/limit-HASH), with `keep_runs` those of both sides of a bracket with frames and contacts, for
    `plot` and `report`; the same call again does only what is missing. `executor`, `jobs` and `scheduler` are those of
    `sweep`, and do not change the answer. Raises ScenarioError, InvalidInputError, OutputExistsError where the folder
    is not free, UnavailableError, StoppedEarlyError on Ctrl-C.
    """
    plan = read_limit(document_of(scenario), vary, stands=stands, tolerance=tolerance)
    return find_limit(
        plan, Execution(executor, jobs, scheduler), out=out, overwrite=overwrite, keep_runs=keep_runs, on_run=on_run
    )


def find_limit(
    plan: LimitPlan,
    execution: Execution,
    *,
    out: Path | str | None = None,
    overwrite: bool = False,
    keep_runs: bool = True,
    on_run: OnRun = lambda *_: None,
) -> LimitResult:
    """Search as planned; see `limit`."""
    run, setting = execution.ready()
    base = plan.scenario_at(plan.span.low)
    check_experiment(base)
    folder = Path(out) if out is not None else files.RESULTS / base.name / f"limit-{plan.name}"
    prepare(folder, base, plan.name, overwrite=overwrite, kind=LIMIT)
    compile_kernels(kernels_of(base))
    with closing(Manifest(folder / MANIFEST, "limit")) as manifest:
        search = _Search(plan, manifest, run, on_run)
        try:
            with stop_requests() as is_stopped:
                search.complete(replace(setting, is_stopped=is_stopped))
        except KeyboardInterrupt:
            raise _stopped(len(search.known)) from None
        found = LimitResult(plan, folder, search.rows, search.ran)
        result = replace(found, kept=keep_sides(folder, plan, found.limits, found.rows) if keep_runs else {})
        _write(result)
    return result


def _stopped(runs: int) -> StoppedEarlyError:
    return StoppedEarlyError(f"stopped after {runs} runs; {AGAIN}")


class _Search:
    """One search: all rows that are known, by the hash of their values, and those that it needed, by value."""

    def __init__(self, plan: LimitPlan, manifest: Manifest, run: Run, on_run: OnRun) -> None:
        self.plan, self.manifest, self.run, self.on_run = plan, manifest, run, on_run
        entries = (entry for _, entry in read_entries(manifest.path))
        self.known = {entry.values: entry.row for entry in entries}  # noqa: PD011 - no table of pandas
        self.rows: dict[Number, Row] = {}
        self.ran = 0

    def complete(self, setting: Setting) -> None:
        """Go from round to round; what an earlier search has run is taken as it is. Raises StoppedEarlyError."""
        while values := self._next():
            missing = {self._hash(value): value for value in values if self._hash(value) not in self.known}
            with closing(self.run(self._tasks(missing.values()), setting)) as batches:
                for batch in batches:
                    for task, row in zip(batch.tasks, batch.rows, strict=True):
                        self._keep(missing[values_hash(task.settings)], task.name, row)
            if not missing.keys() <= self.known.keys():
                raise _stopped(len(self.known))
            self.rows |= {value: self.known[self._hash(value)] for value in values}

    def _next(self) -> list[Number]:
        verdicts = {value: self.plan.criterion.verdict(row) for value, row in self.rows.items()}
        return next_values(self.plan.span, verdicts, self.plan.tolerance)

    def _settings(self, value: Number) -> dict[str, object]:
        return {self.plan.key: self.plan.value(value)}

    def _hash(self, value: Number) -> str:
        return values_hash(self._settings(value))

    def _tasks(self, values: Iterable[Number]) -> Iterator[Task]:
        """Make the tasks of a round; a value that does not go with the others has its row at once."""
        for number, value in enumerate(values, start=len(self.known)):
            try:
                scenario = self.plan.scenario_at(value)
            except BlocksimError as error:
                self._keep(value, "", invalid_row(str(error).splitlines()[0]))
                continue
            yield Task(number, run_hash(scenario), self._settings(value), scenario)

    def _keep(self, value: Number, name: str, row: Row) -> None:
        """Bring a row to the disk, and then report it."""
        values = self._hash(value)
        self.manifest.append([Entry(len(self.known), name, values, row)])
        self.known[values] = row
        self.ran += 1
        self.on_run(value, self.plan.criterion.verdict(row), row)


def _head(plan: LimitPlan) -> str:
    return f"{VALUE} [{plan.unit}]" if plan.unit else VALUE


def _records(result: LimitResult) -> Iterator[list[object]]:
    """Yield the rows of limit.csv."""
    for value, verdict in result.verdicts.items():
        row = result.rows[value]
        yield [value, verdict.value, *(as_cell(row.get(name)) for name in COLUMNS[1:])]


def _write(result: LimitResult) -> None:
    """Write limit.csv, and the answer into limit.json."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([_head(result.plan), *COLUMNS])
    writer.writerows(_records(result))
    write_text(result.folder / TABLE, text.getvalue())
    origin = read_origin(result.folder, LIMIT)
    begun = {} if origin is None else origin.model_dump(exclude_none=True)
    write_text(result.folder / LIMIT.origin, json.dumps({**begun, **result.to_dict()}, indent=2) + "\n")

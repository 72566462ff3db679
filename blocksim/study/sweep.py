"""Many runs of one scenario with some keys varied, with one row per case in sweep.csv.

What has ended is in the manifest, so a sweep that is called again, after a kill too, does only what is missing. The
table is written from the manifest: it depends neither on the executor nor on the order in which the cases ended.
"""

import hashlib
import json
import re
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, suppress
from dataclasses import KW_ONLY, dataclass, replace
from pathlib import Path
from typing import Annotated

from blocksim.errors import InputMissingError, InvalidInputError, OutputExistsError, StoppedEarlyError, UnavailableError
from blocksim.options import Option, Overwrite, takes
from blocksim.scenario import Document, Scenario, Source, document_of, scenario_hash
from blocksim.scenario.models.study import Sweep
from blocksim.silence import silent
from blocksim.simulation import files, interruption, provenance, schemes as compilation
from blocksim.simulation.schemes import SCHEMES
from blocksim.study import executors, manifest, plan as plans, rows, sweep_folder

TIMINGS = "timings.csv"
MOST_INVALID = 500  # kept in memory before they are written
SOONEST = 2.0  # s between two tables while the sweep runs
SHARE = 0.02  # of the time, at most, goes into tables that are soon replaced
OnRow = Callable[[int, int, rows.Row], None]
SHARDED = re.compile(r"manifest-\d+-of-(\d+)\.jsonl")
MOST_SHARDS = 20
SharedCases = Annotated[
    manifest.Shard,
    Option("Run only cases I, I + N, ... (job arrays); then --merge.", metavar="I/N", read=manifest.Shard.parse),
]


@dataclass(frozen=True)
class SweepOptions(executors.Execution):
    """What is varied in a sweep, and how its cases are run and kept."""

    vary: Annotated[
        Mapping[str, plans.Values] | None,
        plans.variations_option(
            "KEY=a,b,c or KEY=from:to:count; for random draws KEY=from:to or KEY=mean+-sd. With :log at the end, "
            "from:to is spaced logarithmically. Repeatable.",
            "KEY=VALUES",
            "The values of each dotted key: a list, {from, to, count}, {from, to} or {mean, sd}.",
        ),
    ] = None
    _: KW_ONLY
    mode: Annotated[
        str | None,
        Option(
            "All combinations, the k-th value of every key, the scenario's table, or random draws.",
            python="grid (all combinations), list (the k-th value of every key), table (the scenario's), or random "
            "draws by lhs, sobol or normal.",
            choices=("grid", "list", "table", "lhs", "sobol", "normal"),
        ),
    ] = None
    samples: Annotated[int | None, Option("Number of cases to draw (default: 128).", metavar="N")] = None
    seed: Annotated[int | None, Option("Random seed (default: 0).", metavar="S")] = None
    out: Annotated[
        Path | str | None,
        Option("Folder for the results (default: results/NAME/sweep-HASH).", metavar="DIR"),
    ] = None
    shard: SharedCases = manifest.WHOLE
    keep_cases: Annotated[bool, Option("Keep a run folder with all frames for every case.")] = False
    fail_fast: Annotated[bool, Option("Stop at the first case that fails.")] = False
    retry_failed: Annotated[bool, Option("Run failed cases again.")] = False
    overwrite: Overwrite = False
    on_row: OnRow = silent

    def document(self, scenario: Source) -> Document:
        """Return a scenario with the [sweep] table that these options make. Raises as `with_sweep`."""
        return plans.with_sweep(document_of(scenario), self.vary, self.mode, samples=self.samples, seed=self.seed)


@takes(SweepOptions)
def sweep(scenario: Source, options: SweepOptions) -> manifest.SweepResult:
    """Run every case of a sweep that has no row yet.

    `vary`, `mode`, `samples` and `seed` replace what the scenario's [sweep] table says. `executor` is by default
    processes with `keep_cases` and dask with a `scheduler`; the rows are the same. With a `shard`, only its cases are
    run, and `merge` makes one table of all shards. `on_row` is called with every row, and how many there are.

    Cases that fail get a row with their status; the others continue, unless `fail_fast`. Raises ScenarioError for a bad
    scenario, InvalidInputError where nothing is varied, OutputExistsError where the folder is not free,
    UnavailableError for a scheduler that does not answer, StoppedEarlyError on Ctrl-C.

    A script that has processes started needs the guard `if __name__ == "__main__":`, as they import the script.
    """
    return run_sweep(options.document(scenario), options)


def run_sweep(document: Document, options: SweepOptions) -> manifest.SweepResult:
    """Run the cases of a document that has its [sweep] table; see `sweep`."""
    shard = options.shard
    refuse_loss(shard, overwrite=options.overwrite)
    base = document.build()
    plan = plans.plan_of(base)
    cases = plans.cases_of(document, plan)
    name = sweep_hash(base, plan, plans.table_digests(document, plan.vary))
    folder = Path(options.out) if options.out is not None else files.RESULTS / base.name / f"sweep-{name}"
    run, setting = options.ready(folder / sweep_folder.CASES if options.keep_cases else None)
    sweep_folder.prepare(folder, base, name, overwrite=options.overwrite)
    sweep_folder.keep_varied(folder, document, plan.vary, overwrite=options.overwrite)
    for kernels in kernels_for(document):
        compilation.compile_kernels(kernels)
    with closing(manifest.Manifest(folder / shard.file(manifest.MANIFEST))) as kept:
        share = SweepRun(cases, shard, kept, options.on_row, measured_ranges(base))
        if options.retry_failed:
            share.forget_failed()
        share.run(run, setting, fail_fast=options.fail_fast)
    return manifest.SweepResult(folder, shard.file(rows.TABLE), share.count)


def refuse_loss(shard: manifest.Shard, *, overwrite: bool) -> None:
    """Refuse that every job of an array removes what the others have done."""
    if overwrite and shard != manifest.WHOLE:
        raise InvalidInputError("a shard cannot overwrite what other shards have done; remove the folder first")


def measured_ranges(base: Scenario) -> rows.Ranges | None:
    """Return the measured ranges that a scenario is compared with, if it names any."""
    return None if base.experiment is None else rows.Ranges.read(base.experiment.table)


def sweep_hash(base: Scenario, plan: Sweep, tables: Mapping[str, Sequence[str]]) -> str:
    """Return the name of a sweep: a hash of its scenario, of what it varies, and of the code.

    `tables` has the digests of the files that varied keys name.
    """
    text = json.dumps([scenario_hash(base), plan.as_table(), *([tables] if tables else []), provenance.code_hash()])
    return hashlib.sha256(text.encode()).hexdigest()[: provenance.HASH_DIGITS]


def kernels_for(document: Document) -> tuple[str, ...]:
    """Return the sets of kernels that the cases of a sweep need."""
    base = document.build()
    vary = base.sweep.vary if base.sweep else {}
    schemes = (base.time.scheme, *map(str, plans.levels_of(vary.get("time.scheme", ()))))
    models = (base.contact.model, *map(str, plans.levels_of(vary.get("contact.model", ()))))
    sets = (SCHEMES[scheme].kernels(model) for scheme in schemes for model in models)
    return tuple(dict.fromkeys((compilation.kernels_of(base), *sets)))


class SweepRun:
    """One process's share of the cases of a study, and what it keeps of them beside its manifest."""

    def __init__(
        self,
        cases: plans.Cases,
        shard: manifest.Shard,
        kept: manifest.Manifest,
        on_row: OnRow,
        ranges: rows.Ranges | None = None,
        kind: sweep_folder.FolderKind = sweep_folder.SWEEP,
        table: str = rows.TABLE,
    ) -> None:
        """Take what is in the folder already; rows go into `table`, judged by `ranges` where these are given."""
        self.cases, self.shard, self.manifest, self.on_row = cases, shard, kept, on_row
        self.ranges, self.kind, self.folder = ranges, kind, kept.path.parent
        self.table = self.folder / shard.file(table)
        self.done = manifest.CaseIndex(self.folder, len(cases))
        self.count = len(self.done.state[shard.slice])  # cases of this share
        self.new = 0  # rows of this call
        self.invalid: list[tuple[manifest.Entry, plans.Settings]] = []  # cases that cannot be run, not written yet
        self.next_at = time.monotonic() + SOONEST

    def forget_failed(self) -> None:
        """Have those cases run again that did not end well."""
        state = self.done.state[self.shard.slice]
        state[state == manifest.ENDED_BADLY] = manifest.MISSING

    def run(self, executor: executors.Run, setting: executors.Setting, *, fail_fast: bool = False) -> None:
        """Run what has no row yet. Raises StoppedEarlyError on Ctrl-C; what has ended by then is kept."""
        try:
            with interruption.stop_requests() as is_stopped:
                setting = replace(setting, is_stopped=is_stopped)
                # closed here and now: left to the garbage collector, workers would continue
                with closing(executor(self._tasks(), setting)) as batches:
                    for batch in batches:
                        has_failed = self._keep_batch(batch, setting.executor)
                        if time.monotonic() >= self.next_at:
                            with suppress(OutputExistsError):  # somebody has changed it: said at the end
                                self._write()
                        if fail_fast and has_failed:
                            break
                    else:
                        self._keep()
                stopped = is_stopped()
        except KeyboardInterrupt:
            stopped = True
        except UnavailableError:
            self._write()
            raise
        self._write()
        if stopped and self.done.count(self.shard) < self.count:
            done = f"{self.done.count(self.shard)} of {self.count} cases done"
            raise StoppedEarlyError(f"stopped with {done}; rerun the command to finish")

    def _write(self) -> None:
        """Write the table; the more rows, the longer the while until it is worth it again."""
        began = time.monotonic()
        self.next_at = began + SOONEST
        sweep_folder.write_table(
            self.table, self.kind, manifest.table_rows(self.cases, self.done, self.ranges, self.shard)
        )
        ended = time.monotonic()
        self.next_at = ended + max(SOONEST, (ended - began) / SHARE)

    def _tasks(self) -> Iterator[executors.Task]:
        """Make one task after the other; cases that cannot be run get their rows on the way."""
        for number in self.shard.numbers(len(self.cases)):
            if self.done.holds(number, self.cases.design[number]):
                continue
            case = self.cases[number]
            if case.scenario is not None:
                yield executors.Task(number, case.name, case.settings, case.scenario)
                continue
            entry = manifest.Entry(
                number, case.name, manifest.values_hash(case.settings), rows.invalid_row(case.problem)
            )
            self.invalid.append((entry, case.settings))
            if len(self.invalid) >= MOST_INVALID:
                self._keep()

    def _keep_batch(self, batch: executors.Batch, executor: str) -> bool:
        """Keep rows, and return whether one of them is of a case that failed."""
        ended = [
            (manifest.Entry(task.number, task.name, manifest.values_hash(task.settings), row), task.settings)
            for task, row in zip(batch.tasks, batch.rows, strict=True)
        ]
        has_failed = bool(self.invalid) or any(row["status"] != rows.FINISHED for row in batch.rows)
        self._keep(ended)
        names = [task.name for task in batch.tasks]
        manifest.note_timings(self.folder / self.shard.file(TIMINGS), executor, names, batch.seconds, batch.host)
        return has_failed

    def _keep(self, ended: Sequence[tuple[manifest.Entry, plans.Settings]] = ()) -> None:
        """Bring rows to the disk, with those of cases that cannot be run, and then report them."""
        ended, self.invalid = [*ended, *self.invalid], []
        if not ended:
            return
        entries = [entry for entry, _ in ended]
        for start, entry in zip(self.manifest.append(entries), entries, strict=True):
            self.done.note(self.manifest.path, start, entry)
        self.new += len(ended)
        before = self.done.count(self.shard) - len(ended)
        for position, (entry, settings) in enumerate(ended, start=1):
            self.on_row(before + position, self.count, {"case": entry.case, **settings, **entry.row})


def merge(folder: Path | str, *, allow_missing: bool = False) -> manifest.SweepResult:
    """Write sweep.csv from everything that has been run in a folder, by shards or not.

    Raises InputMissingError where no sweep is there, and InvalidInputError, with a list of shards, where cases are
    missing, unless that is allowed.
    """
    folder = Path(folder)
    document = sweep_folder.read_plan(folder)
    base = document.build()
    cases = plans.cases_of(document, plans.plan_of(base))
    done = manifest.CaseIndex(folder, len(cases))
    if not done.paths:
        raise InputMissingError(f"{folder}: no case of this sweep has run yet")
    for number, settings in enumerate(cases.design):
        done.holds(number, settings)
    count = len(cases)
    if done.count() < count and not allow_missing:
        lines = [f"{folder}: {count - done.count()} of {count} cases are missing; --allow-missing merges the others"]
        of = max((int(match[1]) for path in done.paths if (match := SHARDED.fullmatch(path.name))), default=1)
        shards = [(shard, len(shard.numbers(count))) for shard in (manifest.Shard(index, of) for index in range(of))]
        missing = [(shard, size - done.count(shard), size) for shard, size in shards if done.count(shard) < size]
        if of > 1:  # by shards, those of the job array with the most jobs where there were several
            lines += [f"  --shard {shard}: {left} of {size} missing" for shard, left, size in missing[:MOST_SHARDS]]
        if of > 1 and len(missing) > MOST_SHARDS:
            lines.append(f"  and {len(missing) - MOST_SHARDS} more shards")
        raise InvalidInputError("\n".join(lines))
    sweep_folder.write_table(
        folder / rows.TABLE, sweep_folder.SWEEP, manifest.table_rows(cases, done, measured_ranges(base))
    )
    return manifest.SweepResult(folder, planned=len(cases))

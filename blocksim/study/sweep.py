"""Many runs of one scenario with some keys varied, with one row per case in sweep.csv.

What has ended is in the manifest, so a sweep that is called again, after a kill too, does only what is missing. The
table is written from the manifest: it depends neither on the executor nor on the order in which the cases ended.
Studies whose runs follow from the rows of others (`Runs`) keep them in a manifest as well, and are repeated from there.
"""

import re
import time
from collections.abc import Callable, Generator, Hashable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, nullcontext, suppress
from dataclasses import KW_ONLY, dataclass, field, replace
from pathlib import Path
from typing import Annotated, Self, TypeVar

from blocksim import errors
from blocksim.options import Option, Overwrite, silent, takes
from blocksim.scenario import Document, Model, Source, document_of
from blocksim.simulation import files, interruption, provenance, schemes
from blocksim.study import executors, manifest, plan as plans, rows, sweep_folder

SOONEST = 2.0  # s between two tables while the sweep runs
SHARE = 0.02  # of the time, at most, goes into tables that are soon replaced
OnRow = Callable[[int, int, rows.Row], None]
Key = TypeVar("Key", bound=Hashable)
Ended = tuple[int, str, plans.Settings, rows.Row]  # number of a case, name of its run, its values, its row
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

    >>> blocks, friction = "scenarios/three_blocks_nonsmooth.toml", {"friction.block_block": [0.1, 0.3]}
    >>> swept = sweep(blocks, friction, out="results/swept")
    >>> swept.table["3.x_mm"].round().tolist()
    [214.0, 132.0]
    """
    return run_sweep(options.document(scenario), options)


def run_sweep(document: Document, options: SweepOptions) -> manifest.SweepResult:
    """Run the cases of a document that has its [sweep] table; see `sweep`."""
    shard = options.shard
    refuse_loss(shard, overwrite=options.overwrite)
    model = Model(document)
    base, plan = model.scenario, plans.plan_of(model)
    cases = plans.cases_of(document, plan)
    tables = plans.table_digests(document, plan.vary)
    about = [model.hash, plan.as_table(), *([tables] if tables else []), provenance.code_hash()]
    name = manifest.short_hash(about)
    folder = Path(options.out) if options.out is not None else files.RESULTS / base.name / f"sweep-{name}"
    rounds, setting = options.ready(folder / sweep_folder.CASES if options.keep_cases else None)
    sweep_folder.prepare(folder, base, name, overwrite=options.overwrite)
    sweep_folder.copy_tables(folder, document, plan.vary, overwrite=options.overwrite)
    for kernels in kernels_for(document):
        schemes.compile_kernels(kernels)
    with closing(manifest.Manifest(folder / shard.file(manifest.MANIFEST))) as kept, rounds() as run:
        share = SweepRun(cases, shard, kept, options.on_row, rows.Ranges.of(base))
        share.run(run, setting, fail_fast=options.fail_fast, retry_failed=options.retry_failed)
    return manifest.SweepResult(folder, shard.file(rows.TABLE), share.count)


def refuse_loss(shard: manifest.Shard, *, overwrite: bool) -> None:
    """Refuse that every job of an array removes what the others have done."""
    if overwrite and shard != manifest.WHOLE:
        raise errors.InvalidInputError("a shard cannot overwrite what other shards have done; remove the folder first")


def kernels_for(document: Document) -> tuple[str, ...]:
    """Return the sets of kernels that the cases of a sweep need."""
    base = document.build()
    vary = base.sweep.vary if base.sweep else {}
    names = (base.time.scheme, *map(str, plans.levels_of(vary.get("time.scheme", ()))))
    models = (base.contact.model, *map(str, plans.levels_of(vary.get("contact.model", ()))))
    sets = (schemes.SCHEMES[scheme].kernels(model) for scheme in names for model in models)
    return tuple(dict.fromkeys((schemes.kernels_of(base), *sets)))


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
        self.invalid: list[Ended] = []  # cases that cannot be run, not written yet
        self.next_at = time.monotonic() + SOONEST

    def run(
        self,
        runner: executors.Run,
        setting: executors.RunSetting,
        *,
        fail_fast: bool = False,
        retry_failed: bool = False,
    ) -> None:
        """Run what has no row yet, or that of a case that failed where these are to be run again.

        Raises StoppedEarlyError on Ctrl-C; what has ended by then is kept.
        """
        state = self.done.state[self.shard.slice]
        if retry_failed:
            state[state == manifest.ENDED_BADLY] = manifest.MISSING
        timings = self.folder / self.shard.file("timings.csv")
        try:
            with interruption.stop_requests() as is_stopped:
                setting = replace(setting, is_stopped=is_stopped)
                # closed here and now: left to the garbage collector, workers would continue
                with closing(runner(self._tasks(), setting)) as batches:
                    for batch in batches:
                        has_failed = bool(self.invalid) or any(row["status"] != rows.FINISHED for row in batch.rows)
                        tasks = zip(batch.tasks, batch.rows, strict=True)
                        self._keep([(task.number, task.name, task.settings, row) for task, row in tasks])
                        manifest.note_timings(timings, setting.executor, batch)
                        if time.monotonic() >= self.next_at:
                            with suppress(errors.OutputExistsError):  # somebody has changed it: said at the end
                                self._write()
                        if fail_fast and has_failed:
                            break
                    else:
                        self._keep()
                stopped = is_stopped()
        except KeyboardInterrupt:
            stopped = True
        except errors.UnavailableError:
            self._write()
            raise
        self._write()
        if stopped and self.done.count(self.shard) < self.count:
            done = f"{self.done.count(self.shard)} of {self.count} cases done"
            raise errors.StoppedEarlyError(f"stopped with {done}; rerun the command to finish")

    def _write(self) -> None:
        """Write the table; the more rows, the longer the while until it is worth it again."""
        began = time.monotonic()
        self.next_at = began + SOONEST
        sweep_folder.write_table(self.table, manifest.table_rows(self.cases, self.done, self.ranges, self.shard))
        ended = time.monotonic()
        self.next_at = ended + max(SOONEST, (ended - began) / SHARE)

    def _tasks(self) -> Iterator[executors.Task]:
        """Make one task after the other; cases that cannot be run get their rows on the way."""
        for number in range(len(self.cases))[self.shard.slice]:
            if self.done.holds(number, self.cases.design[number]):
                continue
            case = self.cases[number]
            if case.model is not None:
                yield executors.Task(number, case.name, case.settings, case.model)
                continue
            self.invalid.append((number, case.name, case.settings, rows.invalid_row(case.problem)))
            if len(self.invalid) >= 500:  # kept in memory before they are written
                self._keep()

    def _keep(self, ended: Sequence[Ended] = ()) -> None:
        """Bring rows to the disk, with those of cases that cannot be run, and then report them."""
        ended, self.invalid = [*ended, *self.invalid], []
        if not ended:
            return
        entries = [manifest.Entry(one, case, manifest.short_hash(values), row) for one, case, values, row in ended]
        for start, entry in zip(self.manifest.append(entries), entries, strict=True):
            self.done.note(self.manifest.path, start, entry)
        self.new += len(ended)
        before = self.done.count(self.shard) - len(ended)
        for position, (_, case, settings, row) in enumerate(ended, start=1):
            self.on_row(before + position, self.count, {"case": case, **settings, **row})


def merge(folder: Path | str, *, allow_missing: bool = False) -> manifest.SweepResult:
    """Write sweep.csv from everything that has been run in a folder, by shards or not.

    Raises InputMissingError where no sweep is there, and InvalidInputError, with a list of shards, where cases are
    missing, unless that is allowed.
    """
    folder = Path(folder)
    document = sweep_folder.read_plan(folder)
    model = Model(document)
    base, cases = model.scenario, plans.cases_of(document, plans.plan_of(model))
    done = manifest.CaseIndex(folder, len(cases))
    if not done.paths:
        raise errors.InputMissingError(f"{folder}: no case of this sweep has run yet")
    for number, settings in enumerate(cases.design):
        done.holds(number, settings)
    count = len(cases)
    if done.count() < count and not allow_missing:
        lines = [f"{folder}: {count - done.count()} of {count} cases are missing; --allow-missing merges the others"]
        of = max((int(match[1]) for path in done.paths if (match := SHARDED.fullmatch(path.name))), default=1)
        shards = [(manifest.Shard(index, of), len(range(index, count, of))) for index in range(of)]
        missing = [(shard, size - done.count(shard), size) for shard, size in shards if done.count(shard) < size]
        if of > 1:  # by shards, those of the job array with the most jobs where there were several
            lines += [f"  --shard {shard}: {left} of {size} missing" for shard, left, size in missing[:MOST_SHARDS]]
        if of > 1 and len(missing) > MOST_SHARDS:
            lines.append(f"  and {len(missing) - MOST_SHARDS} more shards")
        raise errors.InvalidInputError("\n".join(lines))
    sweep_folder.write_table(folder / rows.TABLE, manifest.table_rows(cases, done, rows.Ranges.of(base)))
    return manifest.SweepResult(folder, planned=len(cases))


class Runs:
    """The rows of a study: those in its manifest, and what an executor adds to them."""

    def __init__(self, kept: manifest.Manifest, base: Model, run: executors.Run, setting: executors.RunSetting) -> None:
        """Take what is known from the manifest; all others are runs of the base with other values."""
        self.manifest, self.base, self._run, self._setting = kept, base, run, setting
        self.known = {entry.values: entry.row for _, entry in manifest.read_entries(kept.path)}
        self.new = 0

    def rows_of(
        self, wanted: Mapping[Key, plans.Settings], on_row: Callable[[Key, rows.Row], None] = silent
    ) -> dict[Key, rows.Row]:
        """Return the rows of runs with these values, after running what is missing; each is reported as it ends.

        Values that do not go together have a row that says so. Raises StoppedEarlyError on Ctrl-C.
        """
        names = {key: manifest.short_hash(settings) for key, settings in wanted.items()}
        missing = {name: key for key, name in names.items() if name not in self.known}

        def keep(settings: plans.Settings, case: str, row: rows.Row) -> None:
            name = manifest.short_hash(settings)
            # to the disk before it is reported
            self.manifest.append([manifest.Entry(len(self.known), case, name, row)])
            self.known[name] = row
            self.new += 1
            on_row(missing[name], row)

        def tasks() -> Iterator[executors.Task]:
            for number, key in enumerate(missing.values(), start=len(self.known)):
                case = plans.SweepCase.of(self.base, wanted[key])
                if case.model is None:
                    keep(wanted[key], "", rows.invalid_row(case.problem))
                else:
                    yield executors.Task(number, case.name, wanted[key], case.model)

        try:
            with interruption.stop_requests() as is_stopped:
                setting = replace(self._setting, is_stopped=is_stopped)
                with closing(self._run(tasks(), setting)) as batches:
                    for batch in batches:
                        for task, row in zip(batch.tasks, batch.rows, strict=True):
                            keep(task.settings, task.name, row)
                is_complete = missing.keys() <= self.known.keys()
        except KeyboardInterrupt:
            is_complete = False
        if not is_complete:
            raise errors.StoppedEarlyError(f"stopped after {len(self.known)} runs; rerun the command to finish")
        return {key: self.known[name] for key, name in names.items()}


@contextmanager
def runs_of(
    base: Model,
    first: Model,
    out: Path | str | None,
    kind: sweep_folder.FolderKind,
    name: str,
    execution: executors.Execution,
    *,
    overwrite: bool = False,
    peaks: bool = False,
) -> Iterator[Runs]:
    """Make the folder of a study with its first model, see `make_folder`, and give what runs varied ones of its base.

    With `peaks` rows have the largest rotation on the way. Raises OutputExistsError where the folder is not free,
    UnavailableError for an executor that is not there.
    """
    rounds, setting = execution.ready()
    folder = make_folder(out, first, kind, name, overwrite=overwrite)
    schemes.compile_kernels(schemes.kernels_of(first.scenario))
    what = kind.what.split(" ", 1)[1]
    with closing(manifest.Manifest(folder / manifest.MANIFEST, what)) as kept, rounds() as run:
        yield Runs(kept, base, run, replace(setting, peaks=peaks))


def make_folder(
    out: Path | str | None, base: Model, kind: sweep_folder.FolderKind, name: str, *, overwrite: bool
) -> Path:
    """Make the folder of a study of this name with its scenario: as given, or results/SCENARIO/STUDY-NAME.

    Raises OutputExistsError where it is not free, and what is wrong with the scenario's experiment.
    """
    rows.check_experiment(base)
    folder = Path(out) if out is not None else files.RESULTS / base.scenario.name / f"{Path(kind.plan).stem}-{name}"
    sweep_folder.prepare(folder, base.scenario, name, overwrite=overwrite, kind=kind)
    return folder


@dataclass(frozen=True)
class Replay(executors.Execution):
    """An executor that runs nothing: rows come from the manifests of a folder."""

    entries: Mapping[int | str, manifest.Entry] = field(default_factory=dict)
    by_number: bool = False
    runs: list[tuple[executors.Task, manifest.Entry]] = field(default_factory=list)  # all that were asked for

    @classmethod
    def of(cls, folder: Path, *, by_number: bool = False) -> Self:
        """Take what the manifests of a folder hold: by the numbers of runs in a design, or by their values."""
        entries = [entry for path in sorted(folder.glob(manifest.PATTERN)) for _, entry in manifest.read_entries(path)]
        return cls(entries={one.number if by_number else one.values: one for one in entries}, by_number=by_number)

    def ready(self, _: Path | None = None, /) -> tuple[executors.Rounds, executors.RunSetting]:
        """Return what gives the rows."""
        return lambda: nullcontext(self._run), executors.RunSetting(1)

    def _run(self, tasks: Iterator[executors.Task], _: executors.RunSetting) -> Generator[executors.Batch, None, None]:
        """Yield every task with the row that it has. Raises InvalidInputError."""
        for task in tasks:
            entry = self.entries.get(task.number if self.by_number else manifest.short_hash(task.settings))
            if entry is None:
                values = ", ".join(f"{key} = {value}" for key, value in task.settings.items())
                raise errors.InvalidInputError(f"the manifest has no run with {values}")
            self.runs.append((task, entry))
            yield executors.Batch((task,), (entry.row,), 0.0, "")

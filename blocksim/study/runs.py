"""The runs of a study: on any executor, each once, kept in a manifest, so that a study that was killed goes on."""

import hashlib
import json
from collections.abc import Callable, Generator, Hashable, Iterator, Mapping
from contextlib import AbstractContextManager, closing, contextmanager, nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Self, TypeVar

from blocksim.errors import BlocksimError, InvalidInputError, StoppedEarlyError
from blocksim.scenario import Document, Scenario
from blocksim.silence import silent
from blocksim.simulation import files, interruption, provenance, schemes
from blocksim.study.executors import Batch, Execution, Run, Setting, Task
from blocksim.study.manifest import MANIFEST, PATTERN, Entry, Manifest, read_entries, values_hash
from blocksim.study.rows import Row, check_experiment, invalid_row
from blocksim.study.sweep_folder import FolderKind, prepare

Settings = dict[str, object]
Key = TypeVar("Key", bound=Hashable)


class Runs:
    """The rows of a study: those in its manifest, and what an executor adds to them."""

    def __init__(self, manifest: Manifest, document: Document, run: Run, setting: Setting) -> None:
        """Take what is known from the manifest; all others are runs of the document with other values."""
        self.manifest, self.document, self._run, self._setting = manifest, document, run, setting
        self.known = {entry.values: entry.row for _, entry in read_entries(manifest.path)}
        self.new = 0

    def rows(self, wanted: Mapping[Key, Settings], on_row: Callable[[Key, Row], None] = silent) -> dict[Key, Row]:
        """Return the rows of runs with these values, after running what is missing; each is reported as it ends.

        Values that do not go together have a row that says so. Raises StoppedEarlyError on Ctrl-C.
        """
        names = {key: values_hash(settings) for key, settings in wanted.items()}
        missing = {name: key for key, name in names.items() if name not in self.known}

        def keep(settings: Settings, case: str, row: Row) -> None:
            name = values_hash(settings)
            self.manifest.append([Entry(len(self.known), case, name, row)])  # to the disk before it is reported
            self.known[name] = row
            self.new += 1
            on_row(missing[name], row)

        def tasks() -> Iterator[Task]:
            for number, key in enumerate(missing.values(), start=len(self.known)):
                try:
                    scenario = self.document.with_values(wanted[key]).build()
                except BlocksimError as error:
                    keep(wanted[key], "", invalid_row(str(error).splitlines()[0]))
                    continue
                yield Task(number, provenance.run_hash(scenario), wanted[key], scenario)

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
            raise StoppedEarlyError(f"stopped after {len(self.known)} runs; rerun the command to finish")
        return {key: self.known[name] for key, name in names.items()}


@contextmanager
def runs_of(
    document: Document,
    base: Scenario,
    out: Path | str | None,
    kind: FolderKind,
    name: str,
    execution: Execution,
    *,
    overwrite: bool = False,
    peaks: bool = False,
) -> Iterator[Runs]:
    """Make the folder of a study, see `make_folder`, and give what runs the document.

    With `peaks` rows have the largest rotation on the way. Raises OutputExistsError where the folder is not free,
    UnavailableError for an executor that is not there.
    """
    _, setting = execution.ready()
    folder = make_folder(out, base, kind, name, overwrite=overwrite)
    schemes.compile_kernels(schemes.kernels_of(base))
    what = kind.what.split(" ", 1)[1]
    with closing(Manifest(folder / MANIFEST, what)) as manifest, execution.for_rounds() as run:
        yield Runs(manifest, document, run, replace(setting, peaks=peaks))


def make_folder(out: Path | str | None, base: Scenario, kind: FolderKind, name: str, *, overwrite: bool) -> Path:
    """Make the folder of a study of this name with its scenario: as given, or results/SCENARIO/STUDY-NAME.

    Raises OutputExistsError where it is not free, and what is wrong with the scenario's experiment.
    """
    check_experiment(base)
    folder = Path(out) if out is not None else files.RESULTS / base.name / f"{Path(kind.plan).stem}-{name}"
    prepare(folder, base, name, overwrite=overwrite, kind=kind)
    return folder


def short_hash(data: object) -> str:
    """Return a hash of data that can be written as JSON, to name a study."""
    return hashlib.sha256(json.dumps(data, default=str).encode()).hexdigest()[: provenance.HASH_DIGITS]


@dataclass(frozen=True)
class Replay(Execution):
    """An executor that runs nothing: rows come from the manifests of a folder."""

    entries: Mapping[int | str, Entry] = field(default_factory=dict)
    by_number: bool = False
    tasks: list[Task] = field(default_factory=list)  # all that were asked for

    @classmethod
    def of(cls, folder: Path, *, by_number: bool = False) -> Self:
        """Take what the manifests of a folder hold: by the numbers of runs in a design, or by their values."""
        entries = [entry for path in sorted(folder.glob(PATTERN)) for _, entry in read_entries(path)]
        return cls(entries={one.number if by_number else one.values: one for one in entries}, by_number=by_number)

    def anew(self) -> Self:
        """Forget what was asked for."""
        self.tasks.clear()
        return self

    def ready(self, _: Path | None = None, /) -> tuple[Run, Setting]:
        """Return what gives the rows."""
        return self._run, Setting(1)

    def for_rounds(self) -> AbstractContextManager[Run]:
        """Give the same for one round after the other."""
        return nullcontext(self._run)

    def entry(self, task: Task) -> Entry | None:
        """Return what a task came to."""
        return self.entries.get(task.number if self.by_number else values_hash(task.settings))

    def _run(self, tasks: Iterator[Task], _: Setting) -> Generator[Batch, None, None]:
        """Yield every task with the row that it has. Raises InvalidInputError."""
        for task in tasks:
            entry = self.entry(task)
            if entry is None:
                values = ", ".join(f"{key} = {value}" for key, value in task.settings.items())
                raise InvalidInputError(f"the manifest has no run with {values}")
            self.tasks.append(task)
            yield Batch((task,), (entry.row,), 0.0, "")

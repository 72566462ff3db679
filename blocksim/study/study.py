"""A study: runs of one scenario with other values, and the answer that they give.

A study plans its runs, has them done by `runs_of` (on any executor, each once, kept in a manifest so that a study that
was stopped or killed goes on), and makes an `Answer` of their rows. The answer is one model: it is written as NAME.json
beside the table NAME.csv, read back from there, printed, drawn and put into reports. A new study is a module with its
search, another with its answer, and a line in STUDIES.
"""

from collections.abc import Callable, Generator, Hashable, Iterator, Mapping
from contextlib import AbstractContextManager, closing, contextmanager, nullcontext
from dataclasses import dataclass, field, replace
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple, Self, TypeVar

from blocksim.errors import BlocksimError, InvalidInputError, StoppedEarlyError
from blocksim.scenario import Document, Scenario, load_stored
from blocksim.silence import silent
from blocksim.simulation import folder as files
from blocksim.simulation.compilation import compile_kernels, kernels_of
from blocksim.simulation.provenance import run_hash
from blocksim.simulation.stopping import stop_requests
from blocksim.study.answer import Answer
from blocksim.study.executors import Batch, Execution, Run, Setting, Task
from blocksim.study.progress import MANIFEST, PATTERN, Entry, Manifest, read_entries, values_hash
from blocksim.study.rows import Row, check_experiment, invalid_row
from blocksim.study.sweep_folder import FolderKind, prepare
from blocksim.view.layout import OWN, Paper
from blocksim.view.report.studies import StudyPage
from blocksim.view.style import picture_suffix

STUDIES = {
    "fragility": "blocksim.study.fragility:FRAGILITY",
    "limit": "blocksim.study.limit:LIMIT",
    "limits": "blocksim.study.limit:CURVE",
}
"""Studies by the name of their files; each is imported where it is needed."""
Settings = dict[str, object]
Key = TypeVar("Key", bound=Hashable)


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

    def ready(self) -> tuple[Run, Setting]:
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
                message = f"the manifest has no run with {values}"
                raise InvalidInputError(message)
            self.tasks.append(task)
            yield Batch((task,), (entry.row,), 0.0, "")


class Study(NamedTuple):
    """What is done with the folder of a study, whoever made it."""

    answer: type[Answer]
    repeat: Callable[[Any, Replay, Path], Answer]  # from its answer and manifest, in another folder
    parts: Callable[[Any], list[Path]] = lambda _: []  # folders of the studies that it consists of
    is_design: bool = False  # all runs are known before the first: they are known by their numbers


def study_in(place: Path | str) -> Study | None:
    """Return the study whose answer a folder holds, None for anything else."""
    return next((study_named(name) for name in STUDIES if (Path(place) / f"{name}.json").is_file()), None)


def study_named(name: str) -> Study:
    """Return a study."""
    module, _, kind = STUDIES[name].partition(":")
    return getattr(import_module(module), kind)  # type: ignore[no-any-return]


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
                yield Task(number, run_hash(scenario), wanted[key], scenario)

        try:
            with stop_requests() as is_stopped:
                setting = replace(self._setting, is_stopped=is_stopped)
                with closing(self._run(tasks(), setting)) as batches:
                    for batch in batches:
                        for task, row in zip(batch.tasks, batch.rows, strict=True):
                            keep(task.settings, task.name, row)
                is_complete = missing.keys() <= self.known.keys()
        except KeyboardInterrupt:
            is_complete = False
        if not is_complete:
            message = f"stopped after {len(self.known)} runs; rerun the command to finish"
            raise StoppedEarlyError(message)
        return {key: self.known[name] for key, name in names.items()}


@contextmanager
def runs_of(
    document: Document,
    base: Scenario,
    folder: Path,
    kind: FolderKind,
    name: str,
    execution: Execution,
    *,
    overwrite: bool = False,
    peaks: bool = False,
) -> Iterator[Runs]:
    """Make the folder of a study of this name, with `base` as its scenario, and give what runs the document.

    With `peaks` rows have the largest rotation on the way.

    Raises OutputExistsError where the folder is not free, UnavailableError for an executor that is not there.
    """
    _, setting = execution.ready()
    check_experiment(base)
    prepare(folder, base, name, overwrite=overwrite, kind=kind)
    compile_kernels(kernels_of(base))
    what = kind.what.split(" ", 1)[1]
    with closing(Manifest(folder / MANIFEST, what)) as manifest, execution.for_rounds() as run:
        yield Runs(manifest, document, run, replace(setting, peaks=peaks))


def folder_for(out: Path | str | None, base: Scenario, kind: FolderKind, name: str) -> Path:
    """Return the folder of a study: as given, or results/SCENARIO/STUDY-NAME."""
    return Path(out) if out is not None else files.RESULTS / base.name / f"{Path(kind.plan).stem}-{name}"


def draw_study(
    folder: Path,
    study: Study,
    path: Path | None,
    picture: str | None,
    paper: Paper,
    ready: Callable[[Path], None],
    published: Path | None = None,
) -> Path:
    """Draw a study; return the picture's path (default: NAME_KIND.png).

    `ready` is asked about the path first; `published` is a table of others to draw beside it. Raises InvalidInputError
    for another kind of picture, an unknown format, a table for another study and what cannot be read,
    InputMissingError, OutputError.
    """
    kind = study.answer
    if picture not in {None, kind.picture}:
        message = f"{folder}: {kind.files.what} is drawn as {kind.picture!r}, not as {picture!r}"
        raise InvalidInputError(message)
    if published is not None and not kind.takes_table:
        takers = [one.files.what for one in (study_named(name).answer for name in STUDIES) if one.takes_table]
        message = f"{published}: a table is drawn beside {takers[0]} only, and {folder} is {kind.files.what}"
        raise InvalidInputError(message)
    scenario = load_stored(folder / kind.files.plan)
    path = path or Path(f"{scenario.name}_{kind.picture}.png")
    picture_suffix(path)
    ready(path)
    answer = kind.read(folder).model_copy(update={"beside": published})
    answer.draw(path, scenario.description or scenario.name, paper)
    return path


def study_page(folder: Path, study: Study) -> StudyPage:
    """Return a study as a report shows it. Raises InputMissingError or InvalidInputError where it cannot be read."""
    answer = study.answer.read(folder)
    scenario, table = load_stored(folder / answer.files.plan), answer.shown()
    picture, problems = None, []
    with TemporaryDirectory() as place:
        path = Path(place) / "picture.png"
        try:
            answer.draw(path, scenario.description or scenario.name, OWN)
            picture = path.read_bytes()
        except BlocksimError as error:
            problems = [str(error)]
    summary, description = answer.summary(), scenario.description or ""
    return StudyPage(scenario.name, description, summary, answer.caption, table.heads, table.texts(), picture, problems)

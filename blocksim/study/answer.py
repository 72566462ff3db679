"""Studies: what one has come to, which there are, and what is done with their folders, whoever made them.

A study plans its runs, has them done by `runs_of` (sweep.py), and makes an `Answer` of their rows: one model that is
written as NAME.json beside the table NAME.csv, read back from there, printed, drawn and put into reports. A new study
is one module or two, for its search and its answer, and a line in STUDIES; see README.md.
"""

import json
import math
from collections.abc import Callable, Sequence
from html import escape
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Self

from pydantic import BaseModel, Field, ValidationError

from blocksim.errors import BlocksimError, ExitCode, InvalidInputError
from blocksim.notebook import Shown
from blocksim.scenario import Model, Scenario, input_files
from blocksim.study.sweep_folder import FolderKind, write_answer
from blocksim.view.report.subjects import StudyPage
from blocksim.view.style import OWN, Paper

if TYPE_CHECKING:
    import pandas as pd

    from blocksim.study.pictures import PlotOptions
    from blocksim.study.sweep import Replay

MOST_BYTES = 50 * input_files.MEGABYTE
STUDIES = {
    "fragility": "blocksim.study.fragility:FRAGILITY",
    "limit": "blocksim.study.limit:LIMIT",
    "limits": "blocksim.study.limit:CURVE",
    "static": "blocksim.study.static_limit:STATIC",
}
"""Studies by the name of their files; each is imported where it is needed."""


def with_unit(number: float, unit: str, digits: int = 7) -> str:
    """Return a number for people, with its unit if it has one."""
    return f"{number:.{digits}g} {unit}".rstrip()


class Overview(NamedTuple):
    """What an answer is for people, on the screen and in a report: a table, what belongs to it, and an exit code.

    Numbers have so many digits, and stand on the right of `left` columns of text on a screen.
    """

    title: str
    heads: Sequence[str]
    rows: Sequence[Sequence[str | float]]
    left: int = 1
    digits: int = 2
    lines: Sequence[str] = ()  # below the table
    notes: Sequence[str] = ()  # remarks that are no part of the answer, with where the files are
    summary: Sequence[tuple[str, str]] = ()  # above the table of a report
    code: ExitCode = ExitCode.SUCCESS

    def texts(self) -> list[list[str]]:
        """Return the cells of all rows: fixed digits, no minus sign on zero, a dash where there is no number."""
        digits = self.digits
        return [[number_text(cell, digits) if isinstance(cell, float) else cell for cell in row] for row in self.rows]


def number_text(number: float, digits: int) -> str:
    """Return a number with fixed digits, without a minus sign on zero; a dash where there is none."""
    if not math.isfinite(number):
        return "–"
    text = f"{number:.{digits}f}"
    return text[1:] if text.startswith("-") and not text.strip("-0.") else text


class StudyResult(Shown):
    """What a study has come to: a table with remarks, and a picture of one kind."""

    picture: ClassVar[str]  # name of its kind
    caption: ClassVar[str]  # of the table in a report

    def overview(self) -> Overview:
        """Return what it is for people."""
        raise NotImplementedError

    def draw(self, path: Path, title: str, paper: Paper) -> None:
        """Draw the picture. Raises InvalidInputError where there is nothing to draw."""
        raise NotImplementedError

    def _repr_html_(self) -> str:
        """Return title, table, remarks and picture, for notebooks."""
        told = self.overview()
        head = "".join(f"<th>{escape(one)}</th>" for one in told.heads)
        lines = "".join(f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>" for row in told.texts())
        notes = "".join(f"<p>{escape(line)}</p>" for line in (*told.lines, *told.notes))
        return f"<p>{escape(told.title)}</p><table><tr>{head}</tr>{lines}</table>{notes}{super()._repr_html_()}"


class UnstoredResult(StudyResult):
    """A result of a study that has no folder of its own: it is drawn from memory."""

    what: ClassVar[str]
    folder: ClassVar[None] = None
    scenario: Scenario  # that was studied

    @property
    def name(self) -> str:
        """The name of the scenario."""
        return self.scenario.name

    def __repr__(self) -> str:
        """Return the title."""
        return f"<{type(self).__name__} of {self.overview().title}>"


class Answer(StudyResult, BaseModel, frozen=True):
    """What a study has come to; its fields are those of NAME.json, in their order."""

    files: ClassVar[FolderKind]
    takes_table: ClassVar[bool] = False  # of others in its picture
    folder: Path = Field(default=Path(), exclude=True)
    run: int = Field(default=0, exclude=True)  # runs of this call; the others were known
    beside: Path | None = Field(default=None, exclude=True)  # table of others, to be drawn into the picture
    heads: Sequence[str] = Field(default=(), exclude=True, repr=False)  # of NAME.csv
    cells: Sequence[Sequence[object]] = Field(default=(), exclude=True, repr=False)  # its rows, all numbers given

    @classmethod
    def read(cls, folder: Path) -> Self:
        """Return the answer that a folder holds. Raises InputMissingError or InvalidInputError."""
        path = folder / cls.files.origin
        try:
            found = cls.model_validate_json(input_files.read_limited(path, MOST_BYTES))
        except ValidationError as error:
            message = f"{path}: not the answer of {cls.files.what}: {str(error).splitlines()[0]}"
            raise InvalidInputError(message) from None
        return found.model_copy(update={"folder": folder})

    def write(self) -> None:
        """Write NAME.csv and NAME.json. Raises OutputError."""
        name = Path(self.files.plan).with_suffix(".csv").name
        write_answer(self.folder / name, self.files, [self.heads, *self.cells], self.to_dict())

    def to_dict(self) -> dict[str, object]:
        """Return plain values for JSON."""
        text = self.model_dump_json(by_alias=True, exclude_unset=True)
        return dict(json.loads(text))

    @property
    def table(self) -> "pd.DataFrame":
        """The rows of NAME.csv."""
        import pandas as pd

        return pd.DataFrame(list(self.cells), columns=list(self.heads))


def without_cases(data: Any) -> Any:
    """Return the values of an answer without the names of folders, in which the code has a part."""
    if isinstance(data, dict):
        return {name: without_cases(value) for name, value in data.items() if name != "case"}
    return [without_cases(one) for one in data] if isinstance(data, list) else data


class Study(NamedTuple):
    """What is done with the folder of a study, whoever made it."""

    answer: type[Answer]
    repeat: Callable[[Any, "Replay", Path], Answer]  # from its answer and manifest, in another folder
    parts: Callable[[Any], list[Path]] = lambda _: []  # folders of the studies that it consists of
    is_design: bool = False  # all runs are known before the first: they are known by their numbers


def study_in(place: Path | str) -> Study | None:
    """Return the study whose answer a folder holds, None for anything else."""
    return next((load_study(name) for name in STUDIES if (Path(place) / f"{name}.json").is_file()), None)


def load_study(name: str) -> Study:
    """Return a study."""
    module, _, kind = STUDIES[name].partition(":")
    return getattr(import_module(module), kind)  # type: ignore[no-any-return]


def draw_study(folder: Path, study: Study, options: "PlotOptions") -> Path:
    """Draw a study; return the picture's path (default: NAME_KIND.png).

    `options.experiment` is a table of others to draw beside it. Raises InvalidInputError for another kind of picture,
    an unknown format, a table for another study and what cannot be read, InputMissingError, OutputExistsError,
    OutputError.
    """
    kind, published = study.answer, None if options.experiment is None else Path(options.experiment)
    if options.kind not in {None, kind.picture}:
        raise InvalidInputError(f"{folder}: {kind.files.what} is drawn as {kind.picture!r}, not as {options.kind!r}")
    if published is not None and not kind.takes_table:
        takers = [one.files.what for one in (load_study(name).answer for name in STUDIES) if one.takes_table]
        message = f"{published}: a table is drawn beside {takers[0]} only, and {folder} is {kind.files.what}"
        raise InvalidInputError(message)
    scenario = Model.stored(folder / kind.files.plan).scenario
    path = options.picture(f"{scenario.name}_{kind.picture}.png")
    answer = kind.read(folder).model_copy(update={"beside": published})
    answer.draw(path, title_of(scenario), options.paper)
    return path


def draw_result(result: UnstoredResult, options: "PlotOptions") -> Path:
    """Draw a result in memory; return the picture's path (default: NAME_KIND.png).

    Raises InvalidInputError for another kind of picture, an unknown format, options that mean nothing for it and where
    there is nothing to draw, OutputExistsError, OutputError.
    """
    if options.kind not in {None, result.picture}:
        raise InvalidInputError(f"{result.what} is drawn as {result.picture!r}, not as {options.kind!r}")
    if options.experiment is not None:
        raise InvalidInputError(f"{options.experiment}: {result.what} is drawn beside the table of its scenario only")
    options.refuse(None, f"this is {result.what}")
    path = options.picture(f"{result.name}_{result.picture}.png")
    result.draw(path, title_of(result.scenario), options.paper)
    return path


def title_of(scenario: Scenario) -> str:
    """Return the title of a picture of a scenario."""
    return scenario.description or scenario.name


def page_of(answer: StudyResult, scenario: Scenario) -> StudyPage:
    """Return a result as a report shows it."""
    table, picture, problems = answer.overview(), None, []
    with TemporaryDirectory() as place:
        path = Path(place) / "picture.png"
        try:
            answer.draw(path, title_of(scenario), OWN)
            picture = path.read_bytes()
        except BlocksimError as error:
            problems = [str(error)]
    name, caption, description = scenario.name, answer.caption, scenario.description or ""
    return StudyPage(name, description, table.summary, caption, table.heads, table.texts(), picture, problems)

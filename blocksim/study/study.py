"""Which studies there are, and what is done with their folders, whoever made them: recognised, drawn and reported.

A study plans its runs, has them done by `runs_of` (runs.py), and makes an `Answer` of their rows: one model that is
written as NAME.json beside the table NAME.csv, read back from there, printed, drawn and put into reports. A new study
is a module with its search, another with its answer, and a line in STUDIES.
"""

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, NamedTuple

from blocksim.errors import BlocksimError, InvalidInputError
from blocksim.scenario import load_stored
from blocksim.study.answer import Answer
from blocksim.view.report.subjects import StudyPage
from blocksim.view.style import OWN

if TYPE_CHECKING:
    from blocksim.study.pictures import PlotOptions
    from blocksim.study.runs import Replay

STUDIES = {
    "fragility": "blocksim.study.fragility:FRAGILITY",
    "limit": "blocksim.study.limit:LIMIT",
    "limits": "blocksim.study.limit:CURVE",
}
"""Studies by the name of their files; each is imported where it is needed."""


class Study(NamedTuple):
    """What is done with the folder of a study, whoever made it."""

    answer: type[Answer]
    repeat: Callable[[Any, "Replay", Path], Answer]  # from its answer and manifest, in another folder
    parts: Callable[[Any], list[Path]] = lambda _: []  # folders of the studies that it consists of
    is_design: bool = False  # all runs are known before the first: they are known by their numbers


def study_in(place: Path | str) -> Study | None:
    """Return the study whose answer a folder holds, None for anything else."""
    return next((study_named(name) for name in STUDIES if (Path(place) / f"{name}.json").is_file()), None)


def study_named(name: str) -> Study:
    """Return a study."""
    module, _, kind = STUDIES[name].partition(":")
    return getattr(import_module(module), kind)  # type: ignore[no-any-return]


def draw_study(folder: Path, study: Study, options: "PlotOptions") -> Path:
    """Draw a study; return the picture's path (default: NAME_KIND.png).

    `options.table` is one of others to draw beside it. Raises InvalidInputError for another kind of picture, an unknown
    format, a table for another study and what cannot be read, InputMissingError, OutputExistsError, OutputError.
    """
    kind, published = study.answer, options.table
    if options.kind not in {None, kind.picture}:
        message = f"{folder}: {kind.files.what} is drawn as {kind.picture!r}, not as {options.kind!r}"
        raise InvalidInputError(message)
    if published is not None and not kind.takes_table:
        takers = [one.files.what for one in (study_named(name).answer for name in STUDIES) if one.takes_table]
        message = f"{published}: a table is drawn beside {takers[0]} only, and {folder} is {kind.files.what}"
        raise InvalidInputError(message)
    scenario = load_stored(folder / kind.files.plan)
    path = options.picture(f"{scenario.name}_{kind.picture}.png")
    answer = kind.read(folder).model_copy(update={"beside": published})
    answer.draw(path, scenario.description or scenario.name, options.paper)
    return path


def study_page(folder: Path, study: Study) -> StudyPage:
    """Return a study as a report shows it. Raises InputMissingError or InvalidInputError where it cannot be read."""
    answer = study.answer.read(folder)
    scenario, table = load_stored(folder / answer.files.plan), answer.overview()
    picture, problems = None, []
    with TemporaryDirectory() as place:
        path = Path(place) / "picture.png"
        try:
            answer.draw(path, scenario.description or scenario.name, OWN)
            picture = path.read_bytes()
        except BlocksimError as error:
            problems = [str(error)]
    name, caption, description = scenario.name, answer.caption, scenario.description or ""
    return StudyPage(name, description, table.summary, caption, table.heads, table.texts(), picture, problems)

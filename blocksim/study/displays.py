"""What results show in a notebook, and give as pictures, animations and pages in memory."""

from base64 import b64encode
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, ClassVar, NamedTuple

import numpy as np

from blocksim.analysis.compare import Comparison
from blocksim.analysis.metrics import Judgement
from blocksim.errors import BlocksimError, InvalidInputError
from blocksim.notebook import Shown
from blocksim.scenario import Model, Scenario
from blocksim.simulation import Result, files
from blocksim.simulation.instruments import FrameRows, frames_from_rows
from blocksim.study import answer, pictures, report, run_folder
from blocksim.study.answer import UnstoredResult
from blocksim.study.capacity import CapacityAnswer
from blocksim.view import style
from blocksim.view.kinds import CAPACITY, FINAL, MOTION
from blocksim.view.report import page, subjects
from blocksim.world.systems import others_of
from blocksim.world.systems.blocks import block_system

FRAME_HEIGHT = 760  # pixels, of a report within a notebook
PNG, GIF, HTML = ".png", ".gif", ".html"


def _image(content: bytes, kind: str, what: str) -> str:
    source = f"data:image/{kind};base64,{b64encode(content).decode()}"
    return f'<img src="{source}" alt="{escape(what)}" style="max-width:100%">'


@dataclass(frozen=True, repr=False)
class PictureDisplay:
    """A figure that is not written yet; `dots` are those an inch of a PNG."""

    figure: "style.Figure"
    dots: float | None = None

    def content(self, suffix: str = PNG) -> bytes:
        """Return the bytes of the file that `blocksim plot` writes, in the format of a suffix."""
        with style.in_style(self.dots):
            return style.figure_bytes(self.figure, suffix)

    def save(self, path: Path | str, *, overwrite: bool = False) -> Path:
        """Write PNG, SVG or PDF. Raises InvalidInputError, OutputExistsError, OutputError."""
        path = style.picture_path(path)
        files.refuse_foreign(path, overwrite=overwrite)
        files.write_bytes(path, self.content(path.suffix.lower()))
        return path

    def _repr_png_(self) -> bytes:
        return self.content()

    def _repr_html_(self) -> str:
        return _image(self.content(), "png", "picture")


@dataclass(frozen=True, repr=False)
class AnimationDisplay:
    """A run over time; `draw` writes it into a file, `last` is a picture of its end."""

    figure: ClassVar[None] = None
    draw: Callable[[Path], object]
    last: Callable[[], PictureDisplay]

    @cached_property
    def gif(self) -> bytes:
        """The GIF, drawn when first asked for."""
        with TemporaryDirectory() as folder:
            path = Path(folder) / f"animation{GIF}"
            self.draw(path)
            return path.read_bytes()

    def save(self, path: Path | str, *, overwrite: bool = False) -> Path:
        """Write GIF or MP4. Raises InvalidInputError, OutputExistsError, OutputError, UnavailableError."""
        path = Path(path)
        files.refuse_foreign(path, overwrite=overwrite)
        if path.suffix.lower() == GIF:
            files.write_bytes(path, self.gif)
        else:
            self.draw(path)
        return path

    def _repr_png_(self) -> bytes:
        return self.last().content()

    def _repr_html_(self) -> str:
        return _image(self.gif, "gif", "animation")


@dataclass(frozen=True, repr=False)
class PageDisplay:
    """A page of a report, all in one text."""

    text: str
    figure: ClassVar[None] = None

    def save(self, path: Path | str, *, overwrite: bool = False) -> Path:
        """Write HTML. Raises InvalidInputError for another suffix, OutputExistsError, OutputError."""
        path = Path(path)
        if path.suffix.lower() != HTML:
            raise InvalidInputError(f"{path}: '{path.suffix}' unsupported format; use {HTML}")
        files.refuse_foreign(path, overwrite=overwrite)
        files.write_bytes(path, self.text.encode(errors="replace"))
        return path

    def _repr_png_(self) -> None:
        return None

    def _repr_html_(self) -> str:
        look = f"width:100%;height:{FRAME_HEIGHT}px;border:0"
        sandbox = "allow-scripts"  # it reaches nothing of the notebook
        return f'<iframe sandbox="{sandbox}" srcdoc="{escape(self.text)}" style="{look}"></iframe>'


SIZES = np.zeros((2, 2))  # of two frames: contacts and overlaps


class Unwritten(pictures.PlotOptions):
    """A picture that is kept in memory, under whatever name."""

    def picture(self, default: str) -> Path:
        """Return the default."""
        return Path(default)


class PictureSource(NamedTuple):
    """What is drawn of a result of a class, and the options that go with it."""

    of: Callable[[Any], Any]
    options: Callable[[Any], dict[str, Any]]


SUBJECTS: dict[type[Shown], PictureSource] = {
    CapacityAnswer: PictureSource(lambda shown: shown.run, lambda _: {"kind": CAPACITY}),
    Comparison: PictureSource(lambda shown: shown.run, lambda shown: {"experiment": Path(shown.source)}),
    Judgement: PictureSource(lambda shown: Path(shown.sweep).parent, lambda shown: {"experiment": shown.source}),
}
"""Results that are drawn as something else; a new one is a line here, or a kind of `StudyResult`."""


def picture_of(shown: Any, *, kind: str | None = None, **options: Any) -> PictureDisplay:
    """Return a picture of a scenario, a run, a sweep, the answer of a study or a comparison.

    Without `kind` it is the final state of a run, the start of a scenario, and what suits a sweep. Raises as
    `blocksim.plot`.
    """
    preset = SUBJECTS[type(shown)].options(shown) if type(shown) in SUBJECTS else {}
    asked = Unwritten(**{**preset, **options, **({} if kind is None else {"kind": kind})})
    with style.keep_figures() as kept:
        subject = _subject(shown)
        next(draw for one, draw in DRAWN.items() if isinstance(subject, one))(subject, asked)
    return PictureDisplay(kept[-1], asked.paper.dots)


def html_of(shown: Any) -> str:
    """Return the picture of something as HTML; empty where there is none."""
    try:
        return picture_of(shown)._repr_html_()
    except BlocksimError:
        return ""


def animation_of(shown: Any, **options: Any) -> AnimationDisplay:
    """Return an animation of a run. Raises as `blocksim.animate`, and InvalidInputError for anything else."""
    run = _subject(shown)
    if isinstance(run, Scenario):
        raise InvalidInputError(f"{run.name}: run the scenario first; its result is animated")
    if isinstance(run, UnstoredResult):
        raise InvalidInputError(f"{run.name}: {run.what} has no motion; animate a run")
    stored = _stored(run) if isinstance(run, Result) else lambda: run_folder.read_run(run)
    asked = pictures.AnimateOptions(**options)
    return AnimationDisplay(lambda path: pictures.animate_run(stored(), path, asked), lambda: picture_of(shown))


def page_of(shown: Any, *, experiment: Path | str | None = None) -> PageDisplay:
    """Return the page of `blocksim.report` of a run, a sweep or the answer of a study. Raises as that does."""
    subject = _subject(shown)
    if isinstance(subject, Scenario):
        raise InvalidInputError(f"{subject.name}: run the scenario first; a report is about its result")
    table = None if experiment is None else Path(experiment)
    if isinstance(subject, Result):
        return PageDisplay(report.page_of_result(subject, table))
    if isinstance(subject, UnstoredResult):
        part = subjects.study_subject("part-1", answer.page_of(subject, subject.scenario), "")
        return PageDisplay(page.page_text([part]))
    parts, problems = report.subjects_of([subject], table)
    if problems:
        raise InvalidInputError("\n".join(problems))
    return PageDisplay(page.page_text(parts))


def _subject(shown: Any) -> Any:
    """Return what is drawn of something: a scenario, a result, or the folder of a sweep or a study."""
    subject = SUBJECTS[type(shown)].of(shown) if type(shown) in SUBJECTS else shown
    if subject is None:
        raise InvalidInputError("this comparison is of a table; nothing to draw")
    return subject if isinstance(subject, Result | Scenario | UnstoredResult) else run_folder.folder_of(subject)


def _stored(run: Result) -> Callable[[], run_folder.StoredRun]:
    return lambda: run_folder.StoredRun(
        run.folder or Path(), run.model, run.frames, run.summary.events, "", lambda: run.probes
    )


def _draw_result(run: Result, options: pictures.PlotOptions) -> None:
    """Draw a run, by default its end."""
    options = replace(options, kind=options.kind or FINAL)
    if options.kind == MOTION:
        pictures.draw_motion(lambda: run.scenario, options)
    else:
        pictures.draw_run(_stored(run), options)


def _draw_scenario(scenario: Scenario, options: pictures.PlotOptions) -> None:
    """Draw the motion of the supports, or everything as it is placed."""
    if options.kind == MOTION:
        pictures.draw_motion(lambda: scenario, options)
        return
    if options.kind not in {None, FINAL}:
        raise InvalidInputError(f"{options.kind}: a scenario is drawn as {FINAL} or {MOTION}; run it for others")
    model = Model(scenario)
    systems = (block_system(model.bodies), *others_of(model))
    states = tuple(np.stack([one.elements.start] * len(SIZES)) for one in systems)
    frames = frames_from_rows(systems, 0.0, FrameRows(np.arange(len(SIZES)), states, SIZES, ()))
    start = run_folder.StoredRun(Path(), model, frames, (), "", dict)
    pictures.draw_run(lambda: start, replace(options, kind=FINAL, times=(0.0,)))


DRAWN: dict[type, Callable[[Any, pictures.PlotOptions], object]] = {
    Scenario: _draw_scenario,
    Result: _draw_result,
    UnstoredResult: answer.draw_result,
    Path: pictures.draw,
}

"""Options of commands: those that several share, and how typer gets them from the options of the library."""

import inspect
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from types import NoneType, UnionType
from typing import TYPE_CHECKING, Annotated, Any, Literal, NoReturn, Union, get_args, get_origin

import typer

from blocksim.cli import completion
from blocksim.cli.output import answer, note, print_json
from blocksim.errors import ExitCode
from blocksim.options import Option, OptionField, has_options, option_field, option_fields

if TYPE_CHECKING:
    from blocksim.view.layout import Paper

SIZE = re.compile(r"([0-9]+(?:\.[0-9]*)?)\s*[x×]\s*([0-9]+(?:\.[0-9]*)?)\s*(mm|cm|in|px)?")
INCHES = {"mm": 1.0 / 25.4, "cm": 1.0 / 2.54, "in": 1.0}
LEAST_SIDE, MOST_SIDE = 20.0 / 25.4 - 1e-9, 2000.0 / 25.4 + 1e-9  # inches
SPARE_PIXEL = 0.25  # so that no round-off removes a whole one
MOST_PIXELS = 1e8
MOST_SHOWN = 40  # letters of a value in a message


def seconds_of(text: object) -> float:
    """Return a time in s, written with its unit. Raises BadParameter, a mistake of usage."""
    from pydantic_core import PydanticCustomError

    from blocksim.scenario.quantities import TIME, Quantity

    try:
        return Quantity(TIME, above=0.0).read(text)
    except PydanticCustomError as error:
        raise typer.BadParameter(error.message()) from None


@dataclass(frozen=True)
class PageSize:
    """Picture size as the user gave it: width and height in a unit."""

    width: float
    height: float
    unit: str

    def inches(self, dots: float) -> tuple[float, float]:
        """Return width and height in inches; pixels are those of a PNG with so many dots per inch."""
        if self.unit == "px":
            return (self.width + SPARE_PIXEL) / dots, (self.height + SPARE_PIXEL) / dots
        return self.width * INCHES[self.unit], self.height * INCHES[self.unit]


def page_size(text: object) -> PageSize:
    """Return a size of pictures, WxH with mm, cm, in or px. Raises BadParameter, a mistake of usage."""
    found = SIZE.fullmatch(str(text).strip())
    if found is None:
        raise typer.BadParameter(
            f"{str(text)[:MOST_SHOWN]!r} is not a picture size; write it as in 180x120mm or 1600x900px"
        )
    size = PageSize(float(found[1]), float(found[2]), found[3] or "mm")
    if not all(LEAST_SIDE <= side <= MOST_SIDE for side in size.inches(150.0)):
        raise typer.BadParameter("each side of a picture must be 20 to 2000 mm (about 120 to 12 000 px)")
    return size


def paper_of(size: PageSize | None, dots: float | None) -> "Paper":
    """Return the page for --size and --dpi. Raises BadParameter for more than MOST_PIXELS."""
    from blocksim.view.layout import Paper
    from blocksim.view.style import DOTS_PER_INCH

    resolution = dots or float(DOTS_PER_INCH)
    inches = None if size is None else size.inches(resolution)
    if inches is not None and inches[0] * inches[1] * resolution**2 > MOST_PIXELS:
        raise typer.BadParameter(f"--size and --dpi make more than {MOST_PIXELS / 1e6:.0f} million pixels")
    return Paper(inches, dots)


def colour_name(text: object) -> str:
    """Return a way to colour blocks. Raises BadParameter for an unknown one."""
    from blocksim.view.paint import COLOURS

    if text not in COLOURS:
        raise typer.BadParameter(f"{str(text)[:MOST_SHOWN]!r} is unknown; choose {', '.join(COLOURS)}")
    return str(text)


def names_of(option: str, text: str | None) -> tuple[str, ...] | None:
    """Return names separated by commas, None where none were given. Raises BadParameter for an empty list."""
    if text is None:
        return None
    names = tuple(name.strip() for name in text.split(",") if name.strip())
    if not names:
        raise typer.BadParameter("give one name or several, separated by commas", param_hint=option)
    return names


ScenarioPath = Annotated[Path, typer.Argument(metavar="SCENARIO", help="Scenario file (TOML).")]
StoredRunPath = Annotated[
    Path, typer.Argument(metavar="RUN", help="Run folder, results/NAME (its newest finished run) or scenario file.")
]
Forces = Annotated[bool, typer.Option("--forces", help="Draw contact forces, if the run has stored them.")]
Size = Annotated[
    PageSize | None,
    typer.Option(
        "--size", parser=page_size, metavar="WxH", help="Size of the picture: 180x120mm, 7x5in or 1600x900px."
    ),
]
Dots = Annotated[
    float | None,
    typer.Option("--dpi", min=20.0, max=1200.0, metavar="N", help="Dots per inch of a PNG (default: 150)."),
]
Colour = Annotated[
    str,
    typer.Option(
        "--colour",
        "--color",
        parser=colour_name,
        metavar="BY",
        autocompletion=completion.colours,
        help="Colour blocks by block, material, speed or turn; soil by displacement (default), speed, plastic or "
        "pressure.",
    ),
]


class Executor(StrEnum):
    """What runs the cases of a study."""

    ENSEMBLE = "ensemble"
    PROCESSES = "processes"
    DASK = "dask"


ExecutorName = Annotated[
    Executor | None,
    typer.Option(help="ensemble: in this process (default); processes: a case that crashes stops no other."),
]
Jobs = Annotated[int | None, typer.Option(min=1, metavar="N", help="Threads or processes (default: one per core).")]
Scheduler = Annotated[
    str | None, typer.Option(metavar="ADDRESS", help="Scheduler of a Dask cluster, such as tcp://host:8786.")
]
Settings = Annotated[
    list[str] | None,
    Option(
        "Set a scenario key, e.g. contact.stiffness_scale=0.01. Repeatable.",
        flags=("--set",),
        metavar="KEY=VALUE",
        complete="scenario_keys",
    ),
]
OutFolder = Annotated[
    Path | None, typer.Option("--out", metavar="DIR", help="Folder for the results (default: results/NAME/HASH).")
]
SweepFolder = Annotated[
    Path | None, typer.Option("--out", metavar="DIR", help="Folder for the results (default: results/NAME/sweep-HASH).")
]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Run again and replace the existing results.")]
Replace = Annotated[bool, typer.Option("--overwrite", help="Replace a file that blocksim did not write.")]
Resume = Annotated[bool, typer.Option("--resume", help="Resume a run that was stopped or killed.")]
CheckpointEvery = Annotated[
    float,
    typer.Option(
        "--checkpoint-every",
        parser=seconds_of,
        metavar="TIME",
        help="Wall time between checkpoints (default: 60 s).",
        show_default=False,
    ),
]
CheckpointSteps = Annotated[
    int | None, typer.Option("--checkpoint-steps", min=1, metavar="N", help="Steps between checkpoints.")
]
CheckpointTime = Annotated[
    float | None,
    typer.Option("--checkpoint-time", parser=seconds_of, metavar="TIME", help="Simulated time between checkpoints."),
]
WallTime = Annotated[
    float | None,
    typer.Option(
        "--wall-time",
        parser=seconds_of,
        metavar="TIME",
        help='Stop after this wall time, e.g. "90 min", as Ctrl-C does.',
    ),
]
Threads = Annotated[
    int,
    typer.Option(
        "--threads", min=1, metavar="N", help="Threads, for scenes of 200 blocks and more. Results are bit-identical."
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print the answer as JSON, for programs.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print only the answer.")]
ExperimentPath = Annotated[
    Path | None,
    typer.Option("--experiment", metavar="TABLE", help="Experiment table (CSV) instead of the scenario's own."),
]


@dataclass(frozen=True)
class Report:
    """What a command has to say at its end: its answer, as lines and as data, and notes before and after it."""

    lines: Iterable[str] = ()
    data: object = None
    notes: Iterable[str] = ()
    before: Iterable[str] = ()
    always: Iterable[str] = ()  # notes after the answer that --quiet does not silence
    code: int = ExitCode.SUCCESS


@dataclass(frozen=True)
class Screen:
    """Where a command prints, and how much."""

    as_json: Annotated[bool, Option("Print the answer as JSON, for programs.", flags=("--json",))] = False
    quiet: Annotated[bool, Option("Print only the answer.", flags=("--quiet", "-q"))] = False

    @property
    def silent(self) -> bool:
        """Whether there is nothing beside the answer."""
        return self.quiet or self.as_json

    def note(self, text: str) -> None:
        """Print a line beside the answer, unless that is all that is wanted."""
        if not self.silent:
            note(text)

    def print(self, report: Report) -> None:
        """Print a report."""
        for text in report.before:
            self.note(text)
        lines = [] if self.as_json else list(report.lines)
        if self.as_json:
            print_json(report.data)
        elif lines:
            answer("\n".join(lines))
        for text in report.always:
            note(text)
        for text in report.notes:
            self.note(text)

    def show(self, report: Report) -> NoReturn:
        """Print a report and leave with its exit code."""
        self.print(report)
        raise typer.Exit(report.code)


@dataclass(frozen=True)
class TextScreen(Screen):
    """Where a command without JSON prints."""

    as_json: bool = False


def expanded(function: Callable[..., Report | None]) -> Callable[..., None]:
    """Return a command as typer takes it: groups of options are single ones, and its report is shown.

    A command that returns a report and has no parameter for the screen prints text, and has --quiet.
    """
    parameters: list[inspect.Parameter] = []
    groups: dict[str, Any] = {}
    own = inspect.signature(function, eval_str=True)
    for parameter in own.parameters.values():
        field = option_field(parameter.name, parameter.annotation, parameter.default)
        if has_options(field.kind):
            groups[field.name] = field.kind
            parameters += _parameters(field.kind)
        else:
            parameters.append(_parameter(field, field.option) if field.option else parameter)
    plain = own.return_annotation is Report and not any(issubclass(kind, Screen) for kind in groups.values())
    parameters += _parameters(TextScreen) if plain else ()

    def call(**values: Any) -> None:
        screen = _made(TextScreen, values) if plain else None
        made = {name: _made(kind, values) for name, kind in groups.items()}
        report = function(**made, **values)
        if report is not None:
            (screen or next(one for one in made.values() if isinstance(one, Screen))).show(report)

    call.__doc__ = function.__doc__
    by_name = [one.replace(kind=inspect.Parameter.KEYWORD_ONLY) for one in parameters]
    call.__signature__ = inspect.Signature(by_name)  # type: ignore[attr-defined]
    call.__annotations__ = {}
    return call


def _parameters(group: Any) -> Iterator[inspect.Parameter]:
    """Yield the options of a group as typer takes them."""
    for field in option_fields(group):
        if field.option is not None:
            yield _parameter(field, field.option)
        elif has_options(field.kind):
            yield from _parameters(field.kind)


def _parameter(field: OptionField, option: Option) -> inspect.Parameter:
    """Return an option as typer takes it."""
    name, kind, default, _ = field
    kinds = [one for one in get_args(kind) if one is not NoneType] if get_origin(kind) in {Union, UnionType} else [kind]
    typed: Any = Path if Path in kinds else str if option.read else kinds[0]
    typed = list[str] if option.is_repeatable else Literal[option.choices] if option.choices else typed
    is_plain = isinstance(default, bool | int | float | str | Path) or default is inspect.Parameter.empty
    default = (not default if option.is_negated else default) if is_plain else None
    more: dict[str, Any] = {"help": option.help, "metavar": option.metavar, "show_default": option.show_default}
    more |= {"min": option.least, "max": option.most}
    more["autocompletion"] = getattr(completion, option.complete) if option.complete else None
    if option.read and not option.is_repeatable:
        more["parser"] = _parser(option.read)
    flags = option.flags or (f"--{name.replace('_', '-')}",)
    default = ... if default is inspect.Parameter.empty else default
    info = typer.Argument(default, **more) if option.is_argument else typer.Option(default, *flags, **more)
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=info, annotation=typed)


def _parser(read: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Return a reader for typer, which also asks it for defaults."""

    def parse(text: Any) -> Any:
        try:
            return read(text) if isinstance(text, str) else text
        except ValueError as error:
            raise typer.BadParameter(str(error)) from None

    return parse


def _made(group: Any, values: dict[str, Any]) -> Any:
    """Take the values of a group out of those of all options. Raises BadParameter, and what reading them raises."""
    given: dict[str, Any] = {}
    for name, kind, default, option in option_fields(group):
        if option is not None:
            value = values.pop(name)
            if option.is_repeatable and option.read:
                value = option.read(value or [])
            if value is not None or default is inspect.Parameter.empty:
                given[name] = not value if option.is_negated else value
        elif has_options(kind):
            given[name] = _made(kind, values)
    try:
        return group(**given)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from None

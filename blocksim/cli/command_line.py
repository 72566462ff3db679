"""Options of commands: those that several share, how typer gets them from those of the library, and their completion.

What the shell completes after TAB are kinds, keys of the scenario on the line, names of cases and templates. Completion
must never fail or print: it offers nothing where something cannot be read. Nor may it offer what a shell could take for
more than a word: zsh evaluates it at TAB, and bash runs it at Enter. A scenario may be a stranger's.
"""

import inspect
import re
import textwrap
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from importlib import import_module
from pathlib import Path
from types import NoneType, UnionType
from typing import TYPE_CHECKING, Annotated, Any, Literal, NoReturn, Union, get_args, get_origin

import typer

from blocksim.cli.output import answer, note, print_json, table_lines, width_of_screen
from blocksim.errors import ExitCode
from blocksim.options import Option, OptionField, has_options, option_field, option_fields

if TYPE_CHECKING:
    from blocksim.study.answer import Answer


Settings = Annotated[
    list[str] | None,
    Option(
        "Set a scenario key, e.g. contact.stiffness_scale=0.01. Repeatable.",
        flags=("--set",),
        metavar="KEY=VALUE",
        complete="scenario_keys",
    ),
]
Json = Annotated[bool, Option("Print the answer as JSON, for programs.", flags=("--json",))]
Quiet = Annotated[bool, Option("Print only the answer.", flags=("--quiet", "-q"))]


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

    as_json: Json = False
    quiet: Quiet = False

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


def report_of(answers: "Sequence[Answer]", data: object) -> Report:
    """Return what studies have come to: a table of each with its title and lines below it; their notes."""
    overviews = [one.overview() for one in answers]
    texts = []
    for one in overviews:
        table = table_lines(one.heads, one.texts(), left=one.left)
        below = ["", *one.lines] if one.lines else []
        texts.append("\n".join([*textwrap.wrap(one.title, width_of_screen()), "", *table, *below]))
    notes = dict.fromkeys(text for one in overviews for text in one.notes)
    return Report(["\n\n".join(texts)], data, notes, code=max(one.code for one in overviews))


def _allow_outside(context: typer.Context, asked: bool) -> None:
    from blocksim.scenario.input_files import file_access

    if asked:
        context.with_resource(file_access(anywhere=True))


ALLOW_OUTSIDE = typer.Option(
    False,
    "--allow-outside",
    callback=_allow_outside,
    expose_value=False,
    help="Allow tables outside the scenario's folder and the current one.",
)


def as_typer_command(function: Callable[..., Report | None], *, reads_scenarios: bool = False) -> Callable[..., None]:
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
    if reads_scenarios:  # directly or with results
        outside = inspect.Parameter("outside", inspect.Parameter.KEYWORD_ONLY, default=ALLOW_OUTSIDE, annotation=bool)
        parameters.append(outside)

    def call(**values: Any) -> None:
        screen = _made(TextScreen, values) if plain else None
        made = {name: _made(kind, values) for name, kind in groups.items()}
        values.pop("outside", None)
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
    typed: Any = Path if Path in kinds else str if option.read or option.is_repeatable else kinds[0]
    if option.is_repeatable:  # typer has lists of enumerations, but not of literals
        typed = list[StrEnum(name, {one: one for one in option.choices}) if option.choices else typed]  # type: ignore[misc]
    elif option.choices:
        typed = Literal[option.choices]
    is_plain = isinstance(default, bool | int | float | str | Path) and not option.is_repeatable
    if default is not inspect.Parameter.empty:
        default = (not default if option.is_negated else default) if is_plain else None
    more: dict[str, Any] = {"help": option.help, "metavar": option.metavar, "show_default": option.show_default}
    more |= {"min": option.least, "max": option.most}
    more["autocompletion"] = COMPLETIONS[option.complete] if option.complete else None
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
            if option.is_repeatable:
                value = option.read(value or []) if option.read else value and list(map(str, value))
            if value is not None or default is inspect.Parameter.empty:
                given[name] = not value if option.is_negated else value
        elif has_options(kind):
            given[name] = _made(kind, values)
    try:
        return group(**given)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from None


WORD = re.compile(r"[A-Za-z0-9._-]+")
Complete = Callable[[Any, str], list[str]]


def completion_of(names: Callable[[], Iterable[str]]) -> Complete:
    """Return a completion of some names that no shell takes for more, which are computed only when TAB is pressed."""

    def complete(ctx: Any, incomplete: str) -> list[str]:  # noqa: ARG001 - typer passes both by name
        return [name for name in names() if name.startswith(incomplete) and WORD.fullmatch(name)]

    return complete


def _kinds() -> list[str]:
    from blocksim.view.kinds import MOTION, OF_RECORDS, RUN_KINDS, SWEEP_KINDS

    return [*RUN_KINDS, MOTION, *OF_RECORDS, *SWEEP_KINDS, "tornado"]


def _cases() -> list[str]:
    from blocksim.verification.cases import CASES
    from blocksim.verification.soil import SOIL_CASES

    return [case.id for case in (*CASES, *SOIL_CASES)]


def _scenario_keys(ctx: Any, incomplete: str) -> list[str]:
    """Return the dotted keys of the scenario on the line, each with its equals sign; of lists of tables by number."""
    words = map(str, (ctx.params.get("scenario"), *ctx.args))  # after an option without value all words are args
    place = next((word for word in words if word.endswith(".toml")), None)
    if place is None:
        return []
    from blocksim.scenario import load_scenario, scenario_to_toml
    from blocksim.scenario.overrides import format_key

    def paths(entry: object, path: tuple[str | int, ...] = ()) -> Iterator[tuple[str | int, ...]]:
        if isinstance(entry, list) and entry and isinstance(entry[0], Mapping):
            entry = dict(enumerate(entry))
        if isinstance(entry, Mapping):
            for key, value in entry.items():
                yield from paths(value, (*path, key))
        else:
            yield path

    with suppress(Exception):
        keys = map(format_key, paths(tomllib.loads(scenario_to_toml(load_scenario(Path(place))))))
        return [f"{key}=" for key in completion_of(lambda: dict.fromkeys(keys))(ctx, incomplete)]
    return []


COMPLETIONS = {
    "kinds": completion_of(_kinds),
    "colours": completion_of(lambda: import_module("blocksim.view.paints").COLOURS),
    "cases": completion_of(_cases),
    "templates": completion_of(lambda: import_module("blocksim.cli.new").templates()),
    "scenario_keys": _scenario_keys,
}

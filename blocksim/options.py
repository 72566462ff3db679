"""Options that a library function and its command share: one frozen dataclass each, which is the only list of them.

How to write them, as in `study/sweep.py`:

* A field is `name: Annotated[type, Option("help", ...)] = default`; aliases of such types serve several dataclasses. A
  field without `Option`, such as a function that is called with news, is for Python alone. A field that is itself such
  a dataclass stands for all of its fields on the command line.
* `class SweepOptions(Execution)` also has executor, jobs and scheduler. Fields before `_: KW_ONLY` may be given by
  position, as in `sweep(scenario, {"gravity": [9.7, 9.8]})`.
* `@takes(SweepOptions)` above `def sweep(scenario, options: SweepOptions)` lets callers give `SweepOptions(...)` or the
  same names as arguments. Signature and docstring list all of them, and type checkers know them.
* A parameter `options: SweepOptions` of a command (`cli/command_line.py`) becomes its options: own fields, then
  inherited ones. `Option` says what differs there: flags, choices, a reader of the text. `replace(options,
  on_row=...)` adds the rest.
"""

import inspect
import textwrap
from collections.abc import Callable, Iterator
from dataclasses import MISSING, dataclass, fields, is_dataclass
from typing import (
    Annotated,
    Any,
    NamedTuple,
    ParamSpec,
    Protocol,
    TypeVar,
    get_args,
    get_origin,
    get_type_hints,
    overload,
)

WIDTH = 100  # columns of the options in a docstring

P = ParamSpec("P")
Subject = TypeVar("Subject")
Options = TypeVar("Options")
Answer = TypeVar("Answer")
Subject_contra = TypeVar("Subject_contra", contravariant=True)
Options_contra = TypeVar("Options_contra", contravariant=True)
Answer_co = TypeVar("Answer_co", covariant=True)


@dataclass(frozen=True)
class Option:
    """What an option means, and how it is written on the command line."""

    help: str
    flags: tuple[str, ...] = ()  # default: --name-of-the-field
    metavar: str | None = None
    python: str = ""  # the help for Python, where values are written otherwise
    read: Callable[[Any], Any] | None = None  # from its text; ValueError is a mistake of usage
    is_repeatable: bool = False  # a list of texts, which `read` takes as a whole
    is_negated: bool = False  # the flag makes it False
    choices: tuple[str, ...] = ()
    complete: str = ""  # what the shell completes, a name in cli/command_line.py
    least: float | None = None
    most: float | None = None
    show_default: bool = True
    is_argument: bool = False  # by its place, without a flag


Overwrite = Annotated[bool, Option("Run again and replace the existing results.")]
Replace = Annotated[bool, Option("Replace a file that blocksim did not write.")]


class _Silent:
    """The default of everything that is called with news of a run or a study: nothing happens."""

    def __call__(self, *news: object) -> None:
        """Do nothing."""

    def __repr__(self) -> str:
        """Return the name by which signatures in `help` show it."""
        return "silent"


silent = _Silent()


class OptionField(NamedTuple):
    """A field of a dataclass of options; `kind` is its type, without what says that it is an option."""

    name: str
    kind: Any
    default: Any  # `inspect.Parameter.empty` where there is none
    option: Option | None


def option_fields(options: Any) -> Iterator[OptionField]:
    """Yield the fields of a dataclass, its own before those that it inherits."""
    hints = get_type_hints(options, include_extras=True)
    known = {field.name: field for field in fields(options)}
    names = dict.fromkeys(name for kind in options.__mro__ for name in inspect.get_annotations(kind))
    for name in names:
        if name in known:
            default, factory = known[name].default, known[name].default_factory
            made = inspect.Parameter.empty if factory is MISSING else factory()
            yield option_field(name, hints[name], made if default is MISSING else default)


def option_field(name: str, annotation: Any, default: Any) -> OptionField:
    """Return a field of this annotation, which may say that it is an option."""
    kind, *notes = get_args(annotation) if get_origin(annotation) is Annotated else (annotation,)
    return OptionField(name, kind, default, next((note for note in notes if isinstance(note, Option)), None))


def has_options(kind: object) -> bool:
    """Return True for a dataclass that has options."""
    return is_dataclass(kind) and any(field.option or has_options(field.kind) for field in option_fields(kind))


class TakesOptions(Protocol[Subject_contra, P, Options_contra, Answer_co]):
    """A function of a subject, such as a scenario, and its options: as an object, or one by one."""

    @overload
    def __call__(self, subject: Subject_contra, options: Options_contra, /) -> Answer_co: ...

    @overload
    def __call__(self, subject: Subject_contra, /, *args: P.args, **kwargs: P.kwargs) -> Answer_co: ...


def takes(
    options: Callable[P, Options],
) -> Callable[[Callable[[Subject, Options], Answer]], TakesOptions[Subject, P, Options, Answer]]:
    """Let a function of a subject and a dataclass of options be called with these options as arguments."""

    def decorate(function: Callable[[Subject, Options], Answer]) -> Any:
        own = inspect.signature(function, eval_str=True)
        subject = next(iter(own.parameters.values()))
        hints = get_type_hints(options)
        parameters = [
            one.replace(annotation=hints[name]) for name, one in inspect.signature(options).parameters.items()
        ]
        signature = own.replace(parameters=[subject, *parameters])

        def call(*arguments: Any, **keywords: Any) -> Answer:
            if not keywords and len(arguments) == 2 and isinstance(arguments[1], options):  # type: ignore[arg-type]
                return function(*arguments)
            given = signature.bind(*arguments, **keywords).arguments
            return function(given.pop(subject.name), options(**given))  # type: ignore[call-arg]

        for name in ("__module__", "__name__", "__qualname__"):
            setattr(call, name, getattr(function, name))
        name = getattr(options, "__name__", "")
        lines = [inspect.cleandoc(function.__doc__ or ""), "", f"All of these at once: {name}(...).", "Options:"]
        for field in option_fields(options):
            if field.option is not None:
                text = f"{field.name}: {field.option.python or field.option.help}"
                lines += textwrap.wrap(text, WIDTH, initial_indent="    ", subsequent_indent="        ")
        call.__doc__ = "\n".join(lines)
        call.__signature__ = signature  # type: ignore[attr-defined]
        return call

    return decorate

"""The command `blocksim`: its subcommands, each imported when it is called, and errors as messages and exit codes."""

import errno
import re
import sys
import tempfile
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from blocksim import __version__
from blocksim.cli import output
from blocksim.cli.app import cleanup_state, pause_collector
from blocksim.errors import BlocksimError, ExitCode, InputMissingError

PATH_TROUBLE = {errno.ENAMETOOLONG, errno.ELOOP, errno.ENOTDIR, errno.EACCES}
DISK_TROUBLE = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EROFS}

MEMORY = "memory; close other programs, or raise the limit (ulimit -v)"
FILES = "file handles; raise the limit (ulimit -n)"
THREADS = "threads or processes; use fewer (--threads, --jobs), or raise the limit (ulimit -u, ulimit -v)"
SHORTAGES = (
    (MEMORY, {errno.ENOMEM}, ("Cannot allocate memory", "failed to map segment", "nable to allocate")),
    (FILES, {errno.EMFILE, errno.ENFILE}, ("Too many open files",)),
    (THREADS, {errno.EAGAIN}, ("can't start new thread",)),
)

LONGEST_NAME = 200  # characters of a path that a message shows


@contextmanager
def errors_as_messages() -> Iterator[None]:
    """Report every error that a user can cause and leave with its exit code; flush the answer first."""
    try:
        yield
        sys.stdout.flush()
    except BlocksimError as error:
        output.note(str(error))
        raise typer.Exit(error.exit_code) from None
    except KeyboardInterrupt:
        output.note("stopped")
        raise typer.Exit(ExitCode.STOPPED_EARLY) from None
    except Exception as error:
        missing = _shortage(error)
        if missing:
            output.note(f"the system has run out of {missing}")
            raise typer.Exit(ExitCode.INPUT_OUTPUT) from None
        if not isinstance(error, OSError):
            raise
        raise typer.Exit(_tell_trouble(error)) from None


def _shortage(error: BaseException | None) -> str:
    """Return what the system ran out of, in words; nothing where that was not the cause of an error.

    Libraries wrap such an error in others, and the loader of shared libraries reports it as a text.
    """
    while error is not None:
        for words, numbers, texts in SHORTAGES:
            number = getattr(error, "errno", None)
            if number in numbers or any(text in str(error) for text in texts):
                return words
        if isinstance(error, MemoryError):
            return MEMORY
        error = error.__cause__ or error.__context__
    return ""


READER_GONE = 128 + 13  # of a shell for whatever a closed pipe ends (SIGPIPE)


def _tell_trouble(error: OSError) -> int:
    """Report an input or output error; raise it again where the user did not cause it."""
    if isinstance(error, BrokenPipeError):  # the reader of our answer has gone: nothing to report
        output.abandon(sys.stdout)
        return READER_GONE
    if error.errno in PATH_TROUBLE and error.filename is not None:
        name = "".join(c if c.isprintable() else "\ufffd" for c in str(error.filename))
        name = name if len(name) <= LONGEST_NAME else f"{name[:LONGEST_NAME]}…"
        output.note(f"{name}: cannot be reached: {error.strerror}")
        return ExitCode.INPUT_OUTPUT
    if error.errno not in DISK_TROUBLE:
        raise error
    output.note(f"{error.filename or 'the answer'}: cannot be written: {error.strerror}")
    output.abandon(sys.stdout)
    return ExitCode.INPUT_OUTPUT


def report_internal_error(error: Exception) -> None:
    """Print one line; the traceback goes to a file."""
    what = " ".join(f"{type(error).__name__}: {error}".split())
    try:
        with tempfile.NamedTemporaryFile("w", prefix="blocksim-error-", suffix=".txt", delete=False) as file:
            traceback.print_exception(error, file=file)
    except OSError:
        output.note(f"internal error: {what}; please report it (a file with the details could not be written)")
    else:
        output.note(f"internal error: {what}; please report it with the file {file.name}")


COMMANDS = {  # name: first line of its help; `verify-run` is verify_run_command, in verify_run.py unless in MODULES
    "run": "Simulate a scenario and print the final positions.",
    "compare": "Compare runs with measured repeats.",
    "check": "Validate a scenario and summarise it.",
    "sweep": "Run a scenario many times with some keys varied.",
    "limit": "Find the critical value of a parameter (collapse threshold).",
    "capacity": "Find peak force and softening under actuators.",
    "fragility": "Find the probability of collapse over an intensity.",
    "calibrate": "Fit inputs to measured repeats, within their priors.",
    "sensitivity": "Rank the inputs by their effect on final positions.",
    "converge": "Refine step, stiffness and spacing until the run-out converges.",
    "verify": "Run the verification cases and show the table.",
    "verify-run": "Run stored results again and check bitwise reproducibility.",
    "bench": "Measure speed and memory, and show the table.",
    "plot": "Draw a run, a sweep or a table of sensitivities.",
    "animate": "Render a run as an animation, GIF or MP4.",
    "export": "Write all frames as CSV or VTKHDF, or final outlines as GeoJSON or DXF.",
    "report": "Write runs and sweeps into one HTML file.",
    "new": "Write a commented scenario, sweep or table from a template.",
    "schema": "Print the JSON Schema of scenario files, for editors.",
}

MODULES = dict.fromkeys(("animate", "report", "export"), "plot")
MODULES |= {"schema": "new", "fragility": "limit", "bench": "verify"}
GROUPS = {  # heads of the list in `blocksim --help`
    "Run": ("new", "run", "schema"),
    "Look": ("plot", "animate", "report", "export"),
    "Study": ("sweep", "limit", "capacity", "fragility", "calibrate", "sensitivity", "converge"),
    "Check": ("check", "compare", "verify", "verify-run", "bench"),
}
WITH_SCENARIOS = set(COMMANDS) - {"verify", "verify-run", "bench", "new", "schema"}
"""Commands that read scenario files, directly or with results, and so have the option --allow-outside."""
UsageError: Any = typer.BadParameter.__mro__[1]
"""Mistake of usage; typer exports this class under no name."""
HELP = {"help_option_names": ["-h", "--help"]}


class CommandGroup(TyperGroup):
    """Group of all commands; it also turns errors into messages and exit codes."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:  # noqa: ARG002 - the signature is the base class's
        """Write the list of commands, by what they are for."""
        width = max(map(len, COMMANDS))
        for head, names in GROUPS.items():
            with formatter.section(head):
                formatter.write_dl([(name.ljust(width), COMMANDS[name]) for name in names])

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[Any, Any, list[str]]:
        """Import the command that the user named."""
        name, command, rest = super().resolve_command(ctx, args)
        try:
            Path.cwd()  # where it was removed, no path could be shown or written
        except OSError:
            raise InputMissingError("the current folder no longer exists; change to another one with cd") from None
        return name, load_command(name) if name in COMMANDS else command, rest

    def invoke(self, ctx: Any) -> Any:
        """Run the command."""
        with errors_as_messages(), cleanup_state(wanted=True):
            try:
                return super().invoke(ctx)
            except UsageError as error:
                match = re.fullmatch(r"Got unexpected extra argument\w*(?:\(s\))? \((\S+)\)", error.message)
                if match is not None:  # the shell may have taken a unit for an argument
                    from blocksim.scenario.units import unit_in

                    error.message += (
                        f'; quote a value that has a unit: "KEY=10 {match[1]}"' if unit_in(f"1 {match[1]}") else ""
                    )
                raise


def load_command(name: str) -> Any:
    """Return the command of a name, ready to be called."""
    with pause_collector(), cleanup_state(wanted=False):
        from blocksim.cli.command_line import as_typer_command

        plain = name.replace("-", "_")
        function = getattr(import_module(f"blocksim.cli.{MODULES.get(name, plain)}"), f"{plain}_command")
    alone = typer.Typer(add_completion=False, rich_markup_mode=None)
    ready = as_typer_command(function, reads_scenarios=name in WITH_SCENARIOS)
    alone.command(name, short_help=COMMANDS[name], context_settings=HELP)(ready)
    return typer.main.get_command(alone)


def _print_version(asked: bool) -> None:
    if asked:
        print(f"blocksim {__version__}")  # noqa: T201 - this is the answer
        raise typer.Exit


app = typer.Typer(
    cls=CommandGroup,
    name="blocksim",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings=HELP,
    help="Simulate collapses of rigid blocks and compare them with measurements.",
    epilog="Start with: blocksim new wall my_wall; blocksim run my_wall.toml",
)
for _name, _summary in COMMANDS.items():
    app.command(_name, help=_summary)(lambda: None)  # only listed: `CommandGroup` makes the command


@app.callback()
def common(
    _version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Take the options of the command itself."""

"""The command `blocksim`: its options, and the table of its subcommands, each imported only when it is called.

So `blocksim --help` need not wait for numba, pandas and HDF5, and `blocksim check` not for matplotlib.
"""

import re
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from blocksim import __version__
from blocksim.cli.failures import told
from blocksim.cli.process import clearing_up, loading
from blocksim.errors import InputMissingError

COMMANDS = {  # name: first line of its help; `verify-run` is verify_run_command, in verify_run.py unless in MODULES
    "run": "Simulate a scenario and print the final positions.",
    "compare": "Compare runs with measured repeats.",
    "check": "Validate a scenario and summarise it.",
    "sweep": "Run a scenario many times with some keys varied.",
    "limit": "Find the critical value of a parameter (collapse threshold).",
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

MODULES = {"animate": "plot", "report": "plot", "export": "plot", "schema": "new"}
GROUPS = {  # heads of the list in `blocksim --help`
    "Run": ("new", "run", "schema"),
    "Look": ("plot", "animate", "report", "export"),
    "Study": ("sweep", "limit", "fragility", "calibrate", "sensitivity", "converge"),
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
        _refuse_no_folder()
        return name, loaded(name) if name in COMMANDS else command, rest

    def invoke(self, ctx: Any) -> Any:
        """Run the command."""
        with told(), clearing_up(wanted=True):
            try:
                return super().invoke(ctx)
            except UsageError as error:
                error.message += _quoting_hint(error.message)
                raise


def _quoting_hint(message: str) -> str:
    """Return how to quote a value where the shell took its unit for an argument; empty otherwise."""
    found = re.fullmatch(r"Got unexpected extra argument\w*(?:\(s\))? \((\S+)\)", message)
    if found is None:
        return ""
    from blocksim.scenario.quantities import unit_in

    return f'; quote a value that has a unit: "KEY=10 {found[1]}"' if unit_in(f"1 {found[1]}") else ""


def _refuse_no_folder() -> None:
    """Raise InputMissingError where the current folder was removed: no path could be shown or written."""
    try:
        Path.cwd()
    except OSError:
        raise InputMissingError("the current folder no longer exists; change to another one with cd") from None


def function_of(name: str) -> Any:
    """Return the function of a command."""
    plain = name.replace("-", "_")
    return getattr(import_module(f"blocksim.cli.{MODULES.get(name, plain)}"), f"{plain}_command")


def loaded(name: str) -> Any:
    """Return the command of a name, ready to be called."""
    with loading(), clearing_up(wanted=False):
        from blocksim.cli.options import expanded

        function = function_of(name)
    alone = typer.Typer(add_completion=False, rich_markup_mode=None)
    ready = expanded(function, reads_scenarios=name in WITH_SCENARIOS)
    alone.command(name, short_help=COMMANDS[name], context_settings=HELP)(ready)
    return typer.main.get_command(alone)


def _listed() -> None:
    """Stand for a command in the list of all commands."""


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
    app.command(_name, help=_summary)(_listed)


@app.callback()
def common(
    _version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Take the options of the command itself."""

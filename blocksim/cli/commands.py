"""The table of all commands, and a group that imports a command only when it is called.

So `blocksim --help` need not wait for numba, pandas and HDF5, and `blocksim check` not for matplotlib.
"""

import re
from importlib import import_module
from pathlib import Path
from typing import Any

import typer
from typer.core import TyperGroup

from blocksim.cli.collector import loading
from blocksim.cli.failures import told
from blocksim.cli.interrupts import clearing_up
from blocksim.cli.outside import add_outside
from blocksim.errors import InputMissingError

COMMANDS = {  # name: module in this folder, function in it, first line of its help
    "run": ("run", "run_command", "Simulate a scenario and show where the blocks end."),
    "compare": ("compare", "compare_command", "Compare runs with measured repeats."),
    "check": ("check", "check_command", "Validate a scenario and summarise it."),
    "sweep": ("sweep", "sweep_command", "Run a scenario many times with some keys varied."),
    "calibrate": ("calibrate", "calibrate_command", "Fit inputs to measured repeats, within their priors."),
    "sensitivity": ("sensitivity", "sensitivity_command", "Show which inputs decide where the blocks end."),
    "converge": ("converge", "converge_command", "Refine step, stiffness and spacing until the run-out converges."),
    "verify": ("verify", "verify_command", "Run the verification cases and show the table."),
    "verify-run": ("verify_run", "verify_run_command", "Run stored results again and check bitwise reproducibility."),
    "bench": ("bench", "bench_command", "Measure speed and memory, and show the table."),
    "plot": ("plot", "plot_command", "Draw a run, a sweep or a table of sensitivities."),
    "animate": ("animate", "animate_command", "Show a run as an animation, GIF or MP4."),
    "export": ("export", "export_command", "Write all frames of a run as CSV or VTKHDF."),
    "report": ("report", "report_command", "Write runs and sweeps into one HTML file."),
    "new": ("new", "new_command", "Write a commented scenario, sweep or table from a template."),
    "schema": ("schema", "schema_command", "Print the JSON Schema of scenario files, for editors."),
}

GROUPS = {  # heads of the list in `blocksim --help`
    "Run": ("new", "run", "schema"),
    "Look": ("plot", "animate", "report", "export"),
    "Study": ("sweep", "calibrate", "sensitivity", "converge"),
    "Check": ("check", "compare", "verify", "verify-run", "bench"),
}
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
                formatter.write_dl([(name.ljust(width), COMMANDS[name][2]) for name in names])

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


def loaded(name: str) -> Any:
    """Return the command of a name, ready to be called."""
    module, function, summary = COMMANDS[name]
    with loading(), clearing_up(wanted=False):
        command = getattr(import_module(f"blocksim.cli.{module}"), function)
    alone = typer.Typer(add_completion=False, rich_markup_mode=None)
    alone.command(name, short_help=summary, context_settings=HELP)(command)
    return add_outside(name, typer.main.get_command(alone))


def _listed() -> None:
    """Stand for a command in the list of all commands."""


def add_commands(app: typer.Typer) -> None:
    """List all commands in an application whose group is a CommandGroup."""
    for name, (_, _, summary) in COMMANDS.items():
        app.command(name, help=summary)(_listed)

"""The command `blocksim`."""

import io
import sys
from typing import Annotated

import typer

from blocksim import __version__
from blocksim.cli.collector import leave_all
from blocksim.cli.commands import HELP, CommandGroup, add_commands
from blocksim.cli.failures import tell_internal_error
from blocksim.errors import ExitCode

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
add_commands(app)


def _print_version(asked: bool) -> None:
    if asked:
        print(f"blocksim {__version__}")  # noqa: T201 - this is the answer
        raise typer.Exit


@app.callback()
def common(
    _version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Take the options of the command itself."""


def main() -> None:
    """Run the command line; every error becomes a message and an exit code."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # a terminal without ± is no reason to fail
    try:
        app()
    except KeyboardInterrupt:
        sys.exit(ExitCode.STOPPED_EARLY)
    except Exception as error:  # noqa: BLE001 - the last line of defence
        tell_internal_error(error)
        sys.exit(ExitCode.INTERNAL)
    finally:
        leave_all()

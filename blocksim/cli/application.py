"""The command `blocksim` and its subcommands."""

from typing import Annotated

import typer

from blocksim import __version__
from blocksim.cli.commands import HELP, CommandGroup, add_commands

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

"""The command `blocksim`: its subcommands, and what happens when something goes wrong."""

import errno
import os
import sys
import tempfile
import traceback
from importlib import metadata
from typing import Annotated

import typer

from blocksim.cli.check import check_command
from blocksim.cli.comparison import compare_command
from blocksim.cli.output import note
from blocksim.cli.plot import plot_command
from blocksim.cli.run import run_command
from blocksim.cli.schema import schema_command
from blocksim.cli.sweep import sweep_command
from blocksim.errors import BlocksimError, ExitCode

app = typer.Typer(
    name="blocksim",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    help="Simulate collapses of rigid blocks and compare them with measurements.",
    epilog="First steps: blocksim run scenarios/three_blocks.toml, then blocksim compare scenarios/three_blocks.toml",
)
app.command("run")(run_command)
app.command("compare")(compare_command)
app.command("check")(check_command)
app.command("sweep")(sweep_command)
app.command("plot")(plot_command)
app.command("schema")(schema_command)


def _print_version(asked: bool) -> None:
    if asked:
        print(f"blocksim {metadata.version('blocksim')}")  # noqa: T201 - this is the answer
        raise typer.Exit


@app.callback()
def common(
    _version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Take the options of the command itself."""


def main() -> None:
    """Run the command line; every error a user can cause becomes a message and an exit code."""
    try:
        app()
    except BlocksimError as error:
        note(str(error))
        sys.exit(error.exit_code)
    except KeyboardInterrupt:
        note("stopped")
        sys.exit(ExitCode.STOPPED_EARLY)
    except BrokenPipeError:
        # whoever read our output has gone; do not fail again when Python flushes at its end
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(ExitCode.INPUT_OUTPUT)
    except OSError as error:
        note(f"{error.filename or 'input/output'}: {error.strerror or error}")
        sys.exit(ExitCode.INPUT_OUTPUT if error.errno in {errno.ENOSPC, errno.EIO, errno.EFBIG} else ExitCode.INTERNAL)
    except Exception as error:  # noqa: BLE001 - the last line of defence: one line on screen, the rest in a file
        note(f"internal error: {type(error).__name__}: {error}; please report it with {_keep_traceback()}")
        sys.exit(ExitCode.INTERNAL)


def _keep_traceback() -> str:
    with tempfile.NamedTemporaryFile("w", prefix="blocksim-error-", suffix=".txt", delete=False) as file:
        traceback.print_exc(file=file)
    return file.name

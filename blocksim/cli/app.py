"""What the command `blocksim` calls first: light, so that Ctrl-C is handled before anything heavy is imported."""

import gc
import io
import sys
import time
from importlib import import_module
from typing import TYPE_CHECKING, Any

from blocksim.cli.process import take_interrupts

if TYPE_CHECKING:
    from blocksim.cli.commands import app as app  # noqa: PLC0414 - found when first asked for, as in blocksim


def __getattr__(name: str) -> Any:
    if name != "app":
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return import_module("blocksim.cli.commands").app


def main() -> None:
    """Run the command line; every error becomes a message and an exit code."""
    began = time.monotonic()
    gc.set_threshold(50_000)  # what imports and pictures make by the thousand lives to the end
    take_interrupts()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # a terminal without ± is no reason to fail
    from blocksim.cli.commands import app, report_internal_error
    from blocksim.errors import ExitCode

    try:
        app(obj=began)
    except KeyboardInterrupt:
        sys.exit(ExitCode.STOPPED_EARLY)
    except Exception as error:  # noqa: BLE001 - the last line of defence
        report_internal_error(error)
        sys.exit(ExitCode.INTERNAL)
    finally:
        gc.freeze()  # nothing for the collector: the process ends, and its memory goes as a whole

"""What the command `blocksim` calls first, and its process: Ctrl-C where no run is in progress, the garbage collector.

It is light, so that Ctrl-C is handled before anything heavy is imported.

Ctrl-C may come while the program is loaded, while a command works, and while the process ends. Python would raise
KeyboardInterrupt wherever it happens to be, and print a traceback from where nobody catches it: in the middle of an
import, or of leaving, or in a function that the compiler or the collector calls, where it would also be lost.

Packages and compiled kernels come as 200 000 objects, none of which is garbage. The collector would look at all of them
again and again while they come in, and once more when the process ends: a fifth of the time of a short run.
"""

import atexit
import gc
import io
import os
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

STOPPED_EARLY = 75  # the exit code; its own module takes longer to import than all that is needed here, unprotected


AGAIN = 0.01  # s, after which Ctrl-C that was lost comes again: whoever lost it has gone on by then


class Interrupts:
    """Handler of Ctrl-C, SIGTERM and SIGHUP of the whole process.

    A part that can stop in a better way may replace it for a while.
    """

    gives_way = True
    has_to_clear_up = has_come = False  # while it begins to be loaded

    def __call__(self, _number: int, _frame: Any) -> None:
        """Take Ctrl-C."""
        if not self.has_to_clear_up:
            with suppress(OSError):
                os.write(2, b"stopped\n")
            os._exit(STOPPED_EARLY)
        self.has_to_clear_up, self.has_come = False, True
        raise KeyboardInterrupt

    def come_again(self, lost: Any) -> None:
        """Take Ctrl-C that was raised where nothing can be raised; report anything else as Python does."""
        if not issubclass(lost.exc_type, KeyboardInterrupt):
            sys.__unraisablehook__(lost)
            return
        import threading

        self.has_to_clear_up, self.has_come = self.has_come, False
        again = threading.Timer(AGAIN, os.kill, (os.getpid(), signal.SIGINT))
        again.daemon = True
        again.start()


@contextmanager
def cleanup_state(*, wanted: bool) -> Iterator[None]:
    """State for a while whether something has been started that must be cleared up.

    If not, as during an import, Ctrl-C ends the process; else the first one raises KeyboardInterrupt.
    """
    handler = signal.getsignal(signal.SIGINT)
    if not isinstance(handler, Interrupts):
        yield
        return
    before, handler.has_to_clear_up = handler.has_to_clear_up, wanted
    try:
        yield
    finally:
        handler.has_to_clear_up = before and not handler.has_come


@contextmanager
def pause_collector() -> Iterator[None]:
    """Keep the collector away while code is loaded, and from what has been loaded afterwards."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        if was_enabled:
            gc.enable()


def _distrust_current_folder() -> None:
    """Take no module from the current folder, here and in processes to be started: it may be a stranger's.

    An empty path means that folder: `python -c` has one, and so has a PYTHONPATH that ends with a colon. Modules that
    Python itself has imported by now still come from there.
    """
    named, unwanted = os.environ.get("PYTHONPATH", ""), {""}
    with suppress(OSError):  # the folder was removed
        here = os.path.realpath(os.curdir)
        if os.path.realpath(__file__).startswith(f"{here}{os.sep}blocksim{os.sep}"):  # this package is taken from there
            return
        paths = [one for one in named.split(os.pathsep) if one]
        if named and "" in named.split(os.pathsep) and here not in map(os.path.realpath, paths):
            unwanted.add(here)
            os.environ["PYTHONPATH"] = os.pathsep.join(paths)
    sys.path[:] = [one for one in sys.path if one not in unwanted]


def main() -> None:
    """Run the command line; every error becomes a message and an exit code."""
    began = time.monotonic()
    _distrust_current_folder()
    gc.set_threshold(200_000)  # what imports and pictures make by the thousand lives to the end
    with suppress(ValueError):  # not the main thread, which alone receives signals
        interrupts = Interrupts()
        for name in {"SIGTERM", "SIGHUP"} & set(signal.Signals.__members__):
            if signal.getsignal(signal.Signals[name]) is signal.SIG_DFL:
                signal.signal(signal.Signals[name], interrupts)
        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # neither taken nor ignored
            signal.signal(signal.SIGINT, interrupts)
            sys.unraisablehook = interrupts.come_again
            # Python's end would bring the system's handler back, and with it another exit code; what is ignored stays
            atexit.register(signal.signal, signal.SIGINT, signal.SIG_IGN)
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

"""What happens when something goes wrong: a message, an exit code, and never a traceback."""

import errno
import sys
import tempfile
import traceback
from collections.abc import Iterator
from contextlib import contextmanager

import typer

from blocksim.cli.output import abandon, note
from blocksim.errors import BlocksimError, ExitCode

PATH_TROUBLE = {errno.ENAMETOOLONG, errno.ELOOP, errno.ENOTDIR, errno.EACCES}
DISK_TROUBLE = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EROFS}

LONGEST_NAME = 200  # characters of a path that a message shows


@contextmanager
def told() -> Iterator[None]:
    """Tell every error a user can cause, and leave with its exit code; the answer is on its way by then."""
    try:
        yield
        sys.stdout.flush()
    except BlocksimError as error:
        note(str(error))
        raise typer.Exit(error.exit_code) from None
    except KeyboardInterrupt:
        note("stopped")
        raise typer.Exit(ExitCode.STOPPED_EARLY) from None
    except OSError as error:
        raise typer.Exit(_tell_trouble(error)) from None


def _tell_trouble(error: OSError) -> ExitCode:
    """Tell an input or output error; raises it again when a user has no part in it."""
    if isinstance(error, BrokenPipeError):  # whoever read our answer has gone: nothing to tell
        abandon(sys.stdout)
        return ExitCode.INPUT_OUTPUT
    if error.errno in PATH_TROUBLE and error.filename is not None:
        note(f"{_shortened(error.filename)}: cannot be reached: {error.strerror}")
        return ExitCode.INPUT_OUTPUT
    if error.errno not in DISK_TROUBLE:
        raise error
    note(f"{error.filename or 'the answer'}: cannot be written: {error.strerror}")
    abandon(sys.stdout)
    return ExitCode.INPUT_OUTPUT


def _shortened(name: object) -> str:
    """Return a name for a line of a message."""
    text = "".join(c if c.isprintable() else "\ufffd" for c in str(name))
    return text if len(text) <= LONGEST_NAME else f"{text[:LONGEST_NAME]}…"


def tell_internal_error(error: Exception) -> None:
    """Print one line; the traceback goes to a file."""
    what = " ".join(f"{type(error).__name__}: {error}".split())
    try:
        with tempfile.NamedTemporaryFile("w", prefix="blocksim-error-", suffix=".txt", delete=False) as file:
            traceback.print_exception(error, file=file)
    except OSError:
        note(f"internal error: {what}; please report it (there is no room for a file with the details)")
    else:
        note(f"internal error: {what}; please report it with the file {file.name}")

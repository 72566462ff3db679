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
def told() -> Iterator[None]:
    """Report every error that a user can cause and leave with its exit code; flush the answer first."""
    try:
        yield
        sys.stdout.flush()
    except BlocksimError as error:
        note(str(error))
        raise typer.Exit(error.exit_code) from None
    except KeyboardInterrupt:
        note("stopped")
        raise typer.Exit(ExitCode.STOPPED_EARLY) from None
    except Exception as error:
        missing = _shortage(error)
        if missing:
            note(f"the system has run out of {missing}")
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


def _tell_trouble(error: OSError) -> ExitCode:
    """Report an input or output error; raise it again where the user did not cause it."""
    if isinstance(error, BrokenPipeError):  # the reader of our answer has gone: nothing to report
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
        note(f"internal error: {what}; please report it (a file with the details could not be written)")
    else:
        note(f"internal error: {what}; please report it with the file {file.name}")

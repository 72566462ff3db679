"""That no more than one run at a time writes into a folder."""

import contextlib
import fcntl
import os
from collections.abc import Iterator
from pathlib import Path

from blocksim.errors import OutputExistsError
from blocksim.simulation.output_folder import make_folder


def takes_lock(handle: int) -> bool:
    """Take the lock of an open file or folder; False where another process has it.

    The lock goes with the process, however that ends. File systems that know no locks let everybody have it.
    """
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return True
    return True


@contextlib.contextmanager
def claimed(folder: Path) -> Iterator[None]:
    """Make a folder, where it is missing, and keep other runs out of it. Raises OutputExistsError where one has it."""
    make_folder(folder)
    try:
        handle = os.open(folder, os.O_RDONLY)
    except OSError as error:
        message = f"{folder}: cannot be opened: {error.strerror}"
        raise OutputExistsError(message) from error
    try:
        if not takes_lock(handle):
            message = f"{folder}: a run is in progress here; wait for it, or write elsewhere with --out DIR"
            raise OutputExistsError(message)
        yield
    finally:
        os.close(handle)

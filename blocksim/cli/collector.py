"""Python's garbage collector while a command starts and ends.

Packages and compiled kernels come as 200 000 objects, none of which is garbage. The collector would look at all of them
again and again while they come in, and once more when the process ends: a fifth of the time of a short run.
"""

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def loading() -> Iterator[None]:
    """Keep the collector away while code is loaded, and from what has been loaded afterwards."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        if was_enabled:
            gc.enable()


def leave_all() -> None:
    """Keep the collector from everything that there is: the process ends, and its memory goes as a whole."""
    gc.freeze()

"""Ctrl-C during a run: a flag that is looked at between two frames, so that no frame is cut in half."""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

SIGNALS = (signal.SIGINT, signal.SIGTERM)


@contextmanager
def stop_requests() -> Iterator[Callable[[], bool]]:
    """Give a function that tells whether the user has asked to stop.

    Only signals that would raise KeyboardInterrupt are taken over, and only in the main thread, where Python has them.
    """
    asked: list[int] = []
    taken = [number for number in SIGNALS if _raises_interrupt(number)]
    for number in taken:
        signal.signal(number, lambda number, _: asked.append(number))
    try:
        yield lambda: bool(asked)
    finally:
        for number in taken:
            signal.signal(number, signal.default_int_handler)


def _raises_interrupt(number: int) -> bool:
    in_main_thread = threading.current_thread() is threading.main_thread()
    return in_main_thread and signal.getsignal(number) is signal.default_int_handler

"""Ctrl-C, being terminated, a lost connection and limits of time: when a run or a sweep takes notice of them."""

import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from blocksim.errors import StoppedEarlyError

NAMES = ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGUSR1")  # the last: of batch systems ahead of their time limit
SIGNALS = tuple(signal.Signals[name] for name in NAMES if hasattr(signal, name))
FOR_ALL = tuple(number for number in SIGNALS if number != signal.SIGTERM)  # a terminal or batch system sends them so
DEFAULT = (signal.default_int_handler, signal.SIG_DFL)  # what is ignored, as under nohup, stays so


class StopRequests:
    """The signals that have come: checked between steps, so that no step is interrupted."""

    def __init__(self) -> None:
        """Know of none yet."""
        self.names: list[str] = []
        self.is_heard = False

    def __call__(self) -> bool:
        """Return True if the user has asked to stop."""
        return bool(self.names)

    def reason(self) -> str:
        """Return why to stop, in words, and nothing where nobody has asked; a further signal then stops at once."""
        self.is_heard = bool(self.names)
        return f"stopped by {self.names[0]}" if self.names else ""

    def hear(self, number: int, _: Any) -> None:
        """Note a signal. Raises KeyboardInterrupt for one that comes after an earlier one was heard."""
        self.names.append(signal.Signals(number).name)
        if self.is_heard:
            raise KeyboardInterrupt


@contextmanager
def stop_requests() -> Iterator[StopRequests]:
    """Give the requests to stop that come meanwhile."""
    requests = StopRequests()
    with _handling(SIGNALS, requests.hear):
        yield requests


class WallTime:
    """A limit of wall time (s), None for no limit, of which so much is over now."""

    def __init__(self, limit: float | None, over: float = 0.0) -> None:
        """Begin."""
        self.limit = limit
        self.began = time.monotonic() - over

    def reason(self) -> str:
        """Return why to stop, in words, and nothing before the limit."""
        if self.limit is None or time.monotonic() - self.began < self.limit:
            return ""
        return f"wall-time limit of {self.limit:g} s reached"

    def check(self) -> None:
        """Raise StoppedEarlyError after the limit, where a scene is being built."""
        if why := self.reason():
            raise StoppedEarlyError(f"{why} while the scene was built; nothing is kept of that")


@contextmanager
def interruptible() -> Iterator[None]:
    """Let all other signals to stop raise KeyboardInterrupt, as Ctrl-C does."""
    with _handling(tuple(set(SIGNALS) - {signal.SIGINT}), signal.default_int_handler):
        yield


@contextmanager
def _handling(numbers: tuple[signal.Signals, ...], handler: Callable[[int, Any], None]) -> Iterator[None]:
    """Handle signals that nobody else handles; only in the main thread, where Python has them."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.getsignal(number) for number in numbers}
    # Python's own handlers give way, and those that say so
    taken = [one for one in numbers if before[one] in DEFAULT or getattr(before[one], "gives_way", False)]
    for number in taken:
        signal.signal(number, handler)
    try:
        yield
    finally:
        for number in taken:
            signal.signal(number, before[number])

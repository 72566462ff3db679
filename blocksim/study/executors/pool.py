"""A pool of spawned processes that ends with whoever started it, at once when something goes wrong."""

import signal
import threading
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import active_children, get_context, parent_process, resource_tracker
from os import _exit

from blocksim.simulation.stopping import FOR_ALL


@contextmanager
def pool_of(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Give a pool that ends at once when something goes wrong here: what is cut off is run again next time."""
    others = set(active_children())
    _start_tracker()
    # spawned, not forked: threads of numerical libraries do not survive a fork
    pool = ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=_start_worker)
    try:
        yield pool
    except BaseException:
        for process in set(active_children()) - others:
            process.kill()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def _start_tracker() -> None:
    """Start the process in which Python counts semaphores so that it outlives what a terminal sends to all processes.

    It would be killed otherwise, and its successor complain. What is blocked while it starts is blocked in it for ever.
    """
    if not hasattr(signal, "pthread_sigmask"):
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, FOR_ALL)
    try:
        resource_tracker.ensure_running()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _start_worker() -> None:
    """Leave to the parent what a terminal sends to all processes, and end with it."""
    for number in FOR_ALL:
        signal.signal(number, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
    _exit(0)

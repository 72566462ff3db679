"""Many runs at once, each into a folder of its own, on a pool of processes."""

import signal
import threading
import time
from collections.abc import Generator, Iterator, Mapping
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from multiprocessing import active_children, get_context, parent_process
from os import _exit
from pathlib import Path

from blocksim.analysis.compare import compare_final
from blocksim.analysis.experiment import load_table
from blocksim.errors import BlocksimError
from blocksim.scenario import Scenario
from blocksim.simulation import Summary
from blocksim.simulation import folder as files
from blocksim.simulation.provenance import run_hash
from blocksim.simulation.summary import read_summary
from blocksim.simulation.table import Columns, read_table
from blocksim.study.single import FINISHED, run

INTERRUPTED = "interrupted"
Row = dict[str, object]


def run_all(tasks: Mapping[Path, Scenario], jobs: int) -> Generator[tuple[Path, Row], None, None]:
    """Run every scenario into its folder; yield folder and row as they end. Raises KeyboardInterrupt on Ctrl-C."""
    workers = min(jobs, len(tasks))
    if workers <= 1:
        yield from _run_here(tasks)
        return
    with _pool(workers) as pool:
        futures = {pool.submit(run_case, scenario, folder): folder for folder, scenario in tasks.items()}
        for future in as_completed(futures):
            yield futures[future], _outcome(future)


def _run_here(tasks: Mapping[Path, Scenario]) -> Iterator[tuple[Path, Row]]:
    for folder, scenario in tasks.items():
        row = run_case(scenario, folder)
        if row["status"] == INTERRUPTED:
            raise KeyboardInterrupt
        yield folder, row


@contextmanager
def _pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Give a pool that ends at once when something goes wrong here: what is cut off is run again next time."""
    others = set(active_children())
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


def _start_worker() -> None:
    """Leave Ctrl-C to the parent, and end with it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
    _exit(0)


def _outcome(future: Future[Row]) -> Row:
    try:
        return future.result()
    except BrokenProcessPool:
        reason = "a worker process has died (out of memory?); the same command runs this case again"
        return {"status": "failed", "reason": reason, "seconds": 0.0}


def run_case(scenario: Scenario, folder: Path) -> Row:
    """Run one case, unless it is there already, and return its row: status, seconds, final positions, verdict."""
    began = time.perf_counter()
    try:
        row = _known_row(scenario, folder)
        if row is None:
            result = run(scenario, out=folder, overwrite=True)
            row = _row(scenario, result.summary, result.columns)
    except BlocksimError as error:
        return {"status": "failed", "reason": str(error), "seconds": time.perf_counter() - began}
    except Exception as error:  # noqa: BLE001 - one broken case must not end the others
        reason = f"internal error: {type(error).__name__}: {error}"
        return {"status": "failed", "reason": reason, "seconds": time.perf_counter() - began}
    return row


def _known_row(scenario: Scenario, folder: Path) -> Row | None:
    """Return the row of a case that came to its end before, well or not; None where it has to be run."""
    with suppress(BlocksimError):
        summary = read_summary(folder / files.SUMMARY)
        ended = files.is_finished(folder) if summary.status == FINISHED else summary.status != INTERRUPTED
        if ended and summary.run == run_hash(scenario):
            return _row(scenario, summary, read_table(folder / files.FINAL))
    return None


def _row(scenario: Scenario, summary: Summary, final: Columns) -> Row:
    row: Row = {"status": summary.status, "reason": summary.reason, "seconds": summary.total_seconds}
    if scenario.experiment is not None and summary.status == FINISHED:
        row["inside"] = compare_final(final, load_table(scenario.experiment.table)).inside
    for block, x, rotation in zip(final["block"], final["x_mm"], final["rotation_deg"], strict=True):
        row[f"{block}.x_mm"] = x
        row[f"{block}.rotation_deg"] = rotation
    return row

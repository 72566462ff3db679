"""Runs that are kept, each in a folder of its own."""

from collections.abc import Generator, Iterator, Mapping
from concurrent.futures import Future, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from pathlib import Path

from blocksim.errors import BlocksimError, InputMissingError, InvalidInputError, OutputExistsError
from blocksim.scenario import Scenario, place_bodies
from blocksim.simulation import Result, Summary
from blocksim.simulation import folder as files
from blocksim.simulation.provenance import run_hash
from blocksim.simulation.summary import changed_results, read_summary
from blocksim.simulation.table import read_table
from blocksim.study.executors.pool import pool_of
from blocksim.study.rows import Course, Row, row_of, row_of_error
from blocksim.study.single import FINISHED, run

INTERRUPTED = "interrupted"


def run_all(tasks: Mapping[Path, Scenario], jobs: int) -> Generator[tuple[Path, Row], None, None]:
    """Run every scenario into its folder; yield folder and row as they end. Raises KeyboardInterrupt on Ctrl-C."""
    workers = min(jobs, len(tasks))
    if workers <= 1:
        yield from _run_here(tasks)
        return
    with pool_of(workers) as pool:
        futures = {pool.submit(run_case, scenario, folder): folder for folder, scenario in tasks.items()}
        for future in as_completed(futures):
            yield futures[future], _outcome(future)


def _run_here(tasks: Mapping[Path, Scenario]) -> Iterator[tuple[Path, Row]]:
    for folder, scenario in tasks.items():
        row = run_case(scenario, folder)
        if row["status"] == INTERRUPTED:
            raise KeyboardInterrupt
        yield folder, row


def _outcome(future: Future[Row]) -> Row:
    try:
        return future.result()
    except BrokenProcessPool:
        reason = "a worker process has died (out of memory?); rerun the command to repeat this case"
        return {"status": "failed", "reason": reason, "seconds": 0.0}


def run_case(scenario: Scenario, folder: Path) -> Row:
    """Run one case into its folder, or what is left of it, unless it is there already, and return its row."""
    try:
        row = _known_row(scenario, folder)
        if row is None:
            result = _run_on(scenario, folder)
            row = row_of(_course(result.summary), result.columns, place_bodies(scenario))
    except Exception as error:  # noqa: BLE001 - one broken case must not end the others
        return row_of_error(error)
    return row


def _run_on(scenario: Scenario, folder: Path) -> Result:
    """Run a case from where an interruption has left it; again, where that cannot be taken up, or there was none."""
    try:
        return run(scenario, out=folder, resume=True)
    except (InvalidInputError, InputMissingError, OutputExistsError):
        return run(scenario, out=folder, overwrite=True)


def _known_row(scenario: Scenario, folder: Path) -> Row | None:
    """Return the row of a case that came to its end before, well or not; None where it has to be run."""
    with suppress(BlocksimError):
        summary = read_summary(folder / files.SUMMARY)
        is_same = summary.run == run_hash(scenario)
        if is_same and _has_ended(folder, summary) and not changed_results(folder, summary):
            final = read_table(folder / files.FINAL)
            return row_of(_course(summary), final, place_bodies(scenario))
    return None


def _course(summary: Summary) -> Course:
    first = None if summary.movement is None else summary.movement.first_move
    return Course(summary.status, summary.reason, summary.simulated_time_s, first)


def _has_ended(folder: Path, summary: Summary) -> bool:
    return files.is_finished(folder) if summary.status == FINISHED else summary.status != INTERRUPTED

"""Cases in this process: advanced together in compiled code, on all cores (the default), or one by one into folders.

The next batch is made while the steps of one are under way. A batch has a thread of its own, so that a Ctrl-C is heard
at once, also where a single case takes minutes.
"""

import platform
import threading
import time
from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import nullcontext, suppress
from dataclasses import dataclass
from functools import partial
from itertools import chain, islice
from pathlib import Path
from queue import SimpleQueue

from blocksim.errors import BlocksimError, InputMissingError, InvalidInputError, OutputExistsError
from blocksim.scenario import Document, Model
from blocksim.simulation import MemberFailure, Summary, files, provenance, results, run_in_batches, trajectory
from blocksim.study.executors import Batch, BatchSize, RunSetting, Task, take
from blocksim.study.rows import FINISHED, Row, row_of, row_of_error
from blocksim.study.run import run

PATIENCE = 0.7  # s that a batch has to end once the user wants to stop
POLL = 0.05  # s
THREAD = "blocksim-batch"
BATCH = 64  # members run together: enough for all cores, few enough to report progress
INTERRUPTED = "interrupted"


def run_tasks(tasks: Iterator[Task], setting: RunSetting) -> Generator[Batch, None, None]:
    """Run batches one after the other."""
    size = BatchSize(2 * setting.jobs, least=setting.jobs)
    batch = take(tasks, size.count, setting.is_stopped)
    while batch and not setting.is_stopped():
        began, ended = time.monotonic(), SimpleQueue[Batch]()
        thread = threading.Thread(target=_run, args=(batch, setting, ended), name=THREAD, daemon=True)
        thread.start()
        following = take(tasks, size.count, setting.is_stopped)
        while thread.is_alive() and not setting.is_stopped():
            thread.join(POLL)
        thread.join(PATIENCE)
        if thread.is_alive():  # the user does not want to wait that long
            return
        size.adapt(len(batch), time.monotonic() - began)
        yield ended.get_nowait()
        batch = following


for_rounds = partial(nullcontext, run_tasks)


def _run(tasks: tuple[Task, ...], setting: RunSetting, ended: SimpleQueue[Batch]) -> None:
    began = time.perf_counter()
    rows = rows_of([task.model for task in tasks], setting.jobs, peaks=setting.peaks)
    ended.put(Batch(tasks, tuple(rows), time.perf_counter() - began, platform.node()))


def rows_of(models: Sequence[Model], threads: int, *, peaks: bool = False) -> list[Row]:
    """Return the row of every model; one that ends in an error of ours fails alone, found by halving."""
    if not models:
        return []
    try:
        return [
            row_of_error(end.error)
            if isinstance(end, MemberFailure)
            else row_of(end.outcome, end.seconds, end.observables, end.columns)
            for end in chain(*run_in_batches(models, threads=threads, peaks=peaks))
        ]
    except Exception as error:  # noqa: BLE001 - one broken case must not end the others
        if len(models) == 1:
            return [row_of_error(error)]
    middle = len(models) // 2
    return rows_of(models[:middle], threads, peaks=peaks) + rows_of(models[middle:], threads, peaks=peaks)


@dataclass(frozen=True)
class Member:
    """The end of one member: its final table, or the reason why it has none."""

    final: trajectory.Columns | None
    problem: str = ""


def run_members(document: Document, values: Iterable[Mapping[str, object]]) -> Iterator[Member]:
    """Yield where the scenario ends with each set of values (dotted key: value), in order.

    A member whose values do not go together, or whose run fails, has a problem instead of a final table; the others do
    not depend on it.
    """
    rest, base = iter(values), Model(document.without_sweep())
    while batch := list(islice(rest, BATCH)):
        built: list[Model | Member] = []
        for one in batch:
            try:
                built.append(base.varied(one))
            except BlocksimError as error:
                built.append(Member(None, str(error).splitlines()[0]))
        ends = chain(*run_in_batches([one for one in built if isinstance(one, Model)]))
        for member in built:
            if isinstance(member, Member):
                yield member
            elif isinstance(end := next(ends), MemberFailure) or end.outcome.status != "finished":
                yield Member(None, end.outcome.reason.splitlines()[0])
            else:
                yield Member(end.columns)


def run_case(model: Model, folder: Path) -> Row:
    """Run one case into its folder, or what is left of it, unless it is there already, and return its row."""
    try:
        with suppress(BlocksimError):
            summary = results.read_summary(folder / files.SUMMARY)
            # a case that failed has come to its end too
            has_ended = (folder / files.DONE).is_file() if summary.status == FINISHED else summary.status != INTERRUPTED
            if (
                has_ended
                and summary.run == provenance.run_hash(model)
                and not results.changed_files(folder, summary, results.RESULT_FILES)
            ):
                return _row_of(summary, trajectory.read_table(folder / files.FINAL))
        try:
            result = run(model, out=folder, resume=True)
        except (InvalidInputError, InputMissingError, OutputExistsError):  # it cannot be taken up, or there was none
            result = run(model, out=folder, overwrite=True)
        return _row_of(result.summary, result.columns)
    except Exception as error:  # noqa: BLE001 - one broken case must not end the others
        return row_of_error(error)


def _row_of(summary: Summary, final: trajectory.Columns) -> Row:
    moved = summary.movement
    return row_of(summary, summary.simulated_time_s, {} if moved is None else moved.row, final)


BatchResult = tuple[tuple[Row, ...], float, str]  # rows in the order of the models, wall time (s), machine


def run_batch(models: Sequence[Model], folders: Sequence[Path], code: str, *, peaks: bool = False) -> BatchResult:
    """Run models on one thread, into folders where these are given, by the same code as whoever asks.

    Raises InvalidInputError where it is another.
    """
    if code != (own := provenance.code_hash()):
        other, here = own[: provenance.HASH_DIGITS], code[: provenance.HASH_DIGITS]
        versions = f"has another version of blocksim (code {other}, here {here})"
        raise InvalidInputError(f"the worker on {platform.node()} {versions}; install the same one")
    began = time.perf_counter()
    rows: list[Row] = []
    for model, folder in zip(models, folders, strict=False):
        rows.append(run_case(model, folder))
        if rows[-1]["status"] == INTERRUPTED:  # somebody has ended this process: no end of the case
            raise KeyboardInterrupt
    rows = rows or rows_of(models, 1, peaks=peaks)
    return tuple(rows), time.perf_counter() - began, platform.node()

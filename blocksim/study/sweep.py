"""Many runs of one scenario with some keys varied, on a pool of processes, with one row a case in sweep.csv.

Every case lies in a folder named by the hash of its run, so a sweep that is called again does only what is missing.
"""

import hashlib
import json
import os
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import dataclass, field
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import pandas as pd

from blocksim.errors import BlocksimError, ExitCode, InvalidInputError, OutputExistsError
from blocksim.scenario import Document, Scenario
from blocksim.simulation import folder as files
from blocksim.simulation.atomic import write_text
from blocksim.simulation.compilation import compile_kernels
from blocksim.study.cases import Case, build_case, combinations
from blocksim.study.single import compare, run

TABLE = "sweep.csv"
PLAN = "sweep.json"
CASES = "cases"
WRITE_SECONDS = 1.0
FINISHED = "finished"
Row = dict[str, object]


@dataclass
class SweepResult:
    """The folder of a sweep and its table, a row a case; `share_inside` is None without an experiment."""

    folder: Path
    table: pd.DataFrame = field(repr=False)

    @property
    def failed(self) -> int:
        """How many cases did not finish."""
        return int((self.table["status"] != FINISHED).sum())

    @property
    def share_inside(self) -> float | None:
        """Share of all cases that lie inside all measured ranges."""
        if "inside" not in self.table or self.table["inside"].isna().all():
            return None
        return float((self.table["inside"] == True).mean())  # noqa: E712 - the column has True, False and missing values


def sweep(
    scenario: Path | str | Document,
    vary: Mapping[str, Iterable[object]] | None = None,
    *,
    mode: str | None = None,
    out: Path | str | None = None,
    jobs: int | None = None,
    overwrite: bool = False,
    on_row: Callable[[int, int, Row], None] = lambda *_: None,
) -> SweepResult:
    """Run every case of a sweep; `vary` and `mode` replace what the scenario's [sweep] table says.

    Cases that fail get a row with their status; the others go on. Raises ScenarioError for a bad scenario,
    InvalidInputError where nothing is varied, OutputExistsError where the folder is not free.
    """
    document = scenario if isinstance(scenario, Document) else Document.read(scenario)
    base = document.build()
    chosen, how = _what_varies(base, vary, mode)
    cases = [build_case(document, i, values) for i, values in enumerate(combinations(chosen, how))]
    folder = Path(out) if out is not None else files.RESULTS / base.name / f"sweep-{_sweep_hash(cases)}"
    _prepare(folder, chosen, how)
    rows = _Rows(folder / TABLE, cases, on_row)
    compile_kernels()
    for number, row in _run_cases(cases, folder / CASES, jobs or os.cpu_count() or 1, overwrite=overwrite):
        rows.add(number, row)
    return SweepResult(folder, rows.write())


def _what_varies(
    base: Scenario, vary: Mapping[str, Iterable[object]] | None, mode: str | None
) -> tuple[dict[str, tuple[object, ...]], str]:
    if vary:
        chosen = {key: tuple(values) for key, values in vary.items()}
    elif base.sweep is not None:
        chosen = dict(base.sweep.vary)
    else:
        message = "nothing to vary: give --vary KEY=VALUES, or a [sweep] table in the scenario"
        raise InvalidInputError(message)
    how = mode or (base.sweep.mode if base.sweep is not None and not vary else "grid")
    counts = {len(values) for values in chosen.values()}
    if how == "list" and len(counts) > 1:
        message = "mode list takes one value of every key at a time; the keys have different numbers of values"
        raise InvalidInputError(message)
    return chosen, how


def _sweep_hash(cases: list[Case]) -> str:
    names = " ".join(case.name for case in cases)
    return hashlib.sha256(names.encode()).hexdigest()[:12]


def _prepare(folder: Path, vary: Mapping[str, tuple[object, ...]], mode: str) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        present = {path.name for path in folder.iterdir()}
    except OSError as error:
        message = f"{folder}: cannot be created: {error.strerror}"
        raise OutputExistsError(message) from error
    if present and PLAN not in present:
        message = f"{folder}: holds files that are not a sweep; choose another folder with --out"
        raise OutputExistsError(message)
    write_text(
        folder / PLAN, json.dumps({"mode": mode, "vary": {k: list(v) for k, v in vary.items()}}, indent=2) + "\n"
    )


def _run_cases(cases: list[Case], folder: Path, jobs: int, *, overwrite: bool) -> Iterator[tuple[int, Row]]:
    """Yield number and row of every case as it ends; few cases are handed out at a time."""
    runnable: list[tuple[Case, Scenario]] = []
    for case in cases:
        if case.scenario is None:
            yield case.number, {"status": "invalid", "reason": case.problem, "seconds": 0.0}
        else:
            runnable.append((case, case.scenario))
    workers = min(jobs, len(runnable))
    if workers <= 1:
        yield from ((case.number, run_case(scenario, folder / case.name, overwrite)) for case, scenario in runnable)
        return
    # spawned, not forked: threads of numerical libraries do not survive a fork
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        waiting = iter(runnable)
        running: dict[Future[Row], int] = {}
        while True:
            for case, scenario in waiting:
                future = pool.submit(run_case, scenario, folder / case.name, overwrite)
                running[future] = case.number
                if len(running) >= 2 * workers:
                    break
            if not running:
                return
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                yield running.pop(future), future.result()


def run_case(scenario: Scenario, folder: Path, overwrite: bool) -> Row:  # noqa: FBT001 - called through a pool
    """Run one case into its folder and return its row: status, seconds, final positions, verdict."""
    began = time.perf_counter()
    try:
        unfinished = folder.is_dir() and not files.is_finished(folder)
        result = run(scenario, out=folder, overwrite=overwrite or unfinished)
    except BlocksimError as error:
        return {"status": "failed", "reason": str(error), "seconds": time.perf_counter() - began}
    row: Row = {"status": result.status, "reason": result.reason, "seconds": time.perf_counter() - began}
    if result.experiment is not None and result.status == FINISHED:
        row["inside"] = compare(result).inside
    for block in result.final.itertuples():
        row[f"{block.block}.x_mm"] = block.x_mm
        row[f"{block.block}.rotation_deg"] = block.rotation_deg
    return row


class _Rows:
    """The rows so far, written to sweep.csv every now and then and at the end."""

    def __init__(self, path: Path, cases: list[Case], on_row: Callable[[int, int, Row], None]) -> None:
        self.path = path
        self.heads: list[dict[str, Any]] = [{"case": case.name, **case.values} for case in cases]
        self.rows: dict[int, Row] = {}
        self.on_row = on_row
        self.written_at = time.monotonic()

    def add(self, number: int, row: Row) -> None:
        self.rows[number] = row
        self.on_row(len(self.rows), len(self.heads), {**self.heads[number], **row})
        if time.monotonic() - self.written_at > WRITE_SECONDS:
            self.write()

    def write(self) -> pd.DataFrame:
        table = pd.DataFrame([{**self.heads[number], **self.rows[number]} for number in sorted(self.rows)])
        write_text(self.path, table.to_csv(index=False, lineterminator="\n"))
        self.written_at = time.monotonic()
        return table


def sweep_exit_code(result: SweepResult) -> ExitCode:
    """Return success, or the code that says that some cases failed."""
    return ExitCode.SWEEP_HAS_FAILURES if result.failed else ExitCode.SUCCESS


def read_sweep(folder: Path) -> SweepResult:
    """Return the sweep that a folder holds. Raises InvalidInputError."""
    try:
        table = pd.read_csv(folder / TABLE)
    except (OSError, ValueError) as error:
        message = f"{folder / TABLE}: cannot be read: {error}"
        raise InvalidInputError(message) from error
    if "status" not in table:
        message = f"{folder / TABLE}: not the table of a sweep (no column status)"
        raise InvalidInputError(message)
    return SweepResult(folder, table)

"""Many runs of one scenario with some keys varied, with one row a case in sweep.csv.

Every case lies in a folder named by the hash of its run, so a sweep that is called again does only what is missing.
"""

import hashlib
import json
import os
import shutil
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from multiprocessing import current_process
from pathlib import Path
from typing import Any

import pandas as pd

from blocksim.analysis.compare import compare_final
from blocksim.analysis.experiment import load_table
from blocksim.errors import InputMissingError, InvalidInputError, OutputExistsError, StoppedEarlyError
from blocksim.scenario import Document, Scenario, scenario_hash
from blocksim.scenario.models.study import Sweep
from blocksim.simulation import folder as files
from blocksim.simulation.atomic import write_text
from blocksim.simulation.compilation import compile_kernels, kernel_set
from blocksim.simulation.copies import keep_tables, read_tables, resolved_beside
from blocksim.simulation.provenance import HASH_DIGITS, code_hash
from blocksim.simulation.stopping import interruptible
from blocksim.simulation.table import read_table
from blocksim.study.plan import Case, Values, cases_of, with_sweep
from blocksim.study.pool import Row, run_all
from blocksim.study.sampling.design import levels_of
from blocksim.study.single import FINISHED, check_experiment

TABLE = "sweep.csv"
PLAN = "sweep.toml"
CASES = "cases"
WRITE_SECONDS = 1.0
TEXT_COLUMNS = {"case": str, "status": str, "reason": str}
OnRow = Callable[[int, int, Row], None]


@dataclass(frozen=True)
class SweepResult:
    """The folder of a sweep and its table, a row a case."""

    folder: Path
    table: pd.DataFrame = field(repr=False)

    @property
    def failed(self) -> int:
        """How many cases did not finish."""
        return int((self.table["status"] != FINISHED).sum())

    @property
    def share_inside(self) -> float | None:
        """Share of all cases that lie inside all measured ranges; None without an experiment."""
        if "inside" not in self.table or self.table["inside"].isna().all():
            return None
        return float((self.table["inside"] == True).mean())  # noqa: E712 - the column has True, False and missing values

    def share_inside_of(self, experiment: Path | str) -> float:
        """Share of all cases that lie inside all ranges of another table. Raises what reading it raises."""
        measured = load_table(experiment)
        names = self.table["case"][self.table["status"] == FINISHED]
        finals = (read_table(self.folder / CASES / name / files.FINAL) for name in names)
        return sum(compare_final(final, measured).inside for final in finals) / len(self.table)


def sweep(  # noqa: PLR0913 - one argument for each option of the command
    scenario: Path | str | Document,
    vary: Mapping[str, Values] | None = None,
    *,
    mode: str | None = None,
    out: Path | str | None = None,
    jobs: int | None = None,
    overwrite: bool = False,
    on_row: OnRow = lambda *_: None,
) -> SweepResult:
    """Run every case of a sweep on `jobs` processes (default: one a core).

    `vary` (dotted key: values, or from, to, count) and `mode` (grid, list) replace what the scenario's [sweep] table
    says. Cases that fail get a row with their status; the others go on. Raises ScenarioError for a bad scenario,
    InvalidInputError where nothing is varied, OutputExistsError where the folder is not free, StoppedEarlyError on
    Ctrl-C.

    A script that calls it needs the guard `if __name__ == "__main__":`, as the processes import the script.
    """
    _refuse_in_worker()
    document = with_sweep(scenario if isinstance(scenario, Document) else Document.read(scenario), vary, mode)
    base = document.build()
    if base.sweep is None:
        message = "nothing to vary: give --vary KEY=VALUES, or a [sweep] table in the scenario"
        raise InvalidInputError(message)
    check_experiment(base)
    cases = cases_of(document, base.sweep)
    name = sweep_hash(base, base.sweep)
    folder = Path(out) if out is not None else files.RESULTS / base.name / f"sweep-{name}"
    _prepare(folder, base, name, overwrite=overwrite)
    for kernels in kernels_for(document):
        compile_kernels(kernels)
    return _run_cases(folder, cases, jobs or os.cpu_count() or 1, on_row)


def _refuse_in_worker() -> None:
    """Stop a worker process that runs the user's script again because the script has no main guard."""
    if getattr(current_process(), "_inheriting", False):
        message = 'sweep() starts processes that import this script: call it below if __name__ == "__main__":'
        raise InvalidInputError(message)


def sweep_hash(base: Scenario, plan: Sweep) -> str:
    """Return the name of a sweep: a hash of its scenario, of what it varies, and of the code."""
    text = json.dumps([scenario_hash(base), plan.as_table(), code_hash()])
    return hashlib.sha256(text.encode()).hexdigest()[:HASH_DIGITS]


def kernels_for(document: Document) -> tuple[str, ...]:
    """Return the sets of kernels that the cases of a sweep need."""
    base = document.build()
    vary = base.sweep.vary if base.sweep else {}
    schemes = (base.time.scheme, *map(str, levels_of(vary.get("time.scheme", ()))))
    models = (base.contact.model, *map(str, levels_of(vary.get("contact.model", ()))))
    return tuple(dict.fromkeys(kernel_set(scheme, model) for scheme in schemes for model in models))


def _prepare(folder: Path, base: Scenario, name: str, *, overwrite: bool) -> None:
    """Make the folder and write the plan into it. Raises OutputExistsError when something else is there."""
    head = f"# Sweep {name}. To run it again: blocksim sweep FILE\n"
    tables = read_tables(base)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        _make_free(folder, head, overwrite=overwrite)
    except OSError as error:
        message = f"{folder}: cannot be created: {error.strerror}"
        raise OutputExistsError(message) from error
    write_text(folder / PLAN, head + resolved_beside(base, tables))
    keep_tables(tables, folder)


def _make_free(folder: Path, head: str, *, overwrite: bool) -> None:
    present = {path.name for path in folder.iterdir() if not path.name.startswith(f".{PLAN}.")}
    if not present:
        return
    plan = (folder / PLAN).read_text(encoding="utf-8", errors="replace") if PLAN in present else ""
    if not plan.startswith("# Sweep "):
        message = f"{folder}: holds files that are not a sweep; choose another folder with --out"
        raise OutputExistsError(message)
    if overwrite:
        (folder / TABLE).unlink(missing_ok=True)
        shutil.rmtree(folder / CASES, ignore_errors=True)
    elif not plan.startswith(head):
        message = f"{folder}: another sweep is there; --overwrite replaces it, --out DIR writes elsewhere"
        raise OutputExistsError(message)


def _run_cases(folder: Path, cases: Sequence[Case], jobs: int, on_row: OnRow) -> SweepResult:
    """Run what has to be run; cases of the same name are one run."""
    rows = _Rows(folder / TABLE, cases, on_row)
    tasks: dict[Path, Scenario] = {}
    numbers: dict[Path, list[int]] = {}
    try:
        for number, case in enumerate(cases):
            place = folder / CASES / case.name
            numbers.setdefault(place, []).append(number)
            if case.scenario is None:
                rows.add(number, {"status": "invalid", "reason": case.problem, "seconds": 0.0})
            else:
                tasks[place] = case.scenario
        # closed here and now: left to the garbage collector, a Ctrl-C in this loop would wait for the workers
        with interruptible(), closing(run_all(tasks, jobs)) as ended:
            for place, row in ended:
                for number in numbers[place]:
                    rows.add(number, row)
    except KeyboardInterrupt:
        rows.write()
        message = f"stopped with {len(rows.rows)} of {len(cases)} cases done; the same command does the others"
        raise StoppedEarlyError(message) from None
    return SweepResult(folder, rows.write())


class _Rows:
    """The rows so far, written to sweep.csv every now and then and at the end."""

    def __init__(self, path: Path, cases: Sequence[Case], on_row: OnRow) -> None:
        self.path = path
        self.heads: list[dict[str, Any]] = [{"case": case.name, **case.settings} for case in cases]
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


def read_sweep(folder: Path) -> SweepResult:
    """Return the sweep that a folder holds. Raises InputMissingError or InvalidInputError."""
    path = folder / TABLE
    try:
        table = pd.read_csv(path, dtype=TEXT_COLUMNS)
    except FileNotFoundError:
        message = f"{path}: no such file"
        raise InputMissingError(message) from None
    except (OSError, ValueError) as error:
        message = f"{path}: not the table of a sweep: {str(error).strip()}"
        raise InvalidInputError(message) from error
    if not {"case", "status"} <= set(table.columns):
        message = f"{path}: not the table of a sweep: no columns case and status"
        raise InvalidInputError(message)
    return SweepResult(folder, table)

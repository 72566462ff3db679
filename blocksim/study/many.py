"""Many runs of one scenario with some keys varied, with one row per case in sweep.csv.

What has ended is in the manifest, so a sweep that is called again, after a kill too, does only what is missing. The
table is written from the manifest: it depends neither on the executor nor on the order in which the cases ended.
"""

import hashlib
import json
import os
from collections.abc import Mapping
from contextlib import closing
from multiprocessing import current_process
from pathlib import Path

from blocksim.errors import InvalidInputError
from blocksim.scenario import Document, Scenario, Source, document_of, scenario_hash
from blocksim.scenario.models.study import Sweep
from blocksim.simulation import folder as files
from blocksim.simulation.compilation import compile_kernels, kernel_set
from blocksim.simulation.provenance import HASH_DIGITS, code_hash
from blocksim.study import manifest
from blocksim.study.done import Done
from blocksim.study.executors import DEFAULT, WITH_FOLDERS, WITH_SCHEDULER, executor_named
from blocksim.study.executors.task import Setting
from blocksim.study.manifest import Manifest
from blocksim.study.plan import Cases, Values, cases_of, with_sweep
from blocksim.study.ranges import Ranges
from blocksim.study.sampling.design import levels_of
from blocksim.study.shard import WHOLE, Shard
from blocksim.study.single import check_experiment
from blocksim.study.sweep_folder import CASES, PLAN, prepare
from blocksim.study.sweeping import OnRow, Sweeping
from blocksim.study.table import TABLE, SweepResult, SweepTable, read_sweep
from blocksim.study.timings import Timings

__all__ = ["PLAN", "TABLE", "OnRow", "SweepResult", "kernels_for", "read_sweep", "sweep", "sweep_hash"]

TIMINGS = "timings.csv"
MEASURED = "experiment.table"


def sweep(  # noqa: PLR0913 - one argument for each option of the command
    scenario: Source,
    vary: Mapping[str, Values] | None = None,
    *,
    mode: str | None = None,
    samples: int | None = None,
    seed: int | None = None,
    out: Path | str | None = None,
    executor: str | None = None,
    jobs: int | None = None,
    scheduler: str | None = None,
    shard: Shard = WHOLE,
    keep_cases: bool = False,
    fail_fast: bool = False,
    retry_failed: bool = False,
    overwrite: bool = False,
    on_row: OnRow = lambda *_: None,
) -> SweepResult:
    """Run every case of a sweep that has no row yet, on `jobs` threads or processes (default: one a core).

    `vary` (dotted key: values; from, to, count; from, to; or mean, sd), `mode` (grid, list, table, lhs, sobol, normal)
    and, for drawn cases, `samples` and `seed` replace what the scenario's [sweep] table says. `executor` is ensemble
    (default), processes (default with `keep_cases`, which writes a folder of frames for every case) or dask (default
    with a `scheduler`, such as tcp://host:8786); the rows are the same. With a `shard`, only its cases are run, and
    `merge` makes one table of all shards.

    Cases that fail get a row with their status; the others continue, unless `fail_fast`. `retry_failed` runs them
    again. Raises ScenarioError for a bad scenario, InvalidInputError where nothing is varied, OutputExistsError where
    the folder is not free, UnavailableError for a scheduler that does not answer, StoppedEarlyError on Ctrl-C.

    A script that has processes started needs the guard `if __name__ == "__main__":`, as they import the script.
    """
    executor = _chosen(executor, scheduler, keep_cases=keep_cases)
    _refuse_loss(shard, overwrite=overwrite)
    runner = executor_named(executor)
    document = with_sweep(document_of(scenario), vary, mode, samples=samples, seed=seed)
    base = document.build()
    plan = _plan_of(base)
    cases = cases_of(document, plan)
    name = sweep_hash(base, plan)
    folder = Path(out) if out is not None else files.RESULTS / base.name / f"sweep-{name}"
    setting = Setting(jobs or os.cpu_count() or 1, scheduler=scheduler, folder=folder / CASES if keep_cases else None)
    runner.check(setting)
    prepare(folder, base, name, overwrite=overwrite)
    for kernels in kernels_for(document):
        compile_kernels(kernels)
    with closing(Manifest(folder / shard.file(manifest.NAME))) as kept:
        done = Done(folder, len(cases))
        if retry_failed:
            done.forget_failed(shard)
        table = SweepTable(folder / shard.file(TABLE), cases, done, ranges_of(base), shard)
        timings = Timings(folder / shard.file(TIMINGS), executor)
        Sweeping(cases, shard, kept, done, table, timings, on_row).run(runner.run, setting, fail_fast=fail_fast)
    return SweepResult(folder, shard.file(TABLE), len(done.state[shard.slice]))


def _chosen(executor: str | None, scheduler: str | None, *, keep_cases: bool) -> str:
    """Return the executor that the other options ask for. Raises InvalidInputError where they contradict it."""
    needed = WITH_SCHEDULER if scheduler is not None else WITH_FOLDERS if keep_cases else executor or DEFAULT
    if keep_cases and WITH_SCHEDULER in {needed, executor}:
        raise InvalidInputError("folders of cases are kept on this machine only: not with a scheduler")
    if executor is not None and executor != needed:
        why = "a scheduler" if scheduler is not None else "keeping the folders of cases"
        message = f"{why} goes with the executor {needed}, not {executor}"
        executor_named(executor)
        raise InvalidInputError(message)
    if needed == WITH_SCHEDULER and scheduler is None:
        raise InvalidInputError("the executor dask needs the address of a scheduler: --scheduler tcp://HOST:PORT")
    if needed == WITH_FOLDERS:
        _refuse_in_worker()
    return needed


def _refuse_in_worker() -> None:
    """Stop a worker process that runs the user's script again because the script has no main guard."""
    if getattr(current_process(), "_inheriting", False):
        message = 'sweep() starts processes that import this script: call it below if __name__ == "__main__":'
        raise InvalidInputError(message)


def _refuse_loss(shard: Shard, *, overwrite: bool) -> None:
    """Refuse that every job of an array removes what the others have done."""
    if overwrite and shard != WHOLE:
        raise InvalidInputError("a shard cannot overwrite what other shards have done; remove the folder first")


def _plan_of(base: Scenario) -> Sweep:
    """Return what is varied. Raises InvalidInputError where that is nothing, and for a table that does not fit."""
    if base.sweep is None:
        message = "nothing to vary: give --vary KEY=VALUES, or a [sweep] table in the scenario"
        raise InvalidInputError(message)
    if MEASURED in base.sweep.vary:
        message = f"{MEASURED} cannot be varied: compare --experiment judges by another table"
        raise InvalidInputError(message)
    check_experiment(base)
    return base.sweep


def cases_in(document: Document) -> Cases:
    """Return the cases of a document that has a sweep. Raises InvalidInputError where it has none."""
    return cases_of(document, _plan_of(document.build()))


def ranges_of(base: Scenario) -> Ranges | None:
    """Return the measured ranges that a scenario is compared with, if it names any."""
    return None if base.experiment is None else Ranges.read(base.experiment.table)


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

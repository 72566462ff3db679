"""One run, and its comparison with an experiment."""

from pathlib import Path
from typing import TYPE_CHECKING

from blocksim.analysis.compare import Comparison, compare_final
from blocksim.analysis.experiment import ExperimentTable, load_table
from blocksim.errors import InputMissingError, InvalidInputError
from blocksim.scenario import Scenario, Source, load_scenario, load_stored, place_bodies
from blocksim.simulation import Progress, Result, Watcher, read_result, renew_copies, simulate, simulate_into
from blocksim.simulation import folder as files
from blocksim.simulation.checkpoint_policy import DEFAULTS, CheckpointPolicy
from blocksim.simulation.result import read_final
from blocksim.simulation.running import SILENT, Listener
from blocksim.simulation.summary import changed_results, read_summary
from blocksim.simulation.table import COLUMNS
from blocksim.study.places import FINISHED as FINISHED  # noqa: PLC0414 - their old home, for those who look there
from blocksim.study.places import find_run as find_run  # noqa: PLC0414

if TYPE_CHECKING:
    import pandas as pd


def _ignore(_: Progress) -> None:
    pass


def run(  # noqa: PLR0913 - what a user can choose for a run
    scenario: Source,
    *,
    out: Path | str | None = None,
    overwrite: bool = False,
    resume: bool = False,
    threads: int = 1,
    precautions: CheckpointPolicy = DEFAULTS,
    on_progress: Watcher = _ignore,
    listener: Listener = SILENT,
) -> Result:
    """Simulate a scenario and return the result; with `out` it is kept in that folder as well.

    A folder that holds the finished run of exactly this scenario and code is read instead, unless `overwrite` is
    given. With `resume` a run that was interrupted there continues, to the same bits as without the interruption. The
    result does not depend on the number of threads, nor on `precautions`, which say when checkpoints are written and
    after which wall time to stop. `listener` hears what happens before the first step. Ctrl-C returns what was computed
    until then, with the status `interrupted`. Raises ScenarioError, InvalidInputError for an experiment table that does
    not go with the blocks, for more threads than the system has, for a checkpoint of another scenario or version of the
    code and for results that have been changed or cut since, OutputExistsError, OutputError; ValueError for `resume`
    with `overwrite` or without `out`.
    """
    if resume and (overwrite or out is None):
        raise ValueError("a run is resumed where it was kept: resume needs out, and cannot go with overwrite")
    if not isinstance(scenario, Scenario):
        scenario = load_scenario(scenario)
    check_experiment(scenario)
    if out is None:
        return simulate(scenario, threads=threads, on_progress=on_progress, wall_time=precautions.wall_time)
    folder = Path(out)
    if not overwrite and files.holds_run(folder, scenario):
        _refuse_changed(folder)
        renew_copies(scenario, folder)
        result = read_result(folder)
        listener.on_remark(f"already computed; rerun with --overwrite: {folder}")
        return result
    return simulate_into(
        scenario,
        folder,
        overwrite=overwrite,
        resume=resume,
        threads=threads,
        precautions=precautions,
        on_progress=on_progress,
        listener=listener,
    )


def _refuse_changed(folder: Path) -> None:
    """Raise InvalidInputError where frames or final table are not those that the run has written."""
    changed = changed_results(folder, read_summary(folder / files.SUMMARY))
    if changed:
        name = changed[0]
        what = "does not have the checksum in run.json" if (folder / name).is_file() else "no such file"
        raise InvalidInputError(f"{folder / name}: {what}: changed since the run; rerun with --overwrite")


def check_experiment(scenario: Scenario) -> None:
    """Read the table that a scenario names and look whether it goes with the blocks: better now than after the run."""
    if scenario.experiment is not None:
        names = [body.name for body in place_bodies(scenario)]
        unknown = dict.fromkeys(COLUMNS[1:], [0.0] * len(names))
        compare_final({"block": names, **unknown}, load_table(scenario.experiment.table))


def compare(run: "Result | pd.DataFrame | Path | str", experiment: Path | str | None = None) -> Comparison:
    """Compare a result, a final table or what `find_run` understands with an experiment table.

    Without `experiment` the table that the run's scenario names is taken. Raises InputMissingError without any table,
    InvalidInputError for a run that did not finish.
    """
    if isinstance(run, Result):
        _refuse_unfinished(run.name, run.status, run.reason)
        return compare_final(run.columns, _table(experiment, run.experiment))
    if not isinstance(run, Path | str):
        return compare_final(run, _table(experiment, None))
    folder = find_run(run)
    summary = read_summary(folder / files.SUMMARY)
    _refuse_unfinished(str(folder), summary.status, summary.reason)
    was = load_stored(folder / files.SCENARIO)
    # a scenario file may name another table by now than it did when it was run
    named = (load_scenario(run) if Path(run).is_file() else was).experiment
    return compare_final(read_final(folder, was), _table(experiment, named.table if named else None))


def open_run(place: Path | str) -> Result:
    """Return a stored run: a run folder, `results/NAME` (its newest finished run) or a scenario file that has been run.

    Raises InputMissingError where there is none and InvalidInputError for a damaged one.
    """
    return read_result(find_run(place))


def _table(given: Path | str | None, named: Path | None) -> ExperimentTable:
    table = given or named
    if table is None:
        message = "the scenario names no experiment; give a table with --experiment"
        raise InputMissingError(message)
    return load_table(table)


def _refuse_unfinished(name: str, status: str, reason: str) -> None:
    if status != FINISHED:
        verb = "was" if status == "interrupted" else "has"
        message = f"{name}: this run {verb} {status} ({reason}); only a finished run can be compared"
        raise InvalidInputError(message)

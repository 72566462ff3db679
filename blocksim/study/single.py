"""One run, and its comparison with an experiment."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from blocksim.analysis.compare import Comparison, compare_final
from blocksim.analysis.experiment import ExperimentTable, load_table
from blocksim.errors import InputMissingError, InvalidInputError
from blocksim.scenario import Scenario, load_scenario, place_bodies
from blocksim.simulation import Progress, Result, Watcher, read_result, renew_copies, simulate, simulate_into
from blocksim.simulation import folder as files
from blocksim.simulation.summary import read_summary
from blocksim.simulation.table import COLUMNS, read_table

if TYPE_CHECKING:
    import pandas as pd

FINISHED = "finished"


def _ignore(_: Progress) -> None:
    pass


def run(
    scenario: Scenario | Path | str,
    *,
    out: Path | str | None = None,
    overwrite: bool = False,
    threads: int = 1,
    on_progress: Watcher = _ignore,
) -> Result:
    """Simulate a scenario and return the result; with `out` it is kept in that folder as well.

    A folder that holds the finished run of exactly this scenario and code is read instead, unless `overwrite` is
    given. The result does not depend on the number of threads. Ctrl-C returns what there is by then, with the status
    `interrupted`. Raises ScenarioError, InvalidInputError for an experiment table that does not go with the blocks or
    for more threads than the system has, OutputExistsError, OutputError.
    """
    if not isinstance(scenario, Scenario):
        scenario = load_scenario(scenario)
    check_experiment(scenario)
    if out is None:
        return simulate(scenario, threads=threads, on_progress=on_progress)
    folder = Path(out)
    if not overwrite and files.holds_run(folder, scenario):
        renew_copies(scenario, folder)
        return read_result(folder)
    return simulate_into(scenario, folder, overwrite=overwrite, threads=threads, on_progress=on_progress)


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
    # a scenario file may name another table by now than it did when it was run
    named = load_scenario(run if Path(run).is_file() else folder / files.SCENARIO).experiment
    return compare_final(read_table(folder / files.FINAL), _table(experiment, named.table if named else None))


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


def find_run(place: Path | str, needed: Sequence[str] = (files.SUMMARY,)) -> Path:
    """Return the run folder meant by a run folder, by `results/<name>` (newest finished run) or by a scenario file.

    A folder counts as a run when it has all `needed` files. Raises InputMissingError with the command that helps.
    """
    place = Path(place)
    if not place.exists():
        message = f"{place}: no such run folder or scenario file"
        raise InputMissingError(message)
    if place.is_dir():
        return _run_in(place, needed)
    folder = files.default_folder(load_scenario(place))
    if not files.is_finished(folder):
        message = f"{place}: no finished run of exactly this scenario in {folder}; first: blocksim run {place}"
        raise InputMissingError(message)
    return folder


def _run_in(place: Path, needed: Sequence[str]) -> Path:
    missing = [name for name in needed if not (place / name).is_file()]
    if not missing:
        return place
    if (place / files.SCENARIO).is_file():
        message = f"{place}: this run is not complete (there is no {missing[0]}); blocksim run --overwrite repeats it"
        raise InputMissingError(message)
    newest = files.newest_finished(place)
    if newest is None:
        message = f"{place}: no finished run in this folder; blocksim run SCENARIO makes one"
        raise InputMissingError(message)
    return newest

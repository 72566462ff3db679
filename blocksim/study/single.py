"""One run, and its comparison with an experiment."""

from pathlib import Path

import pandas as pd

from blocksim.analysis.compare import Comparison, compare_final
from blocksim.analysis.experiment import load_table
from blocksim.errors import InputMissingError
from blocksim.scenario import Scenario, load_scenario
from blocksim.simulation import folder as files
from blocksim.simulation.result import Result, read_final, read_result, read_summary
from blocksim.simulation.simulate import Watcher, simulate, simulate_into


def _ignore(_: object) -> None:
    pass


def run(
    scenario: Scenario | Path | str,
    *,
    out: Path | str | None = None,
    overwrite: bool = False,
    on_frame: Watcher = _ignore,
) -> Result:
    """Simulate a scenario and return the result; with `out` it is kept in that folder as well.

    A folder that holds the finished run of exactly this scenario and code is read instead, unless `overwrite` is
    given. Raises ScenarioError, OutputExistsError, OutputError.
    """
    if not isinstance(scenario, Scenario):
        scenario = load_scenario(scenario)
    if out is None:
        return simulate(scenario, on_frame=on_frame)
    folder = Path(out)
    if not overwrite and files.holds_run(folder, scenario):
        return read_result(folder)
    return simulate_into(scenario, folder, overwrite=overwrite, on_frame=on_frame)


def compare(run: Result | pd.DataFrame | Path | str, experiment: Path | str | None = None) -> Comparison:
    """Compare a result, a final table or what `find_run` understands with an experiment table.

    Without `experiment` the table that the run's scenario names is taken. Raises InputMissingError without any table.
    """
    if isinstance(run, Result):
        final, named = run.final, run.experiment
    elif isinstance(run, pd.DataFrame):
        final, named = run, None
    else:
        folder = find_run(run)
        final = read_final(folder)
        named = load_scenario(folder / files.SCENARIO).experiment
        named = None if named is None else named.table
    table = named if experiment is None else Path(experiment)
    if table is None:
        message = "the scenario names no experiment; give a table with --experiment"
        raise InputMissingError(message)
    return compare_final(final, load_table(table))


def find_run(place: Path | str) -> Path:
    """Return the run folder meant by a run folder, by `results/<name>` (newest finished run) or by a scenario file.

    Raises InputMissingError with the command that helps.
    """
    place = Path(place)
    if place.is_dir():
        if (place / files.SUMMARY).is_file():
            read_summary(place)
            return place
        newest = files.newest_finished(place)
        if newest is None:
            message = f"{place}: no finished run in this folder; blocksim run SCENARIO makes one"
            raise InputMissingError(message)
        return newest
    folder = files.default_folder(load_scenario(place))
    if not files.is_finished(folder):
        message = f"{place}: no finished run of exactly this scenario in {folder}; first: blocksim run {place}"
        raise InputMissingError(message)
    return folder

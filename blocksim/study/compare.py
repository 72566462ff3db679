"""Comparison of whatever was simulated, one run or a sweep, with measured repeats."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, overload

from blocksim.analysis.compare import Comparison, compare_final
from blocksim.analysis.curves import TIME, compare_curves, load_curves
from blocksim.analysis.evidence import Members
from blocksim.analysis.experiment import has_curves, load_table
from blocksim.analysis.metrics import Judgement, Settings, judge
from blocksim.errors import InputMissingError, InvalidInputError
from blocksim.options import Option
from blocksim.scenario import Model, load_scenario
from blocksim.simulation import Result, files, results
from blocksim.study import manifest, rows, run_folder, sweep_folder

if TYPE_CHECKING:
    from collections.abc import Mapping

    import pandas as pd

    from blocksim.simulation.instruments import ProbeSeries
    from blocksim.simulation.trajectory import Columns

ExperimentTablePath = Annotated[
    Path | str | None,
    Option("Experiment table (CSV) instead of the scenario's own.", flags=("--experiment",), metavar="TABLE"),
]


@overload
def compare(
    run: manifest.SweepResult, experiment: Path | str | None = None, settings: Settings | None = None
) -> Judgement: ...


@overload
def compare(run: "Result | pd.DataFrame", experiment: Path | str | None = None) -> Comparison: ...


@overload
def compare(
    run: Path | str, experiment: Path | str | None = None, settings: Settings | None = None
) -> Comparison | Judgement: ...


def compare(
    run: "manifest.SweepResult | Result | pd.DataFrame | Path | str",
    experiment: Path | str | None = None,
    settings: Settings | None = None,
) -> Comparison | Judgement:
    """Compare a run, or a sweep or its folder, with an experiment table.

    A run is what `compare_run` takes; `settings` are for sweeps and curves. Raises what `compare_run` and
    `compare_sweep` raise.

    >>> compare(run("scenarios/three_blocks_nonsmooth.toml")).inside
    False
    """
    if isinstance(run, manifest.SweepResult) or (isinstance(run, Path | str) and manifest.is_sweep(run)):
        return compare_sweep(run, experiment, settings)
    return compare_run(run, experiment, settings)


def compare_sweep(
    sweep: manifest.SweepResult | Path | str, experiment: Path | str | None = None, settings: Settings | None = None
) -> Judgement:
    """Judge the cases of a sweep by its table and an experiment's; by default that of the scenario.

    Raises InputMissingError without any experiment, InvalidInputError for tables that cannot be used or do not go with
    each other, UnavailableError without scipy.
    """
    result = sweep if isinstance(sweep, manifest.SweepResult) else manifest.read_sweep(Path(sweep))
    plan = result.folder / sweep_folder.PLAN
    scenario = Model.stored(plan).scenario if plan.exists() else None
    table = experiment or (scenario.experiment.table if scenario is not None and scenario.experiment else None)
    if table is None:
        message = f"{result.folder}: the sweep's scenario names no experiment; give a table with --experiment"
        raise InputMissingError(message)
    members = Members(result.table, str(result.folder / rows.TABLE))
    sweep_of = None if scenario is None else scenario.sweep
    remarks: tuple[str, ...] = ()
    if sweep_of is not None and not sweep_of.is_sampled:  # shares of members are no probabilities
        remarks = (
            f"mode {sweep_of.mode!r} sets its members: shares are counts, not probabilities",
            "the 95 % limits hold for samples only (modes lhs, sobol, normal)",
        )
    if result.missing:
        remarks = (f"{result.progress} cases have run; rerun the sweep to finish", *remarks)
    return judge(members, load_table(table), settings, remarks)


def compare_run(
    run: "Result | pd.DataFrame | Path | str",
    experiment: Path | str | None = None,
    settings: Settings | None = None,
) -> Comparison:
    """Compare a result, a final table or what `find_run` understands with an experiment table.

    A table of final positions is compared with the final table, one of curves with the probes of the run. Without
    `experiment` the table that the run's scenario names is taken; `settings` has the tolerance of curves. Raises
    InputMissingError without any table, InvalidInputError for a run that did not finish.
    """
    final: Columns | pd.DataFrame
    drawn: Result | Path | None = None
    was: Model | None = None
    if isinstance(run, Result):
        name, summary, final, named = run.name, run.summary, run.columns, run.experiment
        drawn, was = run, run.model
    elif not isinstance(run, Path | str):
        name, summary, final, named = "", None, run, None
    else:
        drawn = folder = run_folder.find_run(run)
        name, summary = str(folder), results.read_summary(folder / files.SUMMARY)
        was = Model.stored(folder / files.SCENARIO)
        final = results.read_final(folder, was) if summary.status == rows.FINISHED else {}
        # a scenario file may name another table by now than it did when it was run
        now = (load_scenario(run) if Path(run).is_file() else was.scenario).experiment
        named = now.table if now else None
    if summary is not None and summary.status != rows.FINISHED:
        how = f"this run {'was' if summary.status == 'interrupted' else 'has'} {summary.status} ({summary.reason})"
        raise InvalidInputError(f"{name}: {how}; only a finished run can be compared")
    table = experiment or named
    if table is None:
        raise InputMissingError("the scenario names no experiment; give a table with --experiment")
    if was is not None:
        rows.check_experiment(was, table)
    probes: Mapping[str, ProbeSeries] | None = None
    if drawn is not None and has_curves(table):
        result = drawn if isinstance(drawn, Result) else results.read_result(drawn)
        probes = result.probes
    return replace(against(table, final, probes, (settings or Settings()).tolerance), run=drawn)


def against(
    table: Path | str,
    final: "Columns | pd.DataFrame",
    probes: "Mapping[str, ProbeSeries] | None",
    tolerance: float | None = None,
) -> Comparison:
    """Compare a final table, or probes, with a measured table, as that is of final positions or of curves.

    Raises InvalidInputError, also for curves where there are no probes.
    """
    if not has_curves(table):
        return compare_final(final, load_table(table))
    if probes is None:
        raise InvalidInputError(f"{table}: curves are compared with the probes of a run; this is a final table")
    records = {name: {TIME: one.time, **one.columns} for name, one in probes.items()}
    return compare_curves(records, load_curves(table), tolerance)

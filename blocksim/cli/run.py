"""blocksim run: simulate one scenario."""

import typer

from blocksim.cli import options
from blocksim.cli.compare import comparison_table, verdict_lines
from blocksim.cli.output import answer, note, number, print_json, table_lines
from blocksim.cli.progress import tell_compilation, watching
from blocksim.cli.scenario import read_scenario
from blocksim.simulation import Result
from blocksim.simulation.folder import default_folder, holds_run
from blocksim.study.single import FINISHED, check_experiment, compare, run

MOST_ROWS = 40  # of the final table on the screen; of a longer one the first are shown
FIRST_ROWS = 10


def run_command(
    scenario: options.ScenarioPath,
    settings: options.Settings = None,
    out: options.OutFolder = None,
    overwrite: options.Overwrite = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Simulate a scenario and show where the blocks end.

    Where the scenario names an experiment, the measured ranges stand beside. A run that is there already is shown
    again.

    Example: blocksim run scenarios/three_blocks.toml --set time.end=0.1
    """
    silent = quiet or as_json
    with read_scenario(scenario, settings or []) as ready:
        folder = out or default_folder(ready)
        known = not overwrite and holds_run(folder, ready)
        if not known:
            check_experiment(ready)
            tell_compilation(ready.contact.model, quiet=silent)
        with watching(quiet=silent or known) as on_progress:
            result = run(ready, out=folder, overwrite=overwrite, on_progress=on_progress)
    if known and not silent:
        note(f"already there, --overwrite repeats it: {folder}")
    show_result(result, as_json=as_json, quiet=silent)
    raise typer.Exit(result.summary.exit_code)


def show_result(result: Result, *, as_json: bool, quiet: bool) -> None:
    """Print the final table, beside the measured ranges where the scenario names an experiment."""
    if not quiet:
        _tell_end(result)
    if as_json:
        final = result.final.to_dict(orient="records")
        print_json({"folder": str(result.folder), "final": final, "summary": result.summary.model_dump()})
    else:
        answer("\n".join(_answer_lines(result)))
    if result.status != FINISHED:
        note(f"{result.name}: {result.status}: {result.reason}; what there is by then is kept in {result.folder}")
    elif not quiet:
        note(f"results: {result.folder}")


def _answer_lines(result: Result) -> list[str]:
    """Return the lines of the final table; of a crowd the first ones, as all are in the run's folder."""
    if result.experiment is not None and result.status == FINISHED:
        comparison = compare(result)
        return [*comparison_table(comparison), *verdict_lines(comparison)]
    count = len(result.final)
    final = result.final.head(count if count <= MOST_ROWS else FIRST_ROWS)
    rows = [
        (block, number(x), number(y), number(rotation))
        for block, x, y, rotation in zip(
            final["block"], final["x_mm"], final["y_mm"], final["rotation_deg"], strict=True
        )
    ]
    lines = table_lines(("block", "x mm", "y mm", "rotation °"), rows)
    return lines if len(final) == count else [*lines, f"... and {count - len(final)} blocks more, see final.csv"]


def _tell_end(result: Result) -> None:
    summary = result.summary
    note(f"{result.name}: {result.status} ({result.reason}) at {summary.simulated_time_s:.3f} s of simulated time")
    note(
        f"{summary.steps} steps of {summary.time_step_s:.2e} s in {summary.solver_seconds:.2f} s; "
        f"energy off by {summary.energy_J.relative_residual:.0e} of what was in play"
    )
    for text in summary.warnings:
        note(f"warning: {text}")
    note("")

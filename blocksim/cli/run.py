"""blocksim run: simulate one scenario."""

import typer

from blocksim.cli import options
from blocksim.cli.comparison import comparison_rows
from blocksim.cli.output import note, number, print_json, print_table
from blocksim.cli.progress import tell_compilation, watching
from blocksim.cli.scenario import read_scenario
from blocksim.simulation import Result
from blocksim.simulation.folder import default_folder, holds_run
from blocksim.study.single import compare, run


def run_command(
    scenario: options.ScenarioPath,
    settings: options.Settings = None,
    out: options.OutFolder = None,
    overwrite: options.Overwrite = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Simulate a scenario; keep the result and show where the blocks end.

    Where the scenario names an experiment, the measured ranges stand beside. Example:

    blocksim run scenarios/three_blocks.toml --set contact.stiffness_scale=0.01
    """
    with read_scenario(scenario, settings or []) as ready:
        folder = out or default_folder(ready)
        silent = quiet or as_json
        known = not overwrite and holds_run(folder, ready)
        if not known:
            tell_compilation(quiet=silent)
        with watching(quiet=silent or known) as on_frame:
            result = run(ready, out=folder, overwrite=overwrite, on_frame=on_frame)
    if known and not silent:
        note(f"already there, --overwrite repeats it: {folder}")
    show_result(result, as_json=as_json, quiet=quiet)
    raise typer.Exit(int(result.summary["exit_code"]))


def show_result(result: Result, *, as_json: bool, quiet: bool) -> None:
    """Print the final table, beside the measured ranges where the scenario names an experiment."""
    if as_json:
        final = result.final.to_dict(orient="records")
        print_json({"folder": str(result.folder), "final": final, "summary": result.summary})
        return
    if not quiet:
        for line in _headline(result):
            note(line)
    if result.experiment is not None and result.status == "finished":
        columns, rows = comparison_rows(compare(result))
        print_table(None, columns, rows, left=2)
    else:
        print_table(None, ("block", "x mm", "y mm", "rotation deg"), _final_rows(result))
    if not quiet:
        note(f"Results: {result.folder}")


def _final_rows(result: Result) -> list[tuple[str, ...]]:
    return [
        (str(row.block), number(row.x_mm), number(row.y_mm), number(row.rotation_deg))
        for row in result.final.itertuples()
    ]


def _headline(result: Result) -> list[str]:
    summary = result.summary
    energy = summary["energy_J"]
    lines = [
        f"{result.name}: {result.status} ({result.reason}) at {summary['simulated_time_s']:.3f} s, "
        f"{summary['steps']} steps of {summary['time_step_s']:.2e} s",
        f"{summary['solver_seconds']:.2f} s of solving; energy accounted for to "
        f"{energy['relative_residual']:.0e} of the energy in play",
    ]
    return [*lines, *(f"warning: {text}" for text in summary["warnings"])]

"""blocksim sweep: many runs of one scenario."""

from pathlib import Path
from typing import Annotated

import typer

from blocksim.cli import options
from blocksim.cli.output import note, print_json, print_table
from blocksim.cli.progress import tell_compilation
from blocksim.cli.vary import parse_vary
from blocksim.scenario import Document
from blocksim.study.sweep import Row, SweepResult, sweep, sweep_exit_code

MOST_ROWS = 40


def sweep_command(
    scenario: options.ScenarioPath,
    vary: Annotated[
        list[str] | None,
        typer.Option("--vary", metavar="KEY=VALUES", help="KEY=a,b,c or KEY=from:to:count. Repeatable."),
    ] = None,
    mode: Annotated[
        str | None, typer.Option(metavar="grid|list", help="All combinations, or the k-th value of every key.")
    ] = None,
    settings: options.Settings = None,
    jobs: Annotated[int | None, typer.Option(min=1, metavar="N", help="Processes (default: one a core).")] = None,
    out: options.OutFolder = None,
    overwrite: options.Overwrite = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Run a scenario many times with some keys varied; one row a case in sweep.csv.

    Called again, it runs only the cases that are missing. Example:

    blocksim sweep scenarios/three_blocks.toml --vary friction.block_block.kinetic=0.17:0.21:5
    """
    document = Document.read(scenario).with_settings(settings or [])
    document.build()
    silent = quiet or as_json
    ranges = parse_vary(vary or [])
    tell_compilation(quiet=silent)

    def on_row(done: int, total: int, row: Row) -> None:
        if not silent:
            note(f"{done}/{total} {row['status']}: {_values(row)}")

    result = sweep(document, ranges, mode=mode, out=out, jobs=jobs, overwrite=overwrite, on_row=on_row)
    _show(result, as_json=as_json, quiet=quiet)
    raise typer.Exit(int(sweep_exit_code(result)))


def _values(row: Row) -> str:
    keys = [key for key in row if "." in key and not key.endswith(("_mm", "_deg"))]
    return ", ".join(f"{key} = {row[key]}" for key in keys)


def _show(result: SweepResult, *, as_json: bool, quiet: bool) -> None:
    table = result.table
    if as_json:
        print_json({"folder": str(result.folder), "rows": table.to_dict(orient="records")})
        return
    columns = [name for name in table.columns if name not in {"case", "reason", "seconds"} and "rotation" not in name]
    shown = table[columns].head(MOST_ROWS)
    rows = [[f"{v:.4g}" if isinstance(v, float) else str(v) for v in row] for row in shown.itertuples(index=False)]
    print_table(None, [name.removeprefix("friction.") for name in columns], rows, left=0)
    if quiet:
        return
    if len(table) > MOST_ROWS:
        note(f"... and {len(table) - MOST_ROWS} more rows in the file")
    if result.share_inside is not None:
        note(f"{result.share_inside:.0%} of the cases are inside all measured ranges")
    if result.failed:
        failed = table[table["status"] != "finished"]
        note(f"{result.failed} of {len(table)} cases did not finish; the first: {failed['reason'].iloc[0]}")
    note(f"Table: {Path(result.folder) / 'sweep.csv'}")

"""blocksim sweep: many runs of one scenario."""

import math
from collections.abc import Iterable
from enum import StrEnum
from typing import Annotated

import typer

from blocksim.cli import options
from blocksim.cli.dry_run import show_estimate
from blocksim.cli.output import GAP, answer, note, print_json, table_lines, width_of_screen
from blocksim.cli.progress import tell_compilation
from blocksim.cli.vary import with_vary
from blocksim.errors import ExitCode
from blocksim.scenario import Document
from blocksim.study.many import TABLE, SweepResult, kernels_for, sweep
from blocksim.study.pool import Row
from blocksim.study.single import FINISHED

MOST_ROWS = 40
NOT_SHOWN = {"case", "reason", "seconds"}


class Mode(StrEnum):
    """How values go together."""

    GRID = "grid"
    LIST = "list"
    TABLE = "table"
    LHS = "lhs"
    SOBOL = "sobol"
    NORMAL = "normal"


def sweep_command(
    scenario: options.ScenarioPath,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            "--vary",
            metavar="KEY=VALUES",
            help="KEY=a,b,c or KEY=from:to:count; to be drawn from, KEY=from:to or KEY=mean+-sd. Repeatable.",
        ),
    ] = None,
    mode: Annotated[
        Mode | None,
        typer.Option(help="All combinations, the k-th value of every key, the scenario's table, or random draws."),
    ] = None,
    samples: Annotated[int | None, typer.Option(metavar="N", help="How many cases are drawn (default: 128).")] = None,
    seed: Annotated[int | None, typer.Option(metavar="S", help="The same seed draws the same (default: 0).")] = None,
    settings: options.Settings = None,
    jobs: Annotated[int | None, typer.Option(min=1, metavar="N", help="Processes (default: one a core).")] = None,
    out: options.SweepFolder = None,
    overwrite: options.Overwrite = False,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Tell count, cost and size; run and write nothing.")
    ] = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Run a scenario many times with some keys varied.

    Every case gives a row in sweep.csv. Called again, the same sweep runs only the cases that are missing.

    Example: blocksim sweep scenarios/slide.toml --vary gravity=1.62,9.81
    """
    silent = quiet or as_json
    document = with_vary(
        Document.read(scenario).with_settings(settings or []),
        vary or [],
        None if mode is None else mode.value,
        samples=samples,
        seed=seed,
    )
    if dry_run:
        show_estimate(document, jobs, as_json=as_json)
        return
    short = short_keys(document)
    for kernels in kernels_for(document):
        tell_compilation(kernels, quiet=silent)

    def on_row(done: int, total: int, row: Row) -> None:
        if not silent:
            values = ", ".join(f"{name} = {shown(row[key])}" for key, name in short.items())
            note(f"{done}/{total} {row['status']}: {values}")

    result = sweep(document, out=out, jobs=jobs, overwrite=overwrite, on_row=on_row)
    if as_json:
        print_json({"folder": str(result.folder), "rows": result.table.to_dict(orient="records")})
    else:
        _show(result, short, quiet=quiet)
    raise typer.Exit(ExitCode.SWEEP_HAS_FAILURES if result.failed else ExitCode.SUCCESS)


def short_keys(document: Document) -> dict[str, str]:
    """Return the varied keys with the shortest ends that tell them apart."""
    plan = document.build().sweep
    keys = [] if plan is None else list(plan.vary)
    return {
        key: next(end for end in _ends(key) if sum(f".{other}".endswith(f".{end}") for other in keys) == 1)
        for key in keys
    }


def _ends(key: str) -> list[str]:
    parts = key.split(".")
    return [".".join(parts[start:]) for start in reversed(range(len(parts)))]


def shown(value: object) -> str:
    """Return a cell of the table for people."""
    match value:
        case bool():
            return "yes" if value else "no"
        case float():
            return f"{value:.6g}" if math.isfinite(value) else "–"
        case _:
            return str(value)


def _show(result: SweepResult, short: dict[str, str], *, quiet: bool) -> None:
    table = result.table
    told = [name for name in table.columns if name not in NOT_SHOWN and not name.endswith("rotation_deg")]
    names = [name for name in told if name in short or name == "inside" or _varies(table[name])]
    rows = [[shown(value) for value in row] for row in table[names].head(MOST_ROWS).itertuples(index=False)]
    fitting = _fitting([short.get(name, name) for name in names], rows)
    heads = [short.get(name, name) for name in names[:fitting]]
    answer("\n".join(table_lines(heads, [row[:fitting] for row in rows], left=0)))
    if quiet:
        return
    left_out = {
        "more rows": len(table) - len(rows),
        "more columns": len(names) - fitting,
        "columns that do not vary": len(told) - len(names),
    }
    if any(left_out.values()):
        note(f"{TABLE} has " + ", ".join(f"{count} {what}" for what, count in left_out.items() if count))
    if result.share_inside is not None:
        note(f"{result.share_inside:.0%} of {len(table)} cases are inside all measured ranges")
    if result.failed:
        first = table[table["status"] != FINISHED]["reason"].iloc[0]
        note(f"{result.failed} of {len(table)} cases did not finish; the first: {first}")
    note(f"table: {result.folder / TABLE}")


def _varies(values: Iterable[object]) -> bool:
    """Tell whether a column says anything: all finished, or a block that stays where it is, does not."""
    told = [f"{value:.2f}" if isinstance(value, float) else str(value) for value in values]
    return len(told) == 1 or len(set(told)) > 1


def _fitting(heads: list[str], rows: list[list[str]]) -> int:
    """Return how many columns fit on the screen, at least one."""
    width, room = 0, width_of_screen()
    for index, column in enumerate(zip(heads, *rows, strict=True)):
        width += max(map(len, column)) + (len(GAP) if index else 0)
        if width > room:
            return max(index, 1)
    return len(heads)

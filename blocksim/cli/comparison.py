"""blocksim compare: judge a run against measured repeats."""

from pathlib import Path
from typing import Annotated

import typer

from blocksim.analysis.compare import Comparison, ComparisonRow, Verdict
from blocksim.cli import options
from blocksim.cli.output import note, number, print_json, print_table
from blocksim.errors import ExitCode, InputMissingError
from blocksim.study.single import compare, find_run
from blocksim.study.sweep import TABLE, read_sweep

COLUMNS = ("block", "quantity", "simulated", "mean ± s", "[min, max]", "error", "verdict")


def compare_command(
    places: Annotated[
        list[Path],
        typer.Argument(
            metavar="RUN...", help="Run folder, results/NAME (newest finished run), scenario file or sweep."
        ),
    ],
    experiment: options.ExperimentPath = None,
    threshold: Annotated[
        float, typer.Option(min=0.0, max=1.0, help="For sweeps: the share of cases that must be inside.")
    ] = 0.5,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Compare runs with measured repeats; exit code 1 when anything is outside.

    A centre is inside when it lies between the smallest and the largest repeat, a rotation within 5 degrees of the
    mean. Example:

    blocksim compare scenarios/three_blocks.toml
    """
    missing = [place for place in places if not place.exists()]
    if missing:
        message = "\n".join(f"{place}: no such run folder or scenario file" for place in missing)
        raise InputMissingError(message)
    verdicts = []
    answers: list[object] = []
    for place in places:
        if (place / TABLE).is_file():
            share = read_sweep(place).share_inside or 0.0
            verdicts.append(share >= threshold)
            answers.append({"sweep": str(place), "share_inside": share, "threshold": threshold})
            if not as_json:
                note(f"{place}: {share:.0%} of the cases are inside all ranges (asked: {threshold:.0%})")
            continue
        folder = find_run(place)
        comparison = compare(folder, experiment)
        verdicts.append(comparison.inside)
        answers.append({"run": str(folder), **comparison.to_dict()})
        if not as_json:
            show_comparison(folder, comparison, quiet=quiet)
    if as_json:
        print_json(answers)
    raise typer.Exit(int(ExitCode.SUCCESS if all(verdicts) else ExitCode.OUTSIDE))


def show_comparison(folder: Path, comparison: Comparison, *, quiet: bool) -> None:
    """Print the comparison of one run."""
    if not quiet:
        note(f"{folder} against {comparison.source}")
    columns, rows = comparison_rows(comparison)
    print_table(None, columns, rows, left=2)
    for message in comparison.messages:
        note(message)
    if quiet:
        return
    outside = [row for row in comparison.rows if row.verdict == Verdict.OUTSIDE]
    for row in outside:
        note(f"outside: {row.quantity} of block {row.block} by {number(abs(row.distance))} {row.unit}")
    if not outside:
        note("all inside")


def comparison_rows(comparison: Comparison) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return column names and cells of a comparison, for a table 80 columns wide."""
    return COLUMNS, [_cells(row) for row in comparison.rows]


def _cells(row: ComparisonRow) -> tuple[str, ...]:
    return (
        row.block,
        f"{row.quantity} {row.unit}",
        number(row.simulated),
        f"{number(row.mean)} ± {number(row.s)}",
        f"[{number(row.minimum)}, {number(row.maximum)}]",
        number(row.error),
        str(row.verdict),
    )

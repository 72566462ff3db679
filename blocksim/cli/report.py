"""blocksim report: runs and sweeps as one HTML file."""

from pathlib import Path
from typing import Annotated

import typer

from blocksim.cli import options
from blocksim.cli.output import note
from blocksim.errors import InvalidInputError
from blocksim.simulation.own_files import refuse_foreign
from blocksim.study.reporting import MEMBERS, report_on

MEGABYTE = 1e6


def report_command(
    places: Annotated[
        list[Path],
        typer.Argument(
            metavar="RUN", help="Run folder, results/NAME, scenario file, folder of a sweep or study; one or several."
        ),
    ],
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="File to write.")] = Path("report.html"),
    experiment: options.ExperimentPath = None,
    members: Annotated[
        int,
        typer.Option("--runs", "--members", min=0, metavar="N", help="Maximum number of runs of a sweep in the page."),
    ] = MEMBERS,
    overwrite: options.Replace = False,
    quiet: options.Quiet = False,
) -> None:
    """Write runs and sweeps into one HTML file.

    It has a player, time histories, the comparison with measured repeats, energies and provenance; for a sweep the
    share of members inside, a table, a map and, with --keep-cases, the samples. The file is self-contained and can be
    opened from disk or sent by mail. Frames are thinned and rounded where they are many; the page says so. A run that
    was killed or damaged is shown as far as it can be read (exit code 65 for damage). An older report is replaced; any
    other file only with --overwrite.

    Example: blocksim report scenarios/three_blocks.toml --out three_blocks.html
    """
    refuse_foreign(out, overwrite=overwrite)
    size, problems = report_on(places, out, experiment, members, (lambda _: None) if quiet else note)
    if not quiet:
        note(f"report: {out} ({size / MEGABYTE:.1f} MB)")
    if problems:
        raise InvalidInputError("\n".join([*problems, "the report shows everything else"]))

"""blocksim plot: a strip of frames, or where the blocks of a sweep end."""

from pathlib import Path
from typing import Annotated

import typer

from blocksim.analysis.experiment import load_table
from blocksim.cli import options
from blocksim.cli.output import note
from blocksim.errors import InvalidInputError
from blocksim.study.many import TABLE
from blocksim.study.picture import draw_sweep
from blocksim.study.stored import stored_run
from blocksim.view.kinds import STRIP, kind_named
from blocksim.view.support import support_of


def plot_command(
    run: Annotated[
        Path, typer.Argument(metavar="RUN", help="Run folder, results/NAME, scenario file, or sweep folder.")
    ],
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="Picture to write: .png, .svg or .pdf.")
    ] = None,
    times: Annotated[
        str | None, typer.Option(metavar="T,T,...", help="Times of the frames in s (default: chosen by motion).")
    ] = None,
    kind: Annotated[
        str | None, typer.Option(metavar="KIND", help="Of a run: strip (default), final or history.")
    ] = None,
    experiment: options.ExperimentPath = None,
    quiet: options.Quiet = False,
) -> None:
    """Draw a run: a strip of frames, its end, or its histories.

    Below the final state of a run stand the measured ranges. --kind final shows where the blocks end, with rotation and
    measured range below each of them; --kind history shows x, y, rotation, energies and contacts over time. A run that
    was stopped or killed is drawn as far as it came. For a sweep over one key the picture shows final x against its
    values, with the measured range as a band; a second key gets a column for each of its values.

    Example: blocksim plot scenarios/three_blocks.toml --out strip.png
    """
    moments = _times(times)
    if (run / TABLE).is_file():
        _refuse_for_sweeps(run, times, kind)
        picture = draw_sweep(run, out, experiment)
    else:
        picture = _draw_run(run, out, moments, experiment, kind or STRIP)
    if not quiet:
        note(f"picture: {picture}")


def _draw_run(run: Path, out: Path | None, moments: list[float] | None, experiment: Path | None, kind: str) -> Path:
    draw = kind_named(kind)
    chosen = {} if moments is None else {"times": moments}
    if chosen and kind != STRIP:
        message = f"--times picks frames of the strip; --kind {kind} has none to pick"
        raise InvalidInputError(message)
    stored = stored_run(run)
    scenario = stored.scenario
    table = experiment or (scenario.experiment.table if scenario.experiment is not None else None)
    measured = None if table is None else load_table(table)
    picture = out or Path(f"{scenario.name}.png" if kind == STRIP else f"{scenario.name}_{kind}.png")
    draw(stored.frames, picture, title=scenario.name, measured=measured, support=support_of(scenario), **chosen)
    if stored.remark:
        note(stored.remark)
    return picture


def _refuse_for_sweeps(run: Path, times: str | None, kind: str | None) -> None:
    for option, value, picked in (("--times", times, "frames"), ("--kind", kind, "the picture")):
        if value is not None:
            message = f"{option} picks {picked} of a run, but {run} is a sweep"
            raise InvalidInputError(message)


def _times(text: str | None) -> list[float] | None:
    if text is None:
        return None
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        message = f"--times {text}: give times in seconds, separated by commas, such as 0,0.1,0.2"
        raise InvalidInputError(message) from None

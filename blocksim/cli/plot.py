"""blocksim plot: a strip of frames."""

from pathlib import Path
from typing import Annotated

import typer

from blocksim.analysis.experiment import load_table
from blocksim.cli import options
from blocksim.cli.output import note
from blocksim.errors import InvalidInputError
from blocksim.simulation import read_result
from blocksim.study.single import find_run
from blocksim.view.strip import draw_strip

FORMATS = (".png", ".svg", ".pdf")


def plot_command(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="Run folder, results/NAME or scenario file.")],
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="Picture to write: .png, .svg or .pdf.")
    ] = None,
    times: Annotated[
        str | None, typer.Option(metavar="T,T,...", help="Times of the frames in s (default: chosen by motion).")
    ] = None,
    experiment: options.ExperimentPath = None,
    quiet: options.Quiet = False,
) -> None:
    """Draw a strip of frames of a run, with the measured ranges under the final state.

    Example: blocksim plot scenarios/three_blocks.toml --out strip.png
    """
    folder = find_run(run)
    result = read_result(folder)
    table = experiment or result.experiment
    picture = out or Path(f"{result.name}.png")
    if picture.suffix.lower() not in FORMATS:
        message = f"{picture}: pictures end in {', '.join(FORMATS)}"
        raise InvalidInputError(message)
    measured = None if table is None else load_table(table)
    draw_strip(result.frames, picture, times=_times(times), title=result.name, measured=measured)
    if not quiet:
        note(f"Picture: {picture}")


def _times(text: str | None) -> list[float] | None:
    if text is None:
        return None
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        message = f"--times {text}: give times in seconds, separated by commas, such as 0,0.1,0.2"
        raise InvalidInputError(message) from None

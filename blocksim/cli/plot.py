"""blocksim plot: a strip of frames, where the blocks of a sweep end, or which inputs matter."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from blocksim.analysis.experiment import load_table
from blocksim.cli import options
from blocksim.cli.output import note
from blocksim.errors import InvalidInputError
from blocksim.simulation.own_files import is_picture, refuse_foreign
from blocksim.study.picture import draw_indices, draw_sweep
from blocksim.study.stored import stored_run
from blocksim.study.table import TABLE
from blocksim.view.kinds import STRIP, kind_named
from blocksim.view.support import support_of


def plot_command(
    run: Annotated[
        Path,
        typer.Argument(
            metavar="RUN", help="Run folder, results/NAME, scenario file, sweep folder, table of sensitivities."
        ),
    ],
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="Picture to write: .png, .svg or .pdf.")
    ] = None,
    times: Annotated[
        str | None, typer.Option(metavar="T,T,...", help="Times of the frames in s (default: chosen by motion).")
    ] = None,
    kind: Annotated[
        str | None,
        typer.Option(
            metavar="KIND",
            help="Of a run: strip (default), final or history. Of a sweep: lines, map (two inputs), matrix (every two "
            "inputs) or histogram; tornado for sensitivities (default: what suits).",
        ),
    ] = None,
    experiment: options.ExperimentPath = None,
    forces: options.Forces = False,
    overwrite: options.Replace = False,
    quiet: options.Quiet = False,
) -> None:
    """Draw a run, a sweep or a table of sensitivities.

    Below the final state of a run stand the measured ranges. --kind final shows where the blocks end, with rotation and
    measured range below each of them; --kind history shows x, y, rotation, energies and contacts over time. --forces
    draws contact forces as arrows, of runs that have stored them (output.contacts = true). A run that was stopped or
    killed is drawn as far as it came.

    A sweep over one key, or a second one with few values, shows final x as lines; one over two keys a map of
    run-outs and outcomes; a sampled one every two of its inputs. The measured range is marked in all of them.

    An older picture of blocksim is replaced; any other file only with --overwrite.

    Example: blocksim plot scenarios/three_blocks.toml --out strip.png
    """
    moments = _times(times)
    ready = partial(refuse_foreign, is_own=is_picture, overwrite=overwrite)
    if (run / TABLE).is_file():
        _refuse_times(run, times, forces, "a sweep")
        picture = draw_sweep(run, out, experiment, kind, ready=ready)
    elif run.suffix.lower() == ".csv":
        _refuse_times(run, times, forces, "a table")
        picture = draw_indices(run, out, kind, ready=ready)
    else:
        picture = _draw_run(run, out, moments, experiment, kind or STRIP, forces, ready)
    if not quiet:
        note(f"picture: {picture}")


def _draw_run(
    run: Path,
    out: Path | None,
    moments: list[float] | None,
    experiment: Path | None,
    kind: str,
    forces: bool,
    ready: Callable[[Path], None],
) -> Path:
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
    ready(picture)
    look = {"title": scenario.name, "measured": measured, "support": support_of(scenario), "forces": forces}
    draw(stored.frames, picture, **look, **chosen)
    if stored.remark:
        note(stored.remark)
    return picture


def _refuse_times(run: Path, times: str | None, forces: bool, what: str) -> None:
    if times is not None or forces:
        option = "--forces shows contacts of a run" if forces else "--times picks frames of a run"
        message = f"{option}, but {run} is {what}"
        raise InvalidInputError(message)


def _times(text: str | None) -> list[float] | None:
    if text is None:
        return None
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        message = f"--times {text}: give times in seconds, separated by commas, such as 0,0.1,0.2"
        raise InvalidInputError(message) from None

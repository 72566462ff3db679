"""blocksim plot: a strip of frames, where the blocks of a sweep end, or which inputs matter."""

from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from blocksim.cli import completion, options
from blocksim.cli.output import note
from blocksim.simulation.own_files import refuse_foreign
from blocksim.study.pictures import draw
from blocksim.study.run_pictures import RunLook


def plot_command(
    run: Annotated[
        Path,
        typer.Argument(
            metavar="RUN",
            help="Run folder, results/NAME, scenario file, folder of a sweep or study, table of sensitivities.",
        ),
    ],
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="Picture to write: .png, .svg or .pdf.")
    ] = None,
    times: Annotated[
        str | None,
        typer.Option(
            "--at",
            "--times",
            metavar="T,T,...",
            help="Times of the panels in s, as printed above them (default: by motion); of a final picture, one.",
        ),
    ] = None,
    kind: Annotated[
        str | None,
        typer.Option(
            metavar="KIND",
            help="Of a run: strip (default), final, history, profile (the surface of soil), motion (of the supports) "
            "or probe. Of a sweep: lines, "
            "map (two inputs), matrix (every two inputs) or histogram; tornado for sensitivities (default: what "
            "suits).",
            autocompletion=completion.kinds,
        ),
    ] = None,
    frames: Annotated[
        int | None, typer.Option("--frames", min=2, max=60, metavar="N", help="Panels of a strip (default: 6 to 8).")
    ] = None,
    panels: Annotated[
        str | None,
        typer.Option(
            metavar="P,P,...",
            help="Panels of a history: x, y, dx, dy, rotation, vx, vy, speed, spin, energy, contacts, force, ground; "
            "displacement is dx,dy and velocity vx,vy.",
        ),
    ] = None,
    blocks: Annotated[
        str | None, typer.Option("--block", metavar="N,N,...", help="Blocks of a history, by name.")
    ] = None,
    probes: Annotated[
        str | None, typer.Option("--probe", metavar="N,N,...", help="Probes to draw, by name (default: all).")
    ] = None,
    relative: Annotated[bool, typer.Option("--relative", help="Plot a history relative to the moving ground.")] = False,
    colour: options.Colour = "block",
    size: options.Size = None,
    dots: options.Dots = None,
    experiment: options.ExperimentPath = None,
    forces: options.Forces = False,
    overwrite: options.Replace = False,
    quiet: options.Quiet = False,
) -> None:
    """Draw a run, a sweep or a table of sensitivities.

    The strip shows the measured ranges below the final state. --kind final shows the final positions, with rotation
    and measured range below each of them; --kind history shows x, y, rotation, energies, contacts and the ground's
    motion over time, or the panels of --panels; --kind motion shows acceleration, velocity and displacement of the
    supports with their peaks, also of a scenario that has not been run; --kind probe shows what [[probes]] recorded;
    --kind profile shows the surface of soil at several times.
    --forces draws contact forces as arrows, of runs that have stored them (output.contacts = true). A run that was
    stopped or killed is drawn as far as it got.

    A sweep over one key, or a second one with few values, is drawn as lines of final x; over two keys as a map of
    run-outs and outcomes; a sampled one as a matrix of its inputs. The measured range is marked in all of them. A
    fragility study is drawn as its counts, with limits, and the curve with its band; a limit as the mechanism beside
    its last stable neighbour; limits over another key as a curve, beside those of a table that --experiment names
    (columns over, limit and series, with units as in limits.csv).

    An older picture of blocksim is replaced; any other file only with --overwrite.

    Example: blocksim plot scenarios/three_blocks.toml --out strip.png
    """
    chosen = options.names_of("--panels", panels), options.names_of("--block", blocks)
    asked = RunLook(_moments(times), frames, *chosen, relative, colour, forces, options.names_of("--probe", probes))
    paper = options.paper_of(size, dots)
    ready = partial(refuse_foreign, overwrite=overwrite)
    picture, remark = draw(run, out, asked, experiment, kind, paper, ready=ready)
    if remark:
        note(remark)
    if not quiet:
        note(f"picture: {picture}")


def _moments(text: str | None) -> tuple[float, ...] | None:
    """Return times in s. Raises BadParameter, a mistake of usage."""
    return None if text is None else tuple(map(_seconds, text.split(",")))


def _seconds(text: str) -> float:
    """Return a time in s, with or without its unit."""
    with suppress(ValueError):
        return float(text)
    with suppress(typer.BadParameter):
        return options.seconds_of(text)
    message = f"{text.strip()[:40]!r} is not a time; give seconds, separated by commas, such as 0,0.1,0.355 or '20 ms'"
    raise typer.BadParameter(message, param_hint="--at")

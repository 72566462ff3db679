"""blocksim plot: a strip of frames, where the blocks of a sweep end, or which inputs matter."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from blocksim.analysis.experiment import load_table
from blocksim.cli import options
from blocksim.cli.output import note
from blocksim.errors import InvalidInputError
from blocksim.simulation.own_files import is_picture, refuse_foreign
from blocksim.study.picture import draw_indices, draw_sweep
from blocksim.study.stored import stored_run
from blocksim.study.table import TABLE
from blocksim.view.curves import Choice
from blocksim.view.kinds import FINAL, HISTORY, STRIP, kind_named
from blocksim.view.paint import PAINTS
from blocksim.view.paper import Paper
from blocksim.view.support import support_of

MEANINGS = {
    "--at": "picks frames of a run's strip or final picture",
    "--frames": "counts the panels of a run's strip",
    "--panels": "chooses the panels of a run's history",
    "--block": "chooses the blocks of a run's history",
    "--relative": "moves a run's history with the ground",
    "--forces": "shows contacts of a run",
    "--colour": "colours the blocks of a run",
}


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
            help="Of a run: strip (default), final or history. Of a sweep: lines, map (two inputs), matrix (every two "
            "inputs) or histogram; tornado for sensitivities (default: what suits).",
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
    relative: Annotated[
        bool, typer.Option("--relative", help="Places and velocities of a history as seen from the moving ground.")
    ] = False,
    colour: options.Colour = "block",
    size: options.Size = None,
    dots: options.Dots = None,
    experiment: options.ExperimentPath = None,
    forces: options.Forces = False,
    overwrite: options.Replace = False,
    quiet: options.Quiet = False,
) -> None:
    """Draw a run, a sweep or a table of sensitivities.

    Below the final state of a run stand the measured ranges. --kind final shows where the blocks end, with rotation and
    measured range below each of them; --kind history shows x, y, rotation, energies, contacts and the ground's motion
    over time, or what --panels names. --forces draws contact forces as arrows, of runs that have stored them
    (output.contacts = true). A run that was stopped or killed is drawn as far as it came.

    A sweep over one key, or a second one with few values, shows final x as lines; one over two keys a map of
    run-outs and outcomes; a sampled one every two of its inputs. The measured range is marked in all of them.

    An older picture of blocksim is replaced; any other file only with --overwrite.

    Example: blocksim plot scenarios/three_blocks.toml --out strip.png
    """
    chosen = options.names_of("--panels", panels), options.names_of("--block", blocks)
    asked = Asked(_moments(times), frames, *chosen, relative, colour, forces)
    paper = options.paper_of(size, dots)
    ready = partial(refuse_foreign, is_own=is_picture, overwrite=overwrite)
    if (run / TABLE).is_file():
        _refuse(asked.of_runs(), f"{run} is a sweep")
        picture = draw_sweep(run, out, experiment, kind, paper, ready=ready)
    elif run.suffix.lower() == ".csv":
        _refuse(asked.of_runs(), f"{run} is a table")
        picture = draw_indices(run, out, kind, paper, ready=ready)
    else:
        picture = _draw_run(run, out, asked, experiment, kind or STRIP, paper, ready)
    if not quiet:
        note(f"picture: {picture}")


@dataclass(frozen=True)
class Asked:
    """What was asked of the picture of a run."""

    times: tuple[float, ...] | None
    frames: int | None
    panels: tuple[str, ...] | None
    blocks: tuple[str, ...] | None
    relative: bool
    colour: str
    forces: bool

    def of_runs(self) -> list[str]:
        """Return the options that were given and mean nothing for a sweep."""
        forces, colour = {"--forces": self.forces}, {"--colour": self.colour != "block"}
        given = {**self._of_strips(), **self._of_histories(), **forces, **colour}
        return [option for option, is_given in given.items() if is_given]

    def beside(self, kind: str) -> list[str]:
        """Return the options that were given and mean nothing for a kind of picture."""
        meant = {STRIP: self._of_histories(), FINAL: {**self._of_histories(), "--frames": self.frames is not None}}
        return [option for option, is_given in meant.get(kind, self._of_strips()).items() if is_given]

    def look(self, kind: str) -> dict[str, Any]:
        """Return what a kind of picture is drawn with."""
        if kind == HISTORY:
            return {"choice": Choice(self.panels or (), self.blocks or (), self.relative)}
        return {"times": self.times, "count": self.frames} if kind == STRIP else {"times": self.times}

    def _of_strips(self) -> dict[str, bool]:
        return {"--at": self.times is not None, "--frames": self.frames is not None}

    def _of_histories(self) -> dict[str, bool]:
        return {"--panels": self.panels is not None, "--block": self.blocks is not None, "--relative": self.relative}


def _draw_run(
    run: Path,
    out: Path | None,
    asked: Asked,
    experiment: Path | None,
    kind: str,
    paper: Paper,
    ready: Callable[[Path], None],
) -> Path:
    draw = kind_named(kind)
    _refuse(asked.beside(kind), f"this picture is of the kind {kind}")
    stored = stored_run(run)
    scenario = stored.scenario
    table = experiment or (scenario.experiment.table if scenario.experiment is not None else None)
    measured = None if table is None else load_table(table)
    picture = out or Path(f"{scenario.name}.png" if kind == STRIP else f"{scenario.name}_{kind}.png")
    ready(picture)
    look = {"title": scenario.name, "measured": measured, "support": support_of(scenario), "forces": asked.forces}
    paint = PAINTS[asked.colour](stored.frames, scenario)
    draw(stored.frames, picture, **look, **asked.look(kind), paint=paint, paper=paper)
    if stored.remark:
        note(stored.remark)
    return picture


def _refuse(given: Sequence[str], what: str) -> None:
    """Raise InvalidInputError for options that mean nothing for what is drawn."""
    if given:
        message = f"{given[0]} {MEANINGS[given[0]]}, but {what}"
        raise InvalidInputError(message)


def _moments(text: str | None) -> tuple[float, ...] | None:
    """Return times in s. Raises BadParameter, a mistake of usage."""
    return None if text is None else tuple(map(_seconds, text.split(",")))


def _seconds(text: str) -> float:
    """Return a time in s, with or without its unit."""
    with suppress(ValueError):
        return float(text)
    with suppress(typer.BadParameter):
        return options.seconds_of(text)
    message = f"{text.strip()[:40]!r} is no time; give seconds, separated by commas, such as 0,0.1,0.355 or '20 ms'"
    raise typer.BadParameter(message, param_hint="--at")

"""blocksim animate: a run as an animation."""

from pathlib import Path
from typing import Annotated

import typer

from blocksim.cli import options
from blocksim.cli.output import note, replacement
from blocksim.cli.progress import counting
from blocksim.simulation.own_files import refuse_foreign
from blocksim.study.stored_run import stored_run
from blocksim.view.animation import Look, Pace, draw_animation, writer_of
from blocksim.view.paint import paint_named
from blocksim.view.run_data import support_of


def animate_command(
    run: options.StoredRunPath,
    out: Annotated[Path | None, typer.Option("--out", metavar="FILE", help="Animation to write: .gif or .mp4.")] = None,
    speed: Annotated[
        float, typer.Option(min=1e-6, max=1e6, metavar="FACTOR", help="Simulated seconds per second of the animation.")
    ] = 0.25,
    fps: Annotated[float, typer.Option(min=0.1, max=240.0, metavar="N", help="Frames per second; 50 in a GIF.")] = 30.0,
    trails: Annotated[
        bool | None, typer.Option("--trails/--no-trails", help="Paths of the centres (default: up to 30 blocks).")
    ] = None,
    forces: options.Forces = False,
    colour: options.Colour = "block",
    width: Annotated[int, typer.Option(min=200, max=4000, metavar="PX", help="Width in pixels.")] = 800,
    overwrite: options.Replace = False,
    quiet: options.Quiet = False,
) -> None:
    """Render a run as an animation, GIF or MP4.

    The default is a GIF, NAME.gif, at a quarter of the real speed; the last frame is held. A run that was
    stopped or killed is shown as far as it got. --forces needs a run that has stored contacts (output.contacts =
    true), MP4 the extra `video` or the system's ffmpeg. The view is fitted to the blocks; a few that travel far may
    leave it. An older animation of blocksim is replaced; any other file only with --overwrite.

    Example: blocksim animate scenarios/three_blocks.toml --speed 0.1
    """
    if out is not None:
        writer_of(out)
    stored = stored_run(run)
    animation = out or Path(f"{stored.scenario.name}.gif")
    refuse_foreign(animation, overwrite=overwrite)
    support = support_of(stored.scenario, stored.events)
    older = replacement(animation)
    look = Look(width, trails, stored.scenario.name, forces, paint_named(colour, stored.frames, stored.scenario))
    with counting("frames", quiet=quiet) as on_picture:
        count, beyond = draw_animation(stored.frames, animation, Pace(speed, fps), look, support, on_picture)
    if stored.remark:
        note(stored.remark)
    if not quiet:
        note(f"animation: {animation} ({older}{count} frames{f'; {beyond}' if beyond else ''})")

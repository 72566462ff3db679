"""A run as a strip of pictures on one common scale, like Figure 4 of the paper."""

from collections.abc import Sequence
from pathlib import Path
from textwrap import wrap

import numpy as np

from blocksim.view import style
from blocksim.view.forces import ForceScale, WithContacts, draw_forces, force_scale
from blocksim.view.layout import OWN, Paper, write_heading, write_text
from blocksim.view.load_arrows import draw_marks, draw_outside
from blocksim.view.loads import length_in, outside, with_room
from blocksim.view.measured import MeasuredTable, measured_ranges, rows_of, widened
from blocksim.view.paint import Paint, by_block, draw_key
from blocksim.view.panel import ROW_HEIGHT, Canvas, depth_of, draw_ruler, finish_panel
from blocksim.view.run_data import FramesLike, Support, drawable_frames, moments_at, moments_by_motion
from blocksim.view.scene import TOP, MeasuredRange, Scene, draw_centres, draw_measured, draw_scene, readable_scale
from blocksim.view.strip_layout import (
    LEAST_WIDTH,
    LINE,
    POINTS,
    SIDE,
    WIDTH,
    Lines,
    arrangement,
    plan,
)
from blocksim.view.window import MILLIMETRES, extent_of

LETTERS_AN_INCH = 15.0  # in a line below the strip
CAPTION = 3.0  # points, from a panel to the text above it
LEAST_MOVED = 0.005  # mm; less is zero in two decimals


def draw_strip(
    frames: WithContacts,
    path: Path | str,
    times: Sequence[float] | None = None,
    title: str | None = None,
    measured: MeasuredTable | None = None,
    support: Support | None = None,
    *,
    forces: bool = False,
    count: int | None = None,
    paint: Paint | None = None,
    paper: Paper = OWN,
) -> None:
    """Draw the run as 6 to 8 panels from release to the final state and write them as PNG, SVG or PDF.

    `times` (s) selects the panels, `count` is their maximum number. With `measured` the last panel shows
    mean and range of the measured centres below the ground. `support` is what the blocks stand on: level ground at rest
    if it is not given. `forces` draws those of all contacts; `paint` colours the blocks. The same input gives the same
    bytes. Raises InvalidInputError for an unknown picture format, a time that was not recorded, forces that were not, a
    page that is too small or nothing to draw, and OutputError when the file cannot be written.
    """
    path = Path(path)
    style.picture_suffix(path)
    support, paint = support or Support(), paint or by_block(frames)
    drawable = drawable_frames(frames)
    scale = force_scale(frames) if forces else None
    extent = extent_of(frames, drawable, support)
    length = length_in(extent)
    extent = with_room(extent, outside(frames, drawable, support), length)
    ranges = [] if measured is None else measured_ranges(measured, frames.names, extent.width)
    extent = widened(extent, ranges)
    columns, usual = arrangement(extent, readable_scale(frames))
    if times is None:
        carried = support.offset(frames.time[drawable])
        chosen = moments_by_motion(frames, drawable, count or usual, carried)
    else:
        chosen = moments_at(frames, drawable, times)
        ranges = ranges if chosen[-1] == drawable[-1] else []  # they belong to the final state
    acts = outside(frames, chosen, support)
    upper = [TOP] if frames.names else []
    told = [*upper, _legend(ranges, support, scale), acts.explanation]
    notes = wrap(" ".join(filter(None, told)), int(LETTERS_AN_INCH * paper.width(WIDTH, LEAST_WIDTH)))
    captions = 1 + (support.motion is not None) + any(acts.marks)
    lines = Lines(captions, len(notes), rows_of(ranges), paint.height)
    layout = plan(paper, extent, columns, len(chosen), lines)
    scene = Scene(frames, support, paint)
    with style.styled_figure(layout.width, layout.height, paper.dots) as figure:
        for index, frame in enumerate(chosen.tolist()):
            is_last = index == len(chosen) - 1
            canvas = Canvas(figure.add_axes(layout.place(index)), layout.extent, layout.points_per_mm)
            draw_scene(canvas, scene, frame)
            if is_last and ranges:
                draw_centres(canvas, frames, frame)
                draw_measured(canvas, ranges, ROW_HEIGHT)
            is_lowest = index + layout.columns >= len(chosen)
            finish_panel(canvas, (layout.panel_width, layout.panel_height), labelled=is_lowest)
            if layout.extent.tilt:
                draw_ruler(canvas, depth_of(rows_of(ranges)))
            draw_outside(canvas, acts, index, length)
            draw_marks(canvas, acts.marks[index], up=2.0)
            pad = CAPTION + (LINE * POINTS if acts.marks[index] else 0.0)  # marks stand below the time
            canvas.axes.set_title(_caption(frames, frame, support), loc="left", pad=pad)
            if scale is not None:
                draw_forces(canvas, frames, frame, scale)
        write_heading(figure, title, SIDE)
        write_text(figure, SIDE, 0.05, "\n".join(notes), color=style.FAINT_INK, va="bottom")
        draw_key(figure, paint, SIDE, 0.05 + len(notes) * LINE)
        style.save_figure(figure, path)


def _caption(frames: FramesLike, frame: int, support: Support) -> str:
    """Return the time of a frame and the displacement of the support; the two ends of a run are named."""
    time = f"{float(frames.time[frame]):.3f} s"
    if frame == 0:
        time = f"{time}, release"
    elif frame == len(frames.time) - 1:
        time = f"{time}, final"
    if support.motion is None:
        return time
    moved = MILLIMETRES * float(support.displacement(frames.time[frame : frame + 1])[0])
    shown = f"{moved:+.2f}".replace("-", "−") if abs(moved) >= LEAST_MOVED else "0.00"
    return f"{time}\nsupport {shown} mm"


def _legend(ranges: Sequence[MeasuredRange], support: Support, scale: ForceScale | None) -> str:
    texts = []
    if any(support.fixed):
        texts.append("Grey: fixed.")
    if support.motion is not None:
        texts.append(f"The support moves {support.way}; dashes and arrow: from where it was at the start.")
    if support.tilt:
        angle = f"{float(np.degrees(support.tilt)):.3g}°".replace("-", "−")
        texts.append(f"The ground is tilted by {angle}, gravity points down; x along the ground in mm.")
    if ranges:
        texts.append("Last panel: simulated centres marked on the ground, measured mean and range below it.")
    if scale is not None:
        texts.append(scale.explanation)
    return " ".join(texts)

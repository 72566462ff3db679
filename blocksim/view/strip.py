"""A run as a strip of panels on one scale, and the surface of soil at several times."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from textwrap import wrap

import numpy as np

from blocksim.errors import InvalidInputError
from blocksim.view import style
from blocksim.view.arrows import (
    ForceScale,
    WithContacts,
    draw_forces,
    draw_marks,
    draw_outside,
    force_scale,
    length_in,
    outside,
    with_room,
)
from blocksim.view.final import MeasuredTable, measured_ranges, rows_of, widened
from blocksim.view.paint import Paint, by_block, draw_key
from blocksim.view.run_data import (
    MILLIMETRES,
    Extent,
    FramesLike,
    Support,
    drawable_frames,
    extent_of,
    moments_at,
    moments_by_motion,
    others_of,
)
from blocksim.view.scene import (
    ROW_HEIGHT,
    TOP,
    Canvas,
    MeasuredRange,
    Scene,
    depth_of,
    draw_centres,
    draw_measured,
    draw_ruler,
    draw_scene,
    finish_panel,
    page_for,
    readable_scale,
    room_below,
)
from blocksim.view.style import OWN, Paper, write_heading, write_text

WIDTH = 10.0  # inches, of the whole strip
SIDE, GAP = 0.25, 0.25  # inches, at the left and right end and between columns
_HEAD, TITLE, FOOT = 0.22, 0.30, 0.52  # inches: time above a panel, title of the strip, axis and legend below
LINE = 0.155  # inches, of each further line of text above a panel or below the strip
LEAST_WIDTH, NARROWEST_PANEL, LOWEST_PANEL = 1.75, 1.25, 0.25  # inches, on a page whose size was asked for
POINTS = style.POINTS_PER_INCH
TICKS = 0.26  # inches, for the numbers under a row of panels
TALLEST_PANEL = 4.0  # inches
WIDEST_IN_FOURS, WIDEST_IN_PAIRS = 2.5, 6.0  # width over height, so that a panel stays about an inch tall
LOW_ENOUGH = 1.6  # width over height from which four rows of pairs fit on a page


@dataclass(frozen=True)
class Lines:
    """Lines of text above each panel and below the strip, rows of measured ranges, height of the key (inches)."""

    captions: int = 1
    notes: int = 1
    measured_rows: int = 0
    key: float = 0.0


@dataclass(frozen=True)
class Layout:
    """How the panels are arranged, in inches; `points_per_mm` is the scale of all of them."""

    columns: int
    rows: int
    panel_width: float
    panel_height: float
    points_per_mm: float
    height: float
    extent: Extent
    head: float = _HEAD
    foot: float = FOOT
    width: float = WIDTH

    @property
    def ticks(self) -> float:
        """Height of the numbers under a row of panels; tilted panels have theirs inside."""
        return 0.0 if self.extent.tilt else TICKS

    def place(self, index: int) -> tuple[float, float, float, float]:
        """Return left, bottom, width, height of a panel as parts of the figure."""
        row, column = divmod(index, self.columns)
        used = self.columns * self.panel_width + (self.columns - 1) * GAP
        left = 0.5 * (self.width - used) + column * (self.panel_width + GAP)
        bottom = self.foot + (self.rows - 1 - row) * (self.panel_height + self.head + self.ticks)
        return left / self.width, bottom / self.height, self.panel_width / self.width, self.panel_height / self.height


def arrangement(extent: Extent, readable: float = 0.0) -> tuple[int, int]:
    """Return the number of columns and the number of panels: flat and long scenes get few columns.

    So do scenes in between where names are `readable`, from that many points a mm on, in two columns but not in four.
    """
    aspect = extent.width / extent.height
    if aspect <= WIDEST_IN_FOURS:
        fours, pairs = (style.POINTS_PER_INCH * _panel_width(columns) / extent.width for columns in (4, 2))
        return (2, 8) if aspect >= LOW_ENOUGH and fours < readable <= pairs else (4, 8)
    return (2, 8) if aspect <= WIDEST_IN_PAIRS else (1, 6)


def plan(paper: Paper, extent: Extent, columns: int, panels: int, lines: Lines) -> Layout:
    """Fit the panels into a page. Where its size was asked for, as many columns as make them largest.

    Raises InvalidInputError for a page that is too small.
    """
    width = paper.width(WIDTH, LEAST_WIDTH)
    if paper.size is None:
        columns = min(columns, panels)
        scale = min(_panel_width(columns, width) / extent.width, TALLEST_PANEL / extent.height)  # inches per mm
        return _laid_out(extent, columns, panels, lines, (width, scale))
    most = max(1, min(panels, int((width - 2.0 * SIDE + GAP) / (NARROWEST_PANEL + GAP))))
    scale, columns = max((_scale_on(paper, extent, columns, panels, lines), columns) for columns in range(1, most + 1))
    rows = -(-panels // columns)
    paper.panel(0.0, rows, _others(extent, columns, panels, lines), LOWEST_PANEL)  # refuses a page that is too small
    narrow = 0.5 * max(NARROWEST_PANEL / scale - extent.width, 0.0)  # so that captions do not run into each other
    extent = replace(extent, left=extent.left - narrow, right=extent.right + narrow)
    layout = _laid_out(extent, columns, panels, lines, (width, scale))
    spare = paper.size[1] - layout.height
    return replace(layout, height=paper.size[1], head=layout.head + spare / layout.rows)


def _scale_on(paper: Paper, extent: Extent, columns: int, panels: int, lines: Lines) -> float:
    """Return the largest scale (inches per mm) at which so many columns fit into a page of a given size; 0 if none."""
    rows = -(-panels // columns)
    below = room_below(extent, lines.measured_rows) / style.POINTS_PER_INCH
    height = (paper.height(0.0) - _others(extent, columns, panels, lines)) / rows
    if height < LOWEST_PANEL:
        return 0.0
    tallest = min(height / (extent.top - extent.lowest), (height + below) / (extent.top - extent.bottom))
    return min(_panel_width(columns, paper.width(WIDTH)) / extent.width, tallest)


def _others(extent: Extent, columns: int, panels: int, lines: Lines) -> float:
    """Return the height (inches) of everything but the part of panels above the lowest ground."""
    rows = -(-panels // columns)
    ticks, head, foot = _heights(extent, lines)
    below = room_below(extent, lines.measured_rows) / style.POINTS_PER_INCH
    return TITLE + rows * (head + below) + (rows - 1) * ticks + foot


def _laid_out(extent: Extent, columns: int, panels: int, lines: Lines, page: tuple[float, float]) -> Layout:
    """Return the layout for a width (inches) and a scale (inches per mm)."""
    width, scale = page
    rows = -(-panels // columns)
    below = max((extent.lowest - extent.bottom) * scale, room_below(extent, lines.measured_rows) / POINTS)
    panel_height = (extent.top - extent.lowest) * scale + below
    ticks, head, foot = _heights(extent, lines)
    height = TITLE + rows * (panel_height + head) + (rows - 1) * ticks + foot
    return Layout(columns, rows, extent.width * scale, panel_height, scale * POINTS, height, extent, head, foot, width)


def _heights(extent: Extent, lines: Lines) -> tuple[float, float, float]:
    """Return the heights (inches) of the numbers below a panel, the text above it, and all below the strip."""
    ticks = 0.0 if extent.tilt else TICKS
    return ticks, _HEAD + (lines.captions - 1) * LINE, FOOT - TICKS + ticks + (lines.notes - 1) * LINE + lines.key


def _panel_width(columns: int, width: float = WIDTH) -> float:
    """Return the width that a panel may have (inches)."""
    return (width - 2.0 * SIDE - (columns - 1) * GAP) / columns


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


_WIDTH, _LEAST_WIDTH, TALLEST = 7.2, 2.0, 6.0  # inches
_SIDE, _HEAD_PROFILE, AXIS = 0.25, 0.40, 0.42  # inches
LINES = 6  # by default
COLOURS = "viridis"
PALE = "#e8e8e8"
THICK = 1.4  # points


def draw_profile(
    frames: WithContacts,
    path: Path | str,
    title: str | None = None,
    measured: MeasuredTable | None = None,  # noqa: ARG001 - of blocks
    support: Support | None = None,
    *,
    forces: bool = False,  # noqa: ARG001 - of blocks
    times: Sequence[float] | None = None,
    paint: Paint | None = None,  # noqa: ARG001 - lines are coloured by time
    paper: Paper = OWN,
) -> None:
    """Draw the surface of soil at these times (s), by default at six that are even in motion.

    Raises InvalidInputError for an unknown picture format, a run without soil, a time that was not stored or a page
    that is too small, and OutputError when the file cannot be written.
    """
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    path = Path(path)
    style.picture_suffix(path)
    support = support or Support()
    drawable = drawable_frames(frames)
    chosen = moments_by_motion(frames, drawable, LINES) if times is None else moments_at(frames, drawable, times)
    chosen = np.unique(chosen)
    soils = [track for track in others_of(frames) if track.system.profile is not None]
    lines = [
        [line for one in soils if one.system.profile for line in one.system.profile(one, frame)]
        for frame in chosen.tolist()
    ]
    if not any(lines):
        message = "no soil in this run: --kind profile draws its surface"
        raise InvalidInputError(message)
    shades = [to_hex(colour) for colour in colormaps[COLOURS](np.linspace(0.0, 0.85, len(chosen)))]  # dark to light
    named = tuple((f"{float(frames.time[frame]):.3f} s", shade) for frame, shade in zip(chosen, shades, strict=True))
    key = Paint(lambda _: [PALE] * len(frames.names), named)
    page = page_for(
        extent_of(frames, drawable, support),
        paper.width(_WIDTH, _LEAST_WIDTH),
        TALLEST,
        (_SIDE, _HEAD_PROFILE, AXIS + key.height),
    )
    with style.styled_figure(page.width, paper.height(page.height), paper.dots) as figure:
        canvas = Canvas(figure.add_axes(page.place), page.extent, page.points_per_mm)
        draw_scene(canvas, Scene(frames, support, key, with_others=False), int(chosen[-1]))
        for shade, of_frame in zip(shades, lines, strict=True):
            for line in of_frame:
                canvas.axes.plot(*(MILLIMETRES * line).T, color=shade, linewidth=THICK, transform=canvas.scene)
        finish_panel(canvas, (page.panel_width, page.panel_height), labelled=True)
        if page.extent.tilt:
            draw_ruler(canvas, depth_of(0))
        draw_key(figure, key, _SIDE, 0.06)
        if title:
            shown = style.cut_to(f"{title}: surface", page.panel_width * style.POINTS_PER_INCH, style.TITLE_SIZE)
            figure.text(_SIDE / page.width, 1.0 - 0.08 / page.height, shown, va="top", fontsize=style.TITLE_SIZE)
        style.save_figure(figure, path)

"""A run as a strip of pictures on one common scale, like Figure 4 of the paper."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Protocol

import numpy as np

from blocksim.view import style
from blocksim.view.forces import ForceScale, WithContacts, draw_forces, force_scale
from blocksim.view.layout import OWN, Paper, write_heading
from blocksim.view.load_arrows import draw_marks, draw_outside
from blocksim.view.loads import Outside, length_in, outside, with_room
from blocksim.view.paint import Paint, by_block, draw_key
from blocksim.view.panel import ROW_HEIGHT, Canvas, depth_of, draw_ruler, finish_panel, room_below
from blocksim.view.run_data import FramesLike, Indices, Support, drawable_frames, moments_at, moments_by_motion
from blocksim.view.scene import MeasuredRange, draw_centres, draw_measured, draw_scene, readable_scale
from blocksim.view.window import MILLIMETRES, Extent, extent_of

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

WIDTH = 10.0  # inches, of the whole strip
SIDE, GAP = 0.25, 0.25  # inches, at the left and right end and between columns
HEAD, TITLE, FOOT = 0.22, 0.30, 0.52  # inches: time above a panel, title of the strip, axis and legend below
LINE = 0.155  # inches, of each further line of text above a panel or below the strip
LETTERS_AN_INCH = 15.0  # in a line below the strip
LEAST_WIDTH, NARROWEST_PANEL, LOWEST_PANEL = 1.75, 1.25, 0.25  # inches, on a page whose size was asked for
POINTS = style.POINTS_PER_INCH
CAPTION = 3.0  # points, from a panel to the text above it
TICKS = 0.26  # inches, for the numbers under a row of panels
TALLEST_PANEL = 4.0  # inches
WIDEST_IN_FOURS, WIDEST_IN_PAIRS = 2.5, 6.0  # width over height, so that a panel stays about an inch tall
LOW_ENOUGH = 1.6  # width over height from which four rows of pairs fit on a page
NARROWEST = 0.35  # width over height
LEAST_MOVED = 0.005  # mm; less is zero in two decimals
RANGE_GAP = 0.06  # part of the width that two measured ranges in one row keep apart


class MeasuredTable(Protocol):
    """The part of a measured table that pictures need."""

    def statistics(self) -> "pd.DataFrame":
        """Return one row a block and quantity: block, quantity, mean, minimum, maximum (mm), ..."""
        ...


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
    head: float = HEAD
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


def draw_strip(  # noqa: PLR0913 - one argument for each option of the command
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
    extent, length = _window(frames, drawable, support)
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
    upper = ["Thick line inside a block: its own upper side."] if frames.names else []
    told = [*upper, _legend(ranges, support, scale), acts.explanation]
    notes = wrap(" ".join(filter(None, told)), int(LETTERS_AN_INCH * paper.width(WIDTH, LEAST_WIDTH)))
    lines = Lines(_captions(support, acts), len(notes), rows_of(ranges), paint.height)
    layout = plan_on(paper, extent, columns, len(chosen), lines)
    with style.styled_figure(layout.width, layout.height, paper.dots) as figure:
        _draw_panels(figure, frames, chosen, layout, ranges, support, paint)
        _draw_acts(figure, acts, layout, length)
        if scale is not None:
            _draw_forces(figure, frames, chosen, layout, scale)
        _draw_texts(figure, layout, title, notes)
        draw_key(figure, paint, SIDE, 0.05 + len(notes) * LINE)
        style.save_figure(figure, path)


def arrangement(extent: Extent, readable: float = 0.0) -> tuple[int, int]:
    """Return the number of columns and the number of panels: flat and long scenes get few columns.

    So do scenes in between where names are `readable`, from that many points a mm on, in two columns but not in four.
    """
    aspect = extent.width / extent.height
    if aspect <= WIDEST_IN_FOURS:
        fours, pairs = (style.POINTS_PER_INCH * _panel_width(columns) / extent.width for columns in (4, 2))
        return (2, 8) if aspect >= LOW_ENOUGH and fours < readable <= pairs else (4, 8)
    return (2, 8) if aspect <= WIDEST_IN_PAIRS else (1, 6)


def plan(extent: Extent, columns: int, panels: int, measured_rows: int, captions: int = 1, notes: int = 1) -> Layout:
    """Fit the panels into the width of the strip, all at one scale, with room for what stands below the ground.

    `captions` and `notes` count the lines of text above each panel and below the strip.
    """
    return plan_on(OWN, extent, columns, panels, Lines(captions, notes, measured_rows))


def plan_on(paper: Paper, extent: Extent, columns: int, panels: int, lines: Lines) -> Layout:
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
    return ticks, HEAD + (lines.captions - 1) * LINE, FOOT - TICKS + ticks + (lines.notes - 1) * LINE + lines.key


def _panel_width(columns: int, width: float = WIDTH) -> float:
    """Return the width that a panel may have (inches)."""
    return (width - 2.0 * SIDE - (columns - 1) * GAP) / columns


def measured_ranges(measured: MeasuredTable, names: Sequence[str], width: float) -> list[MeasuredRange]:
    """Return the measured centres (mm) of the blocks, in rows without overlap; `width` (mm) is shown."""
    statistics = measured.statistics()
    centres = statistics[(statistics["quantity"] == "x") & statistics["block"].isin(names)]
    row_ends: list[float] = []
    ranges = []
    for line in centres.sort_values("minimum", kind="stable").itertuples():
        mean, minimum, maximum = (float(getattr(line, key)) for key in ("mean", "minimum", "maximum"))
        row = next((row for row, end in enumerate(row_ends) if end < minimum), len(row_ends))
        row_ends[row : row + 1] = [maximum + RANGE_GAP * width]
        ranges.append(MeasuredRange(str(line.block), mean, minimum, maximum, row))
    return ranges


def rows_of(ranges: Sequence[MeasuredRange]) -> int:
    """Return the number of rows that measured ranges take."""
    return 1 + max((item.row for item in ranges), default=-1)


def widened(extent: Extent, ranges: Sequence[MeasuredRange]) -> Extent:
    """Return an extent that also holds the measured ranges, and is wide enough for the time above a tower."""
    margin = RANGE_GAP * extent.width
    missing = max(NARROWEST * extent.height - extent.width, 0.0)
    cosine, shift = float(np.cos(extent.tilt)), extent.base * float(np.sin(extent.tilt))
    left = min([extent.left - 0.5 * missing, *(cosine * item.minimum - shift - 0.5 * margin for item in ranges)])
    right = max([extent.right + 0.5 * missing, *(cosine * item.maximum - shift + margin for item in ranges)])
    return replace(extent, left=left, right=right)


def _draw_panels(  # noqa: PLR0913, PLR0917 - what is drawn, and where
    figure: "Figure",
    frames: FramesLike,
    chosen: Indices,
    layout: Layout,
    ranges: list[MeasuredRange],
    support: Support,
    paint: Paint,
) -> None:
    last = len(chosen) - 1
    for index, frame in enumerate(int(frame) for frame in chosen):
        canvas = Canvas(figure.add_axes(layout.place(index)), layout.extent, layout.points_per_mm)
        draw_scene(canvas, frames, frame, support, paint)
        if ranges and index == last:
            draw_centres(canvas, frames, frame)
            draw_measured(canvas, ranges, ROW_HEIGHT)
        finish_panel(canvas, (layout.panel_width, layout.panel_height), labelled=index + layout.columns > last)
        if layout.extent.tilt:
            draw_ruler(canvas, depth_of(rows_of(ranges)))
        canvas.axes.set_title(_caption(frames, frame, support), loc="left", pad=CAPTION)


def _window(frames: FramesLike, drawable: Indices, support: Support) -> tuple[Extent, float]:
    """Return the extent that holds blocks and arrows of loads, and the length (mm) of the longest arrow."""
    extent = extent_of(frames, drawable, support)
    length = length_in(extent)
    return with_room(extent, outside(frames, drawable, support), length), length


def _captions(support: Support, acts: Outside) -> int:
    """Return the lines of text above each panel: time, displacement of the support, loads on all bodies."""
    return 1 + (support.motion is not None) + any(acts.marks)


def _draw_acts(figure: "Figure", acts: Outside, layout: Layout, length: float) -> None:
    """Add what acts from outside to all panels, and above them what acts on all bodies, below the time."""
    for index, axes in enumerate(() if acts.is_empty else figure.axes):
        canvas = Canvas(axes, layout.extent, layout.points_per_mm)
        draw_outside(canvas, acts, index, length)
        if acts.marks[index]:
            draw_marks(canvas, acts.marks[index], up=2.0)
            axes.set_title(axes.get_title(loc="left"), loc="left", pad=CAPTION + LINE * POINTS)


def _draw_forces(figure: "Figure", frames: WithContacts, chosen: Indices, layout: Layout, scale: ForceScale) -> None:
    """Add the contact forces of every moment to its panel."""
    for axes, frame in zip(figure.axes, chosen, strict=True):
        draw_forces(Canvas(axes, layout.extent, layout.points_per_mm), frames, int(frame), scale)


def _draw_texts(figure: "Figure", layout: Layout, title: str | None, notes: Sequence[str]) -> None:
    side = SIDE / layout.width
    write_heading(figure, title, SIDE)
    figure.text(side, 0.05 / layout.height, "\n".join(notes), color=style.FAINT_INK, va="bottom")


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

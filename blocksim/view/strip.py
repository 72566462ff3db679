"""A run as a strip of pictures on one common scale, like Figure 4 of the paper."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from blocksim.view import style
from blocksim.view.moments import FramesLike, Indices, drawable_frames, moments_at, moments_by_motion
from blocksim.view.scene import (
    GROUND_THICKNESS,
    Extent,
    MeasuredRange,
    draw_centres,
    draw_measured,
    draw_scene,
    extent_of,
)

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH = 10.0  # inches, of the whole strip
SIDE, GAP = 0.25, 0.25  # inches, at the left and right end and between columns
HEAD, TITLE, FOOT = 0.22, 0.30, 0.52  # inches: time above a panel, title of the strip, axis and legend below
TICKS = 0.26  # inches, for the numbers under a row of panels
TICK_ROOM = 0.4  # inches along the axis for one number
TALLEST_PANEL = 4.0  # inches
ROW_HEIGHT = 9.0  # points, of one row of measured ranges
WIDEST_IN_FOURS, WIDEST_IN_PAIRS = 2.5, 6.0  # width over height, so that a panel stays about an inch tall
NARROWEST = 0.35  # width over height
RANGE_GAP = 0.06  # part of the width that two measured ranges in one row keep apart


class MeasuredTable(Protocol):
    """The part of a measured table that pictures need."""

    def statistics(self) -> "pd.DataFrame":
        """Return one row a block and quantity: block, quantity, mean, minimum, maximum (mm), ..."""
        ...


@dataclass(frozen=True)
class Layout:
    """How the panels are arranged, in inches; `points_per_mm` is the scale of all of them."""

    columns: int
    rows: int
    panel_width: float
    panel_height: float
    points_per_mm: float
    height: float

    def place(self, index: int) -> tuple[float, float, float, float]:
        """Return left, bottom, width, height of a panel as parts of the figure."""
        row, column = divmod(index, self.columns)
        used = self.columns * self.panel_width + (self.columns - 1) * GAP
        left = 0.5 * (WIDTH - used) + column * (self.panel_width + GAP)
        bottom = FOOT + (self.rows - 1 - row) * (self.panel_height + HEAD + TICKS)
        return left / WIDTH, bottom / self.height, self.panel_width / WIDTH, self.panel_height / self.height


def draw_strip(
    frames: FramesLike,
    path: Path | str,
    times: Sequence[float] | None = None,
    title: str | None = None,
    measured: MeasuredTable | None = None,
) -> None:
    """Draw the run as 6 to 8 panels from release to the final state and write them as PNG, SVG or PDF.

    `times` (s) picks the panels by hand. With `measured` the last panel shows mean and range of the measured
    centres below the ground. The same input gives the same bytes. Raises InvalidInputError for an unknown
    picture format, a time that was not recorded, or nothing to draw, and OutputError when the file cannot be
    written.
    """
    path = Path(path)
    style.picture_suffix(path)
    drawable = drawable_frames(frames)
    extent = extent_of(frames, drawable)
    ranges = [] if measured is None else measured_ranges(measured, frames.names, extent.width)
    extent = widened(extent, ranges)
    columns, count = arrangement(extent)
    if times is None:
        chosen = moments_by_motion(frames, drawable, count)
    else:
        chosen = moments_at(frames, drawable, times)
        ranges = ranges if chosen[-1] == drawable[-1] else []  # they belong to the final state
    layout = plan(extent, columns, len(chosen), 1 + max((item.row for item in ranges), default=-1))
    with style.styled_figure(WIDTH, layout.height) as figure:
        _draw_panels(figure, frames, chosen, extent, layout, ranges)
        _draw_texts(figure, layout, title, ranges)
        style.save_figure(figure, path)


def arrangement(extent: Extent) -> tuple[int, int]:
    """Return the number of columns and the number of panels: flat and long scenes get few columns."""
    aspect = extent.width / extent.height
    if aspect <= WIDEST_IN_FOURS:
        return 4, 8
    return (2, 8) if aspect <= WIDEST_IN_PAIRS else (1, 6)


def plan(extent: Extent, columns: int, panels: int, measured_rows: int) -> Layout:
    """Fit the panels into the width of the strip, all at one scale, with room for rows of measured ranges."""
    columns = min(columns, panels)
    rows = -(-panels // columns)
    panel_width = (WIDTH - 2.0 * SIDE - (columns - 1) * GAP) / columns
    scale = min(panel_width / extent.width, TALLEST_PANEL / extent.height)  # inches per mm
    ground = (GROUND_THICKNESS + (measured_rows + 0.4) * ROW_HEIGHT) / style.POINTS_PER_INCH
    below = max(-extent.bottom * scale, ground)
    panel_height = extent.top * scale + below
    height = TITLE + rows * (panel_height + HEAD) + (rows - 1) * TICKS + FOOT
    return Layout(columns, rows, extent.width * scale, panel_height, scale * style.POINTS_PER_INCH, height)


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


def widened(extent: Extent, ranges: Sequence[MeasuredRange]) -> Extent:
    """Return an extent that also holds the measured ranges, and is wide enough for the time above a tower."""
    margin = RANGE_GAP * extent.width
    missing = max(NARROWEST * extent.height - extent.width, 0.0)
    left = min([extent.left - 0.5 * missing, *(item.minimum - 0.5 * margin for item in ranges)])
    right = max([extent.right + 0.5 * missing, *(item.maximum + margin for item in ranges)])
    return Extent(left, right, extent.bottom, extent.top)


def _draw_panels(
    figure: "Figure",
    frames: FramesLike,
    chosen: Indices,
    extent: Extent,
    layout: Layout,
    ranges: list[MeasuredRange],
) -> None:
    last = len(chosen) - 1
    for index, frame in enumerate(int(frame) for frame in chosen):
        axes = figure.add_axes(layout.place(index))
        draw_scene(axes, frames, frame, extent, layout.points_per_mm)
        if ranges and index == last:
            draw_centres(axes, frames, frame, layout.points_per_mm)
            draw_measured(axes, ranges, layout.points_per_mm, ROW_HEIGHT)
        _finish_panel(axes, extent, layout, labelled=index + layout.columns > last)
        axes.set_title(_caption(frames, frame), loc="left", pad=3.0)


def _draw_texts(figure: "Figure", layout: Layout, title: str | None, ranges: list[MeasuredRange]) -> None:
    side = SIDE / WIDTH
    if title:
        top = 1.0 - 0.06 / layout.height
        figure.suptitle(title, x=side, y=top, ha="left", va="top", fontsize=style.TITLE_SIZE)
    figure.text(side, 0.05 / layout.height, _legend(ranges), color=style.FAINT_INK, va="bottom")


def _finish_panel(axes: "Axes", extent: Extent, layout: Layout, *, labelled: bool) -> None:
    """Fix the scale of a panel and leave only its x axis."""
    from matplotlib.ticker import MaxNLocator  # noqa: PLC0415 - see style

    axes.set_xlim(extent.left, extent.right)
    points_high = layout.panel_height * style.POINTS_PER_INCH
    axes.set_ylim(extent.top - points_high / layout.points_per_mm, extent.top)
    axes.spines[["left", "right", "top"]].set_visible(False)
    axes.yaxis.set_visible(False)
    ticks = max(2, int(layout.panel_width / TICK_ROOM))
    axes.xaxis.set_major_locator(MaxNLocator(nbins=ticks, steps=[1, 2, 5, 10]))
    axes.tick_params(axis="x", length=2.5, pad=1.5)
    if labelled:
        axes.set_xlabel("x (mm)", labelpad=1.0)


def _caption(frames: FramesLike, frame: int) -> str:
    """Return the time of a frame; the two ends of a run are named."""
    time = f"{float(frames.time[frame]):.3f} s"
    if frame == 0:
        return f"{time}, release"
    return f"{time}, final" if frame == len(frames.time) - 1 else time


def _legend(ranges: Sequence[MeasuredRange]) -> str:
    legend = "Thick line inside a block: its own upper side."
    if not ranges:
        return legend
    return f"{legend} Last panel: simulated centres marked on the ground, measured mean and range below it."

"""A run as a strip of panels on one scale, and the surface of soil at several times."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from blocksim.errors import InvalidInputError
from blocksim.simulation.trajectory import Frames
from blocksim.view import arrows, final, paints, run_data, scene, style

WIDTH = 10.0  # inches, of the whole strip
SIDE, GAP = 0.25, 0.25  # inches, at the left and right end and between columns
HEAD, TITLE, FOOT = 0.22, 0.30, 0.28  # inches: time above a panel, title of the strip, axis below
LINE = 0.155  # inches, of each further line of text above a panel
LEAST_WIDTH, NARROWEST_PANEL, LOWEST_PANEL = 1.75, 1.25, 0.25  # inches, on a page whose size was asked for
TICKS = 0.26  # inches, for the numbers under a row of panels; tilted panels have theirs inside
WIDEST_IN_FOURS, WIDEST_IN_PAIRS = 2.5, 6.0  # width over height, so that a panel stays about an inch tall
LOW_ENOUGH = 1.6  # width over height from which four rows of pairs fit on a page
CAPTION = 3.0  # points, from a panel to the text above it
LEAST_MOVED = 0.005  # mm; less is zero in two decimals


@dataclass(frozen=True)
class Lines:
    """Lines of text above each panel and below the strip, rows of measured ranges, height of the key (inches)."""

    captions: int = 1
    notes: int = 1
    measured_rows: int = 0
    key: float = 0.0


@dataclass(frozen=True)
class PanelGrid:
    """How the panels are arranged, in inches; `points_per_mm` is the scale of all of them."""

    columns: int
    rows: int
    panel: tuple[float, float]
    points_per_mm: float
    size: tuple[float, float]  # of the page
    extent: run_data.Extent
    step: float  # from a row of panels to the next
    foot: float

    def place(self, index: int) -> tuple[float, float, float, float]:
        """Return left, bottom, width, height of a panel."""
        row, column = divmod(index, self.columns)
        return SIDE + column * (self.panel[0] + GAP), self.foot + (self.rows - 1 - row) * self.step, *self.panel


def arrangement(extent: run_data.Extent, readable: float = 0.0) -> tuple[int, int]:
    """Return the number of columns and the number of panels: flat and long scenes get few columns.

    So do scenes in between where names are `readable`, from that many points a mm on, in two columns but not in four.
    """
    aspect = extent.width / extent.height
    if aspect <= WIDEST_IN_FOURS:
        fours, pairs = (style.POINTS_PER_INCH * _panel_width(columns, WIDTH) / extent.width for columns in (4, 2))
        return (2, 8) if aspect >= LOW_ENOUGH and fours < readable <= pairs else (4, 8)
    return (2, 8) if aspect <= WIDEST_IN_PAIRS else (1, 6)


def plan(paper: style.Paper, extent: run_data.Extent, columns: int, panels: int, lines: Lines) -> PanelGrid:
    """Fit the panels into a page. Where its size was asked for, as many columns as make them largest.

    Raises InvalidInputError for a page that is too small.
    """
    width = paper.width(WIDTH, LEAST_WIDTH)
    ticks = 0.0 if extent.tilt else TICKS
    head = HEAD + (lines.captions - 1) * LINE
    foot = FOOT + ticks + lines.notes * style.LINE + lines.key
    below = scene.room_below(extent, lines.measured_rows) / style.POINTS_PER_INCH

    def others(rows: int) -> float:
        return TITLE + rows * head + (rows - 1) * ticks + foot

    def scale_in(columns: int) -> float:
        """Return the largest scale (inches per mm) of so many columns; not above 0 where none fits."""
        rows = -(-panels // columns)
        tallest = 4.0 if paper.size is None else (paper.size[1] - others(rows)) / rows  # inches
        high = min((tallest - below) / (extent.top - extent.lowest), tallest / extent.height)
        return min(_panel_width(columns, width) / extent.width, high)

    most = max(1, min(panels, int((width - 2.0 * SIDE + GAP) / (NARROWEST_PANEL + GAP))))
    possible = [min(columns, panels)] if paper.size is None else range(1, most + 1)
    scale, columns = max((scale_in(count), count) for count in possible)
    rows, across = -(-panels // columns), _panel_width(columns, width)
    paper.panel(0.0, rows, others(rows) + rows * below, LOWEST_PANEL)  # refuses a page that is too small
    wide = 0.5 * max(across / scale - extent.width, 0.0)
    extent = replace(extent, left=extent.left - wide, right=extent.right + wide)
    height = scene.panel_height(extent, scale, lines.measured_rows)
    total = others(rows) + rows * height
    step = height + head + ticks + (paper.height(total) - total) / rows
    size = width, paper.height(total)
    return PanelGrid(columns, rows, (across, height), scale * style.POINTS_PER_INCH, size, extent, step, foot)


def _panel_width(columns: int, width: float) -> float:
    """Return the width of a panel (inches)."""
    return (width - 2.0 * SIDE - (columns - 1) * GAP) / columns


def draw_strip(frames: Frames, path: Path | str, options: scene.PictureOptions = scene.PLAIN) -> None:
    """Draw the run as 6 to 8 panels from release to the final state and write them as PNG, SVG or PDF.

    The last panel shows mean and range of what was measured below the ground. The same input gives the same bytes.
    Raises InvalidInputError for an unknown picture format, a time that was not recorded, forces that were not, a page
    that is too small or nothing to draw, and OutputError when the file cannot be written.
    """
    path = style.picture_path(path)
    support, paint, paper = options.support, options.paint or paints.by_block(frames), options.paper
    drawable = run_data.drawable_frames(frames)
    scale = arrows.force_scale(frames) if options.forces else None
    extent = run_data.extent_of(frames, drawable, support)
    extent, length = arrows.with_room(extent, arrows.actions_on(frames, drawable, support))
    ranges = [] if options.measured is None else final.ranges_of(options.measured, frames.names, extent.width)
    extent = final.widen(extent, ranges)
    columns, usual = arrangement(extent, scene.readable_scale(frames))
    if options.times is None:
        carried = support.offset(frames.time[drawable])
        chosen = run_data.moments_by_motion(frames, drawable, options.count or usual, carried)
    else:
        chosen = run_data.moments_at(frames, drawable, options.times)
        ranges = ranges if chosen[-1] == drawable[-1] else []  # they belong to the final state
    rows = 1 + max((one.row for one in ranges), default=-1)
    acts = arrows.actions_on(frames, chosen, support)
    texts = [*([scene.TOP] if frames.names else []), _notes(support, is_measured=bool(ranges))]
    texts += ["" if scale is None else scale.explanation, acts.explanation]
    notes = style.break_lines(" ".join(filter(None, texts)), paper.width(WIDTH, LEAST_WIDTH) - 2.0 * SIDE)
    captions = 1 + (support.motion is not None) + any(acts.marks)
    layout = plan(paper, extent, columns, len(chosen), Lines(captions, len(notes), rows, paint.height))
    with style.open_figure(*layout.size, paper.dots) as figure:
        for index, frame in enumerate(chosen.tolist()):
            canvas = scene.Canvas(style.add_axes(figure, *layout.place(index)), layout.extent, layout.points_per_mm)
            scene.draw_scene(canvas, scene.Scene(frames, support, paint), frame)
            if index == len(chosen) - 1 and ranges:
                scene.draw_centres(canvas, frames, frame)
                scene.draw_repeats(canvas, ranges)
            scene.finish_panel(canvas, labelled=index + layout.columns >= len(chosen), rows=rows)
            arrows.draw_actions(canvas, acts, index, length)
            arrows.draw_marks(canvas, acts.marks[index], up=2.0)
            pad = CAPTION + (LINE * style.POINTS_PER_INCH if acts.marks[index] else 0.0)  # marks stand below the time
            canvas.axes.set_title(_caption(frames, frame, support), loc="left", pad=pad)
            if scale is not None:
                arrows.draw_forces(canvas, frames, frame, scale)
        style.write_heading(figure, options.title, SIDE)
        style.write_text(figure, SIDE, 0.05, "\n".join(notes), color=style.FAINT_INK, va="bottom")
        paints.draw_key(figure, paint, SIDE, 0.05 + len(notes) * style.LINE)
        style.save_figure(figure, path)


def _caption(frames: Frames, frame: int, support: run_data.Support) -> str:
    """Return the time of a frame and the displacement of the support; the two ends of a run are named."""
    time = f"{float(frames.time[frame]):.3f} s"
    if frame == 0:
        time = f"{time}, release"
    elif frame == len(frames.time) - 1:
        time = f"{time}, final"
    if support.motion is None:
        return time
    moved = run_data.MILLIMETRES * float(support.displacement(frames.time[frame : frame + 1])[0])
    shown = f"{moved:+.2f}".replace("-", "−") if abs(moved) >= LEAST_MOVED else "0.00"
    return f"{time}\nsupport {shown} mm"


def _notes(support: run_data.Support, *, is_measured: bool) -> str:
    texts = ["Grey: fixed."] if any(support.fixed) else []
    if support.motion is not None:
        texts.append(f"The support moves {support.way}; dashes and arrow: from where it was at the start.")
    if support.tilt:
        angle = f"{float(np.degrees(support.tilt)):.3g}°".replace("-", "−")
        texts.append(f"The ground is tilted by {angle}, gravity points down; x along the ground in mm.")
    if is_measured:
        texts.append("Last panel: simulated centres marked on the ground, measured mean and range below it.")
    return " ".join(texts)


PROFILE_WIDTH, PROFILE_LEAST, PROFILE_TALLEST = 7.2, 2.0, 6.0  # inches
PROFILE_MARGINS = 0.25, 0.40, 0.42  # inches: at the sides, above and below the panel
LINES = 6  # by default
COLOURS = "viridis"
PALE = "#e8e8e8"
THICK = 1.4  # points


def draw_profile(frames: Frames, path: Path | str, options: scene.PictureOptions = scene.PLAIN) -> None:
    """Draw the surface of soil, by default at six times that are even in motion; lines are coloured by time.

    Raises InvalidInputError for an unknown picture format, a run without soil, a time that was not stored or a page
    that is too small, and OutputError when the file cannot be written.
    """
    from matplotlib import colormaps, colors

    path = style.picture_path(path)
    support, paper, drawable = options.support, options.paper, run_data.drawable_frames(frames)
    if options.times is None:
        chosen = np.unique(run_data.moments_by_motion(frames, drawable, LINES))
    else:
        chosen = np.unique(run_data.moments_at(frames, drawable, options.times))
    surfaces = [(track, track.system.profile) for track in frames.others if track.system.profile is not None]
    lines = [[line for track, profile in surfaces for line in profile(track, frame)] for frame in chosen.tolist()]
    if not any(lines):
        raise InvalidInputError("no soil in this run: --kind profile draws its surface")
    steps = np.linspace(0.0, 0.85, len(chosen))  # dark to light
    shades = [colors.to_hex(colour) for colour in colormaps[COLOURS](steps)]
    named = tuple((f"{float(frames.time[frame]):.3f} s", shade) for frame, shade in zip(chosen, shades, strict=True))
    key = paints.Paint(lambda _: [PALE] * len(frames.names), named)
    side, head, foot = PROFILE_MARGINS
    extent, width = run_data.extent_of(frames, drawable, support), paper.width(PROFILE_WIDTH, PROFILE_LEAST)
    page = scene.page_for(extent, width, PROFILE_TALLEST, (side, head, foot + key.height))
    with style.open_figure(page.width, paper.height(page.height), paper.dots) as figure:
        canvas = page.canvas(figure)
        scene.draw_scene(canvas, scene.Scene(frames, support, key, with_others=False), int(chosen[-1]))
        for shade, of_frame in zip(shades, lines, strict=True):
            for line in of_frame:
                canvas.axes.plot(*(run_data.MILLIMETRES * line).T, color=shade, linewidth=THICK, transform=canvas.scene)
        scene.finish_panel(canvas, labelled=True)
        paints.draw_key(figure, key, side, 0.06)
        style.write_heading(figure, options.title and f"{options.title}: surface", side)
        style.save_figure(figure, path)

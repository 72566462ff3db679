"""Where the blocks of a run end, with labels below them that do not cover each other, and measured ranges."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.simulation.trajectory import Frames
from blocksim.view import arrows, paints, run_data, scene, style

NARROWEST = 0.35  # width over height
RANGE_GAP = 0.06  # part of the width that two measured ranges in one row keep apart


def ranges_of(measured: run_data.Repeats, names: Sequence[str], width: float) -> list[scene.MeasuredRange]:
    """Return the measured centres (mm) of the blocks, in rows without overlap; `width` (mm) is shown."""
    centres = [one for one in measured if one.quantity == "x" and one.block in names]
    row_ends: list[float] = []
    ranges = []
    for one in sorted(centres, key=lambda one: one.minimum):
        row = next((row for row, end in enumerate(row_ends) if end < one.minimum), len(row_ends))
        row_ends[row : row + 1] = [one.maximum + RANGE_GAP * width]
        ranges.append(scene.MeasuredRange(one.block, one.mean, one.minimum, one.maximum, row))
    return ranges


def widen(extent: run_data.Extent, ranges: Sequence[scene.MeasuredRange]) -> run_data.Extent:
    """Return an extent that also holds the measured ranges, and is wide enough for the time above a tower."""
    margin = RANGE_GAP * extent.width
    missing = max(NARROWEST * extent.height - extent.width, 0.0)
    cosine, shift = float(np.cos(extent.tilt)), extent.base * float(np.sin(extent.tilt))
    left = min([extent.left - 0.5 * missing, *(cosine * item.minimum - shift - 0.5 * margin for item in ranges)])
    right = max([extent.right + 0.5 * missing, *(cosine * item.maximum - shift + margin for item in ranges)])
    return replace(extent, left=left, right=right)


WIDTH = 7.2  # inches
MARKS = 0.2  # inches, for what acts on all blocks, above the panel
SIDE, HEAD, AXIS, FOOT = 0.25, 0.32, 0.42, 0.08  # inches; AXIS: numbers below the panel, FOOT: below all lines
TALLEST = 5.0  # inches, of the panel
MOST_LINES = 36  # below the panel; more labels fit no page
LEAST_WIDTH, LOWEST = 2.0, 0.6  # inches, of a page and of a panel on a page whose size was asked for
FITTINGS = 6  # a lower panel has labels nearer to each other, so in more rows
LINE, FONT = 9.5, 7.0  # points, of a line of a label
SPACE = 10.0, 7.0  # points between labels, across and down
LETTERS = 14  # of a name
MOST_ROWS = 4  # of labels with measured ranges below their blocks; others in rows are hard to find


class Labels(NamedTuple):
    """The lines of n labels, where their middles are (points from the panel's left end), and in which rows."""

    lines: list[list[str]]
    middles: run_data.Floats
    rows: NDArray[np.intp]
    is_listed: bool  # in the order of the blocks, and not each below its own

    def spacing(self) -> tuple[int, float]:
        """Return how many rows there are, none where there are too many to draw them, and how far apart (points)."""
        most, rows = max(map(len, self.lines), default=0), int(self.rows.max(initial=-1)) + 1
        return rows if rows * most <= MOST_LINES else 0, most * LINE + SPACE[1]


def labels_of(frames: Frames, frame: int, page: scene.Page, ranges: Sequence[scene.MeasuredRange]) -> Labels:
    """Return a label for every block, centred below it as far as the page allows.

    Where too many blocks are above one another, all are listed in rows as wide as the page.
    """
    measured = {one.block: one for one in ranges}
    centres = run_data.MILLIMETRES * np.stack([frames.x[frame], frames.y[frame]], axis=-1)
    lines = []
    for name, (x, _), turn in zip(frames.names, centres, np.degrees(frames.rotation[frame]), strict=True):
        texts = [f"x {x:.2f} mm", f"{turn:z.2f}°".replace("-", "−")]
        if name in measured:
            one = measured[name]
            texts.append(f"measured {one.mean:.2f} [{one.minimum:.2f}, {one.maximum:.2f}]".replace("-", "−"))
        lines.append([style.shorten(name, LETTERS), *texts])
    room = page.panel_width * style.POINTS_PER_INCH
    half = np.array([0.5 * style.LETTER[0] * FONT * max(map(len, texts)) for texts in lines])
    below = (run_data.rotate_points(centres, page.extent.tilt)[:, 0] - page.extent.left) * page.points_per_mm
    middles = np.clip(below, half, np.maximum(room - half, half))
    rows, ends = np.zeros(len(lines), dtype=np.intp), list[float]()
    for number in np.argsort(middles - half, kind="stable").tolist():
        left, right = middles[number] - half[number], middles[number] + half[number]
        row = next((row for row, end in enumerate(ends) if end + SPACE[0] <= left), len(ends))
        ends[row : row + 1] = [right]
        rows[number] = row
    if len(ends) <= (MOST_ROWS if measured else 1):
        return Labels(lines, middles, rows, is_listed=False)
    columns = max(1, min(int(room / (2.0 * half.max() + SPACE[0])), len(lines)))
    rows, column = np.divmod(np.arange(len(lines)), columns)
    return Labels(lines, (column + 0.5) * room / columns, rows, is_listed=True)


def draw_final(frames: Frames, path: Path | str, options: scene.PictureOptions = scene.PLAIN) -> None:
    """Draw the last frame, or the one nearest to the last of the times that were asked for.

    Labels below each block give x, rotation, and the measured mean and range of its centre, if the labels of all
    blocks fit. The same input gives the same bytes. Raises InvalidInputError for an unknown picture format, a time or
    forces that were not stored, a page that is too small or nothing to draw, and OutputError when the file cannot be
    written.
    """
    path = style.picture_path(path)
    support, paint, paper = options.support, options.paint or paints.by_block(frames), options.paper
    drawable = run_data.drawable_frames(frames)
    chosen = drawable[-1:] if options.times is None else run_data.moments_at(frames, drawable, options.times)[-1:]
    frame = int(chosen[0])
    scale = arrows.force_scale(frames) if options.forces else None
    acts = arrows.actions_on(frames, chosen, support)
    extent = run_data.extent_of(frames, chosen, support)
    extent, length = arrows.with_room(extent, acts)
    ranges = []
    if options.measured is not None and frame == drawable[-1]:  # measurements are of the final state
        ranges = ranges_of(options.measured, frames.names, extent.width)
    extent, rows = widen(extent, ranges), 1 + max((one.row for one in ranges), default=-1)
    width, tallest = paper.width(WIDTH, LEAST_WIDTH), TALLEST
    margins = SIDE, HEAD + MARKS * any(acts.marks), AXIS
    explanations = [] if scale is None else [scale.explanation]
    for remaining in reversed(range(FITTINGS)):
        page = scene.page_for(extent, width, tallest, margins, rows)
        labels = labels_of(frames, frame, page, ranges)
        texts = [_notes(labels, is_measured=bool(ranges)), *explanations, acts.explanation]
        notes = style.break_lines(" ".join(filter(None, texts)), width - 2.0 * SIDE)
        label_rows, apart = labels.spacing()
        room = label_rows * apart / style.POINTS_PER_INCH
        foot = FOOT + len(notes) * style.LINE + paint.height
        height = page.height + room + foot
        paper.panel(0.0, 1, height - page.panel_height, LOWEST)  # refuses a page that is too small
        excess = height - paper.height(height)
        if excess <= 0.0 or not remaining:
            break
        tallest = max(min(tallest, page.panel_height) - excess, LOWEST)
    else:  # for the type checker: the last round breaks
        raise AssertionError
    height = paper.height(height)
    with style.open_figure(width, height, paper.dots) as figure:
        canvas = page.canvas(figure, bottom=height - margins[1] - page.panel_height)
        scene.draw_scene(canvas, scene.Scene(frames, support, paint), frame)
        scene.finish_panel(canvas, labelled=True, rows=rows)
        if label_rows:
            scene.draw_centres(canvas, frames, frame)
            scene.draw_repeats(canvas, ranges)
            _draw_labels(style.add_axes(figure, SIDE, height - page.height - room, page.panel_width, room), labels)
        arrows.draw_actions(canvas, acts, 0, length)
        arrows.draw_marks(canvas, acts.marks[0])
        if scale is not None:
            arrows.draw_forces(canvas, frames, frame, scale)
        paints.draw_key(figure, paint, SIDE, foot - paint.height)
        caption = f"{float(frames.time[frame]):.3f} s" + (", final" if frame == len(frames.time) - 1 else "")
        beside = SIDE + (style.width_of(caption, style.FONT_SIZE) + SPACE[0]) / style.POINTS_PER_INCH
        style.write_text(figure, width - SIDE, height - style.EDGE, caption, ha="right", va="top")
        style.write_heading(figure, options.title, SIDE, beside)
        style.write_text(figure, SIDE, 0.06, "\n".join(notes), color=style.FAINT_INK, va="bottom")
        style.save_figure(figure, path)


def _draw_labels(axes: "style.Axes", labels: Labels) -> None:
    """Draw the labels below the axis, on a scale of points."""
    axes.set_axis_off()
    axes.set_xlim(0.0, style.size_of(axes)[0] * style.POINTS_PER_INCH)
    count, apart = labels.spacing()
    axes.set_ylim(-count * apart, 0.0)
    at: dict[str, Any] = {"ha": "center", "va": "top", "fontsize": FONT}
    for lines, middle, row in zip(labels.lines, labels.middles, labels.rows, strict=True):
        for number, line in enumerate(lines):
            look: dict[str, Any] = {"weight": "bold"} if number == 0 else {}
            look |= {"color": style.MEASURED_COLOUR} if line.startswith("measured") and number else {}
            axes.text(middle, -row * apart - number * LINE, line, **look, **at)


def _notes(labels: Labels, *, is_measured: bool) -> str:
    if not labels.lines:
        return ""
    if not labels.spacing()[0]:
        return f"{len(labels.lines)} blocks: too many to name x and rotation of each. {scene.TOP}"
    where = "Listed by block" if labels.is_listed else "Below each block"
    bars = "Dot and bar: measured mean and range of the centre (mm). " if is_measured else ""
    return f"{where}: x of the centre (marked on the ground), rotation. {bars}{scene.TOP}"

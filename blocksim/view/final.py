"""Where the blocks of a run end: labels below them that do not cover each other, and measured ranges."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

from blocksim.view import style
from blocksim.view.arrows import (
    WithContacts,
    draw_forces,
    draw_marks,
    draw_outside,
    force_scale,
    length_in,
    outside,
    with_room,
)
from blocksim.view.paint import Paint, by_block, draw_key
from blocksim.view.run_data import (
    MILLIMETRES,
    Extent,
    Floats,
    FramesLike,
    Support,
    drawable_frames,
    extent_of,
    moments_at,
    rotate_points,
)
from blocksim.view.scene import (
    TOP,
    Canvas,
    MeasuredRange,
    Page,
    Scene,
    depth_of,
    draw_centres,
    draw_ruler,
    draw_scene,
    finish_panel,
    page_for,
)
from blocksim.view.style import OWN, Paper, add_axes, write_text

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes


NARROWEST = 0.35  # width over height
RANGE_GAP = 0.06  # part of the width that two measured ranges in one row keep apart


class MeasuredTable(Protocol):
    """The part of a measured table that pictures need."""

    def statistics(self) -> "pd.DataFrame":
        """Return one row a block and quantity: block, quantity, mean, minimum, maximum (mm), ..."""
        ...


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


LINE = 9.5  # points, of a line of text
FONT = 7.0  # points
BAR = 9.0  # points, of a measured range
SPACE = 10.0, 7.0  # points between labels, across and down
LETTERS = 14  # of a name
MOST_ROWS = 4  # of labels with measured ranges below their blocks; others in rows are hard to find
CAP = 2.2  # points


@dataclass(frozen=True)
class Label:
    """Label of one block; positions in points from the panel's left end, `middle` is the block's centre."""

    lines: tuple[str, ...]
    middle: float
    left: float
    right: float
    row: int = 0
    bar: tuple[float, float, float] | None = None  # smallest, mean, largest
    measured: str = ""


def labels_of(frames: FramesLike, frame: int, page: Page, measured: MeasuredTable | None) -> list[Label]:
    """Return the label of every block, centred below it as far as the page allows."""
    ranges = _ranges(measured)
    centres = MILLIMETRES * np.stack([frames.x[frame], frames.y[frame]], axis=-1)
    below = _page_x(page, centres)
    turns = np.degrees(frames.rotation[frame])
    labels = []
    for index, name in enumerate(frames.names):
        turn = f"{turns[index] + 0.0:.2f}".replace("-0.00", "0.00").replace("-", "−")
        lines = (style.shortened(name, LETTERS), f"x {centres[index, 0]:.2f} mm", f"{turn}°")
        labels.append(_label(lines, float(below[index]), page, ranges.get(name)))
    return labels


def arranged(labels: Sequence[Label], page: Page) -> list[Label]:
    """Return the labels below their blocks, or one after the other where too many blocks are above one another.

    Where ranges are measured, labels below their blocks may take several rows.
    """
    placed = placed_labels(labels)
    most = MOST_ROWS if any(label.bar for label in labels) else 1
    if all(label.row < most for label in placed):
        return placed
    return listed_labels(labels, page.panel_width * style.POINTS_PER_INCH)


def placed_labels(labels: Sequence[Label]) -> list[Label]:
    """Return the labels in rows, the first ones first, so that none covers another."""
    ends: list[float] = []
    placed = []
    for label in sorted(labels, key=lambda label: label.left):
        row = next((row for row, end in enumerate(ends) if end + SPACE[0] <= label.left), len(ends))
        ends[row : row + 1] = [label.right]
        placed.append(replace(label, row=row))
    return placed


def listed_labels(labels: Sequence[Label], width: float) -> list[Label]:
    """Return the labels in rows as wide as the page (points), in the order of the blocks, without bars."""
    widest = max(2.0 * _half(label.lines, label.measured) for label in labels) + SPACE[0]
    columns = max(1, min(int(width / widest), len(labels)))
    spacing = width / columns
    listed = []
    for number, label in enumerate(labels):
        row, column = divmod(number, columns)
        middle = (column + 0.5) * spacing
        listed.append(replace(label, middle=middle, left=middle, right=middle, row=row, bar=None))
    return listed


def _rows(labels: Sequence[Label]) -> int:
    return 1 + max((label.row for label in labels), default=-1)


def lines_of(labels: Sequence[Label]) -> int:
    """Return how many lines of text all rows of labels take."""
    most = max((len(label.lines) + bool(label.measured) + bool(label.bar) for label in labels), default=0)
    return _rows(labels) * most


def depth(labels: Sequence[Label]) -> float:
    """Return how far the rows of labels reach down (points)."""
    return _rows(labels) * row_height(labels)


def row_height(labels: Sequence[Label]) -> float:
    """Return how far apart the rows of labels are (points)."""
    lines = max((len(label.lines) + bool(label.measured) for label in labels), default=0)
    return lines * LINE + any(label.bar for label in labels) * BAR + SPACE[1]


def _label(lines: tuple[str, ...], middle: float, page: Page, measured: tuple[float, float, float] | None) -> Label:
    """Return a label that stays on the page."""
    text, bar, ends = "", None, [middle]
    if measured is not None:
        smallest, mean, largest = measured
        text = f"measured {mean:.2f} [{smallest:.2f}, {largest:.2f}]".replace("-", "−")
        places = _page_x(page, np.array([[x, page.extent.base] for x in measured]))
        bar = float(places[0]), float(places[1]), float(places[2])
        ends += [bar[0] - CAP, bar[2] + CAP]
    half = _half(lines, text)
    room = page.panel_width * style.POINTS_PER_INCH
    place = min(max(middle, half), max(room - half, half))
    return Label(lines, place, min([place - half, *ends]), max([place + half, *ends]), 0, bar, text)


def _half(lines: Sequence[str], measured: str) -> float:
    """Return half the width of a label's text (points)."""
    return 0.5 * style.LETTER[0] * FONT * max(map(len, (*lines, measured)))


def _ranges(measured: MeasuredTable | None) -> dict[str, tuple[float, float, float]]:
    """Return smallest, mean and largest measured centre (mm) by block."""
    if measured is None:
        return {}
    statistics = measured.statistics()
    centres = statistics[statistics["quantity"] == "x"]
    return {
        str(line.block): (float(line.minimum), float(line.mean), float(line.maximum))  # type: ignore[arg-type]
        for line in centres.itertuples()
    }


def _page_x(page: Page, places: Floats) -> Floats:
    """Return how far (points) places (mm, scene, (k, 2)) are from the panel's left end."""
    return np.asarray((rotate_points(places, page.extent.tilt)[:, 0] - page.extent.left) * page.points_per_mm)


def draw_label(axes: "Axes", label: Label, top: float) -> None:
    """Draw a label below a height (points)."""
    at: dict[str, Any] = {"ha": "center", "va": "top", "fontsize": FONT}
    for number, line in enumerate(label.lines):
        weight = "bold" if number == 0 else "normal"
        axes.text(label.middle, top - number * LINE, line, weight=weight, **at)
    y = top - len(label.lines) * LINE
    if label.bar is not None:
        _draw_bar(axes, label.bar, y - 0.5 * BAR)
        y -= BAR
    axes.text(label.middle, y, label.measured, color=style.MEASURED_COLOUR, **at)


def _draw_bar(axes: "Axes", bar: tuple[float, float, float], y: float) -> None:
    """Draw a measured mean and range at a height (points)."""
    smallest, mean, largest = bar
    line: dict[str, Any] = {"color": style.MEASURED_COLOUR, "linewidth": 1.2}
    axes.plot([smallest, largest], [y, y], **line)
    for end in (smallest, largest):
        axes.plot([end, end], [y - CAP, y + CAP], **line)
    axes.plot(mean, y, marker="o", markersize=3.2, **line)


WIDTH = 7.2  # inches
MARKS = 0.2  # inches, for what acts on all blocks, above the panel
SIDE, HEAD, AXIS, FOOT = 0.25, 0.32, 0.42, 0.24  # inches; AXIS: numbers below the panel, FOOT: the line below all
TALLEST = 5.0  # inches, of the panel
MOST_LINES = 36  # below the panel; more labels fit no page
LETTERS_AN_INCH = 15.0  # in a line below
LEAST_WIDTH, LOWEST = 2.0, 0.6  # inches, of a page and of a panel on a page whose size was asked for
FITTINGS = 4  # a lower panel has labels nearer to each other, so in more rows


def draw_final(
    frames: WithContacts,
    path: Path | str,
    title: str | None = None,
    measured: MeasuredTable | None = None,
    support: Support | None = None,
    *,
    forces: bool = False,
    times: Sequence[float] | None = None,
    paint: Paint | None = None,
    paper: Paper = OWN,
) -> None:
    """Draw the last frame, or the one nearest to the last of `times` (s).

    Labels below each block give x, rotation, and the measured mean and range of its centre, if the labels of all
    blocks fit. `forces` draws those of all contacts, `paint` colours the blocks. The same input gives the
    same bytes. Raises InvalidInputError for an unknown picture format, a time or forces that were not stored, a page
    that is too small or nothing to draw, and OutputError when the file cannot be written.
    """
    path = Path(path)
    style.picture_suffix(path)
    support, paint = support or Support(), paint or by_block(frames)
    drawable = drawable_frames(frames)
    chosen = drawable[-1:] if times is None else moments_at(frames, drawable, times)[-1:]
    frame = int(chosen[0])
    scale = force_scale(frames) if forces else None
    acts = outside(frames, chosen, support)
    told = "\n".join(filter(None, ("" if scale is None else scale.explanation, acts.explanation)))
    around = _Around(HEAD + MARKS * any(acts.marks), paint.height, told)
    extent = extent_of(frames, chosen, support)
    length = length_in(extent)
    extent = widened(with_room(extent, acts, length), [])
    sheet = _sheet(frames, frame, extent, measured if frame == drawable[-1] else None, paper, around)
    page, room = sheet.page, sheet.room
    with style.styled_figure(page.width, sheet.height, paper.dots) as figure:
        bottom = sheet.height - sheet.head - page.panel_height
        canvas = Canvas(
            add_axes(figure, SIDE, bottom, page.panel_width, page.panel_height), page.extent, page.points_per_mm
        )
        draw_scene(canvas, Scene(frames, support, paint), frame)
        finish_panel(canvas, (page.panel_width, page.panel_height), labelled=True)
        if page.extent.tilt:
            draw_ruler(canvas, depth_of(0))
        if sheet.is_labelled and sheet.labels:
            draw_centres(canvas, frames, frame)
            _draw_labels(add_axes(figure, SIDE, sheet.height - page.height - room, page.panel_width, room), sheet)
        draw_outside(canvas, acts, 0, length)
        draw_marks(canvas, acts.marks[0])
        if scale is not None:
            draw_forces(canvas, frames, frame, scale)
        draw_key(figure, paint, SIDE, sheet.foot - paint.height)
        caption = f"{float(frames.time[frame]):.3f} s" + (", final" if frame == len(frames.time) - 1 else "")
        top = sheet.height - 0.08
        write_text(figure, page.width - SIDE, top, caption, ha="right", va="top")
        if title:
            width = page.panel_width * style.POINTS_PER_INCH - style.width_of(caption, style.FONT_SIZE) - SPACE[0]
            shown = style.cut_to(title, width, style.TITLE_SIZE)
            write_text(figure, SIDE, top, shown, va="top", fontsize=style.TITLE_SIZE)
        write_text(figure, SIDE, 0.06, "\n".join(sheet.notes), color=style.FAINT_INK, va="bottom")
        style.save_figure(figure, path)


class _Around(NamedTuple):
    """What is above and below: heights (inches) of the head and of the key of colours, explanations."""

    head: float
    key: float
    told: str


@dataclass(frozen=True)
class Sheet:
    """The page: its panel, the labels and lines below it; heights of all, of the head and of what is below (inches)."""

    page: Page
    labels: tuple[Label, ...]
    notes: tuple[str, ...]
    height: float
    head: float
    foot: float

    @property
    def is_labelled(self) -> bool:
        """Whether the labels are drawn."""
        return lines_of(self.labels) <= MOST_LINES

    @property
    def room(self) -> float:
        """Height of the labels (inches)."""
        return depth(self.labels) / style.POINTS_PER_INCH if self.is_labelled else 0.0


def _sheet(
    frames: FramesLike,
    frame: int,
    extent: Extent,
    measured: MeasuredTable | None,
    paper: Paper,
    around: _Around,
) -> Sheet:
    """Return the page; if its size is given, the panel takes the room that the labels leave."""
    width, tallest = paper.width(WIDTH, LEAST_WIDTH), TALLEST
    margins = SIDE, around.head, AXIS
    sheet = _tried(frames, frame, page_for(extent, width, tallest, margins), measured, around)
    for _ in range(FITTINGS if paper.size is not None else 0):
        tallest = min(paper.panel(0.0, 1, sheet.height - sheet.page.panel_height, LOWEST), tallest)
        sheet = _tried(frames, frame, page_for(extent, width, tallest, margins), measured, around)
        tallest -= max(sheet.height - paper.height(0.0), 0.0)
    return replace(sheet, height=paper.height(sheet.height))


def _tried(frames: FramesLike, frame: int, page: Page, measured: MeasuredTable | None, around: _Around) -> Sheet:
    """Return the page for a panel."""
    labels = tuple(arranged(labels_of(frames, frame, page, measured), page))
    text = _legend(labels, is_labelled=lines_of(labels) <= MOST_LINES)
    text = "\n".join(filter(None, (text, around.told)))
    notes = tuple(line for part in text.split("\n") for line in wrap(part, int(LETTERS_AN_INCH * page.width)))
    foot = FOOT + (len(notes) - 1) * LINE / style.POINTS_PER_INCH + around.key
    sheet = Sheet(page, labels, notes, 0.0, around.head, foot)
    return replace(sheet, height=page.height + sheet.room + foot)


def _draw_labels(axes: "Axes", sheet: Sheet) -> None:
    """Draw the labels below the axis, on a scale of points."""
    axes.set_axis_off()
    axes.set_xlim(0.0, sheet.page.panel_width * style.POINTS_PER_INCH)
    axes.set_ylim(-sheet.room * style.POINTS_PER_INCH, 0.0)
    apart = row_height(sheet.labels)
    for label in sheet.labels:
        draw_label(axes, label, -label.row * apart)


def _legend(labels: Sequence[Label], *, is_labelled: bool) -> str:
    if not labels:
        return ""
    if not is_labelled:
        return f"{len(labels)} blocks: too many to name x and rotation of each. {TOP}"
    is_listed = any(label.left == label.right for label in labels)
    where = "Listed by block" if is_listed else "Below each block"
    texts = [f"{where}: x of the centre (marked on the ground), rotation.", TOP]
    if any(label.bar for label in labels):
        texts.insert(1, "Dot and bar: measured mean and range of the centre (mm).")
    return " ".join(texts)

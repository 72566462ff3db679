"""Where the blocks of a run end, like Figure 3 of the paper: x, rotation and what was measured, below each block."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from blocksim.view import style
from blocksim.view.forces import WithContacts, draw_forces, force_scale
from blocksim.view.ground import Canvas, draw_ruler
from blocksim.view.moments import Floats, FramesLike, drawable_frames
from blocksim.view.panel import Page, depth_of, finish_panel, page_for
from blocksim.view.scene import corners, draw_centres, draw_scene
from blocksim.view.strip import MeasuredTable, widened
from blocksim.view.support import Support
from blocksim.view.window import MILLIMETRES, extent_of, turned

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH = 7.2  # inches
SIDE, HEAD, AXIS, FOOT = 0.25, 0.32, 0.42, 0.24  # inches; AXIS: numbers below the panel, FOOT: the line below all
TALLEST = 5.0  # inches, of the panel
LINE = 9.5  # points, of a line of text
FONT = 7.0  # points
BAR = 9.0  # points, of a measured range
SPACE = 10.0, 7.0  # points between labels, across and down
LETTERS = 14  # of a name
MOST_ROWS = 4  # of labels below their blocks
MOST_LINES = 36  # below the panel; more labels than that fit nobody's page
COLOUR_BAR = 0.5  # inches
CAP = 2.2  # points
HALF_TURN = 180.0  # degrees; what turned farther has the same colour


@dataclass(frozen=True)
class Label:
    """What stands below one block; places in points from the panel's left end, `middle` is the block's centre."""

    lines: tuple[str, ...]
    middle: float
    left: float
    right: float
    row: int = 0
    bar: tuple[float, float, float] | None = None  # smallest, mean, largest
    measured: str = ""


def draw_final(
    frames: WithContacts,
    path: Path | str,
    title: str | None = None,
    measured: MeasuredTable | None = None,
    support: Support | None = None,
    *,
    forces: bool = False,
) -> None:
    """Draw the last frame; below each block its x and rotation, and the measured mean and range of its centre.

    Where labels of all blocks do not fit below the picture, the blocks are coloured by their rotation instead. `forces`
    draws those of all contacts. The same input gives the same bytes. Raises InvalidInputError for an unknown picture
    format, forces that were not stored or nothing to draw, and OutputError when the file cannot be written.
    """
    path = Path(path)
    style.picture_suffix(path)
    support = support or Support()
    drawable = drawable_frames(frames)
    scale = force_scale(frames) if forces else None
    frame = int(drawable[-1])
    extent = widened(extent_of(frames, drawable[-1:], support), [])
    page = page_for(extent, WIDTH, TALLEST, (SIDE, HEAD, AXIS))
    labels = arranged(labels_of(frames, frame, page, measured), page)
    is_labelled = lines_of(labels) <= MOST_LINES
    room = depth(labels) / style.POINTS_PER_INCH if is_labelled else COLOUR_BAR
    legend = _legend(labels, is_labelled=is_labelled)
    notes = [legend] if scale is None else [legend, scale.told]
    foot = FOOT + (len(notes) - 1) * LINE / style.POINTS_PER_INCH
    height = page.height + room + foot
    with style.styled_figure(WIDTH, height) as figure:
        canvas = _draw_panel(figure, frames, frame, page, support)
        if is_labelled:
            draw_centres(canvas, frames, frame)
            _draw_labels(figure, labels, page, (foot, room))
        else:
            _draw_turns(figure, canvas, frames, frame, foot)
        if scale is not None:
            draw_forces(canvas, frames, frame, scale)
        _draw_texts(figure, title, _caption(frames, frame), "\n".join(notes))
        style.save_figure(figure, path)


def labels_of(frames: FramesLike, frame: int, page: Page, measured: MeasuredTable | None) -> list[Label]:
    """Return the label of every block, centred below it as far as the page allows."""
    ranges = _ranges(measured)
    centres = MILLIMETRES * np.stack([frames.x[frame], frames.y[frame]], axis=-1)
    below = _page_x(page, centres)
    turns = np.degrees(frames.angle[frame] - frames.angle[0])
    labels = []
    for index, name in enumerate(frames.names):
        lines = (style.shortened(name, LETTERS), f"x {centres[index, 0]:.2f} mm", f"{_plain(turns[index])}°")
        labels.append(_label(lines, float(below[index]), page, ranges.get(name)))
    return labels


def arranged(labels: Sequence[Label], page: Page) -> list[Label]:
    """Return the labels below their blocks, or one after the other where too many blocks are above one another."""
    placed = placed_labels(labels)
    if max(label.row for label in placed) < MOST_ROWS:
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


def lines_of(labels: Sequence[Label]) -> int:
    """Return how many lines of text all rows of labels take."""
    rows = 1 + max(label.row for label in labels)
    return rows * max(len(label.lines) + bool(label.measured) + bool(label.bar) for label in labels)


def depth(labels: Sequence[Label]) -> float:
    """Return how far the rows of labels reach down (points)."""
    return (1 + max(label.row for label in labels)) * _row_height(labels)


def _row_height(labels: Sequence[Label]) -> float:
    lines = max(len(label.lines) + bool(label.measured) for label in labels)
    return lines * LINE + any(label.bar for label in labels) * BAR + SPACE[1]


def _label(lines: tuple[str, ...], middle: float, page: Page, measured: tuple[float, float, float] | None) -> Label:
    """Return a label that stays on the page."""
    told, bar, ends = "", None, [middle]
    if measured is not None:
        smallest, mean, largest = measured
        told = f"measured {mean:.2f} [{smallest:.2f}, {largest:.2f}]".replace("-", "−")
        places = _page_x(page, np.array([[x, page.extent.base] for x in measured]))
        bar = float(places[0]), float(places[1]), float(places[2])
        ends += [bar[0] - CAP, bar[2] + CAP]
    half = _half(lines, told)
    room = page.panel_width * style.POINTS_PER_INCH
    text = min(max(middle, half), max(room - half, half))
    return Label(lines, text, min([text - half, *ends]), max([text + half, *ends]), 0, bar, told)


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
    return np.asarray((turned(places, page.extent.tilt)[:, 0] - page.extent.left) * page.points_per_mm)


def _draw_panel(figure: "Figure", frames: FramesLike, frame: int, page: Page, support: Support) -> Canvas:
    """Draw the blocks at the top of the page."""
    height = float(figure.get_figheight())
    bottom = height - HEAD - page.panel_height
    place = SIDE / WIDTH, bottom / height, page.panel_width / WIDTH, page.panel_height / height
    canvas = Canvas(figure.add_axes(place), page.extent, page.points_per_mm)
    draw_scene(canvas, frames, frame, support)
    finish_panel(canvas, (page.panel_width, page.panel_height), labelled=True)
    if page.extent.tilt:
        draw_ruler(canvas, depth_of(0))
    return canvas


def _draw_labels(figure: "Figure", labels: Sequence[Label], page: Page, heights: tuple[float, float]) -> None:
    """Draw the labels below the axis, on a scale of points; `heights` (inches) of the foot and of their room."""
    foot, room = heights
    height = float(figure.get_figheight())
    axes = figure.add_axes((SIDE / WIDTH, foot / height, page.panel_width / WIDTH, room / height))
    axes.set_axis_off()
    axes.set_xlim(0.0, page.panel_width * style.POINTS_PER_INCH)
    axes.set_ylim(-room * style.POINTS_PER_INCH, 0.0)
    row_height = _row_height(labels)
    for label in labels:
        _draw_label(axes, label, -label.row * row_height)


def _draw_label(axes: "Axes", label: Label, top: float) -> None:
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


def _draw_turns(figure: "Figure", canvas: Canvas, frames: FramesLike, frame: int, foot: float) -> None:
    """Fill the blocks by their rotation and draw what the colours mean below, over a foot (inches)."""
    from matplotlib.collections import PolyCollection  # noqa: PLC0415 - see style

    turns = np.degrees(frames.angle[frame] - frames.angle[0])
    farthest = float(np.abs(turns).max())
    most = min(max(farthest, 1.0), HALF_TURN)
    fills = PolyCollection(
        list(corners(frames, frame)), array=turns, cmap="PuOr", edgecolors=style.INK, linewidths=0.15, zorder=2.2
    )
    fills.set_transform(canvas.scene)
    fills.set_clim(-most, most)
    canvas.axes.add_collection(fills)
    height = float(figure.get_figheight())
    place = figure.add_axes((0.3, (foot + 0.32) / height, 0.4, 0.10 / height))
    bar = figure.colorbar(fills, cax=place, orientation="horizontal", extend="both" if farthest > most else "neither")
    bar.set_label("rotation (°)", labelpad=1.0)


def _draw_texts(figure: "Figure", title: str | None, caption: str, legend: str) -> None:
    height = float(figure.get_figheight())
    left, top = SIDE / WIDTH, 1.0 - 0.08 / height
    figure.text(1.0 - left, top, caption, ha="right", va="top")
    if title:
        room = (WIDTH - 2.0 * SIDE) * style.POINTS_PER_INCH - style.width_of(caption, style.FONT_SIZE) - SPACE[0]
        figure.text(left, top, style.cut_to(title, room, style.TITLE_SIZE), va="top", fontsize=style.TITLE_SIZE)
    figure.text(left, 0.06 / height, legend, color=style.FAINT_INK, va="bottom")


def _caption(frames: FramesLike, frame: int) -> str:
    time = f"{float(frames.time[frame]):.3f} s"
    return f"{time}, final" if frame == len(frames.time) - 1 else time


def _plain(value: float) -> str:
    """Return two decimals, with a proper minus sign and none before zero."""
    return f"{value + 0.0:.2f}".replace("-0.00", "0.00").replace("-", "−")


def _legend(labels: Sequence[Label], *, is_labelled: bool) -> str:
    if not is_labelled:
        return f"{len(labels)} blocks, coloured by how far they have turned, counter-clockwise positive."
    texts = ["Below each block: x of its centre, rotation."]
    if any(label.bar for label in labels):
        texts.append("Dot and bar: measured mean and range of the centre (mm).")
    elif any(label.left == label.right for label in labels):
        texts = ["Of each block: x of its centre, rotation."]
    return " ".join(texts)

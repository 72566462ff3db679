"""Labels below the blocks of a final state: x, rotation and measured range, so that none covers another."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from blocksim.view import style
from blocksim.view.measured import MeasuredTable
from blocksim.view.panel import Page
from blocksim.view.run_data import Floats, FramesLike
from blocksim.view.window import MILLIMETRES, turned

if TYPE_CHECKING:
    from matplotlib.axes import Axes

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
    return np.asarray((turned(places, page.extent.tilt)[:, 0] - page.extent.left) * page.points_per_mm)


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

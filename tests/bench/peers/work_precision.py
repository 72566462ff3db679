"""Accuracy over computing time: a panel for each scene, a line for each method."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from blocksim.view import style
from blocksim.view.run_data import Floats
from blocksim.view.style import OWN, Paper

PANEL, LEAST = (3.6, 2.9), (1.9, 0.9)  # inches, of a panel, and on a page whose size was asked for
LEFT, RIGHT, HEAD, FOOT, GAP = 0.62, 0.15, 0.32, 0.40, 0.72  # inches
LEGEND_ROW, LEGEND_ENTRY = 0.17, 1.8  # inches: height of a row of the legend, width of an entry
MARKERS = "os^D"
DASHES = ("-", (0, (4, 2)), (0, (1, 1.5)))
COLOURS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#D55E00", "#56B4E9")  # as in style, the well visible ones
MANY_DECADES = 100.0  # ratio of the ends of an axis
SMALLEST_SHARE = 1e-4  # of the largest error: what is less is drawn there


@dataclass(frozen=True)
class Curve:
    """One method: n settings from coarse to fine. Methods of one group share a colour."""

    label: str
    group: str
    seconds: Floats  # (n,) CPU time
    error: Floats  # (n,)
    low: Floats | None = None  # (n,) ends of the spread, where there is one
    high: Floats | None = None


@dataclass(frozen=True)
class Panel:
    """One scene."""

    title: str
    quantity: str  # label of the vertical axis, with its unit
    curves: tuple[Curve, ...]
    level: float | None = None  # an error worth a line, such as a tolerance
    meaning: str = ""  # label of that line


def draw_work_precision(
    panels: Sequence[Panel], path: Path | str, title: str | None = None, paper: Paper = OWN
) -> None:
    """Draw the panels side by side and write them as PNG, SVG or PDF; the same input gives the same bytes.

    Raises InvalidInputError for an unknown picture format or too small a page, and OutputError when the file cannot be
    written.
    """
    path = style.picture_path(path)
    groups = tuple(dict.fromkeys(curve.group for panel in panels for curve in panel.curves))
    with _opened(len(panels), max(len(panel.curves) for panel in panels), title, paper) as (figure, row, columns):
        for axes, panel in zip(row, panels, strict=True):
            _draw_panel(axes, panel, groups)
            handles, _ = axes.get_legend_handles_labels()
            left = axes.get_position().x0 * float(figure.get_figwidth())
            style.write_legend(figure, handles, left, style.EDGE, ncols=columns)
        style.save_figure(figure, path)


@contextmanager
def _opened(panels: int, curves: int, title: str | None, paper: Paper) -> Iterator[tuple["Figure", list["Axes"], int]]:
    """Give panels side by side with room below each for its legend, and the columns of that."""
    beside = LEFT + RIGHT + (panels - 1) * GAP
    width = paper.width(beside + panels * PANEL[0], beside + panels * LEAST[0])
    columns = int(((width - beside) / panels + GAP) / LEGEND_ENTRY)
    sides = LEFT, RIGHT, HEAD, FOOT + LEGEND_ROW * -(-curves // columns)
    with style.open_panels(paper, [panels], PANEL, LEAST, sides, (GAP, 0.0), title=title) as (figure, (row,)):
        yield figure, row, columns


def floor_of(panel: Panel) -> float:
    """Return the least error that is drawn: an axis of logarithms has no zero."""
    errors = np.concatenate([curve.error for curve in panel.curves])
    errors = errors[np.isfinite(errors) & (errors > 0.0)]
    if errors.size == 0:
        return panel.level or 1.0
    return max(float(errors.min()), SMALLEST_SHARE * float(errors.max()))


def _draw_panel(axes: "Axes", panel: Panel, groups: Sequence[str]) -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    least = floor_of(panel)
    drawn: dict[str, int] = {}
    for curve in panel.curves:
        number = drawn.get(curve.group, 0)
        drawn[curve.group] = number + 1
        look = _look(groups.index(curve.group), number)
        axes.plot(curve.seconds, np.maximum(curve.error, least), **look, label=curve.label, zorder=3)
        if curve.low is not None and curve.high is not None:
            low, high = np.maximum(curve.low, least), np.maximum(curve.high, least)
            axes.vlines(curve.seconds, low, high, color=look["color"], linewidth=style.LINE_WIDTH, alpha=0.6)
    if panel.level is not None:
        axes.axhline(panel.level, color=style.FAINT_INK, linewidth=style.LINE_WIDTH, linestyle=(0, (5, 3)))
        at = (0.0, panel.level), (2.0, 2.0), ("axes fraction", "data"), "offset points"
        axes.annotate(panel.meaning, *at, color=style.FAINT_INK, ha="left")  # where quick settings have large errors
    _number_axes(axes)
    axes.spines[["right", "top"]].set_visible(False)
    axes.set_xlabel("CPU time of the steps (s)", labelpad=2.0)
    axes.set_ylabel(panel.quantity)
    axes.set_title(panel.title, loc="left")


def _number_axes(axes: "Axes") -> None:
    """Write plain numbers; between the powers of ten too where an axis has less than two of them."""
    for axis, (low, high) in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
        between = (1.0, 2.0, 5.0) if high < MANY_DECADES * low else (1.0,)
        axis.set_major_locator(LogLocator(subs=between))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_formatter(NullFormatter())


def _look(group: int, number: int) -> dict[str, Any]:
    """Return the look of the curve with this number (from 0) in its group.

    Later ones are dashed and hollow, the third and those after it dotted.
    """
    colour = COLOURS[group % len(COLOURS)]
    return {
        "color": colour,
        "marker": MARKERS[group % len(MARKERS)],
        "markersize": 4.0,
        "markerfacecolor": "#FFFFFF" if number else colour,
        "linewidth": 1.2,
        "linestyle": DASHES[min(number, len(DASHES) - 1)],
    }

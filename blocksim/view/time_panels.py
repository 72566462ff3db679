"""Named lines over time, a panel for each quantity, one below the other."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from blocksim.view import style
from blocksim.view.layout import OWN, Paper, add_axes, number_axis, write_heading, write_text
from blocksim.view.run_data import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH = 7.2  # inches
LEFT, RIGHT, HEAD, FOOT = 0.78, 1.75, 0.40, 0.42  # inches; texts stand on the right
LABEL = 0.16  # inches, from the edge of the page to the right of the name of an axis
PANEL, GAP = 1.3, 0.16  # inches
LOWEST, NARROWEST = 0.6, 1.0  # inches, of a panel on a page whose size was asked for
_BESIDE = 0.1  # inches, from a panel to its text
LINE = 0.155  # inches, of a line of text
MOST_POINTS = 4000  # of a line; each that stands for many shows their range
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
DASHES: tuple[Any, ...] = ("-", (0, (5, 1.5)), (0, (1.5, 1.5)))


@dataclass(frozen=True)
class TimePanel:
    """A quantity over time: lines by name, each times (s) and values in the unit of the label."""

    label: str
    lines: Mapping[str, tuple[Floats, Floats]]
    note: str = ""  # beside the panel, below the names of the lines
    marks: Sequence[tuple[float, float]] = field(default=())  # points (s, value) that are marked
    limits: tuple[float, float] | None = None  # of the values, where the panel does not show all of them


def draw_time_panels(
    panels: Sequence[TimePanel], path: Path, title: str | None, note: str = "", paper: Paper = OWN
) -> None:
    """Draw panels one below the other; names of lines are written where a panel has more than one.

    Raises InvalidInputError for an unknown picture format or too small a page, OutputError when the file cannot be
    written.
    """
    style.picture_suffix(path)
    with _drawn(panels, title, note, paper) as figure:
        style.save_figure(figure, path)


def time_panels_png(panels: Sequence[TimePanel], paper: Paper = OWN) -> bytes:
    """Return such a picture without a title as PNG."""
    with _drawn(panels, None, "", paper) as figure:
        return style.figure_bytes(figure, ".png")


@contextmanager
def _drawn(panels: Sequence[TimePanel], title: str | None, note: str, paper: Paper) -> Iterator["Figure"]:
    head, foot = HEAD if title else GAP, FOOT + (LINE if note else 0.0)
    own = max(PANEL, *(LINE * (_rows(panel) + 1) for panel in panels))
    with stacked(len(panels), (LEFT, RIGHT, head, foot), GAP, (own, LOWEST), paper) as (figure, drawn):
        span = _span(panels)
        across, up = (float(size) for size in figure.get_size_inches())
        for axes, panel in zip(drawn, panels, strict=True):
            _draw(axes, panel, span)
            _write_beside(figure, panel, across - RIGHT + _BESIDE, axes.get_position().y1 * up)
        write_heading(figure, title, 0.12, 0.08)
        write_text(figure, 0.12, 0.05, note, color=style.FAINT_INK, va="bottom")
        yield figure


@contextmanager
def stacked(
    count: int,
    sides: tuple[float, float, float, float],
    gap: float,
    heights: tuple[float, float],
    paper: Paper,
) -> Iterator[tuple["Figure", list["Axes"]]]:
    """Give so many panels over one axis of time, one below the other, with room at left, right, top and bottom.

    `heights` are those of a panel: its own, and the least on a page whose size was asked for. All in inches. Raises
    InvalidInputError for too small a page.
    """
    left, right, head, foot = sides
    width = paper.width(WIDTH, left + right + NARROWEST)
    others = head + foot + (count - 1) * gap
    height = paper.panel(heights[0], count, others, heights[1])
    total = paper.height(others + count * height)
    with style.styled_figure(width, total, paper.dots) as figure:
        panels = []
        for row in range(count):
            bottom = foot + (count - 1 - row) * (height + gap)
            axes = add_axes(figure, left, bottom, width - left - right, height)
            axes.spines[["right", "top"]].set_visible(False)
            axes.tick_params(axis="x", labelbottom=row == count - 1)
            axes.yaxis.set_label_coords((LABEL - left) / (width - left - right), 0.5)
            panels.append(axes)
        panels[-1].set_xlabel("time (s)", labelpad=2.0)
        yield figure, panels


def _rows(panel: TimePanel) -> int:
    return (len(panel.lines) if len(panel.lines) > 1 else 0) + (panel.note.count("\n") + 1 if panel.note else 0)


def _span(panels: Sequence[TimePanel]) -> tuple[float, float]:
    times = [time for panel in panels for time, _ in panel.lines.values() if len(time)]
    first, last = min(float(time[0]) for time in times), max(float(time[-1]) for time in times)
    return first, first + max(last - first, 1e-9)


def _look(number: int) -> dict[str, Any]:
    colour, dashes = COLOURS[number % len(COLOURS)], DASHES[number // len(COLOURS) % len(DASHES)]
    return {"color": colour, "linestyle": dashes, "linewidth": 1.0}


def _draw(axes: "Axes", panel: TimePanel, span: tuple[float, float]) -> None:
    axes.axhline(0.0, color=style.FAINT_INK, linewidth=0.4)
    for number, (time, values) in enumerate(panel.lines.values()):
        axes.plot(*thinned(time, values), **_look(number))
    for moment, value in panel.marks:
        axes.plot(moment, value, marker="o", markersize=3.5, color=style.MEASURED_COLOUR, clip_on=False)
    axes.set_xlim(span)
    axes.margins(y=0.08)
    if panel.limits is not None:
        axes.set_ylim(*panel.limits)
    axes.set_ylabel(panel.label)
    number_axis(axes.yaxis)
    number_axis(axes.xaxis, 8)


def _write_beside(figure: "Figure", panel: TimePanel, left: float, top: float) -> None:
    room = (RIGHT - 2.0 * _BESIDE) * style.POINTS_PER_INCH
    names = [*panel.lines] if len(panel.lines) > 1 else []
    for number, name in enumerate(names):
        cut = style.cut_to(name, room, style.FONT_SIZE)
        write_text(figure, left, top - number * LINE, cut, va="top", color=_look(number)["color"])
    write_text(figure, left, top - len(names) * LINE, panel.note, va="top")


def thinned(time: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return at most MOST_POINTS points of a line: of each stretch the first, least, greatest and last one."""
    if len(time) <= MOST_POINTS:
        return time, values
    edges = np.linspace(0, len(time), MOST_POINTS // 4 + 1).round().astype(np.intp)
    kept: set[int] = set()
    for first, after in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        part = values[first:after]
        kept |= {first, after - 1, first + int(np.argmin(part)), first + int(np.argmax(part))}
    places = np.array(sorted(kept), dtype=np.intp)
    return time[places], values[places]

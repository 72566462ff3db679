"""Histogram: final x of the members of a sweep, with the repeats of the experiment and their intervals."""

from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from blocksim.view import layout, style
from blocksim.view.layout import OWN, Paper
from blocksim.view.sweeps.data import Flags, Floats, SweepData, percent

if TYPE_CHECKING:
    from collections.abc import Iterator

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_LEFT, RIGHT, _FOOT = 0.55, 0.2, 0.42  # inches
PANEL_HEIGHT, _GAP, ROOM = 1.15, 0.62, 0.26  # inches; ROOM is above the bars, for the repeats
NARROWEST, _LOWEST = 2.6, 0.6  # inches, of a page and a panel where a size was asked for
_NAME_ROOM = 1.2  # inches, for the name of a block
CAPTION = 0.2  # inches, of the text above a panel
LINE = 0.145  # inches, of a row of text
_MOST_BLOCKS = 4
_BINS = 40
_RARE = 1.0  # percent at either end that may lie beyond the axis
LEAST_BIN_MM = 0.01
ALL_COLOUR, INSIDE_COLOUR = "#B5D6EA", "#0072B2"
_MARK: dict[str, Any] = {"marker": "|", "color": style.MEASURED_COLOUR, "zorder": 4}
_REPEATS: dict[str, Any] = {**_MARK, "linestyle": "", "markersize": 7.0, "markeredgewidth": 1.1}
_INTERVAL: dict[str, Any] = {**_MARK, "markersize": 4.0, "linewidth": 1.0}


@contextmanager
def drawn_histogram(sweep: SweepData, paper: Paper = OWN) -> "Iterator[Figure]":
    """Give a panel for each block that moves."""
    blocks = sweep.moving[-_MOST_BLOCKS:]
    legend = _entries(sweep)
    foot = _FOOT + LINE * -(-len(legend) // 2) + 2.0 * layout.EDGE
    width = paper.width(layout.COLUMN_WIDTH, NARROWEST)
    head = layout.title_height(sweep.title, width) + CAPTION
    others = head + (len(blocks) - 1) * _GAP + foot
    panel = paper.panel(PANEL_HEIGHT, len(blocks), others, _LOWEST)
    height = paper.height(others + len(blocks) * panel)
    with style.styled_figure(width, height, paper.dots) as figure:
        layout.write_title(figure, sweep.title)
        for row, block in enumerate(blocks):
            bottom = foot + (len(blocks) - 1 - row) * (panel + _GAP)
            axes = layout.add_axes(figure, _LEFT, bottom, width - _LEFT - RIGHT, panel)
            _draw_block(axes, sweep, block, ROOM / (panel - ROOM))
        look: dict[str, Any] = {"ncols": 2, "labelspacing": 0.25, "columnspacing": 1.0}
        layout.write_legend(figure, legend, layout.EDGE, layout.EDGE, **look)
        yield figure


def limits_of(x_mm: Floats, others: Floats) -> tuple[float, float]:
    """Return the ends of an axis (mm) around all but the rarest run-outs and everything measured."""
    ends = np.concatenate([np.percentile(x_mm, [_RARE, 100.0 - _RARE]), others])
    low, high = float(ends.min()), float(ends.max())
    margin = max(0.04 * (high - low), 0.5 * _BINS * LEAST_BIN_MM)
    return low - margin, high + margin


def _draw_block(axes: "Axes", sweep: SweepData, block: int, room: float) -> None:
    """Draw a panel; `room` is that above the bars, over their height."""
    name = sweep.blocks[block]
    x = sweep.x_mm[sweep.finished, block]
    inside = None if sweep.inside is None else sweep.inside[sweep.finished]
    repeats = sweep.measured.x_mm.get(name, np.empty(0))
    interval = np.array(sweep.measured.prediction_mm.get(name, ()))
    limits = limits_of(x, np.concatenate([repeats, interval]))
    top = _draw_bars(axes, x, inside, len(sweep.finished), limits)
    if repeats.size:
        axes.axvspan(repeats.min(), repeats.max(), color=style.MEASURED_COLOUR, alpha=0.15, linewidth=0, zorder=0)
        axes.plot(repeats, np.full(len(repeats), 1.2 * top), **_REPEATS)
    if interval.size:
        axes.plot(interval, [1.08 * top] * 2, **_INTERVAL)
    axes.set_xlim(*limits)
    axes.set_ylim(0.0, top * (1.0 + room))
    axes.spines[["right", "top"]].set_visible(False)
    for side in (axes.xaxis, axes.yaxis):
        layout.number_axis(side)
    axes.set_yticks([tick for tick in axes.get_yticks() if tick <= top])
    axes.set_ylabel("cases (%)")
    shown = style.cut_to(name, _NAME_ROOM * style.POINTS_PER_INCH, style.FONT_SIZE)
    axes.set_xlabel(f"final x of block {shown} (mm)", labelpad=2.0)
    axes.set_title(_caption(x, limits), loc="left", pad=4.0)


def _draw_bars(axes: "Axes", x: Floats, inside: Flags | None, count: int, limits: tuple[float, float]) -> float:
    """Draw shares of all cases (%) and return the largest."""
    edges = np.linspace(*limits, _BINS + 1)
    shares, _ = np.histogram(x, edges)
    axes.stairs(100.0 * shares / count, edges, fill=True, color=ALL_COLOUR)
    if inside is not None:
        hits, _ = np.histogram(x[inside], edges)
        axes.stairs(100.0 * hits / count, edges, fill=True, color=INSIDE_COLOUR)
    return float(100.0 * shares.max() / count)


def _entries(sweep: SweepData) -> list[Any]:
    """Return the entries of the legend."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    entries: list[Any] = [Patch(color=ALL_COLOUR, label=f"all {len(sweep.finished)} cases")]
    if sweep.inside is not None:
        share = percent(float(sweep.inside.mean()))
        entries.append(Patch(color=INSIDE_COLOUR, label=f"all inside ({share})"))
    if sweep.measured.x_mm:
        count = max(len(repeats) for repeats in sweep.measured.x_mm.values())
        entries.append(Line2D([], [], **_REPEATS, label=f"{count} repeats and their range"))
    if sweep.measured.prediction_mm:
        entries.append(Line2D([], [], **_INTERVAL, label="next test (95 %)"))
    return entries


def _caption(x: Floats, limits: tuple[float, float]) -> str:
    beyond = int(((x < limits[0]) | (x > limits[1])).sum())
    rest = f", {beyond} beyond the axis" if beyond else ""
    return f"median {np.median(x):.1f} mm{rest}"

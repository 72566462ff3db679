"""Scatter matrix of inputs and final x, and histogram of final x."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from blocksim.view import run_data, style
from blocksim.view.sweeps.data import Input, SweepData, ValueAxis, percent, short_names, value_axis

LEFT, HEAD, FOOT = 0.46, 0.12, 0.34  # inches; more where names of levels stand at the left and below
GAP = 0.05  # inches, between panels
LARGEST, LOWEST = 1.1, 0.35  # inches, of a panel
SMALL_FONT, NAME_FONT = 6.0, style.FONT_SIZE - 1.0  # points
NAME_ROOM = 1.5  # inches, of a line of a name; longer ones take several
FITTINGS = 4  # smaller panels leave less room for names beside them
CROWDED = 0.08  # of an axis; a number this near to its start runs into the last one of the panel before
MOST_INPUTS, MOST_BLOCKS = 9, 3
RARE = 0.5  # percent of run-outs at either end that may lie beyond an axis
MARGIN = 0.04
SCATTER = 0.5  # of the distance between levels, over which their dots are spread
GOLDEN = 0.5 * (5.0**0.5 - 1.0)  # multiples of it, cut to their fractions, are evenly spread
OUTSIDE: dict[str, Any] = {"s": 1.2, "color": "#9FB4C2", "linewidth": 0.0, "rasterized": True, "zorder": 1}
INSIDE: dict[str, Any] = {"s": 6.0, "color": "#0072B2", "linewidth": 0.0, "rasterized": True, "zorder": 3}
FAILED: dict[str, Any] = {"s": 7.0, "color": style.INK, "marker": "x", "linewidth": 0.6, "zorder": 2}
REPEAT: dict[str, Any] = {"s": 8.0, "color": style.MEASURED_COLOUR, "marker": "D", "linewidth": 0.0, "zorder": 4}
REPEAT_LINE: dict[str, Any] = {"color": style.MEASURED_COLOUR, "linewidth": 0.5, "alpha": 0.7, "zorder": 2}
BAND: dict[str, Any] = {"color": style.MEASURED_COLOUR, "alpha": 0.13, "linewidth": 0.0, "zorder": 0}


@dataclass(frozen=True, eq=False)
class Variable:
    """Variable of one row and one column of the matrix, n cases; `repeats` are measured values of it."""

    name: str
    values: run_data.Floats  # (n,) as shown on the axis; NaN where there is none
    limits: tuple[float, float]
    is_log: bool = False
    levels: tuple[str, ...] = ()
    repeats: run_data.Floats | None = None


def variables_of(sweep: SweepData) -> list[Variable]:
    """Return the first inputs and the blocks that move, in this order."""
    names = short_names([one.key for one in sweep.inputs])
    variables = [_of_input(one, name) for one, name in zip(sweep.inputs, names, strict=True)][:MOST_INPUTS]
    for block in sweep.movers[-MOST_BLOCKS:]:
        x, name = sweep.x_mm[:, block], sweep.blocks[block]
        repeats = sweep.measured.x_mm.get(name)
        ends = np.nanpercentile(x, [RARE, 100.0 - RARE])
        known = ends if repeats is None else np.concatenate([ends, repeats])
        variables.append(Variable(f"x of {name} (mm)", x, _around(known, None), repeats=repeats))
    return variables


@contextmanager
def draw_matrix(sweep: SweepData, paper: style.Paper = style.OWN) -> "Iterator[style.Figure]":
    """Give the lower half of the matrix, with histograms on its diagonal and names beside that."""
    variables = variables_of(sweep)
    count, levels = len(variables), [level for one in variables for level in one.levels]
    gaps = (count - 1) * GAP
    widest = max((style.width_of(level, SMALL_FONT) for level in levels), default=0.0) / style.POINTS_PER_INCH + 0.12
    left, foot = max(LEFT, widest), max(FOOT, widest if levels else 0.0)
    width = paper.width(style.PAGE_WIDTH, left + _right_of(variables, LOWEST) + (count * LOWEST + gaps))
    size = LARGEST
    for _ in range(FITTINGS):
        size = min(size, (width - left - _right_of(variables, size) - gaps) / count)
    size = max(size, LOWEST)
    room = style.COLUMN_WIDTH if paper.size is None else width
    right = max(_right_of(variables, size), room - left - (count * size + gaps))
    own, least, sides = (size, size), (LOWEST, LOWEST), (left, right, HEAD, foot)
    more: dict[str, Any] = {"title": sweep.title, "handles": _entries(sweep), "columns": 4}
    with style.open_panels(paper, range(1, count + 1), own, least, sides, (GAP, GAP), **more) as (figure, panels):
        for row, (up, axes_of_row) in enumerate(zip(variables, panels, strict=True)):
            for column, (across, axes) in enumerate(zip(variables, axes_of_row, strict=False)):
                _draw_panel(axes, sweep, up, across)
                _finish(axes, up, across, is_left=column == 0 < row, is_last=row == count - 1)
            beside: dict[str, Any] = {"transform": axes_of_row[row].transAxes, "va": "center", "fontsize": NAME_FONT}
            lines = style.break_lines(up.name, NAME_ROOM, NAME_FONT)
            axes_of_row[row].text(1.0 + 0.04 / size, 0.5, "\n".join(lines), **beside)
        yield figure


def _right_of(variables: Sequence[Variable], size: float) -> float:
    """Return the room (inches) to the right of the panels that the names beside the diagonal need."""
    widths = [
        style.width_of(line, NAME_FONT) / style.POINTS_PER_INCH - (len(variables) - 1 - row) * (size + GAP)
        for row, one in enumerate(variables)
        for line in style.break_lines(one.name, NAME_ROOM, NAME_FONT)
    ]
    return max(*widths, 0.0) + 0.04 + style.EDGE


def _of_input(one: Input, name: str) -> Variable:
    if one.levels:
        spread = SCATTER * (np.arange(len(one.values)) * GOLDEN % 1.0 - 0.5)
        room = style.POINTS_PER_INCH
        levels = tuple(style.cut_to(level, room, SMALL_FONT) for level in one.levels)
        return Variable(name, one.values + spread, (-0.5, len(levels) - 0.5), levels=levels)
    axis = value_axis(one.values, name, one.unit, is_even=one.is_even, typed=one.typed)
    values = axis.scale(one.values)
    return Variable(axis.label, values, _around(values, axis), is_log=axis.is_log)


def _around(values: run_data.Floats, axis: ValueAxis | None) -> tuple[float, float]:
    """Return limits a little outside of all values."""
    low, high = float(values.min()), float(values.max())
    if axis is not None and axis.is_log:
        factor = (high / low) ** MARGIN
        return low / factor, high * factor
    margin = MARGIN * (high - low) or 0.5 * (abs(low) * 0.1 or 1.0)
    return low - margin, high + margin


def _draw_panel(axes: "style.Axes", sweep: SweepData, up: Variable, across: Variable) -> None:
    """Draw cases as dots, on the diagonal how many have which value, and of those that agree, each to the full height.

    Repeats are dots where both variables are measured together, else lines over their range.
    """
    if up is across:
        spread = np.geomspace if up.is_log else np.linspace
        edges = spread(*up.limits, 17)
        for cases, colour in ((sweep.finished, OUTSIDE["color"]), (sweep.inside, INSIDE["color"])):
            if cases is not None:
                counts, _ = np.histogram(up.values[cases], edges)
                look = {"fill": cases is sweep.finished, "color": colour, "linewidth": 1.0}
                axes.stairs(counts / max(int(counts.max()), 1), edges, **look)
        if up.repeats is not None:
            axes.axvspan(up.repeats.min(), up.repeats.max(), **BAND)
        return
    inside = sweep.finished if sweep.inside is None else sweep.inside
    outside = sweep.finished & ~inside
    for cases, look in ((outside, OUTSIDE), (~sweep.finished, FAILED), (inside, INSIDE)):
        if cases.any():
            axes.scatter(across.values[cases], up.values[cases], **look)
    if up.repeats is not None and across.repeats is not None and len(up.repeats) == len(across.repeats):
        axes.scatter(across.repeats, up.repeats, **REPEAT)
        return
    for repeats, line, band in ((up.repeats, axes.axhline, axes.axhspan), (across.repeats, axes.axvline, axes.axvspan)):
        if repeats is not None:
            band(repeats.min(), repeats.max(), **BAND)
            for repeat in repeats:
                line(repeat, **REPEAT_LINE)


def _finish(axes: "style.Axes", up: Variable, across: Variable, *, is_left: bool, is_last: bool) -> None:
    """Set the limits and write numbers at the outer panels only."""
    axes.tick_params(labelsize=SMALL_FONT, length=2.0, pad=1.5, labelleft=is_left, labelbottom=is_last)
    axes.tick_params(which="minor", length=1.0)
    if across.is_log:
        axes.set_xscale("log")
    _number(axes.xaxis, across)
    axes.set_xlim(*across.limits)
    if up is across:
        axes.set_ylim(0.0, 1.15)
        axes.set_yticks([])
        return
    if up.is_log:
        axes.set_yscale("log")
    _number(axes.yaxis, up)
    axes.set_ylim(*up.limits)


def _number(side: "style.Axis", one: Variable) -> None:
    """Write two numbers along an axis, below none so near to its start that it runs into the panel before."""
    from matplotlib.ticker import LogLocator, MaxNLocator

    style.number_axis(side, 2, is_log=one.is_log)
    if one.levels:
        side.set_ticks(range(len(one.levels)), list(one.levels))
    if side is not side.axes.xaxis:
        return
    if not one.levels:
        low, high = one.limits
        locator = LogLocator() if one.is_log else MaxNLocator(nbins=4, steps=[1, 2, 2.5, 5, 10])
        first = low * (high / low) ** CROWDED if one.is_log else low + CROWDED * (high - low)
        clear = [float(tick) for tick in locator.tick_values(low, high) if first < tick <= high]
        side.set_ticks(sorted({clear[0], clear[-1]}) if clear else [high])
    for label in side.get_ticklabels():
        label.set(rotation=90.0 if one.levels else 45.0, rotation_mode="default" if one.levels else "anchor")
        label.set_horizontalalignment("center" if one.levels else "right")


def _entries(sweep: SweepData) -> list[Any]:
    """Return the entries of the legend."""
    dot: dict[str, Any] = {"linestyle": "", "marker": "o", "markeredgewidth": 0.0}
    entries = []
    if sweep.inside is None:
        entries.append(style.legend_entry("finished", **dot, color=INSIDE["color"], markersize=3.0))
    else:
        share = percent(float(sweep.inside.mean()))
        label = f"in all measured ranges ({share} of {len(sweep.finished)})"
        entries.append(style.legend_entry(label, **dot, color=INSIDE["color"], markersize=3.5))
        entries.append(style.legend_entry("others", **dot, color=OUTSIDE["color"], markersize=2.5))
    if not sweep.finished.all():
        failed = f"failed ({percent(1.0 - float(sweep.finished.mean()))})"
        entries.append(style.legend_entry(failed, linestyle="", marker="x", color=style.INK, markersize=3.5))
    if sweep.measured.x_mm:
        look: dict[str, Any] = {"linestyle": "-", "marker": "D", "markersize": 3.0, "linewidth": 0.8}
        entries.append(style.legend_entry("repeats", **look, color=style.MEASURED_COLOUR))
    return entries


SIDES = 0.55, 0.2, 0.32, 0.42  # inches, around the panels of a histogram
PANEL_HEIGHT, ROW_GAP, ROOM = 1.15, 0.62, 0.26  # inches; ROOM is above the bars, for the repeats
LEAST_PANEL = 1.85, 0.6  # inches, of a panel where a size was asked for
MANY_BINS = 40
RARE_RUN_OUTS = 1.0  # percent at either end that may lie beyond the axis
ALL_COLOUR, INSIDE_COLOUR = "#B5D6EA", "#0072B2"
_MARK: dict[str, Any] = {"marker": "|", "color": style.MEASURED_COLOUR, "zorder": 4}
_REPEATS: dict[str, Any] = {**_MARK, "linestyle": "", "markersize": 7.0, "markeredgewidth": 1.1}
_INTERVAL: dict[str, Any] = {**_MARK, "markersize": 4.0, "linewidth": 1.0}


@contextmanager
def draw_histogram(sweep: SweepData, paper: style.Paper = style.OWN) -> "Iterator[style.Figure]":
    """Give a panel for each block that moves."""
    blocks = sweep.movers[-4:]
    own = style.COLUMN_WIDTH - sum(SIDES[:2]), PANEL_HEIGHT
    more: dict[str, Any] = {"title": sweep.title, "handles": _entries_histogram(sweep), "columns": 2}
    with style.open_panels(paper, [1] * len(blocks), own, LEAST_PANEL, SIDES, (0.0, ROW_GAP), **more) as opened:
        figure, rows = opened
        for block, (axes,) in zip(blocks, rows, strict=True):
            _draw_block(axes, sweep, block, ROOM / (style.size_of(axes)[1] - ROOM))
        yield figure


def limits_of(x_mm: run_data.Floats, others: run_data.Floats) -> tuple[float, float]:
    """Return the ends of an axis (mm) around all but the rarest run-outs and everything measured."""
    ends = np.concatenate([np.percentile(x_mm, [RARE_RUN_OUTS, 100.0 - RARE_RUN_OUTS]), others])
    return style.limits_around(ends, 0.04, MANY_BINS * 0.01)


def _draw_block(axes: "style.Axes", sweep: SweepData, block: int, room: float) -> None:
    """Draw the shares of all cases (%) over final x; `room` is that above the bars, over their height."""
    name, count = sweep.blocks[block], len(sweep.finished)
    x = sweep.x_mm[sweep.finished, block]
    repeats = sweep.measured.x_mm.get(name, np.empty(0))
    interval = np.array(sweep.measured.prediction_mm.get(name, ()))
    low, high = limits_of(x, np.concatenate([repeats, interval]))
    edges = np.linspace(low, high, MANY_BINS + 1)
    shares = 100.0 * np.histogram(x, edges)[0] / count
    axes.stairs(shares, edges, fill=True, color=ALL_COLOUR)
    if sweep.inside is not None:
        inside = x[sweep.inside[sweep.finished]]
        axes.stairs(100.0 * np.histogram(inside, edges)[0] / count, edges, fill=True, color=INSIDE_COLOUR)
    top = float(shares.max())
    if repeats.size:
        axes.axvspan(repeats.min(), repeats.max(), color=style.MEASURED_COLOUR, alpha=0.15, linewidth=0, zorder=0)
        axes.plot(repeats, np.full(len(repeats), 1.2 * top), **_REPEATS)
    if interval.size:
        axes.plot(interval, [1.08 * top] * 2, **_INTERVAL)
    axes.set_xlim(low, high)
    axes.set_ylim(0.0, top * (1.0 + room))
    axes.spines[["right", "top"]].set_visible(False)
    for side in (axes.xaxis, axes.yaxis):
        style.number_axis(side)
    axes.set_yticks([tick for tick in axes.get_yticks() if tick <= top])
    axes.set_ylabel("cases (%)")
    shown = style.cut_to(name, 1.2 * style.POINTS_PER_INCH, style.FONT_SIZE)  # inches, for the name of a block
    axes.set_xlabel(f"final x of block {shown} (mm)", labelpad=2.0)
    beyond = int(((x < low) | (x > high)).sum())
    axes.set_title(
        f"median {np.median(x):.1f} mm{f', {beyond} beyond the axis' if beyond else ''}", loc="left", pad=4.0
    )


def _entries_histogram(sweep: SweepData) -> list[Any]:
    """Return the entries of the legend."""
    entries: list[Any] = [
        style.legend_entry(f"all {len(sweep.finished)} cases", facecolor=ALL_COLOUR, edgecolor=ALL_COLOUR)
    ]
    if sweep.inside is not None:
        share = percent(float(sweep.inside.mean()))
        entries.append(style.legend_entry(f"all inside ({share})", facecolor=INSIDE_COLOUR, edgecolor=INSIDE_COLOUR))
    if sweep.measured.x_mm:
        count = max(len(repeats) for repeats in sweep.measured.x_mm.values())
        entries.append(style.legend_entry(f"{count} repeats and their range", **_REPEATS))
    if sweep.measured.prediction_mm:
        entries.append(style.legend_entry("next test (95 %)", **_INTERVAL))
    return entries

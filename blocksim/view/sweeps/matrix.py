"""Scatter matrix: every two of the inputs and the final x of the blocks, cases that agree and the repeats marked."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from blocksim.view import style
from blocksim.view.series import ValueAxis, value_axis
from blocksim.view.sweeps import layout
from blocksim.view.sweeps.colours import percent
from blocksim.view.sweeps.found import Floats, FoundSweep, Input, short_names
from blocksim.view.sweeps.kind import Kind

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis

LEFT, RIGHT, FOOT = 0.46, 0.78, 0.34  # inches
LEVELS_LEFT, LEVELS_FOOT = 0.62, 0.54  # inches, where names of levels stand there
GAP = 0.05  # inches, between panels
LINE = 0.145  # inches, of a row of text
LARGEST_PANEL, SMALL_FONT = 1.1, 6.0  # inches, points
MOST_INPUTS, MOST_BLOCKS = 9, 3
BINS = 16
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
    """What one row and one column of the matrix show, n cases; `repeats` are measured values of it."""

    name: str
    values: Floats  # (n,) as shown on the axis; NaN where there is none
    limits: tuple[float, float]
    is_log: bool = False
    levels: tuple[str, ...] = ()
    repeats: Floats | None = None


def refusal(sweep: FoundSweep) -> str:
    """Tell why a sweep cannot be shown: never."""
    del sweep
    return ""


def suits(sweep: FoundSweep) -> bool:
    """Tell whether there are inputs to set against each other."""
    return len(sweep.inputs) > 1


def variables_of(sweep: FoundSweep) -> list[Variable]:
    """Return the first inputs and the blocks that move, in this order."""
    inputs = sweep.inputs[:MOST_INPUTS]
    named = zip(inputs, short_names([one.key for one in sweep.inputs])[: len(inputs)], strict=True)
    return [
        *(_of_input(one, name) for one, name in named),
        *(_of_block(sweep, block) for block in sweep.moving[-MOST_BLOCKS:]),
    ]


def draw(sweep: FoundSweep, path: Path) -> None:
    """Draw the lower half of the matrix, with histograms on its diagonal."""
    variables = variables_of(sweep)
    count, has_levels = len(variables), any(one.levels for one in variables)
    left = LEVELS_LEFT if has_levels else LEFT
    size = min(LARGEST_PANEL, (layout.PAGE_WIDTH - left - RIGHT - (count - 1) * GAP) / count)
    legend = _entries(sweep)
    foot = (LEVELS_FOOT if has_levels else FOOT) + LINE + 2.0 * layout.EDGE
    across = max(left + RIGHT + count * size + (count - 1) * GAP, layout.COLUMN_WIDTH)
    height = layout.title_height(sweep.title, across) + count * size + (count - 1) * GAP + foot
    with style.styled_figure(across, height) as figure:
        layout.write_title(figure, sweep.title)
        for row in range(count):
            bottom = foot + (count - 1 - row) * (size + GAP)
            for column in range(row + 1):
                axes = layout.add_axes(figure, left + column * (size + GAP), bottom, size, size)
                _draw_panel(axes, sweep, variables[row], variables[column])
                _finish(axes, variables[row], variables[column], is_left=column == 0 < row, is_last=row == count - 1)
            place = (left + row * (size + GAP) + size + 0.04, bottom + 0.5 * size)
            layout.write_text(figure, *place, variables[row].name, va="center", fontsize=style.FONT_SIZE - 1.0)
        figure.legend(handles=legend, **_legend_place(across, height))
        style.save_figure(figure, path)


def _of_input(one: Input, name: str) -> Variable:
    if one.levels:
        spread = SCATTER * (np.arange(len(one.values)) * GOLDEN % 1.0 - 0.5)
        return Variable(name, one.values + spread, (-0.5, len(one.levels) - 0.5), levels=one.levels)
    axis = value_axis(one.values, name, one.unit, is_even=one.is_even)
    values = axis.shown(one.values)
    return Variable(axis.label, values, _around(values, axis), is_log=axis.is_log)


def _of_block(sweep: FoundSweep, block: int) -> Variable:
    x, name = sweep.x_mm[:, block], sweep.blocks[block]
    repeats = sweep.measured.x_mm.get(name)
    ends = np.nanpercentile(x, [RARE, 100.0 - RARE])
    known = ends if repeats is None else np.concatenate([ends, repeats])
    return Variable(f"x of {name} (mm)", x, _around(known, None), repeats=repeats)


def _around(values: Floats, axis: ValueAxis | None) -> tuple[float, float]:
    """Return limits a little outside of all values."""
    low, high = float(values.min()), float(values.max())
    if axis is not None and axis.is_log:
        factor = (high / low) ** MARGIN
        return low / factor, high * factor
    margin = MARGIN * (high - low) or 0.5 * (abs(low) * 0.1 or 1.0)
    return low - margin, high + margin


def _draw_panel(axes: "Axes", sweep: FoundSweep, up: Variable, across: Variable) -> None:
    if up is across:
        _draw_histogram(axes, sweep, up)
        return
    inside = sweep.finished if sweep.inside is None else sweep.inside
    outside = sweep.finished & ~inside
    for cases, look in ((outside, OUTSIDE), (~sweep.finished, FAILED), (inside, INSIDE)):
        axes.scatter(across.values[cases], up.values[cases], **look)
    _draw_repeats(axes, up, across)


def _draw_repeats(axes: "Axes", up: Variable, across: Variable) -> None:
    """Draw repeats as dots where both are measured together, else as lines over their range."""
    if up.repeats is not None and across.repeats is not None and len(up.repeats) == len(across.repeats):
        axes.scatter(across.repeats, up.repeats, **REPEAT)
        return
    for repeats, line, band in ((up.repeats, axes.axhline, axes.axhspan), (across.repeats, axes.axvline, axes.axvspan)):
        if repeats is not None:
            band(repeats.min(), repeats.max(), **BAND)
            for repeat in repeats:
                line(repeat, **REPEAT_LINE)


def _draw_histogram(axes: "Axes", sweep: FoundSweep, one: Variable) -> None:
    """Draw how many cases have which value, and the same of those that agree, both to the height of the panel."""
    spread = np.geomspace if one.is_log else np.linspace
    edges = spread(*one.limits, BINS + 1)
    drawn = [(sweep.finished, OUTSIDE["color"], True)]
    if sweep.inside is not None:
        drawn.append((sweep.inside, INSIDE["color"], False))
    for cases, colour, fill in drawn:
        counts, _ = np.histogram(one.values[cases], edges)
        axes.stairs(counts / max(int(counts.max()), 1), edges, fill=fill, color=colour, linewidth=1.0)
    if one.repeats is not None:
        axes.axvspan(one.repeats.min(), one.repeats.max(), **BAND)


def _finish(axes: "Axes", up: Variable, across: Variable, *, is_left: bool, is_last: bool) -> None:
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


def _number(side: "Axis", one: Variable) -> None:
    layout.number_axis(side, None if not one.is_log else ValueAxis("", 0.0, 1.0, is_log=True), most=2)
    if one.levels:
        side.set_ticks(range(len(one.levels)), [level[:9] for level in one.levels])
    if side is side.axes.xaxis:
        for label in side.get_ticklabels():
            label.set_rotation(90.0 if one.levels else 45.0)


def _entries(sweep: FoundSweep) -> list[Any]:
    """Return what the legend names."""
    from matplotlib.lines import Line2D  # noqa: PLC0415 - see style

    dot: dict[str, Any] = {"linestyle": "", "marker": "o", "markeredgewidth": 0.0}
    entries = []
    if sweep.inside is None:
        entries.append(Line2D([], [], **dot, color=INSIDE["color"], markersize=3.0, label="finished"))
    else:
        share = percent(float(sweep.inside.mean()))
        told = f"in all measured ranges ({share} of {len(sweep.finished)})"
        entries.append(Line2D([], [], **dot, color=INSIDE["color"], markersize=3.5, label=told))
        entries.append(Line2D([], [], **dot, color=OUTSIDE["color"], markersize=2.5, label="others"))
    if not sweep.finished.all():
        failed = f"failed ({percent(1.0 - float(sweep.finished.mean()))})"
        entries.append(Line2D([], [], linestyle="", marker="x", color=style.INK, markersize=3.5, label=failed))
    if sweep.measured.x_mm:
        look: dict[str, Any] = {"linestyle": "-", "marker": "D", "markersize": 3.0, "linewidth": 0.8}
        entries.append(Line2D([], [], **look, color=style.MEASURED_COLOUR, label="repeats"))
    return entries


def _legend_place(across: float, height: float) -> dict[str, Any]:
    return {
        "loc": "lower left",
        "bbox_to_anchor": (layout.EDGE / across, layout.EDGE / height),
        "ncols": 4,
        "frameon": False,
        "borderpad": 0.0,
        "borderaxespad": 0.0,
        "handletextpad": 0.3,
        "columnspacing": 1.2,
    }


MATRIX = Kind("every two of the inputs and final x, cases that agree marked", refusal, suits, draw)

"""Pictures of studies: a quantity with its law, limits over a key, fragility, and bars of sensitivity."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from blocksim.view import style
from blocksim.view.run_data import Floats
from blocksim.view.style import (
    EDGE,
    LINE,
    OWN,
    Paper,
    add_axes,
    number_axis,
    plain_numbers,
    wrapped,
    write_heading,
    write_text,
)
from blocksim.view.sweeps.data import short_names
from blocksim.view.time_panels import limits_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes


_WIDTH, PANEL_HEIGHT = 5.2, 3.0  # inches
_RIGHT, _HEAD, _FOOT = 0.15, 0.38, 0.48  # inches
_NARROWEST, _LOWEST = 1.8, 1.0  # inches, of the panel on a page whose size was asked for


@contextmanager
def open_study_figure(
    path: Path | str, title: str | None, notes: Sequence[str], paper: Paper, left: float
) -> "Iterator[Axes]":
    """Give the panel, `left` inches from the edge; then write the picture as PNG, SVG or PDF.

    The same input gives the same bytes. Raises InvalidInputError for an unknown picture format or too small a page,
    before the panel is given, and OutputError when the file cannot be written.
    """
    path = Path(path)
    style.picture_suffix(path)
    width = paper.width(_WIDTH, left + _RIGHT + _NARROWEST)
    lines = wrapped(list(notes), width - left - EDGE)
    foot = _FOOT + LINE * len(lines)
    row = paper.panel(PANEL_HEIGHT, 1, _HEAD + foot, _LOWEST)
    with style.styled_figure(width, paper.height(_HEAD + row + foot), paper.dots) as figure:
        axes = add_axes(figure, left, foot, width - left - _RIGHT, row)
        axes.spines[["right", "top"]].set_visible(False)
        yield axes
        for number, line in enumerate(reversed(lines)):
            write_text(figure, left, EDGE + LINE * number, line, color=style.FAINT_INK)
        write_heading(figure, title, EDGE)
        style.save_figure(figure, path)


_WIDTH_LAW, UPPER, LOWER = 7.2, 2.4, 1.0  # inches
_LEFT, _RIGHT_LAW, _HEAD_LAW, _FOOT_LAW, _GAP = 0.75, 0.15, 0.38, 0.42, 0.16  # inches
_LOWEST_LAW = 0.5  # inches, of the lower panel on a page whose size was asked for
SIMULATED: dict[str, Any] = {"color": "#0072B2", "linewidth": 3.0, "alpha": 0.55, "solid_capstyle": "butt"}
EXPECTED: dict[str, Any] = {"color": style.INK, "linewidth": 1.0, "linestyle": (0, (4, 2))}


@dataclass(frozen=True, eq=False)
class Law:
    """n values of one quantity: simulated and by a formula, in the unit of `quantity`; NaN where there is no formula.

    `marks` are times (s) worth a thin line, such as impacts.
    """

    quantity: str
    unit: str
    formula: str
    time: Floats  # (n,) s
    simulated: Floats  # (n,)
    expected: Floats  # (n,)
    marks: Sequence[float] = ()

    @property
    def difference(self) -> Floats:
        """Simulated − expected, (n,)."""
        return self.simulated - self.expected

    @property
    def largest(self) -> float:
        """The largest difference, without sign."""
        return float(np.nanmax(np.abs(self.difference)))


def draw_law(law: Law, path: Path | str, title: str, paper: Paper = OWN) -> None:
    """Draw the quantity and the difference and write PNG, SVG or PDF; the same input gives the same bytes.

    Raises InvalidInputError for an unknown picture format or a page that is too small, and OutputError when the file
    cannot be written.
    """
    path = Path(path)
    style.picture_suffix(path)
    width = paper.width(_WIDTH_LAW, _LEFT + _RIGHT_LAW + 1.0)
    lower = paper.panel(LOWER, 1, _HEAD_LAW + UPPER + _GAP + _FOOT_LAW, _LOWEST_LAW)
    lower = lower if paper.size is None else min(lower, LOWER)
    height = paper.height(_HEAD_LAW + UPPER + _GAP + lower + _FOOT_LAW)
    upper = height - _HEAD_LAW - _GAP - lower - _FOOT_LAW
    with style.styled_figure(width, height, paper.dots) as figure:
        inside = (width - _LEFT - _RIGHT_LAW) / width
        above = figure.add_axes((_LEFT / width, (_FOOT_LAW + lower + _GAP) / height, inside, upper / height))
        below = figure.add_axes((_LEFT / width, _FOOT_LAW / height, inside, lower / height))
        above.plot(law.time, law.simulated, label="simulated", **SIMULATED)
        above.plot(law.time, law.expected, label=law.formula, **EXPECTED)
        above.legend(loc="upper right", frameon=False)
        below.plot(law.time, law.difference, color=SIMULATED["color"], linewidth=1.0)
        known = np.concatenate([law.simulated, law.expected[np.isfinite(law.expected)]])
        _finish(above, law, f"{law.quantity} ({law.unit})", known, inside * width)
        _finish(below, law, f"difference ({law.unit})", law.difference[np.isfinite(law.difference)], inside * width)
        above.tick_params(labelbottom=False)
        below.set_xlabel("time (s)", labelpad=2.0)
        write_heading(figure, title, 0.12, 0.08)
        style.save_figure(figure, path)


def _finish(axes: "Axes", law: Law, label: str, values: Floats, inside: float) -> None:
    """Set limits and texts of a panel, `inside` inches wide."""
    for mark in law.marks:
        axes.axvline(mark, color=style.FAINT_INK, linewidth=0.5, zorder=0)
    axes.spines[["right", "top"]].set_visible(False)
    axes.set_xlim(float(law.time[0]), float(law.time[-1]))
    low, high = limits_of(values)
    axes.set_ylim(low, high)
    axes.yaxis.set_label_coords(-0.52 / inside, 0.5)
    axes.set_ylabel(label)
    plain_numbers(axes.yaxis)


_LEFT_LIMIT_CURVE = 0.62  # inches
_MARGIN = 0.06  # of an axis
_MOST_NUMBERS = 6
COLOURS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7")  # by the kind of the change
LINE_COLOUR = "#777777"
OTHERS = ("#D55E00", "#000000", "#56B4E9", "#777777")  # of what others found
MARKS = "DsX^"
MOST_MARKS = 12  # series with more points are lines


class Bracket(NamedTuple):
    """A limit at one value: between which values it lies, and what the structure does below and above."""

    low: float
    high: float
    below: str
    above: str


class Series(NamedTuple):
    """What others found: a name, and limits as pairs of the other key's value and the limit."""

    name: str
    points: tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class LimitCurve:
    """The brackets at every value of the other key, the names of both axes, and what others found."""

    across: str
    up: str
    points: Sequence[tuple[float, Sequence[Bracket]]]
    notes: tuple[str, ...] = ()
    beside: tuple[Series, ...] = ()


def join_brackets(curve: LimitCurve) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    """Return the lines between middles of brackets: of neighbours with as many limits of the same kinds."""
    lines = []
    for (left, here), (right, there) in pairwise(curve.points):
        if [one[2:] for one in here] == [one[2:] for one in there]:
            lines += [((left, _middle(a)), (right, _middle(b))) for a, b in zip(here, there, strict=True)]
    return lines


def _middle(one: Bracket) -> float:
    return 0.5 * (one.low + one.high)


def draw_limit_curve(curve: LimitCurve, path: Path | str, title: str | None = None, paper: Paper = OWN) -> None:
    """Draw the picture and write it; raises as `sheet`."""
    with open_study_figure(path, title, curve.notes, paper, _LEFT_LIMIT_CURVE) as axes:
        for start, end in join_brackets(curve):
            axes.plot(*zip(start, end, strict=True), color=LINE_COLOUR, linewidth=1.0, zorder=2)
        _draw_others(axes, curve.beside)
        _draw_brackets(axes, [(x, one) for x, found in curve.points for one in found])
        axes.margins(_MARGIN)
        for axis in (axes.xaxis, axes.yaxis):
            number_axis(axis, _MOST_NUMBERS)
        axes.set_xlabel(curve.across, labelpad=2.0)
        axes.set_ylabel(curve.up, labelpad=2.0)
        axes.legend(loc="best", frameon=False)


def _draw_brackets(axes: "Axes", brackets: Sequence[tuple[float, Bracket]]) -> None:
    """Draw brackets at their places, those of a kind in one colour."""
    for number, kind in enumerate(dict.fromkeys((one.below, one.above) for _, one in brackets)):
        own = [(x, one) for x, one in brackets if one[2:] == kind]
        middles = [_middle(one) for _, one in own]
        reach = [0.5 * (one.high - one.low) for _, one in own]
        places = [x for x, _ in own]
        look: dict[str, Any] = {"color": COLOURS[number % len(COLOURS)], "markersize": 4.5, "linewidth": 0.0}
        label = f"{kind[0]} below, {kind[1]} above"
        axes.errorbar(places, middles, yerr=reach, fmt="o", elinewidth=1.0, capsize=2.5, label=label, **look)


def _draw_others(axes: "Axes", beside: Sequence[Series]) -> None:
    """Draw long series as lines and short ones as marks, which no line between few points would do justice."""
    for number, one in enumerate(beside):
        colour = OTHERS[number % len(OTHERS)]
        look: dict[str, Any] = {"color": colour, "linewidth": 1.4, "zorder": 1.5}
        if len(one.points) <= MOST_MARKS:
            mark = MARKS[number % len(MARKS)]
            look |= {"linestyle": "none", "marker": mark, "markersize": 6.0, "markerfacecolor": "none", "zorder": 3.0}
        axes.plot(*zip(*one.points, strict=True), label=one.name, **look)


_LEFT_FRAGILITY = 0.55  # inches
WIDE = 8.0  # ratio of the largest to the smallest intensity from which on the axis is logarithmic
CURVE_COLOUR = "#0072B2"
POINTS = 200


@dataclass(frozen=True, eq=False)
class Band:
    """A curve and its limits at intensities, (n,) each."""

    x: Floats
    probability: Floats
    low: Floats
    high: Floats


@dataclass(frozen=True, eq=False)
class Fragility:
    """Shares of failures at k intensities with limits, (k,) each, the curve if there is one, and notes below."""

    key: str
    unit: str
    x: Floats
    share: Floats
    low: Floats
    high: Floats
    band: Band | None
    notes: tuple[str, ...] = ()


def axis_of(x: Floats) -> tuple[float, float, bool]:
    """Return the ends of the axis of intensities, and whether it is logarithmic."""
    low, high = float(x.min()), float(x.max())
    if high > WIDE * low:
        margin = (high / low) ** _MARGIN
        return low / margin, high * margin, True
    margin = _MARGIN * (high - low) or _MARGIN * high
    return max(low - margin, 0.5 * low), high + margin, False


def places(x: Floats) -> Floats:
    """Return intensities over the whole axis, at which a curve is drawn."""
    low, high, is_log = axis_of(x)
    return np.asarray(np.geomspace(low, high, POINTS) if is_log else np.linspace(low, high, POINTS))


def draw_fragility(found: Fragility, path: Path | str, title: str | None = None, paper: Paper = OWN) -> None:
    """Draw the picture and write it; raises as `sheet`."""
    with open_study_figure(path, title, found.notes, paper, _LEFT_FRAGILITY) as axes:
        band = found.band
        if band is not None:
            axes.fill_between(band.x, band.low, band.high, color=CURVE_COLOUR, alpha=0.18, linewidth=0.0)
            axes.plot(band.x, band.probability, color=CURVE_COLOUR, linewidth=1.4, label="lognormal curve, 95 % band")
        reach = np.maximum([found.share - found.low, found.high - found.share], 0.0)
        axes.errorbar(
            found.x,
            found.share,
            yerr=reach,
            fmt="o",
            color=style.INK,
            markersize=4.0,
            linewidth=style.LINE_WIDTH,
            capsize=2.5,
            label="share of samples, 95 % limits",
            clip_on=False,
            zorder=3,
        )
        low, high, is_log = axis_of(found.x)
        axes.set_xscale("log" if is_log else "linear")
        axes.set_xlim(low, high)
        axes.set_ylim(0.0, 1.0)
        number_axis(axes.xaxis, _MOST_NUMBERS, is_log=is_log)
        axes.set_xlabel(f"{found.key} ({found.unit})" if found.unit else found.key, labelpad=2.0)
        axes.set_ylabel("probability of failure")
        handles, labels = axes.get_legend_handles_labels()
        axes.legend(handles[::-1], labels[::-1], loc="best", frameon=False)


BAR, _GAP_TORNADO, _FOOT_TORNADO = 0.15, 0.46, 0.34  # inches: height of a bar, between panels, below them
LEAST_ROOM, MOST_ROOM = 0.5, 1.75  # inches, for the name of a key; longer ones take several lines
BROKEN = 0.95  # of the height of a bar, for each line of keys
_NARROWEST_TORNADO, LEAST_BAR = 0.8, 0.12  # inches, on a page whose size was asked for
MOST_KEYS, MOST_PANELS = 10, 8
MOST_INTERVAL = 0.6  # of the longest bar, that an axis makes room for
BEYOND: dict[str, Any] = {"linestyle": "", "marker": ">", "markersize": 3.0, "color": style.INK, "clip_on": False}
MAIN_COLOUR, FIRST_COLOUR = "#B5D6EA", "#0072B2"


@dataclass(frozen=True, eq=False)
class Bars:
    """Indices of k keys for one result; `low` and `high` are the ends of their intervals, `part` a share of them."""

    title: str
    keys: tuple[str, ...]
    values: Floats  # (k,)
    half_widths: Floats  # (k,) of the intervals of `values`
    part: Floats | None = None  # (k,)


def draw_tornado(
    panels: Sequence[Bars], labels: tuple[str, str], path: Path | str, title: str, paper: Paper = OWN
) -> None:
    """Draw bars of the indices and write PNG, SVG or PDF; `labels` name the whole bars and their dark parts.

    Raises InvalidInputError for an unknown picture format or a page that is too small, and OutputError when the file
    cannot be written.
    """
    path = Path(path)
    style.picture_suffix(path)
    varying = [panel for panel in panels if np.any(panel.values)] or list(panels)
    panels = [replace(panel, keys=tuple(map(broken, short_names(panel.keys)))) for panel in varying[:MOST_PANELS]]
    left = _room_for_keys(panels)
    width = paper.width(style.COLUMN_WIDTH, left + _NARROWEST_TORNADO)
    titles = ["\n".join(style.broken(panel.title, width - 2.0 * style.EDGE)) for panel in panels]
    rows = [min(len(panel.keys), MOST_KEYS) + 0.6 for panel in panels]
    foot = _FOOT_TORNADO + style.LINE * (2 if labels[1] else 1) + style.EDGE
    head = style.title_height(title, width) + 0.2
    gaps = _GAP_TORNADO * (len(panels) - 1) + style.LINE * sum(one.count("\n") for one in titles)
    lines = max(key.count("\n") + 1 for panel in panels for key in panel.keys)
    bar = paper.panel(BAR * (1.0 if lines == 1 else BROKEN * lines), 1, head + gaps + foot, LEAST_BAR * sum(rows))
    bar = bar if paper.size is None else bar / sum(rows)
    height = paper.height(head + bar * sum(rows) + gaps + foot)
    with style.styled_figure(width, height, paper.dots) as figure:
        style.write_title(figure, title)
        bottom = height - head
        for panel, heading, count in zip(panels, titles, rows, strict=True):
            bottom -= bar * count + style.LINE * heading.count("\n")
            axes = style.add_axes(figure, left, bottom, width - left - 2.0 * style.EDGE, bar * count)
            _draw_bars(axes, panel, min(style.FONT_SIZE, bar * style.POINTS_PER_INCH / (style.LETTER[1] * lines)))
            style.write_text(figure, style.EDGE, bottom + bar * count + 0.05, heading)
            bottom -= _GAP_TORNADO
        style.write_legend(figure, _entries(labels), style.EDGE, style.EDGE, labelspacing=0.25)
        style.save_figure(figure, path)


def order_of(values: Floats) -> list[int]:
    """Return the numbers of the keys to draw, the largest index first."""
    return [int(key) for key in np.argsort(-np.abs(values), kind="stable")[:MOST_KEYS]]


def broken(name: str) -> str:
    """Return a key in as many lines as it needs at the left of the bars."""
    return "\n".join(style.broken(name, MOST_ROOM))


def _room_for_keys(panels: Sequence[Bars]) -> float:
    """Return the width (inches) of the widest key, and a gap."""
    lines = [line for panel in panels for key in panel.keys for line in key.split("\n")]
    widest = max(style.width_of(line, style.FONT_SIZE) for line in lines) / style.POINTS_PER_INCH
    return max(widest, LEAST_ROOM) + 0.2


def _draw_bars(axes: "Axes", panel: Bars, font: float) -> None:
    order = order_of(panel.values)
    places = np.arange(len(order))[::-1]
    intervals = np.nan_to_num(panel.half_widths[order])
    whisker = {"ecolor": style.INK, "elinewidth": style.LINE_WIDTH, "capsize": 1.5}
    axes.barh(places, panel.values[order], 0.72, color=MAIN_COLOUR, xerr=intervals, error_kw=whisker)
    if panel.part is not None:
        axes.barh(places, panel.part[order], 0.36, color=FIRST_COLOUR)
    axes.axvline(0.0, color=style.FAINT_INK, linewidth=style.LINE_WIDTH)
    axes.set_yticks(places, [panel.keys[key] for key in order], fontsize=font)
    axes.set_ylim(-0.8, len(order) - 0.2)
    axes.tick_params(axis="y", length=0.0)
    axes.spines[["right", "top", "left"]].set_visible(False)
    low, high = span_of_bars(panel)
    axes.set_xlim(low, high)
    beyond = places[panel.values[order] + intervals > high]
    axes.plot(np.full(len(beyond), high), beyond, **BEYOND)
    style.number_axis(axes.xaxis)


def span_of_bars(panel: Bars) -> tuple[float, float]:
    """Return the ends of an axis around the bars; intervals of indices that are hardly known may lie beyond."""
    ends = np.concatenate([panel.values, np.zeros(1) if panel.part is None else panel.part])
    largest = float(np.abs(ends).max()) or 1.0
    reach = np.minimum(np.nan_to_num(panel.half_widths), largest * MOST_INTERVAL)
    low = float(min(ends.min(), 0.0, np.min(panel.values - reach)))
    high = float(max(ends.max(), 0.0, np.max(panel.values + reach)))
    return low - 0.02 * largest, high + 0.02 * largest


def _entries(labels: tuple[str, str]) -> list[Any]:
    from matplotlib.patches import Patch

    pairs = zip((MAIN_COLOUR, FIRST_COLOUR), labels, strict=True)
    return [Patch(color=colour, label=label) for colour, label in pairs if label]

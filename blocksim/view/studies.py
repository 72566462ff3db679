"""Pictures of studies: limits over a key, fragility, bars of sensitivity, convergence.

Of convergence: how far coarser levels of a numerical setting are from the finest, a panel each, finer to the right.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.view import run_data, style
from blocksim.view.sweeps.data import short_names

PANEL, LEAST = (4.4, 3.0), (1.8, 1.0)  # inches, of the panel, and on a page whose size was asked for
SIDES = 0.65, 0.15, 0.11, 0.42  # inches


@contextmanager
def open_study_figure(
    path: Path | str, title: str | None, notes: Sequence[str], paper: style.Paper
) -> "Iterator[style.Axes]":
    """Give the panel; then write the picture as PNG, SVG or PDF.

    The same input gives the same bytes. Raises InvalidInputError for an unknown picture format or too small a page,
    before the panel is given, and OutputError when the file cannot be written.
    """
    path = style.picture_path(path)
    with style.open_panels(paper, [1], PANEL, LEAST, SIDES, title=title, notes=" ".join(notes)) as opened:
        figure, ((axes,),) = opened
        axes.spines[["right", "top"]].set_visible(False)
        yield axes
        style.save_figure(figure, path)


MARGIN = 0.06  # of an axis
MOST_NUMBERS = 6
COLOURS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7")  # by the kind of the change
LINE_COLOUR = "#777777"
OTHERS = ("#D55E00", "#000000", "#56B4E9", "#777777")  # of what others found
MARKS = "DsX^"


class LimitRange(NamedTuple):
    """A limit at one value: between which values it lies, and what the structure does below and above."""

    low: float
    high: float
    below: str
    above: str

    @property
    def middle(self) -> float:
        """The middle of the bracket."""
        return 0.5 * (self.low + self.high)


class OtherLimits(NamedTuple):
    """What others found: a name, and limits as pairs of the other key's value and the limit."""

    name: str
    points: tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class LimitCurve:
    """The brackets at every value of the other key, the names of both axes, and what others found."""

    across: str
    up: str
    points: Sequence[tuple[float, Sequence[LimitRange]]]
    notes: tuple[str, ...] = ()
    beside: tuple[OtherLimits, ...] = ()


def join_brackets(curve: LimitCurve) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    """Return the lines between middles of brackets: of neighbours with as many limits of the same kinds."""
    lines = []
    for (left, here), (right, there) in pairwise(curve.points):
        if [one[2:] for one in here] == [one[2:] for one in there]:
            lines += [((left, a.middle), (right, b.middle)) for a, b in zip(here, there, strict=True)]
    return lines


def draw_limit_curve(
    curve: LimitCurve, path: Path | str, title: str | None = None, paper: style.Paper = style.OWN
) -> None:
    """Draw the picture and write it; raises as `open_study_figure`.

    Brackets of a kind have one colour. Of what others found, long series are lines and short ones marks, which no line
    between few points would do justice.
    """
    brackets = [(x, one) for x, found in curve.points for one in found]
    with open_study_figure(path, title, curve.notes, paper) as axes:
        for start, end in join_brackets(curve):
            axes.plot(*zip(start, end, strict=True), color=LINE_COLOUR, linewidth=1.0, zorder=2)
        for number, series in enumerate(curve.beside):
            look: dict[str, Any] = {"color": OTHERS[number % len(OTHERS)], "linewidth": 1.4, "zorder": 1.5}
            if len(series.points) <= 12:  # series with more points are lines
                look |= {"linestyle": "none", "marker": MARKS[number % len(MARKS)], "markersize": 6.0, "zorder": 3.0}
                look |= {"markerfacecolor": "none"}
            axes.plot(*zip(*series.points, strict=True), label=series.name, **look)
        for number, kind in enumerate(dict.fromkeys((one.below, one.above) for _, one in brackets)):
            own = [(x, one.middle, 0.5 * (one.high - one.low)) for x, one in brackets if one[2:] == kind]
            x, middles, reach = zip(*own, strict=True)
            look = {"color": COLOURS[number % len(COLOURS)], "markersize": 4.5, "linewidth": 0.0, "elinewidth": 1.0}
            label = f"{kind[0]} below, {kind[1]} above"
            axes.errorbar(x, middles, yerr=reach, fmt="o", capsize=2.5, label=label, **look)
        axes.margins(MARGIN)
        for axis in (axes.xaxis, axes.yaxis):
            style.number_axis(axis, MOST_NUMBERS)
        axes.set_xlabel(curve.across, labelpad=2.0)
        axes.set_ylabel(curve.up, labelpad=2.0)
        axes.legend(loc="best", frameon=False)


WIDE = 8.0  # ratio of the largest to the smallest intensity from which on the axis is logarithmic
CURVE_COLOUR = "#0072B2"
POINTS = 200


@dataclass(frozen=True, eq=False)
class Band:
    """A curve and its limits at intensities, (n,) each."""

    x: run_data.Floats
    probability: run_data.Floats
    low: run_data.Floats
    high: run_data.Floats


@dataclass(frozen=True, eq=False)
class Fragility:
    """Shares of failures at k intensities with limits, (k,) each, the curve if there is one, and notes below."""

    key: str
    unit: str
    x: run_data.Floats
    share: run_data.Floats
    low: run_data.Floats
    high: run_data.Floats
    band: Band | None
    notes: tuple[str, ...] = ()


def axis_of(x: run_data.Floats) -> tuple[float, float, bool]:
    """Return the ends of the axis of intensities, and whether it is logarithmic."""
    low, high = float(x.min()), float(x.max())
    if high > WIDE * low:
        margin = (high / low) ** MARGIN
        return low / margin, high * margin, True
    margin = MARGIN * (high - low) or MARGIN * high
    return max(low - margin, 0.5 * low), high + margin, False


def places(x: run_data.Floats) -> run_data.Floats:
    """Return intensities over the whole axis, at which a curve is drawn."""
    low, high, is_log = axis_of(x)
    return np.asarray(np.geomspace(low, high, POINTS) if is_log else np.linspace(low, high, POINTS))


def draw_fragility(
    found: Fragility, path: Path | str, title: str | None = None, paper: style.Paper = style.OWN
) -> None:
    """Draw the picture and write it; raises as `open_study_figure`."""
    band = found.band
    with open_study_figure(path, title, found.notes, paper) as axes:
        if band is not None:
            axes.fill_between(band.x, band.low, band.high, color=CURVE_COLOUR, alpha=0.18, linewidth=0.0)
            axes.plot(band.x, band.probability, color=CURVE_COLOUR, linewidth=1.4, label="lognormal curve, 95 % band")
        reach = np.maximum([found.share - found.low, found.high - found.share], 0.0)
        look: dict[str, Any] = {"fmt": "o", "color": style.INK, "markersize": 4.0, "linewidth": style.LINE_WIDTH}
        look |= {"capsize": 2.5, "label": "share of samples, 95 % limits", "clip_on": False, "zorder": 3}
        axes.errorbar(found.x, found.share, yerr=reach, **look)
        low, high, is_log = axis_of(found.x)
        axes.set_xscale("log" if is_log else "linear")
        axes.set_xlim(low, high)
        axes.set_ylim(0.0, 1.0)
        style.number_axis(axes.xaxis, MOST_NUMBERS, is_log=is_log)
        axes.set_xlabel(f"{found.key} ({found.unit})" if found.unit else found.key, labelpad=2.0)
        axes.set_ylabel("probability of failure")
        handles, labels = axes.get_legend_handles_labels()
        axes.legend(handles[::-1], labels[::-1], loc="best", frameon=False)


BAR, BAR_GAP, BAR_FOOT = 0.15, 0.46, 0.34  # inches: height of a bar, between panels, below them
LEAST_ROOM, MOST_ROOM = 0.5, 1.75  # inches, for the name of a key; longer ones take several lines
BROKEN = 0.95  # of the height of a bar, for each line of keys
NARROWEST, LEAST_BAR = 0.7, 0.12  # inches, on a page whose size was asked for
MOST_KEYS, MOST_PANELS = 10, 8
MOST_INTERVAL = 0.6  # of the longest bar, that an axis makes room for
BEYOND: dict[str, Any] = {"linestyle": "", "marker": ">", "markersize": 3.0, "color": style.INK, "clip_on": False}
MAIN_COLOUR, FIRST_COLOUR = "#B5D6EA", "#0072B2"


@dataclass(frozen=True, eq=False)
class Bars:
    """Indices of k keys for one result, with half the widths of their intervals; `part` is a share of them."""

    title: str
    keys: tuple[str, ...]
    values: run_data.Floats  # (k,)
    half_widths: run_data.Floats  # (k,) of the intervals of `values`
    part: run_data.Floats | None = None  # (k,)


def draw_tornado(
    panels: Sequence[Bars], labels: tuple[str, str], path: Path | str, title: str, paper: style.Paper = style.OWN
) -> None:
    """Draw bars of the indices and write PNG, SVG or PDF; `labels` name the whole bars and their dark parts.

    Raises InvalidInputError for an unknown picture format or a page that is too small, and OutputError when the file
    cannot be written.
    """
    path = style.picture_path(path)
    varying = [panel for panel in panels if np.any(panel.values)] or list(panels)
    panels = []
    for panel in varying[:MOST_PANELS]:  # keys in as many lines as they need at the left of the bars
        names = ("\n".join(style.break_lines(name, MOST_ROOM)) for name in short_names(panel.keys))
        panels.append(replace(panel, keys=tuple(names)))
    keys = [key for panel in panels for key in panel.keys]
    widest = max(style.width_of(line, style.FONT_SIZE) for key in keys for line in key.split("\n"))
    left, right = max(widest / style.POINTS_PER_INCH, LEAST_ROOM) + 0.2, 2.0 * style.EDGE
    width = paper.width(style.COLUMN_WIDTH, left + right + NARROWEST)
    titles = [style.break_lines(panel.title, width - right) for panel in panels]
    most, lines = max(map(len, titles)), max(key.count("\n") + 1 for key in keys)
    rows = max(min(len(panel.keys), MOST_KEYS) for panel in panels) + 0.6
    bar = BAR * (1.0 if lines == 1 else BROKEN * lines)
    own, least = (width - left - right, bar * rows), (NARROWEST, LEAST_BAR * rows)
    sides, gaps = (left, right, 0.08 + style.LINE * most, BAR_FOOT), (0.0, BAR_GAP + style.LINE * (most - 1))
    pairs = zip((MAIN_COLOUR, FIRST_COLOUR), labels, strict=True)
    handles = [style.legend_entry(label, facecolor=colour, edgecolor=colour) for colour, label in pairs if label]
    counts = [1] * len(panels)
    with style.open_panels(paper, counts, own, least, sides, gaps, title=title, handles=handles) as (figure, drawn):
        up = float(figure.get_figheight())
        for panel, heading, (axes,) in zip(panels, titles, drawn, strict=True):
            place = axes.get_position()
            bar = style.size_of(axes)[1] / rows
            _draw_bars(axes, panel, min(style.FONT_SIZE, bar * style.POINTS_PER_INCH / (style.LETTER[1] * lines)))
            style.write_text(figure, style.EDGE, place.y1 * up + 0.05, "\n".join(heading), va="bottom")
        style.save_figure(figure, path)


def _draw_bars(axes: "style.Axes", panel: Bars, font: float) -> None:
    order = np.argsort(-np.abs(panel.values), kind="stable")[:MOST_KEYS].tolist()  # the largest index first
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


TRIAL_PANEL, TRIAL_LEAST = (2.4, 2.0), (1.3, 0.8)  # inches, of a panel, and on a page whose size was asked for
TRIAL_SIDES, TRIAL_GAPS = (0.65, 0.2, 0.11, 0.45), (0.55, 0.55)  # inches, around panels and between them
MOST_ACROSS, TICKS = 3, 4
TRIED: dict[str, Any] = {"color": style.FAINT_INK, "marker": "o", "markersize": 3.0, "linestyle": "none"}
BEST: dict[str, Any] = {"color": COLOURS[0], "marker": "o", "markersize": 5.0, "linestyle": "none"}


@dataclass(frozen=True, eq=False)
class TrialPanel:
    """One fitted key with its unit: its values in n trials, and the ends of its prior."""

    key: str
    values: run_data.Floats  # (n,)
    ends: tuple[float, float]
    is_log: bool = False


def draw_trials(
    panels: Sequence[TrialPanel],
    scores: run_data.Floats,
    best: NDArray[np.bool_],
    label: str,
    path: Path | str,
    title: str | None = None,
    paper: style.Paper = style.OWN,
) -> None:
    """Draw the score of every trial over each key, the best trials in colour, and write PNG, SVG or PDF.

    `scores` and `best` have an entry a trial, `label` names the scores. Raises InvalidInputError for an unknown
    picture format or too small a page, and OutputError when the file cannot be written.
    """
    path, rest = style.picture_path(path), len(panels)
    counts = [min(MOST_ACROSS, rest - start) for start in range(0, rest, MOST_ACROSS)]
    names = [(TRIED, "trials"), (BEST, "best" if np.count_nonzero(best) == 1 else "equally good")]
    handles = [style.legend_entry(name, **look) for look, name in names]
    more: dict[str, Any] = {"title": title, "handles": handles, "columns": len(handles)}
    with style.open_panels(paper, counts, TRIAL_PANEL, TRIAL_LEAST, TRIAL_SIDES, TRIAL_GAPS, **more) as opened:
        figure, drawn = opened
        for panel, axes in zip(panels, [one for row in drawn for one in row], strict=True):
            for look, chosen in ((TRIED, ~best), (BEST, best)):
                axes.plot(panel.values[chosen], scores[chosen], clip_on=False, zorder=3, **look)
            axes.set_xscale("log" if panel.is_log else "linear")
            axes.set_xlim(*panel.ends)
            axes.set_ylim(0.0, 1.1 * float(scores.max()) or 1.0)
            style.number_axis(axes.xaxis, TICKS, is_log=panel.is_log)
            style.number_axis(axes.yaxis, MOST_NUMBERS)
            axes.spines[["right", "top"]].set_visible(False)
            width, height = (style.POINTS_PER_INCH * one for one in style.size_of(axes))
            axes.set_xlabel(style.cut_to(panel.key, width, style.FONT_SIZE), labelpad=2.0)
            if axes in [row[0] for row in drawn]:
                axes.set_ylabel(style.cut_to(label, height, style.FONT_SIZE))
        style.save_figure(figure, path)


LEVEL_SIDES, LEVEL_GAP = (0.72, 1.05, 0.52, 0.46), 0.35  # inches, around panels and between them
LEVEL_PANEL, LEVEL_LEAST = (3.3, 2.7), (1.7, 0.8)  # inches, of a panel, and on a page whose size was asked for
LEGEND_ENTRY, LEGEND_NAME = 1.55, 0.42  # inches: width of an entry of the legend, and of a block's name in it
DEPTH = 1e-3  # of the tolerance, or of the farthest level where that is less: what is closer is drawn there
MARKERS = "osD^vP"
MOST_BLOCKS = 4
LARGEST: dict[str, Any] = {"color": style.INK, "linewidth": 2.5, "alpha": 0.25}
DISTANCE, SHORT_DISTANCE = "distance from the finest level (mm)", "distance (mm)"


@dataclass(frozen=True)
class LevelPanel:
    """One setting: n levels from coarse to fine, and how far each of b blocks ends from the last one."""

    title: str
    key: str
    verdict: str
    values: run_data.Floats  # (n,)
    blocks: tuple[str, ...]
    off_mm: run_data.Floats  # (n, b) |x - x at the finest level|
    largest_off_mm: run_data.Floats  # (n,) over all blocks, rotation included
    tolerance_mm: float
    own: float
    recommended: float | None


def draw_levels(
    panels: Sequence[LevelPanel],
    path: Path | str,
    title: str | None = None,
    measured: Mapping[str, float] | None = None,
    paper: style.Paper = style.OWN,
) -> None:
    """Draw the panels side by side and write them as PNG, SVG or PDF; the same input gives the same bytes.

    `measured` gives the width of the measured range (mm) of some blocks. Raises InvalidInputError for an unknown
    picture format or too small a page, and OutputError when the file cannot be written.
    """
    path, widths, names = style.picture_path(path), dict(measured or {}), panels[0].blocks
    shown = chosen_blocks(panels)
    repeats = [widths[names[block]] for block in shown if widths.get(names[block], 0.0) > 0.0]
    least = min(repeats, default=None)
    low, high = distance_limits(panels, [] if least is None else [least])
    with _open_levels(len(panels), names, shown, title, paper) as (figure, row):
        width, height = style.size_of(row[0])
        for panel, axes in zip(panels, row, strict=True):
            axes.set_yscale("log")
            style.number_axis(axes.yaxis, is_log=True)
            axes.set_ylim(low, high)
            _draw_level(axes, panel, shown, width)
            _draw_limits(axes, panel.tolerance_mm, least, named=axes is row[-1])
            axes.tick_params(axis="y", which="both", labelleft=axes is row[0])
        has_room = style.width_of(DISTANCE, style.FONT_SIZE) <= height * style.POINTS_PER_INCH
        row[0].set_ylabel(DISTANCE if has_room else SHORT_DISTANCE)
        style.save_figure(figure, path)


def refuse_small_page(panels: int, paper: style.Paper) -> None:
    """Raise InvalidInputError where so many panels have no room, whatever their blocks."""
    with _open_levels(panels, [""] * MOST_BLOCKS, range(MOST_BLOCKS), None, paper):
        pass


@contextmanager
def _open_levels(
    panels: int, blocks: Sequence[str], shown: Sequence[int], title: str | None, paper: style.Paper
) -> Iterator[tuple["style.Figure", list["style.Axes"]]]:
    """Give panels side by side, and a legend that names the lines of some blocks."""
    room = LEGEND_NAME * style.POINTS_PER_INCH
    width = LEVEL_SIDES[0] + LEVEL_SIDES[1] + panels * LEVEL_PANEL[0] + (panels - 1) * LEVEL_GAP
    names = [style.cut_to(blocks[block], room, style.FONT_SIZE) for block in shown]
    handles = [
        style.legend_entry(f"x of block {name}", **_line_look(shown, block))
        for block, name in zip(shown, names, strict=True)
    ]
    handles.append(style.legend_entry("largest, with turns", **LARGEST))
    more: dict[str, Any] = {"handles": handles, "columns": max(1, int(paper.width(width) / LEGEND_ENTRY))}
    with style.open_panels(
        paper, [panels], LEVEL_PANEL, LEVEL_LEAST, LEVEL_SIDES, (LEVEL_GAP, 0.0), title=title, **more
    ) as opened:
        figure, (row,) = opened
        yield figure, row


def distance_limits(panels: Sequence[LevelPanel], others: Sequence[float]) -> tuple[float, float]:
    """Return the range of the common axis (mm) around the tolerance, other lengths and everything that is shown."""
    tolerance = panels[0].tolerance_mm
    off = np.concatenate([array.ravel() for panel in panels for array in (panel.largest_off_mm, panel.off_mm)])
    off = off[np.isfinite(off) & (off > 0.0)]
    farthest = min(float(off.max(initial=0.0)) or tolerance, tolerance)
    least = max(0.5 * float(off.min(initial=tolerance)), DEPTH * farthest)
    return least, 2.0 * max(float(off.max(initial=tolerance)), *others, tolerance)


def chosen_blocks(panels: Sequence[LevelPanel]) -> list[int]:
    """Return the blocks to draw, in their order: those that move at all, the farthest of them if they are many."""
    most = np.max([panel.off_mm.max(axis=0, initial=0.0) for panel in panels], axis=0)
    least = DEPTH * min(float(most.max(initial=0.0)), panels[0].tolerance_mm)
    moving = [int(block) for block in np.argsort(-most, kind="stable") if most[block] > least]
    return sorted(moving[:MOST_BLOCKS])


def _line_look(shown: Sequence[int], block: int) -> dict[str, Any]:
    """Return the colour of a block, as in other pictures, and a marker that none of the others has."""
    return {
        "color": style.block_colour(block),
        "marker": MARKERS[shown.index(block)],
        "markersize": 4.5,
        "markeredgecolor": style.INK,
        "markeredgewidth": 0.4,
        "linewidth": 1.2,
    }


def _draw_level(axes: "style.Axes", panel: LevelPanel, shown: Sequence[int], width: float) -> None:
    low, _ = axes.get_ylim()
    coarser = panel.values[:-1]  # the finest level is what the others are measured from
    axes.set_xscale("log")
    axes.plot(coarser, np.maximum(panel.largest_off_mm[:-1], low), **LARGEST)
    for block in shown:
        off = np.maximum(panel.off_mm[:-1, block], low)
        axes.plot(coarser, off, **_line_look(shown, block), clip_on=False, zorder=3)
    marks = [(panel.own, "own", 1), *([] if panel.recommended is None else [(panel.recommended, "recommended", 0)])]
    for value, text, row in marks:  # above the panel, in a row of text each
        axes.axvline(value, color=style.FAINT_INK, linewidth=style.LINE_WIDTH, linestyle=(0, (1, 2)), zorder=1)
        side = {panel.values[0]: "left", panel.values[-1]: "right"}.get(value, "center")
        place = (value, 1.0), (0.0, 2.0 + row * style.LINE * style.POINTS_PER_INCH), ("data", "axes fraction")
        axes.annotate(text, *place, "offset points", color=style.FAINT_INK, ha=side)
    # numbers below every n-th level where they are many, always below the scenario's own
    margin = (float(panel.values[-1]) / float(panel.values[0])) ** 0.04
    axes.set_xlim(float(panel.values[0]) / margin, float(panel.values[-1]) * margin)
    apart = -(-len(panel.values) // int(width / 0.5))  # inches, for a number below an axis
    start = int(np.argmin(np.abs(panel.values - panel.own))) % apart
    axes.set_xticks(panel.values[start::apart], [f"{value:.3g}" for value in panel.values[start::apart]])
    axes.xaxis.minorticks_off()
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.spines[["right", "top"]].set_visible(False)
    room = width * style.POINTS_PER_INCH
    label = f"{panel.key}, finer to the right"
    has_room = style.width_of(label, style.FONT_SIZE) <= style.SURE * room
    axes.set_xlabel(label if has_room else style.cut_to(panel.key, room, style.FONT_SIZE), labelpad=2.0)
    heading = style.cut_to(f"{panel.title}: {panel.verdict}", room, style.FONT_SIZE)
    axes.set_title(heading, loc="left", pad=4.0 + 2.0 * style.LINE * style.POINTS_PER_INCH)


def _draw_limits(axes: "style.Axes", tolerance: float, repeats: float | None, *, named: bool) -> None:
    """Draw the tolerance and the least measured range (mm), named to the right of the last panel."""
    lines = [(tolerance, f"tolerance\n{tolerance:g} mm", style.INK)]
    if repeats is not None:
        lines.append((repeats, f"repeats differ\nby {repeats:.2g} mm", style.MEASURED_COLOUR))
    highest = max(y for y, _, _ in lines)
    for y, text, colour in lines:
        axes.axhline(y, color=colour, linewidth=style.LINE_WIDTH, linestyle=(0, (5, 3)))
        if named:
            va = "bottom" if y == highest else "top"
            axes.annotate(text, (1.0, y), (4.0, 0.0), ("axes fraction", "data"), "offset points", color=colour, va=va)

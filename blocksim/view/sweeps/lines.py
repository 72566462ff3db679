"""Lines: final x of the blocks over one input, a row for each block, a column for each value of a second input."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from textwrap import wrap
from typing import TYPE_CHECKING

import numpy as np

from blocksim.view import style
from blocksim.view.style import OWN, Paper, write_heading
from blocksim.view.sweeps.data import (
    MOST_COLUMNS,
    STAYS_MM,
    Flags,
    Floats,
    Input,
    InputUnit,
    SweepData,
    ValueAxis,
    most_moving,
    value_axis,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_INPUTS = 2
WIDTH = 7.6  # inches
LEFT, RIGHT, HEAD, FOOT = 0.62, 0.15, 0.62, 0.68  # inches
COLUMN_GAP, ROW_GAP = 0.25, 0.36  # inches
ROW_HEIGHT = 1.35  # inches
NARROWEST, LOWEST = 1.0, 0.5  # inches, of a panel on a page whose size was asked for
TITLE = 0.29  # inches down to the headings
LINE = 0.155  # inches, of a further line of text
LETTERS_AN_INCH = 14.5  # in a line below the panels
LABEL_DEPTH = 0.25  # inches from the panels down to a label that is below all of them
LEAST_SPAN_MM = 1.0  # of an axis, so that round-off does not look like scatter
WAVERING = 1.6  # way up and down over range, above which points are not joined


@dataclass(frozen=True)
class Series:
    """Final centres of b blocks in n finished runs that differ in one input only, in the order of its values."""

    label: str  # input and value that all runs of this series share; empty where there is one series only
    values: Floats  # (n,) SI
    x_mm: Floats  # (n, b)


def refusal(sweep: SweepData) -> str:
    """Return why a sweep cannot be shown."""
    if len(sweep.inputs) > MOST_INPUTS:
        return f"{len(sweep.inputs)} keys are varied; lines can show one or two"
    if not any(one.is_number for one in sweep.inputs):
        words = next(iter(sweep.inputs))
        return f"the values of {words.key} are not numbers (such as {words.levels[0]!r}); they cannot be an axis"
    return ""


def suits(sweep: SweepData) -> bool:
    """Return True if all combinations exist, and the columns for the values of the second input are not too many."""
    if refusal(sweep) or (sweep.is_sampled and len(sweep.inputs) > 1):
        return False
    _, other = _axis_and_other(sweep)
    return other is None or other.count <= MOST_COLUMNS


def draw_lines(sweep: SweepData, paper: Paper = OWN) -> "AbstractContextManager[Figure]":
    """Give the drawn lines."""
    axis, _ = _axis_and_other(sweep)
    ranges = {block: ends for block in sweep.blocks if (ends := sweep.measured.range_of(block)) is not None}
    key = axis.key, axis.unit
    series = list(series_of(sweep))
    return draw_series(series, sweep.blocks, key, sweep.title, ranges, typed=axis.typed, paper=paper)


def series_of(sweep: SweepData) -> Iterator[Series]:
    """Yield the series of the finished cases, one for each value of the second input of a grid."""
    axis, other = _axis_and_other(sweep)
    groups: list[tuple[str, Flags]] = [("", sweep.finished)]
    if other is not None:
        groups = [
            (f"{other.key} = {other.label(value)}", sweep.finished & (other.values == value))
            for value in np.unique(other.values[sweep.finished])
        ]
    for label, cases in groups:
        order = np.argsort(axis.values[cases], kind="stable")
        yield Series(label, axis.values[cases][order], sweep.x_mm[cases][order])


def _axis_and_other(sweep: SweepData) -> tuple[Input, Input | None]:
    """Return the number with the most values, and the other input where both go through all combinations."""
    axis = max((one for one in sweep.inputs if one.is_number), key=lambda one: one.count)
    others = [one for one in sweep.inputs if one is not axis]
    return axis, others[0] if others and sweep.is_grid else None


@contextmanager
def draw_series(
    series: Sequence[Series],
    blocks: Sequence[str],
    key: tuple[str, str],
    title: str | None = None,
    measured: Mapping[str, tuple[float, float]] | None = None,
    *,
    typed: InputUnit | None = None,
    paper: Paper = OWN,
) -> "Iterator[Figure]":
    """Give final x drawn over a key, that is given with its SI unit.

    The axis has the `typed` unit, or where there is none that in which the values are best read.
    `measured` gives smallest and largest measured x (mm) of some blocks. Raises InvalidInputError for too small a page.
    """
    shown = list(series)[:MOST_COLUMNS]
    rows = [(block, blocks[block]) for block in moving_blocks(shown)]
    axis = value_axis(np.concatenate([one.values for one in shown]), *key, typed=typed)
    page = _page(shown, rows, axis, paper)
    count = len(shown)
    texts = _legend(len(rows), len(blocks), len(series) - count, is_measured=bool(measured))
    notes = wrap(texts, max(1, int(LETTERS_AN_INCH * page.width)))
    page = replace(page, foot=page.foot + (len(notes) - 1) * LINE)
    others = page.head + page.foot + (len(rows) - 1) * page.gap
    page = replace(page, row=paper.panel(ROW_HEIGHT, len(rows), others, LOWEST))
    page = replace(page, height=paper.height(others + len(rows) * page.row))
    with style.styled_figure(page.width, page.height, paper.dots) as figure:
        _draw_panels(figure, page, shown, rows, measured or {})
        for column, lines in enumerate(page.headings):
            place = (LEFT + column * (page.panel + COLUMN_GAP)) / page.width, 1.0 - TITLE / page.height
            figure.text(*place, "\n".join(lines), va="top", weight="bold")
        write_heading(figure, title, 0.1)
        figure.text(0.1 / page.width, 0.06 / page.height, "\n".join(notes), color=style.FAINT_INK, va="bottom")
        yield figure


@dataclass(frozen=True)
class _Page:
    """Widths and heights in inches, and texts that have been broken into lines to fit them."""

    width: float
    panel: float  # width of a panel
    axis: ValueAxis
    label: tuple[str, ...]  # below the panels, once for all where it is wider than one of them
    headings: tuple[tuple[str, ...], ...]  # above each column
    captions: tuple[tuple[str, ...], ...]  # above each panel, by row
    head: float
    foot: float
    gap: float
    row: float = ROW_HEIGHT  # height of a panel
    height: float = 0.0


def _page(series: Sequence[Series], rows: Sequence[tuple[int, str]], axis: ValueAxis, paper: Paper) -> _Page:
    """Return the page, but for the heights that depend on how many lines stand below all."""
    count = len(series)
    sides = LEFT + RIGHT + (count - 1) * COLUMN_GAP
    width = paper.width(WIDTH, sides + count * NARROWEST)
    panel = (width - sides) / count
    label = tuple(style.broken(axis.label, width - LEFT - RIGHT))
    headings = tuple(tuple(style.broken(one.label, panel, bold=True)) for one in series)
    captions = captions_of(series, rows, panel * style.POINTS_PER_INCH)
    more = LINE * (max(text.count("\n") for row in captions for text in row))
    head = HEAD + LINE * (max(map(len, headings)) - 1) + more
    foot = FOOT + LINE * (len(label) - 1)
    return _Page(width, panel, axis, label, headings, captions, head, foot, ROW_GAP + more)


def _draw_panels(
    figure: "Figure",
    page: _Page,
    series: Sequence[Series],
    rows: Sequence[tuple[int, str]],
    measured: Mapping[str, tuple[float, float]],
) -> None:
    """Draw a row of panels for each block, given by number and name, and a column for each series."""
    joined = all(is_smooth(one.x_mm[:, block]) for one in series for block, _ in rows)
    for row, (block, name) in enumerate(rows):
        limits = _limits(series, block, measured.get(name))
        bottom = page.foot + (len(rows) - 1 - row) * (page.row + page.gap)
        for column, one in enumerate(series):
            left = LEFT + column * (page.panel + COLUMN_GAP)
            size = page.panel / page.width, page.row / page.height
            axes = figure.add_axes((left / page.width, bottom / page.height, *size))
            axes.set_ylim(*limits)
            band = measured.get(name)
            if band is not None:  # a line where all repeats are equal
                axes.axhspan(*band, color=style.MEASURED_COLOUR, alpha=0.15, linewidth=0, zorder=0)
                for end in set(band):
                    axes.axhline(end, color=style.MEASURED_COLOUR, linewidth=style.LINE_WIDTH, zorder=1)
            _draw_points(axes, one, block, page.axis, joined=joined)
            _finish(axes, is_log=page.axis.is_log, is_first=column == 0, is_last=row == len(rows) - 1)
            axes.set_title(page.captions[row][column], loc="left", pad=3.0)
    _name_axis(figure, page, len(series))


def _name_axis(figure: "Figure", page: _Page, columns: int) -> None:
    """Write the label below every column, or once below all where it is wider than a column."""
    widest = max(style.width_of(line, style.FONT_SIZE) for line in page.label)
    if len(page.label) == 1 and widest <= page.panel * style.POINTS_PER_INCH:
        for axes in figure.axes[-columns:]:
            axes.set_xlabel(page.label[0], labelpad=2.0)
        return
    middle = (LEFT + 0.5 * (page.width - LEFT - RIGHT)) / page.width
    figure.text(middle, (page.foot - LABEL_DEPTH) / page.height, "\n".join(page.label), ha="center", va="top")


def moving_blocks(series: Sequence[Series]) -> list[int]:
    """Return the blocks to draw, in their order: those whose final x varies most; all are candidates if none does."""
    return most_moving(np.max([np.ptp(one.x_mm, axis=0) for one in series], axis=0))


def is_smooth(values: Floats) -> bool:
    """Return True if values go up and down so little that a line through them is justified."""
    spread = float(np.ptp(values))
    return spread < STAYS_MM or float(np.abs(np.diff(values)).sum()) <= WAVERING * spread


def _limits(series: Sequence[Series], block: int, band: tuple[float, float] | None) -> tuple[float, float]:
    """Return the range of a row's axis (mm), the same for all series."""
    ends = np.concatenate([one.x_mm[:, block] for one in series] + ([] if band is None else [np.array(band)]))
    low, high = float(ends.min()), float(ends.max())
    margin = 0.1 * (high - low) + 0.5 * max(LEAST_SPAN_MM - (high - low), 0.0)
    return low - margin, high + margin


def _draw_points(axes: "Axes", one: Series, block: int, axis: ValueAxis, *, joined: bool) -> None:
    if axis.is_log:
        axes.set_xscale("log")
    axes.plot(
        axis.shown(one.values),
        one.x_mm[:, block],
        color=style.block_colour(block),
        linestyle="-" if joined else "",
        linewidth=1.0,
        marker="o",
        markersize=4.0,
        markeredgecolor=style.INK,
        markeredgewidth=0.4,
        zorder=3,
    )


def _finish(axes: "Axes", *, is_log: bool, is_first: bool, is_last: bool) -> None:
    from matplotlib.ticker import FuncFormatter, MaxNLocator, NullFormatter

    axes.spines[["right", "top"]].set_visible(False)
    axes.yaxis.set_major_locator(MaxNLocator(nbins=5, steps=[1, 2, 5, 10]))
    for side in (axes.xaxis, axes.yaxis):
        side.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.6g}"))
        side.set_minor_formatter(NullFormatter())
    if not is_log:
        axes.xaxis.set_major_locator(MaxNLocator(nbins=5, steps=[1, 2, 2.5, 5, 10]))
    axes.tick_params(axis="x", labelbottom=is_last)
    axes.tick_params(axis="y", labelleft=is_first)
    if is_first:
        axes.set_ylabel("final x (mm)")


def captions_of(series: Sequence[Series], rows: Sequence[tuple[int, str]], room: float) -> tuple[tuple[str, ...], ...]:
    """Return the text above every panel: block and range in one line where there is room (points), else in two."""
    extents = [[_extent(one.x_mm[:, block]) for one in series] for block, _ in rows]
    widest = max(style.width_of(extent[0], style.FONT_SIZE) for row in extents for extent in row)
    form = 0 if widest <= style.SURE * room else 1
    names = [f"block {style.shortened(name, style.MOST_LETTERS)}" for _, name in rows]
    pairs = [
        (f"{name}: {extent[form]}", extent[form]) for name, row in zip(names, extents, strict=True) for extent in row
    ]
    if all(style.width_of(line, style.FONT_SIZE) <= style.SURE * room for line, _ in pairs):
        return tuple(tuple(f"{name}: {one[form]}" for one in row) for name, row in zip(names, extents, strict=True))
    cut = [style.cut_to(name, room, style.FONT_SIZE) for name in names]
    return tuple(tuple(f"{name}\n{one[form]}" for one in row) for name, row in zip(cut, extents, strict=True))


def _extent(x: Floats) -> tuple[str, str]:
    """Return the final places of a block in all runs of a series, in a long and a short form."""
    apart = f"{np.ptp(x):.2f} mm apart"
    ends = [f"{end:.2f}".replace("-0.00", "0.00").replace("-", "−") for end in (x.min(), x.max())]
    return f"{' to '.join(ends)} mm, {apart}", apart


def _legend(rows: int, blocks: int, more_series: int, *, is_measured: bool) -> str:
    texts = ["One point: one run."]
    if is_measured:
        texts.append("Band: smallest to largest of the measured repeats.")
    if rows < blocks:
        texts.append(f"Not shown: {blocks - rows} of {blocks} blocks, whose final x varies least.")
    if more_series:
        texts.append(f"{more_series} more series.")
    return " ".join(texts)

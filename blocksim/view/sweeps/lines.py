"""Lines: final x of the blocks over one input, a row for each block, a column for each value of a second input."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from blocksim.view import run_data, style
from blocksim.view.sweeps import data

MOST_INPUTS = 2
WIDTH = 7.6  # inches
LEFT, RIGHT, HEAD, FOOT = 0.62, 0.15, 0.12, 0.42  # inches
COLUMN_GAP, ROW_GAP = 0.25, 0.21  # inches
ROW_HEIGHT = 1.35  # inches
NARROWEST, LOWEST = 1.0, 0.5  # inches, of a panel on a page whose size was asked for
LABEL_DEPTH = 0.25  # inches from the panels down to the label that is below all of them
LEAST_SPAN_MM = 1.0  # of an axis, so that round-off does not look like scatter
WAVERING = 1.6  # way up and down over range, above which points are not joined
DOTS: dict[str, Any] = {"linewidth": 1.0, "marker": "o", "markersize": 4.0, "markeredgewidth": 0.4, "zorder": 3}


@dataclass(frozen=True)
class Series:
    """Final centres of b blocks in n finished runs that differ in one input only, in the order of its values."""

    label: str  # input and value that all runs of this series share; empty where there is one series only
    values: run_data.Floats  # (n,) SI
    x_mm: run_data.Floats  # (n, b)


def refusal(sweep: data.SweepData) -> str:
    """Return why a sweep cannot be shown."""
    if len(sweep.inputs) > MOST_INPUTS:
        return f"{len(sweep.inputs)} keys are varied; lines can show one or two"
    if all(one.levels for one in sweep.inputs):
        words = next(iter(sweep.inputs))
        return f"the values of {words.key} are not numbers (such as {words.levels[0]!r}); they cannot be an axis"
    return ""


def suits(sweep: data.SweepData) -> bool:
    """Return True if all combinations exist, and the columns for the values of the second input are not too many."""
    if refusal(sweep) or (sweep.mode in {"lhs", "sobol", "normal"} and len(sweep.inputs) > 1):
        return False
    _, other = _axis_and_other(sweep)
    return other is None or other.count <= data.MOST_COLUMNS


def draw_lines(sweep: data.SweepData, paper: style.Paper = style.OWN) -> "AbstractContextManager[style.Figure]":
    """Give the drawn lines."""
    axis, _ = _axis_and_other(sweep)
    ranges = {block: (float(x.min()), float(x.max())) for block, x in sweep.measured.x_mm.items()}
    key, series = (axis.key, axis.unit), list(series_of(sweep))
    return draw_series(series, sweep.blocks, key, sweep.title, ranges, typed=axis.typed, paper=paper)


def series_of(sweep: data.SweepData) -> Iterator[Series]:
    """Yield the series of the finished cases, one for each value of the second input of a grid."""
    axis, other = _axis_and_other(sweep)
    groups: list[tuple[str, run_data.Flags]] = [("", sweep.finished)]
    if other is not None:
        groups = [
            (f"{other.key} = {other.label(value)}", sweep.finished & (other.values == value))
            for value in np.unique(other.values[sweep.finished])
        ]
    for label, cases in groups:
        order = np.argsort(axis.values[cases], kind="stable")
        yield Series(label, axis.values[cases][order], sweep.x_mm[cases][order])


def _axis_and_other(sweep: data.SweepData) -> tuple[data.Input, data.Input | None]:
    """Return the number with the most values, and the other input where both go through all combinations."""
    axis = max((one for one in sweep.inputs if not one.levels), key=lambda one: one.count)
    others = [one for one in sweep.inputs if one is not axis]
    return axis, others[0] if others and sweep.mode == "grid" else None


@contextmanager
def draw_series(
    series: Sequence[Series],
    blocks: Sequence[str],
    key: tuple[str, str],
    title: str | None = None,
    measured: Mapping[str, tuple[float, float]] | None = None,
    *,
    typed: data.InputUnit | None = None,
    paper: style.Paper = style.OWN,
) -> "Iterator[style.Figure]":
    """Give final x drawn over a key, that is given with its SI unit.

    The axis has the `typed` unit, or where there is none that in which the values are best read.
    `measured` gives smallest and largest measured x (mm) of some blocks. Raises InvalidInputError for too small a page.
    """
    shown, measured = list(series)[: data.MOST_COLUMNS], measured or {}
    rows = data.choose_movers(np.max([np.ptp(one.x_mm, axis=0) for one in shown], axis=0))
    axis = data.value_axis(np.concatenate([one.values for one in shown]), *key, typed=typed)
    count = len(shown)
    beside = LEFT + RIGHT + (count - 1) * COLUMN_GAP
    width = paper.width(WIDTH, beside + count * NARROWEST)
    panel = (width - beside) / count
    headings = [style.break_lines(one.label, panel, bold=True) for one in shown]
    names = [style.cut_to(f"block {blocks[block]}", panel * style.POINTS_PER_INCH, style.FONT_SIZE) for block in rows]
    captions = [
        [style.break_lines(f"{name}: {_extent(one.x_mm[:, block])}", panel) for one in shown]
        for block, name in zip(rows, names, strict=True)
    ]
    lines = max(len(caption) for row in captions for caption in row)
    head = HEAD + style.LINE * lines + (style.LINE * max(map(len, headings)) + 0.08 if headings[0] != [""] else 0.0)
    foot = FOOT + style.LINE * (len(style.break_lines(axis.label, width - LEFT)) - 1)
    joined = all(is_smooth(one.x_mm[:, block]) for one in shown for block in rows)
    texts = ["One point: one run."]
    texts += ["Band: smallest to largest of the measured repeats."] if measured else []
    hidden = len(blocks) - len(rows)
    texts += [f"Not shown: {hidden} of {len(blocks)} blocks, whose final x varies least."] if hidden else []
    texts += [f"{len(series) - count} more series."] if len(series) > count else []
    own, least = (panel, ROW_HEIGHT), (NARROWEST, LOWEST)
    sides, gaps = (LEFT, RIGHT, head, foot), (COLUMN_GAP, ROW_GAP + style.LINE * (lines - 1))
    counts = [count] * len(rows)
    with style.open_panels(paper, counts, own, least, sides, gaps, title=title, notes=" ".join(texts)) as opened:
        figure, panels = opened
        for row, (block, of_block) in enumerate(zip(rows, panels, strict=True)):
            band = measured.get(blocks[block])
            ends = np.concatenate([one.x_mm[:, block] for one in shown] + [np.array(band or ())])
            for one, axes, caption in zip(shown, of_block, captions[row], strict=True):
                axes.set_ylim(*style.limits_around(ends, 0.1, LEAST_SPAN_MM))
                if band is not None:  # a line where all repeats are equal
                    axes.axhspan(*band, color=style.MEASURED_COLOUR, alpha=0.15, linewidth=0, zorder=0)
                    for end in set(band):
                        axes.axhline(end, color=style.MEASURED_COLOUR, linewidth=style.LINE_WIDTH, zorder=1)
                axes.set_xscale("log" if axis.is_log else "linear")
                look = {"color": style.block_colour(block), "markeredgecolor": style.INK} | DOTS
                axes.plot(axis.scale(one.values), one.x_mm[:, block], linestyle="-" if joined else "", **look)
                axes.spines[["right", "top"]].set_visible(False)
                style.number_axis(axes.xaxis, is_log=axis.is_log)
                style.number_axis(axes.yaxis)
                axes.tick_params(labelbottom=of_block is panels[-1], labelleft=axes is of_block[0])
                axes.set_title("\n".join(caption), loc="left", pad=3.0)
            of_block[0].set_ylabel("final x (mm)")
        for axes, heading in zip(panels[0], headings, strict=True):
            up = 1.0 + (style.LINE * lines + 0.1) / style.size_of(axes)[1]
            axes.text(0.0, up, "\n".join(heading), transform=axes.transAxes, va="bottom", weight="bold")
        style.name_axes(figure, panels, axis.label, "", LABEL_DEPTH)
        yield figure


def is_smooth(values: run_data.Floats) -> bool:
    """Return True if values go up and down so little that a line through them is justified."""
    spread = float(np.ptp(values))
    return spread < data.STAYS_MM or float(np.abs(np.diff(values)).sum()) <= WAVERING * spread


def _extent(x: run_data.Floats) -> str:
    """Return the final places of a block in all runs of a series."""
    ends = [f"{end:z.2f}".replace("-", "−") for end in (x.min(), x.max())]
    return f"{' to '.join(ends)}\N{NO-BREAK SPACE}mm, {np.ptp(x):.2f}\N{NO-BREAK SPACE}mm apart"

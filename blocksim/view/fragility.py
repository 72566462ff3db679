"""Fragility: shares that fail at each intensity with their limits, and the curve through them with its band."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from blocksim.view import style
from blocksim.view.layout import EDGE, LINE, OWN, Paper, add_axes, number_axis, wrapped, write_heading, write_text
from blocksim.view.run_data import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDTH, PANEL_HEIGHT = 5.2, 3.0  # inches
LEFT, RIGHT, HEAD, FOOT = 0.55, 0.15, 0.38, 0.48  # inches
NARROWEST, LOWEST = 1.8, 1.0  # inches, of the panel on a page whose size was asked for
WIDE = 8.0  # ratio of the largest to the smallest intensity from which on the axis is logarithmic
MARGIN = 0.06  # of the axis beside the outermost points
CURVE_COLOUR = "#0072B2"
POINTS = 200
MOST_NUMBERS = 6


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
        margin = (high / low) ** MARGIN
        return low / margin, high * margin, True
    margin = MARGIN * (high - low) or MARGIN * high
    return max(low - margin, 0.5 * low), high + margin, False


def places(x: Floats) -> Floats:
    """Return intensities over the whole axis, at which a curve is drawn."""
    low, high, is_log = axis_of(x)
    return np.asarray(np.geomspace(low, high, POINTS) if is_log else np.linspace(low, high, POINTS))


def draw_fragility(found: Fragility, path: Path | str, title: str | None = None, paper: Paper = OWN) -> None:
    """Draw the picture and write it as PNG, SVG or PDF; the same input gives the same bytes.

    Raises InvalidInputError for an unknown picture format or too small a page, OutputError when the file cannot be
    written.
    """
    path = Path(path)
    style.picture_suffix(path)
    width = paper.width(WIDTH, LEFT + RIGHT + NARROWEST)
    notes = wrapped(list(found.notes), width - LEFT - EDGE)
    foot = FOOT + LINE * len(notes)
    row = paper.panel(PANEL_HEIGHT, 1, HEAD + foot, LOWEST)
    with style.styled_figure(width, paper.height(HEAD + row + foot), paper.dots) as figure:
        axes = add_axes(figure, LEFT, foot, width - LEFT - RIGHT, row)
        _draw_points(axes, found)
        _finish(axes, found)
        for number, line in enumerate(reversed(notes)):
            write_text(figure, LEFT, EDGE + LINE * number, line, color=style.FAINT_INK)
        write_heading(figure, title, EDGE)
        style.save_figure(figure, path)


def _draw_points(axes: "Axes", found: Fragility) -> None:
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
        label="share of members, 95 % limits",
        clip_on=False,
        zorder=3,
    )


def _finish(axes: "Axes", found: Fragility) -> None:
    low, high, is_log = axis_of(found.x)
    axes.set_xscale("log" if is_log else "linear")
    axes.set_xlim(low, high)
    axes.set_ylim(0.0, 1.0)
    number_axis(axes.xaxis, MOST_NUMBERS, is_log=is_log)
    axes.spines[["right", "top"]].set_visible(False)
    axes.set_xlabel(f"{found.key} ({found.unit})" if found.unit else found.key, labelpad=2.0)
    axes.set_ylabel("probability of failure")
    handles, labels = axes.get_legend_handles_labels()
    axes.legend(handles[::-1], labels[::-1], loc="best", frameon=False)

"""Fragility: shares that fail at each intensity with their limits, and the curve through them with its band."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from blocksim.view import style
from blocksim.view.layout import OWN, Paper, number_axis
from blocksim.view.run_data import Floats
from blocksim.view.sheet import sheet

_LEFT = 0.55  # inches
WIDE = 8.0  # ratio of the largest to the smallest intensity from which on the axis is logarithmic
_MARGIN = 0.06  # of the axis beside the outermost points
CURVE_COLOUR = "#0072B2"
POINTS = 200
_MOST_NUMBERS = 6


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
    with sheet(path, title, found.notes, paper, _LEFT) as axes:
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

"""Tornado: importance of each input, the largest at the top, a panel for each result."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from blocksim.view import layout, style
from blocksim.view.layout import OWN, Paper
from blocksim.view.sweeps.data import Floats, short_names

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BAR, _GAP, _FOOT = 0.15, 0.46, 0.34  # inches: height of a bar, between panels, below them
LEAST_ROOM, MOST_ROOM = 0.5, 1.75  # inches, for the name of a key; longer ones take several lines
BROKEN = 0.95  # of the height of a bar, for each line of keys
_NARROWEST, LEAST_BAR = 0.8, 0.12  # inches, on a page whose size was asked for
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
    width = paper.width(layout.COLUMN_WIDTH, left + _NARROWEST)
    titles = ["\n".join(style.broken(panel.title, width - 2.0 * layout.EDGE)) for panel in panels]
    rows = [min(len(panel.keys), MOST_KEYS) + 0.6 for panel in panels]
    foot = _FOOT + layout.LINE * (2 if labels[1] else 1) + layout.EDGE
    head = layout.title_height(title, width) + 0.2
    gaps = _GAP * (len(panels) - 1) + layout.LINE * sum(one.count("\n") for one in titles)
    lines = max(key.count("\n") + 1 for panel in panels for key in panel.keys)
    bar = paper.panel(BAR * (1.0 if lines == 1 else BROKEN * lines), 1, head + gaps + foot, LEAST_BAR * sum(rows))
    bar = bar if paper.size is None else bar / sum(rows)
    height = paper.height(head + bar * sum(rows) + gaps + foot)
    with style.styled_figure(width, height, paper.dots) as figure:
        layout.write_title(figure, title)
        bottom = height - head
        for panel, heading, count in zip(panels, titles, rows, strict=True):
            bottom -= bar * count + layout.LINE * heading.count("\n")
            axes = layout.add_axes(figure, left, bottom, width - left - 2.0 * layout.EDGE, bar * count)
            _draw_bars(axes, panel, min(style.FONT_SIZE, bar * style.POINTS_PER_INCH / (style.LETTER[1] * lines)))
            layout.write_text(figure, layout.EDGE, bottom + bar * count + 0.05, heading)
            bottom -= _GAP
        layout.write_legend(figure, _entries(labels), layout.EDGE, layout.EDGE, labelspacing=0.25)
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
    low, high = limits_of(panel)
    axes.set_xlim(low, high)
    beyond = places[panel.values[order] + intervals > high]
    axes.plot(np.full(len(beyond), high), beyond, **BEYOND)
    layout.number_axis(axes.xaxis)


def limits_of(panel: Bars) -> tuple[float, float]:
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

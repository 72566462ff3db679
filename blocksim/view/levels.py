"""Distance of coarser levels of a numerical setting from the finest: a panel for each setting, finer to the right."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from blocksim.view import style
from blocksim.view.run_data import Floats
from blocksim.view.style import LINE, OWN, Paper

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SIDES, GAP = (0.72, 1.05, 0.52, 0.46), 0.35  # inches, around panels and between them
PANEL, LEAST = (3.3, 2.7), (1.7, 0.8)  # inches, of a panel, and on a page whose size was asked for
LEGEND_ENTRY, LEGEND_NAME = 1.55, 0.42  # inches: width of an entry of the legend, and of a block's name in it
DEPTH = 1e-3  # of the tolerance, or of the farthest level where that is less: what is closer is drawn there
MARKERS = "osD^vP"
MOST_BLOCKS = 4
LARGEST: dict[str, Any] = {"color": style.INK, "linewidth": 2.5, "alpha": 0.25}
NUMBER_ROOM = 0.5  # inches, for a number below an axis
DISTANCE, SHORT_DISTANCE = "distance from the finest level (mm)", "distance (mm)"


@dataclass(frozen=True)
class Panel:
    """One setting: n levels from coarse to fine, and how far each of b blocks ends from the last one."""

    title: str
    key: str
    verdict: str
    values: Floats  # (n,)
    blocks: tuple[str, ...]
    off_mm: Floats  # (n, b) |x - x at the finest level|
    largest_off_mm: Floats  # (n,) over all blocks, rotation included
    tolerance_mm: float
    own: float
    recommended: float | None


def draw_levels(
    panels: Sequence[Panel],
    path: Path | str,
    title: str | None = None,
    measured: Mapping[str, float] | None = None,
    paper: Paper = OWN,
) -> None:
    """Draw the panels side by side and write them as PNG, SVG or PDF; the same input gives the same bytes.

    `measured` gives the width of the measured range (mm) of some blocks. Raises InvalidInputError for an unknown
    picture format or too small a page, and OutputError when the file cannot be written.
    """
    path, widths, names = style.picture_path(path), dict(measured or {}), panels[0].blocks
    shown = chosen_blocks(panels)
    repeats = [widths[names[block]] for block in shown if widths.get(names[block], 0.0) > 0.0]
    least = min(repeats, default=None)
    low, high = limits_of(panels, [] if least is None else [least])
    with _opened(len(panels), names, shown, title, paper) as (figure, row):
        width, height = style.size_of(row[0])
        for panel, axes in zip(panels, row, strict=True):
            axes.set_yscale("log")
            axes.set_ylim(low, high)
            _draw_panel(axes, panel, shown, width)
            _draw_limits(axes, panel.tolerance_mm, least, named=axes is row[-1])
            axes.tick_params(axis="y", which="both", labelleft=axes is row[0])
        has_room = style.width_of(DISTANCE, style.FONT_SIZE) <= height * style.POINTS_PER_INCH
        row[0].set_ylabel(DISTANCE if has_room else SHORT_DISTANCE)
        style.save_figure(figure, path)


def refuse_small_page(panels: int, paper: Paper) -> None:
    """Raise InvalidInputError where so many panels have no room, whatever their blocks."""
    with _opened(panels, [""] * MOST_BLOCKS, range(MOST_BLOCKS), None, paper):
        pass


@contextmanager
def _opened(
    panels: int, blocks: Sequence[str], shown: Sequence[int], title: str | None, paper: Paper
) -> Iterator[tuple["Figure", list["Axes"]]]:
    """Give panels side by side, and a legend that names the lines of some blocks."""
    from matplotlib.lines import Line2D

    room, width = LEGEND_NAME * style.POINTS_PER_INCH, SIDES[0] + SIDES[1] + panels * PANEL[0] + (panels - 1) * GAP
    names = [style.cut_to(blocks[block], room, style.FONT_SIZE) for block in shown]
    handles = [
        Line2D([], [], **_look(shown, block), label=f"x of block {name}")
        for block, name in zip(shown, names, strict=True)
    ]
    handles.append(Line2D([], [], **LARGEST, label="largest, with turns"))
    more: dict[str, Any] = {"handles": handles, "columns": max(1, int(paper.width(width) / LEGEND_ENTRY))}
    with style.open_panels(paper, (1, panels), PANEL, LEAST, SIDES, (GAP, 0.0), title=title, **more) as opened:
        figure, (row,) = opened
        yield figure, row


def limits_of(panels: Sequence[Panel], others: Sequence[float]) -> tuple[float, float]:
    """Return the range of the common axis (mm) around the tolerance, other lengths and everything that is shown."""
    tolerance = panels[0].tolerance_mm
    off = np.concatenate([array.ravel() for panel in panels for array in (panel.largest_off_mm, panel.off_mm)])
    off = off[np.isfinite(off) & (off > 0.0)]
    farthest = min(float(off.max(initial=0.0)) or tolerance, tolerance)
    least = max(0.5 * float(off.min(initial=tolerance)), DEPTH * farthest)
    return least, 2.0 * max(float(off.max(initial=tolerance)), *others, tolerance)


def chosen_blocks(panels: Sequence[Panel]) -> list[int]:
    """Return the blocks to draw, in their order: those that move at all, the farthest of them if they are many."""
    most = np.max([panel.off_mm.max(axis=0, initial=0.0) for panel in panels], axis=0)
    least = DEPTH * min(float(most.max(initial=0.0)), panels[0].tolerance_mm)
    moving = [int(block) for block in np.argsort(-most, kind="stable") if most[block] > least]
    return sorted(moving[:MOST_BLOCKS])


def _look(shown: Sequence[int], block: int) -> dict[str, Any]:
    """Return the colour of a block, as in other pictures, and a marker that none of the others has."""
    return {
        "color": style.block_colour(block),
        "marker": MARKERS[shown.index(block)],
        "markersize": 4.5,
        "markeredgecolor": style.INK,
        "markeredgewidth": 0.4,
        "linewidth": 1.2,
    }


def _draw_panel(axes: "Axes", panel: Panel, shown: Sequence[int], width: float) -> None:
    from matplotlib.ticker import FuncFormatter, NullLocator

    low, _ = axes.get_ylim()
    coarser = panel.values[:-1]  # the finest level is what the others are measured from
    axes.set_xscale("log")
    axes.plot(coarser, np.maximum(panel.largest_off_mm[:-1], low), **LARGEST)
    for block in shown:
        off = np.maximum(panel.off_mm[:-1, block], low)
        axes.plot(coarser, off, **_look(shown, block), clip_on=False, zorder=3)
    marks = [(panel.own, "own", 1), *([] if panel.recommended is None else [(panel.recommended, "recommended", 0)])]
    for value, text, row in marks:  # above the panel, in a row of text each
        axes.axvline(value, color=style.FAINT_INK, linewidth=style.LINE_WIDTH, linestyle=(0, (1, 2)), zorder=1)
        side = {panel.values[0]: "left", panel.values[-1]: "right"}.get(value, "center")
        place = (value, 1.0), (0.0, 2.0 + row * LINE * style.POINTS_PER_INCH), ("data", "axes fraction")
        axes.annotate(text, *place, "offset points", color=style.FAINT_INK, ha=side)
    # numbers below every n-th level where they are many, always below the scenario's own
    margin = (float(panel.values[-1]) / float(panel.values[0])) ** 0.04
    axes.set_xlim(float(panel.values[0]) / margin, float(panel.values[-1]) * margin)
    apart = -(-len(panel.values) // int(width / NUMBER_ROOM))
    start = int(np.argmin(np.abs(panel.values - panel.own))) % apart
    axes.set_xticks(panel.values[start::apart], [f"{value:.3g}" for value in panel.values[start::apart]])
    axes.xaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.spines[["right", "top"]].set_visible(False)
    room = width * style.POINTS_PER_INCH
    label = f"{panel.key}, finer to the right"
    has_room = style.width_of(label, style.FONT_SIZE) <= style.SURE * room
    axes.set_xlabel(label if has_room else style.cut_to(panel.key, room, style.FONT_SIZE), labelpad=2.0)
    heading = style.cut_to(f"{panel.title}: {panel.verdict}", room, style.FONT_SIZE)
    axes.set_title(heading, loc="left", pad=4.0 + 2.0 * LINE * style.POINTS_PER_INCH)


def _draw_limits(axes: "Axes", tolerance: float, repeats: float | None, *, named: bool) -> None:
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

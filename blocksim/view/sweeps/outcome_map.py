"""Outcome map: run-outs and outcomes over two inputs, a column for each value of a third; cells, dots, colours."""

from collections import Counter
from collections.abc import Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from blocksim.view import style
from blocksim.view.style import OWN, Paper
from blocksim.view.sweeps.data import (
    MOST_COLUMNS,
    Flags,
    Floats,
    Input,
    SweepData,
    ValueAxis,
    outcome_label,
    percent,
    value_axis,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

    from matplotlib.axes import Axes
    from matplotlib.colors import BoundaryNorm, Colormap
    from matplotlib.figure import Figure


STEPS = 8  # of run-out, at most
RARE = 1.0  # percent at either end that share the colour of the last step
LEAST_SPAN_MM = 1.0
RUN_OUT_COLOURS = "viridis"  # distinguishable with every colour blindness, and in grey: brighter all the way
# The same holds of these: no two are nearer than 0.12 in brightness.
MANNERS = {"stands": "#009E73", "rocked back": "#56B4E9", "rocking": "#CC79A7", "slid": "#E69F00", "fell": "#D55E00"}
CLASS_COLOURS = ("#56B4E9", "#16325B", "#F4E27A", "#A05A8C", "#1B6B4A")
OTHER_COLOUR, FAILED_COLOUR = "#D9D9D9", "#FFFFFF"
DOTS: dict[str, Any] = {"s": 9.0, "linewidth": 0.5, "zorder": 2}
HALO: dict[str, Any] = {"colors": "#FFFFFF", "linewidths": 2.4, "zorder": 2.9}  # so that it is seen on any colour
OUTLINE: dict[str, Any] = {"colors": style.MEASURED_COLOUR, "linewidths": 0.9, "zorder": 3}
FAILED: dict[str, Any] = {"marker": "x", "s": 10.0, "linewidth": 0.7, "color": style.INK, "zorder": 4}
MARGIN = 0.03  # of an axis around dots


@dataclass(frozen=True)
class Classes:
    """Numbers of classes by case, and their meaning: the measured one first, then the most frequent."""

    numbers: Floats  # (n,)
    labels: tuple[str, ...]
    colours: tuple[str, ...]
    title: str = "final rotations of all blocks"


def run_out_scale(x_mm: Floats) -> "tuple[Colormap, BoundaryNorm]":
    """Return a map of colours in round steps over all but the rarest run-outs (mm)."""
    from matplotlib import colormaps
    from matplotlib.colors import BoundaryNorm
    from matplotlib.ticker import MaxNLocator

    low, high = np.nanpercentile(x_mm, [RARE, 100.0 - RARE])
    spare = 0.5 * max(LEAST_SPAN_MM - (high - low), 0.0)
    edges = MaxNLocator(nbins=STEPS, steps=[1, 2, 2.5, 5, 10]).tick_values(low - spare, high + spare)
    colours = colormaps[RUN_OUT_COLOURS]
    return colours, BoundaryNorm(edges, colours.N, extend="both")


def classes_of(sweep: SweepData) -> Classes:
    """Return the outcomes of all cases as numbers; classes beyond the colours are taken together."""
    outcomes = sweep.outcomes
    order = _in_order(outcomes, sweep.measured.outcome)[: len(CLASS_COLOURS)]
    known = {outcome: number for number, outcome in enumerate(order)}
    other, failed = len(order), len(order) + 1
    numbers = np.array([failed if one is None else known.get(one, other) for one in outcomes], dtype=np.float64)
    names = [outcome_label(one) + (" (measured)" if one == sweep.measured.outcome else "") for one in order]
    names += ["others", "failed"]
    shares = [float((numbers == number).mean()) for number in range(len(names))]
    labels = tuple(f"{name}: {percent(share)}" for name, share in zip(names, shares, strict=True))
    return Classes(numbers, labels, (*CLASS_COLOURS[: len(order)], OTHER_COLOUR, FAILED_COLOUR))


def manners_of(sweep: SweepData) -> Classes:
    """Return how all cases ended as numbers, in the order of `MANNERS`."""
    names = [name for name in MANNERS if name in sweep.manners]
    ends = zip(sweep.manners, sweep.finished, strict=True)
    numbers = np.array([names.index(one) if ok and one in names else len(names) for one, ok in ends], dtype=np.float64)
    labels = tuple(
        f"{name}: {percent(float((numbers == number).mean()))}" for number, name in enumerate([*names, "failed"])
    )
    return Classes(numbers, labels, (*(MANNERS[name] for name in names), FAILED_COLOUR), "outcome")


def _in_order(outcomes: Sequence[tuple[int, ...] | None], measured: tuple[int, ...] | None) -> list[tuple[int, ...]]:
    counts = Counter(one for one in outcomes if one is not None)
    order = sorted(counts, key=lambda one: (-counts[one], one))
    if measured is None or measured not in counts:
        return order
    return [measured, *(one for one in order if one != measured)]


@dataclass(frozen=True, eq=False)
class Plane:
    """Two inputs of n cases, as shown on their axes."""

    x: Floats  # (n,)
    y: Floats  # (n,)
    axes: tuple[ValueAxis, ValueAxis]
    is_grid: bool


def draw_panel(axes: "Axes", plane: Plane, numbers: Floats, look: dict[str, Any], agrees: Flags | None) -> None:
    """Colour the cases by their numbers (NaN: none), with the map and norm of `look`; outline those that agree."""
    for side, shown in zip((axes.set_xscale, axes.set_yscale), plane.axes, strict=True):
        side("log" if shown.is_log else "linear")
    if plane.is_grid:
        _draw_cells(axes, plane, numbers, look, agrees)
    else:
        _draw_dots(axes, plane, numbers, look, agrees)


def mark_failed(axes: "Axes", plane: Plane, failed: Flags) -> None:
    """Cross out the cases that did not finish."""
    axes.scatter(plane.x[failed], plane.y[failed], **FAILED)


def edges_of(centres: Floats, *, is_log: bool) -> Floats:
    """Return the edges between ascending centres, (n,) to (n + 1,), midway on the axis; the outer cells are whole."""
    places = np.log(centres) if is_log else centres
    if len(places) == 1:
        half = 0.5 * abs(places[0]) or 0.5
        edges = np.array([places[0] - half, places[0] + half])
    else:
        middles = 0.5 * (places[1:] + places[:-1])
        edges = np.array([2.0 * places[0] - middles[0], *middles, 2.0 * places[-1] - middles[-1]])
    return np.exp(edges) if is_log else edges


def outline_of(agrees: Flags, x: Floats, y: Floats) -> list[list[tuple[float, float]]]:
    """Return the sides between cells that agree and others; `agrees` is (rows, columns), x and y are cell edges."""
    framed = np.pad(agrees, 1)
    rows, columns = np.nonzero(framed[1:-1, 1:] != framed[1:-1, :-1])
    upright = [[(x[i], y[j]), (x[i], y[j + 1])] for j, i in zip(rows, columns, strict=True)]
    rows, columns = np.nonzero(framed[1:, 1:-1] != framed[:-1, 1:-1])
    return [*upright, *([(x[i], y[j]), (x[i + 1], y[j])] for j, i in zip(rows, columns, strict=True))]


def on_grid(plane: Plane, numbers: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the ascending centres along x and y, and the numbers on them, (rows, columns); NaN where there is none."""
    x, columns = np.unique(plane.x, return_inverse=True)
    y, rows = np.unique(plane.y, return_inverse=True)
    table = np.full((len(y), len(x)), np.nan)
    table[rows, columns] = numbers
    return x, y, table


def _draw_cells(axes: "Axes", plane: Plane, numbers: Floats, colours: dict[str, Any], agrees: Flags | None) -> None:
    from matplotlib.collections import LineCollection

    x, y, table = on_grid(plane, numbers)
    edges = (edges_of(x, is_log=plane.axes[0].is_log), edges_of(y, is_log=plane.axes[1].is_log))
    axes.pcolormesh(*edges, np.ma.masked_invalid(table), **colours, rasterized=True, zorder=1)
    if agrees is not None:
        mask = on_grid(plane, agrees.astype(np.float64))[2] == 1.0
        lines = outline_of(mask, *edges)
        for look in (HALO, OUTLINE):
            axes.add_collection(LineCollection(lines, **look, capstyle="projecting"))


def _draw_dots(axes: "Axes", plane: Plane, numbers: Floats, look: dict[str, Any], agrees: Flags | None) -> None:
    known = np.isfinite(numbers)
    around = np.full(len(numbers), style.MEASURED_COLOUR if agrees is not None else "none", dtype=object)
    around[~agrees if agrees is not None else known] = "none"
    axes.scatter(plane.x[known], plane.y[known], c=numbers[known], edgecolors=list(around[known]), **look, **DOTS)
    axes.margins(MARGIN)


LEFT, RIGHT, FOOT = 0.80, 0.62, 0.42  # inches; the bars of colour are to the right
ROW_HEIGHT, ROW_GAP, COLUMN_GAP = 1.25, 0.30, 0.12  # inches
NARROWEST, WIDEST = 1.55, 2.1  # inches, of a panel
LEAST, LOWEST = 0.7, 0.5  # inches, of a panel on a page whose size was asked for
X_LABEL = 0.25  # inches from the panels down to the name of their axis
NAME_ROOM = 1.2  # inches, for the name of a block
HEADING = 0.18  # inches, of a heading above panels
MOST_BLOCKS = 3
AXES = 2
FEWEST = 3  # values of an input that is an axis


@dataclass(frozen=True, eq=False)
class OutcomeMap:
    """Contents and layout; `panels` are the axes that are drawn, row by row."""

    sweep: SweepData
    x: Input
    y: Input
    columns: tuple[tuple[str, Flags], ...]  # heading, and the cases (n,)
    blocks: list[int]
    axes: tuple[ValueAxis, ValueAxis]
    paper: Paper = OWN
    row_height: float = ROW_HEIGHT
    panels: "list[list[Axes]]" = field(default_factory=list)

    def plane(self, cases: Flags) -> Plane:
        """Return the inputs of some cases."""
        x, y = (axis.shown(one.values[cases]) for axis, one in zip(self.axes, (self.x, self.y), strict=True))
        return Plane(x, y, self.axes, self.sweep.is_grid)

    @property
    def panel_width(self) -> float:
        """Inches."""
        count, gaps = len(self.columns), LEFT + RIGHT + (len(self.columns) - 1) * COLUMN_GAP
        if self.paper.size is not None:
            return (self.paper.width(0.0, gaps + count * LEAST) - gaps) / count
        return style.COLUMN_WIDTH - gaps if count == 1 else min(WIDEST, (style.PAGE_WIDTH - gaps) / count)

    @property
    def legend_columns(self) -> int:
        """How many classes one row of the legend has."""
        return 1 if len(self.columns) == 1 else 2

    @property
    def head(self) -> float:
        """Inches between the title and the panels."""
        lines = max(len(self.heading(column)) for column in range(len(self.columns)))
        return HEADING if len(self.columns) == 1 else 2.0 * HEADING + (lines - 1) * style.LINE

    def heading(self, column: int) -> list[str]:
        """Return the lines above a column."""
        return style.broken(self.columns[column][0], self.panel_width, bold=True)

    @property
    def x_label(self) -> list[str]:
        """Return the lines below all panels."""
        return style.broken(self.axes[0].label, self.width - LEFT)

    @property
    def rows(self) -> int:
        """How many rows of panels there are."""
        return len(self.blocks) + 1

    @property
    def panels_height(self) -> float:
        """Inches of all rows."""
        return self.rows * self.row_height + (self.rows - 1) * ROW_GAP

    @property
    def width(self) -> float:
        """Inches."""
        return LEFT + RIGHT + len(self.columns) * self.panel_width + (len(self.columns) - 1) * COLUMN_GAP


def suits(sweep: SweepData) -> bool:
    """Return True if two inputs can be axes and the others, at most one, columns."""
    axes = _axes_of(sweep)
    if refusal(sweep):
        return False
    others = [one for one in sweep.inputs if one not in axes]
    spread = all(one.count >= FEWEST for one in axes)
    return spread and len(others) <= 1 and all(one.count <= MOST_COLUMNS for one in others)


def refusal(sweep: SweepData) -> str:
    """Return why a sweep cannot be shown."""
    return "a map needs two numeric inputs" if len(_axes_of(sweep)) < AXES else ""


@contextmanager
def draw_map(
    sweep: SweepData, paper: Paper = OWN, axes: tuple[Input, Input] | None = None, *, by_manner: bool = False
) -> "Iterator[tuple[Figure, OutcomeMap]]":
    """Give the drawn map. Samples over more than two inputs are seen along all others.

    `axes` are the inputs along x and y, by default the two with the most values. `by_manner` shows in the last row how
    cases ended in place of their final rotations. Raises InvalidInputError for a page that is too small.
    """
    found = map_of(sweep, paper, axes)
    classes = manners_of(sweep) if by_manner else classes_of(sweep)
    notes = style.wrapped(_notes(found), found.width - 2.0 * style.EDGE)
    below = len(notes) - (-len(_shown_classes(classes)) // found.legend_columns)
    foot = FOOT + style.LINE * (below + len(found.x_label) - 1) + 2.0 * style.EDGE
    others = style.title_height(sweep.title, found.width) + found.head + foot
    height = paper.panel(ROW_HEIGHT, found.rows, others + (found.rows - 1) * ROW_GAP, LOWEST)
    found = replace(found, row_height=height)
    with style.styled_figure(found.width, paper.height(others + found.panels_height), paper.dots) as figure:
        style.write_title(figure, sweep.title)
        for row, block in enumerate(found.blocks):
            _draw_block(figure, found, block, foot + (found.rows - 1 - row) * (height + ROW_GAP))
        _draw_classes(figure, found, classes, foot)
        _name_axes(figure, found, foot)
        _draw_legend(figure, found, classes, style.EDGE + style.LINE * below)
        for number, line in enumerate(reversed(notes)):
            place = (style.EDGE, style.EDGE + style.LINE * number)
            style.write_text(figure, *place, line, color=style.FAINT_INK, va="bottom")
        yield figure, found


def _axes_of(sweep: SweepData) -> tuple[Input, ...]:
    """Return the two inputs with the most values; of equal ones the first."""
    return tuple(sorted((one for one in sweep.inputs if one.is_number), key=lambda one: -one.count)[:AXES])


def map_of(sweep: SweepData, paper: Paper, axes: tuple[Input, ...] | None = None) -> OutcomeMap:
    """Return the contents of a map over two inputs, by default those with the most values."""
    x, y = axes = axes or _axes_of(sweep)
    others = [one for one in sweep.inputs if one not in axes and one.count <= MOST_COLUMNS]
    everything = np.ones(len(sweep.finished), dtype=bool)
    columns: list[tuple[str, Flags]] = [("", everything)]
    if others:
        name = others[0].key.rpartition(".")[2]
        values = np.unique(others[0].values)
        columns = [(f"{name} = {others[0].label(value)}", others[0].values == value) for value in values]
    shown = tuple(value_axis(one.values, one.key, one.unit, is_even=one.is_even, typed=one.typed) for one in axes)
    return OutcomeMap(sweep, x, y, tuple(columns), sweep.moving[-MOST_BLOCKS:], (shown[0], shown[1]), paper)


def _draw_row(
    figure: "Figure", found: OutcomeMap, bottom: float, numbers: Floats, look: dict[str, Any], agrees: Flags | None
) -> None:
    step = found.panel_width + COLUMN_GAP
    found.panels.append([])
    for column, (_, cases) in enumerate(found.columns):
        axes = style.add_axes(figure, LEFT + column * step, bottom, found.panel_width, found.row_height)
        found.panels[-1].append(axes)
        plane = found.plane(cases)
        draw_panel(axes, plane, numbers[cases], look, None if agrees is None else agrees[cases])
        mark_failed(axes, plane, ~found.sweep.finished[cases])
        style.number_axis(axes.xaxis, 4, is_log=found.axes[0].is_log)
        style.number_axis(axes.yaxis, 4, is_log=found.axes[1].is_log)
        axes.tick_params(axis="y", labelleft=column == 0)
        axes.tick_params(axis="x", labelbottom=len(found.panels) == found.rows)


def _draw_block(figure: "Figure", found: OutcomeMap, block: int, bottom: float) -> None:
    """Draw the run-out of a block, with the measured range outlined and marked at the colour bar."""
    x = found.sweep.x_mm[:, block]
    colours, norm = run_out_scale(x)
    band = found.sweep.measured.limits_mm.get(found.sweep.blocks[block])
    with np.errstate(invalid="ignore"):
        agrees = None if band is None else (x >= band[0]) & (x <= band[1])
    _draw_row(figure, found, bottom, x, {"cmap": colours, "norm": norm}, agrees)
    left = found.width - RIGHT + 0.1
    bar = style.add_axes(figure, left, bottom, 0.1, found.row_height)
    _draw_bar(bar, colours, norm, band)
    name = style.cut_to(found.sweep.blocks[block], NAME_ROOM * style.POINTS_PER_INCH, style.FONT_SIZE)
    style.write_text(figure, LEFT, bottom + found.row_height + 0.05, f"final x of block {name} (mm)")


def _draw_bar(axes: "Axes", colours: Any, norm: Any, band: tuple[float, float] | None) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colorbar import Colorbar

    bar = Colorbar(axes, ScalarMappable(norm, colours), spacing="proportional", extendfrac=0.06)
    bar.ax.minorticks_off()
    style.number_axis(bar.ax.yaxis)
    low, high = np.clip(band or (0.0, 0.0), norm.vmin, norm.vmax)
    if low < high:
        axes.fill_between([0.55, 1.0], low, high, color=style.MEASURED_COLOUR, linewidth=0.0)


def _draw_classes(figure: "Figure", found: OutcomeMap, classes: Classes, bottom: float) -> None:
    from matplotlib.colors import BoundaryNorm, ListedColormap

    look = {
        "cmap": ListedColormap(list(classes.colours)),
        "norm": BoundaryNorm(np.arange(len(classes.colours) + 1) - 0.5, len(classes.colours)),
    }
    _draw_row(figure, found, bottom, classes.numbers, look, found.sweep.inside)
    style.write_text(figure, LEFT, bottom + found.row_height + 0.05, classes.title)


def _name_axes(figure: "Figure", found: OutcomeMap, foot: float) -> None:
    """Write the keys once below and at the left of all panels, headings at the top."""
    middle, upright = 0.5 * (LEFT + found.width - RIGHT), foot + 0.5 * found.panels_height
    style.write_text(figure, middle, foot - X_LABEL, "\n".join(found.x_label), ha="center", va="top")
    label = "\n".join(style.broken(found.axes[1].label, found.panels_height))
    style.write_text(figure, style.EDGE, upright, label, ha="left", va="center", rotation=90.0)
    top = foot + found.panels_height + 0.22
    for column in range(len(found.columns) if len(found.columns) > 1 else 0):
        left = LEFT + column * (found.panel_width + COLUMN_GAP)
        style.write_text(figure, left, top, "\n".join(found.heading(column)), weight="bold", va="bottom")


def _shown_classes(classes: Classes) -> list[tuple[str, str]]:
    """Return label and colour of the classes that occur."""
    pairs = zip(classes.labels, classes.colours, strict=True)
    return [pair for number, pair in enumerate(pairs) if (classes.numbers == number).any()]


def _draw_legend(figure: "Figure", found: OutcomeMap, classes: Classes, top: float) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Any] = []
    for label, colour in _shown_classes(classes):
        if label.startswith("failed"):
            handles.append(Line2D([], [], linestyle="", marker="x", markersize=4.0, color=style.INK, label=label))
        else:
            handles.append(Patch(facecolor=colour, label=label))
    look: dict[str, Any] = {
        "loc": "upper left",
        "ncols": found.legend_columns,
        "labelspacing": 0.25,
        "handlelength": 1.2,
    }
    style.write_legend(figure, handles, style.EDGE, top, **look)


def _notes(found: OutcomeMap) -> list[str]:
    texts = []
    if found.sweep.measured.x_mm:
        texts.append("Outlined: inside the measured range; at the bottom: inside all of them.")
    if not found.sweep.is_grid:
        texts.append("One dot: one run.")
    drawn = {found.x.key, found.y.key}
    hidden = [one for one in found.sweep.inputs if one.key not in drawn and len(found.columns) == 1]
    if hidden:
        texts.append(f"{len(hidden)} other input{' varies' if len(hidden) == 1 else 's vary'}.")
    return texts

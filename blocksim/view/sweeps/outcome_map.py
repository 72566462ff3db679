"""Outcome map: run-outs and class of the outcome over two inputs; one column per value of a third."""

from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from blocksim.view import layout, style
from blocksim.view.layout import OWN, Paper
from blocksim.view.sweeps.cells import Classes, Plane, classes_of, draw_panel, manners_of, mark_failed, run_out_scale
from blocksim.view.sweeps.data import MOST_COLUMNS, Flags, Floats, Input, SweepData, ValueAxis, value_axis

if TYPE_CHECKING:
    from collections.abc import Iterator

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

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
        return layout.COLUMN_WIDTH - gaps if count == 1 else min(WIDEST, (layout.PAGE_WIDTH - gaps) / count)

    @property
    def legend_columns(self) -> int:
        """How many classes one row of the legend has."""
        return 1 if len(self.columns) == 1 else 2

    @property
    def head(self) -> float:
        """Inches between the title and the panels."""
        lines = max(len(self.heading(column)) for column in range(len(self.columns)))
        return HEADING if len(self.columns) == 1 else 2.0 * HEADING + (lines - 1) * layout.LINE

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
def drawn(
    sweep: SweepData, paper: Paper = OWN, axes: tuple[Input, Input] | None = None, *, by_manner: bool = False
) -> "Iterator[tuple[Figure, OutcomeMap]]":
    """Give the drawn map. Samples over more than two inputs are seen along all others.

    `axes` are the inputs along x and y, by default the two with the most values. `by_manner` shows in the last row how
    cases ended in place of their final rotations. Raises InvalidInputError for a page that is too small.
    """
    found = map_of(sweep, paper, axes)
    classes = manners_of(sweep) if by_manner else classes_of(sweep)
    notes = layout.wrapped(_notes(found), found.width - 2.0 * layout.EDGE)
    below = len(notes) - (-len(_shown_classes(classes)) // found.legend_columns)
    foot = FOOT + layout.LINE * (below + len(found.x_label) - 1) + 2.0 * layout.EDGE
    others = layout.title_height(sweep.title, found.width) + found.head + foot
    height = paper.panel(ROW_HEIGHT, found.rows, others + (found.rows - 1) * ROW_GAP, LOWEST)
    found = replace(found, row_height=height)
    with style.styled_figure(found.width, paper.height(others + found.panels_height), paper.dots) as figure:
        layout.write_title(figure, sweep.title)
        for row, block in enumerate(found.blocks):
            _draw_block(figure, found, block, foot + (found.rows - 1 - row) * (height + ROW_GAP))
        _draw_classes(figure, found, classes, foot)
        _name_axes(figure, found, foot)
        _draw_legend(figure, found, classes, layout.EDGE + layout.LINE * below)
        for number, line in enumerate(reversed(notes)):
            place = (layout.EDGE, layout.EDGE + layout.LINE * number)
            layout.write_text(figure, *place, line, color=style.FAINT_INK, va="bottom")
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
        axes = layout.add_axes(figure, LEFT + column * step, bottom, found.panel_width, found.row_height)
        found.panels[-1].append(axes)
        plane = found.plane(cases)
        draw_panel(axes, plane, numbers[cases], look, None if agrees is None else agrees[cases])
        mark_failed(axes, plane, ~found.sweep.finished[cases])
        layout.number_axis(axes.xaxis, 4, is_log=found.axes[0].is_log)
        layout.number_axis(axes.yaxis, 4, is_log=found.axes[1].is_log)
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
    bar = layout.add_axes(figure, left, bottom, 0.1, found.row_height)
    _draw_bar(bar, colours, norm, band)
    name = style.cut_to(found.sweep.blocks[block], NAME_ROOM * style.POINTS_PER_INCH, style.FONT_SIZE)
    layout.write_text(figure, LEFT, bottom + found.row_height + 0.05, f"final x of block {name} (mm)")


def _draw_bar(axes: "Axes", colours: Any, norm: Any, band: tuple[float, float] | None) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colorbar import Colorbar

    bar = Colorbar(axes, ScalarMappable(norm, colours), spacing="proportional", extendfrac=0.06)
    bar.ax.minorticks_off()
    layout.number_axis(bar.ax.yaxis)
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
    layout.write_text(figure, LEFT, bottom + found.row_height + 0.05, classes.title)


def _name_axes(figure: "Figure", found: OutcomeMap, foot: float) -> None:
    """Write the keys once below and at the left of all panels, headings at the top."""
    middle, upright = 0.5 * (LEFT + found.width - RIGHT), foot + 0.5 * found.panels_height
    layout.write_text(figure, middle, foot - X_LABEL, "\n".join(found.x_label), ha="center", va="top")
    label = "\n".join(style.broken(found.axes[1].label, found.panels_height))
    layout.write_text(figure, layout.EDGE, upright, label, ha="left", va="center", rotation=90.0)
    top = foot + found.panels_height + 0.22
    for column in range(len(found.columns) if len(found.columns) > 1 else 0):
        left = LEFT + column * (found.panel_width + COLUMN_GAP)
        layout.write_text(figure, left, top, "\n".join(found.heading(column)), weight="bold", va="bottom")


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
    layout.write_legend(figure, handles, layout.EDGE, top, **look)


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

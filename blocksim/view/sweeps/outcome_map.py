"""Outcome map: run-outs and outcomes over two inputs, a column for each value of a third; cells, dots, colours."""

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from blocksim.view import run_data, style
from blocksim.view.sweeps import data

if TYPE_CHECKING:
    from matplotlib.colors import BoundaryNorm, Colormap


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

    numbers: run_data.Floats  # (n,)
    labels: tuple[str, ...]
    colours: tuple[str, ...]
    title: str = "final rotations of all blocks"


def run_out_scale(x_mm: run_data.Floats) -> "tuple[Colormap, BoundaryNorm]":
    """Return a map of colours in round steps over all but the rarest run-outs (mm)."""
    from matplotlib import colormaps, colors, ticker

    low, high = np.nanpercentile(x_mm, [RARE, 100.0 - RARE])
    spare = 0.5 * max(LEAST_SPAN_MM - (high - low), 0.0)
    edges = ticker.MaxNLocator(nbins=STEPS, steps=[1, 2, 2.5, 5, 10]).tick_values(low - spare, high + spare)
    colours = colormaps[RUN_OUT_COLOURS]
    return colours, colors.BoundaryNorm(edges, colours.N, extend="both")


def classes_of(sweep: data.SweepData) -> Classes:
    """Return the outcomes of all cases as numbers; classes beyond the colours are taken together."""
    outcomes, measured = sweep.outcomes, sweep.measured.outcome
    counts = Counter(one for one in outcomes if one is not None)
    order = sorted(counts, key=lambda one: (one != measured, -counts[one], one))[: len(CLASS_COLOURS)]
    known = {outcome: number for number, outcome in enumerate(order)}
    other, failed = len(order), len(order) + 1
    numbers = np.array([failed if one is None else known.get(one, other) for one in outcomes], dtype=np.float64)
    names = [data.outcome_label(one) + (" (measured)" if one == measured else "") for one in order]
    colours = (*CLASS_COLOURS[: len(order)], OTHER_COLOUR, FAILED_COLOUR)
    return Classes(numbers, _with_shares([*names, "others", "failed"], numbers), colours)


def manners_of(sweep: data.SweepData) -> Classes:
    """Return how all cases ended as numbers, in the order of `MANNERS`."""
    names = [name for name in MANNERS if name in sweep.manners]
    ends = zip(sweep.manners, sweep.finished, strict=True)
    numbers = np.array([names.index(one) if ok and one in names else len(names) for one, ok in ends], dtype=np.float64)
    colours = (*(MANNERS[name] for name in names), FAILED_COLOUR)
    return Classes(numbers, _with_shares([*names, "failed"], numbers), colours, "outcome")


def _with_shares(names: Sequence[str], numbers: run_data.Floats) -> tuple[str, ...]:
    """Return the names of classes, each with the share of the cases that have its number."""
    return tuple(f"{name}: {data.percent(float((numbers == number).mean()))}" for number, name in enumerate(names))


@dataclass(frozen=True, eq=False)
class Plane:
    """Two inputs of n cases, as shown on their axes."""

    x: run_data.Floats  # (n,)
    y: run_data.Floats  # (n,)
    axes: tuple[data.ValueAxis, data.ValueAxis]
    is_grid: bool


def draw_panel(
    axes: "style.Axes", plane: Plane, numbers: run_data.Floats, look: dict[str, Any], agrees: run_data.Flags | None
) -> None:
    """Colour the cases by their numbers (NaN: none), with the map and norm of `look`; outline those that agree."""
    axes.set_xscale("log" if plane.axes[0].is_log else "linear")
    axes.set_yscale("log" if plane.axes[1].is_log else "linear")
    if plane.is_grid:
        x, y, table = on_grid(plane, numbers)
        edges = (edges_of(x, is_log=plane.axes[0].is_log), edges_of(y, is_log=plane.axes[1].is_log))
        axes.pcolormesh(*edges, np.ma.masked_invalid(table), **look, rasterized=True, zorder=1)
        if agrees is not None:
            lines = outline_of(on_grid(plane, agrees.astype(np.float64))[2] == 1.0, *edges)
            for outline in (HALO, OUTLINE):
                style.add_lines(axes, lines, **outline, capstyle="projecting")
        return
    known = np.isfinite(numbers)
    is_outlined = known & (False if agrees is None else agrees)
    around = np.where(is_outlined, style.MEASURED_COLOUR, "none")[known]
    axes.scatter(plane.x[known], plane.y[known], c=numbers[known], edgecolors=list(around), **look, **DOTS)
    axes.margins(MARGIN)


def edges_of(centres: run_data.Floats, *, is_log: bool) -> run_data.Floats:
    """Return the edges between ascending centres, (n,) to (n + 1,), midway on the axis; the outer cells are whole."""
    places = np.log(centres) if is_log else centres
    if len(places) == 1:
        half = 0.5 * abs(places[0]) or 0.5
        edges = np.array([places[0] - half, places[0] + half])
    else:
        middles = 0.5 * (places[1:] + places[:-1])
        edges = np.array([2.0 * places[0] - middles[0], *middles, 2.0 * places[-1] - middles[-1]])
    return np.exp(edges) if is_log else edges


def outline_of(agrees: run_data.Flags, x: run_data.Floats, y: run_data.Floats) -> list[list[tuple[float, float]]]:
    """Return the sides between cells that agree and others; `agrees` is (rows, columns), x and y are cell edges."""
    framed = np.pad(agrees, 1)
    rows, columns = np.nonzero(framed[1:-1, 1:] != framed[1:-1, :-1])
    upright = [[(x[i], y[j]), (x[i], y[j + 1])] for j, i in zip(rows, columns, strict=True)]
    rows, columns = np.nonzero(framed[1:, 1:-1] != framed[:-1, 1:-1])
    return [*upright, *([(x[i], y[j]), (x[i + 1], y[j])] for j, i in zip(rows, columns, strict=True))]


def on_grid(plane: Plane, numbers: run_data.Floats) -> tuple[run_data.Floats, run_data.Floats, run_data.Floats]:
    """Return the ascending centres along x and y, and the numbers on them, (rows, columns); NaN where there is none."""
    x, columns = np.unique(plane.x, return_inverse=True)
    y, rows = np.unique(plane.y, return_inverse=True)
    table = np.full((len(y), len(x)), np.nan)
    table[rows, columns] = numbers
    return x, y, table


LEFT, RIGHT, FOOT = 0.80, 0.62, 0.42  # inches; the bars of colour are to the right
ROW_HEIGHT, ROW_GAP, COLUMN_GAP = 1.25, 0.30, 0.12  # inches
WIDEST = 2.1  # inches, of a panel
LEAST, LOWEST = 0.7, 0.5  # inches, of a panel on a page whose size was asked for
X_LABEL = 0.25  # inches from the panels down to the name of their axis
NAME_ROOM = 1.2  # inches, for the name of a block
HEADING = 0.25  # inches, of a heading above panels
MOST_BLOCKS = 3
AXES = 2
FEWEST = 3  # values of an input that is an axis


@dataclass(frozen=True, eq=False)
class OutcomeMap:
    """Contents; `panels` are the axes that are drawn, row by row."""

    sweep: data.SweepData
    x: data.Input
    y: data.Input
    columns: tuple[tuple[str, run_data.Flags], ...]  # heading, and the cases (n,)
    blocks: list[int]
    axes: tuple[data.ValueAxis, data.ValueAxis]
    panels: "list[list[style.Axes]]" = field(default_factory=list)

    def plane(self, cases: run_data.Flags) -> Plane:
        """Return the inputs of some cases."""
        x, y = (axis.scale(one.values[cases]) for axis, one in zip(self.axes, (self.x, self.y), strict=True))
        return Plane(x, y, self.axes, self.sweep.mode == "grid")


def suits(sweep: data.SweepData) -> bool:
    """Return True if two inputs can be axes and the others, at most one, columns."""
    if refusal(sweep):
        return False
    axes = _axes_of(sweep)
    others = [one for one in sweep.inputs if one not in axes]
    spread = all(one.count >= FEWEST for one in axes)
    return spread and len(others) <= 1 and all(one.count <= data.MOST_COLUMNS for one in others)


def refusal(sweep: data.SweepData) -> str:
    """Return why a sweep cannot be shown."""
    return "a map needs two numeric inputs" if len(_axes_of(sweep)) < AXES else ""


def _axes_of(sweep: data.SweepData) -> tuple[data.Input, ...]:
    """Return the two inputs with the most values; of equal ones the first."""
    return tuple(sorted((one for one in sweep.inputs if not one.levels), key=lambda one: -one.count)[:AXES])


def map_of(sweep: data.SweepData, axes: tuple[data.Input, ...] | None = None) -> OutcomeMap:
    """Return the contents of a map over two inputs, by default those with the most values."""
    x, y = axes = axes or _axes_of(sweep)
    others = [one for one in sweep.inputs if one not in axes and one.count <= data.MOST_COLUMNS]
    columns: list[tuple[str, run_data.Flags]] = [("", np.ones(len(sweep.finished), dtype=bool))]
    if others:
        name = others[0].key.rpartition(".")[2]
        values = np.unique(others[0].values)
        columns = [(f"{name} = {others[0].label(value)}", others[0].values == value) for value in values]
    shown = tuple(data.value_axis(one.values, one.key, one.unit, is_even=one.is_even, typed=one.typed) for one in axes)
    return OutcomeMap(sweep, x, y, tuple(columns), sweep.movers[-MOST_BLOCKS:], (shown[0], shown[1]))


@contextmanager
def draw_map(
    sweep: data.SweepData, paper: style.Paper = style.OWN, found: OutcomeMap | None = None, *, by_manner: bool = False
) -> Iterator["style.Figure"]:
    """Give the drawn map. Samples over more than two inputs are seen along all others.

    `found` are its contents, by default over the two inputs with the most values; it gets the panels. `by_manner` shows
    in the last row how cases ended in place of their final rotations. Raises InvalidInputError for too small a page.
    """
    from matplotlib import colors

    found = found or map_of(sweep)
    count = len(found.columns)
    classes = manners_of(sweep) if by_manner else classes_of(sweep)
    handles: list[Any] = []
    for number, (label, colour) in enumerate(zip(classes.labels, classes.colours, strict=True)):
        if not (classes.numbers == number).any():
            continue
        cross = {"linestyle": "", "marker": "x", "markersize": 4.0, "color": style.INK}
        handles.append(style.legend_entry(label, **cross if label.startswith("failed") else {"facecolor": colour}))
    beside = LEFT + RIGHT + (count - 1) * COLUMN_GAP
    own = style.COLUMN_WIDTH - beside if count == 1 else min(WIDEST, (style.PAGE_WIDTH - beside) / count)
    width = paper.width(beside + count * own, beside + count * LEAST)
    headings = [style.break_lines(heading, (width - beside) / count, bold=True) for heading, _ in found.columns]
    head = HEADING + (style.LINE * max(map(len, headings)) + 0.05 if count > 1 else 0.0)
    foot = FOOT + style.LINE * (len(style.break_lines(found.axes[0].label, width - LEFT)) - 1)
    counts, gaps = [count] * (len(found.blocks) + 1), (COLUMN_GAP, ROW_GAP)
    own_size, least, sides = (own, ROW_HEIGHT), (LEAST, LOWEST), (LEFT, RIGHT, head, foot)
    more: dict[str, Any] = {"notes": _notes(found), "handles": handles, "columns": 1 if count == 1 else 2}
    opened = style.open_panels(paper, counts, own_size, least, sides, gaps, title=sweep.title, **more)
    with opened as (figure, panels):
        found.panels.extend(panels)
        for block, row in zip(found.blocks, panels[:-1], strict=True):
            _draw_block(figure, row, found, block)
        norm = colors.BoundaryNorm(np.arange(len(classes.colours) + 1) - 0.5, len(classes.colours))
        look = {"cmap": colors.ListedColormap(list(classes.colours)), "norm": norm}
        _draw_row(panels[-1], found, classes.title, classes.numbers, look, sweep.inside)
        style.name_axes(figure, panels, found.axes[0].label, found.axes[1].label, X_LABEL)
        for one, heading in zip(panels[0], headings, strict=True):
            up = 1.0 + HEADING / style.size_of(one)[1]
            one.text(0.0, up, "\n".join(heading), transform=one.transAxes, va="bottom", weight="bold")
        yield figure


def _draw_row(
    row: Sequence["style.Axes"],
    found: OutcomeMap,
    caption: str,
    numbers: run_data.Floats,
    look: dict[str, Any],
    agrees: run_data.Flags | None,
) -> None:
    """Draw a row of panels, in which cases that did not finish are crossed out."""
    for axes, (_, cases) in zip(row, found.columns, strict=True):
        plane, failed = found.plane(cases), ~found.sweep.finished[cases]
        draw_panel(axes, plane, numbers[cases], look, None if agrees is None else agrees[cases])
        if failed.any():
            axes.scatter(plane.x[failed], plane.y[failed], **FAILED)
        style.number_axis(axes.xaxis, 4, is_log=found.axes[0].is_log)
        style.number_axis(axes.yaxis, 4, is_log=found.axes[1].is_log)
        axes.tick_params(labelleft=axes is row[0], labelbottom=axes in found.panels[-1])
    row[0].set_title(caption, loc="left", pad=3.6)


def _draw_block(figure: "style.Figure", row: Sequence["style.Axes"], found: OutcomeMap, block: int) -> None:
    """Draw the run-out of a block, with the measured range outlined and marked at the colour bar."""
    from matplotlib import cm, colorbar

    x = found.sweep.x_mm[:, block]
    colours, norm = run_out_scale(x)
    band = found.sweep.measured.limits_mm.get(found.sweep.blocks[block])
    with np.errstate(invalid="ignore"):
        agrees = None if band is None else (x >= band[0]) & (x <= band[1])
    name = style.cut_to(found.sweep.blocks[block], NAME_ROOM * style.POINTS_PER_INCH, style.FONT_SIZE)
    _draw_row(row, found, f"final x of block {name} (mm)", x, {"cmap": colours, "norm": norm}, agrees)
    place, share = row[-1].get_position(), 0.1 / float(figure.get_figwidth())
    axes = figure.add_axes((place.x1 + share, place.y0, share, place.height))
    bar = colorbar.Colorbar(axes, cm.ScalarMappable(norm, colours), spacing="proportional", extendfrac=0.06)
    bar.ax.minorticks_off()
    style.number_axis(bar.ax.yaxis)
    low, high = np.clip(band or (0.0, 0.0), norm.vmin, norm.vmax)
    if low < high:
        axes.fill_between([0.55, 1.0], low, high, color=style.MEASURED_COLOUR, linewidth=0.0)


def _notes(found: OutcomeMap) -> str:
    texts = []
    if found.sweep.measured.x_mm:
        texts.append("Outlined: inside the measured range; at the bottom: inside all of them.")
    if found.sweep.mode != "grid":
        texts.append("One dot: one run.")
    drawn = {found.x.key, found.y.key}
    hidden = [one for one in found.sweep.inputs if one.key not in drawn and len(found.columns) == 1]
    if hidden:
        texts.append(f"{len(hidden)} other input{' varies' if len(hidden) == 1 else 's vary'}.")
    return " ".join(texts)

"""One panel of a map: cells of a grid or dots of samples, coloured by run-out or outcome; agreeing ones outlined."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from blocksim.view import style
from blocksim.view.sweeps.data import Flags, Floats, SweepData, ValueAxis, outcome_label, percent

if TYPE_CHECKING:
    from matplotlib.axes import Axes
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

"""Limits of one key over another: every bracket as a point, joined where a value has as many limits as the next."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from blocksim.view.layout import OWN, Paper, number_axis
from blocksim.view.sheet import sheet

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_LEFT = 0.62  # inches
_MARGIN = 0.06  # of an axis
_MOST_NUMBERS = 6
COLOURS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7")  # by the kind of the change
LINE_COLOUR = "#777777"
OTHERS = ("#D55E00", "#000000", "#56B4E9", "#777777")  # of what others found
MARKS = "DsX^"
MOST_MARKS = 12  # series with more points are lines


class Bracket(NamedTuple):
    """A limit at one value: between which values it lies, and what the structure does below and above."""

    low: float
    high: float
    below: str
    above: str


class Series(NamedTuple):
    """What others found: a name, and limits as pairs of the other key's value and the limit."""

    name: str
    points: tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class LimitCurve:
    """The brackets at every value of the other key, the names of both axes, and what others found."""

    across: str
    up: str
    points: Sequence[tuple[float, Sequence[Bracket]]]
    notes: tuple[str, ...] = ()
    beside: tuple[Series, ...] = ()


def joined(curve: LimitCurve) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    """Return the lines between middles of brackets: of neighbours with as many limits of the same kinds."""
    lines = []
    for (left, here), (right, there) in pairwise(curve.points):
        if [one[2:] for one in here] == [one[2:] for one in there]:
            lines += [((left, _middle(a)), (right, _middle(b))) for a, b in zip(here, there, strict=True)]
    return lines


def _middle(one: Bracket) -> float:
    return 0.5 * (one.low + one.high)


def draw_limit_curve(curve: LimitCurve, path: Path | str, title: str | None = None, paper: Paper = OWN) -> None:
    """Draw the picture and write it; raises as `sheet`."""
    with sheet(path, title, curve.notes, paper, _LEFT) as axes:
        for start, end in joined(curve):
            axes.plot(*zip(start, end, strict=True), color=LINE_COLOUR, linewidth=1.0, zorder=2)
        _draw_others(axes, curve.beside)
        _draw_brackets(axes, [(x, one) for x, found in curve.points for one in found])
        axes.margins(_MARGIN)
        for axis in (axes.xaxis, axes.yaxis):
            number_axis(axis, _MOST_NUMBERS)
        axes.set_xlabel(curve.across, labelpad=2.0)
        axes.set_ylabel(curve.up, labelpad=2.0)
        axes.legend(loc="best", frameon=False)


def _draw_brackets(axes: "Axes", brackets: Sequence[tuple[float, Bracket]]) -> None:
    """Draw brackets at their places, those of a kind in one colour."""
    for number, kind in enumerate(dict.fromkeys((one.below, one.above) for _, one in brackets)):
        own = [(x, one) for x, one in brackets if one[2:] == kind]
        middles = [_middle(one) for _, one in own]
        reach = [0.5 * (one.high - one.low) for _, one in own]
        places = [x for x, _ in own]
        look: dict[str, Any] = {"color": COLOURS[number % len(COLOURS)], "markersize": 4.5, "linewidth": 0.0}
        label = f"{kind[0]} below, {kind[1]} above"
        axes.errorbar(places, middles, yerr=reach, fmt="o", elinewidth=1.0, capsize=2.5, label=label, **look)


def _draw_others(axes: "Axes", beside: Sequence[Series]) -> None:
    """Draw long series as lines and short ones as marks, which no line between few points would do justice."""
    for number, one in enumerate(beside):
        colour = OTHERS[number % len(OTHERS)]
        look: dict[str, Any] = {"color": colour, "linewidth": 1.4, "zorder": 1.5}
        if len(one.points) <= MOST_MARKS:
            mark = MARKS[number % len(MARKS)]
            look |= {"linestyle": "none", "marker": mark, "markersize": 6.0, "markerfacecolor": "none", "zorder": 3.0}
        axes.plot(*zip(*one.points, strict=True), label=one.name, **look)

"""Limits of one key over another: every bracket as a point, joined where a value has as many limits as the next."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

from blocksim.view import style
from blocksim.view.layout import EDGE, LINE, OWN, Paper, add_axes, number_axis, wrapped, write_heading, write_text

WIDTH, PANEL_HEIGHT = 5.2, 3.0  # inches
LEFT, RIGHT, HEAD, FOOT = 0.62, 0.15, 0.38, 0.48  # inches
NARROWEST, LOWEST = 1.8, 1.0  # inches, of the panel on a page whose size was asked for
MARGIN = 0.06  # of an axis
MOST_NUMBERS = 6
COLOURS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7")  # by the kind of the change
LINE_COLOUR = "#777777"


class Bracket(NamedTuple):
    """A limit at one value: between which values it lies, and what the structure does below and above."""

    low: float
    high: float
    below: str
    above: str


@dataclass(frozen=True)
class LimitCurve:
    """The brackets at every value of the other key, the names of both axes, and the range that was searched."""

    across: str
    up: str
    points: Sequence[tuple[float, Sequence[Bracket]]]
    notes: tuple[str, ...] = ()


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
    """Draw the picture and write it as PNG, SVG or PDF; the same input gives the same bytes.

    Raises InvalidInputError for an unknown picture format or too small a page, OutputError when the file cannot be
    written.
    """
    path = Path(path)
    style.picture_suffix(path)
    width = paper.width(WIDTH, LEFT + RIGHT + NARROWEST)
    notes = wrapped(list(curve.notes), width - LEFT - EDGE)
    foot = FOOT + LINE * len(notes)
    row = paper.panel(PANEL_HEIGHT, 1, HEAD + foot, LOWEST)
    with style.styled_figure(width, paper.height(HEAD + row + foot), paper.dots) as figure:
        axes = add_axes(figure, LEFT, foot, width - LEFT - RIGHT, row)
        for start, end in joined(curve):
            axes.plot(*zip(start, end, strict=True), color=LINE_COLOUR, linewidth=1.0, zorder=2)
        brackets = [(x, one) for x, found in curve.points for one in found]
        kinds = dict.fromkeys((one.below, one.above) for _, one in brackets)
        for number, kind in enumerate(kinds):
            own = [(x, one) for x, one in brackets if one[2:] == kind]
            middles = [_middle(one) for _, one in own]
            reach = [0.5 * (one.high - one.low) for _, one in own]
            places = [x for x, _ in own]
            colour = COLOURS[number % len(COLOURS)]
            look: dict[str, Any] = {"color": colour, "markersize": 4.5, "linewidth": 0.0}
            label = f"{kind[0]} below, {kind[1]} above"
            axes.errorbar(places, middles, yerr=reach, fmt="o", elinewidth=1.0, capsize=2.5, label=label, **look)
        axes.margins(MARGIN)
        for axis in (axes.xaxis, axes.yaxis):
            number_axis(axis, MOST_NUMBERS)
        axes.spines[["right", "top"]].set_visible(False)
        axes.set_xlabel(curve.across, labelpad=2.0)
        axes.set_ylabel(curve.up, labelpad=2.0)
        axes.legend(loc="best", frameon=False)
        for number, line in enumerate(reversed(notes)):
            write_text(figure, LEFT, EDGE + LINE * number, line, color=style.FAINT_INK)
        write_heading(figure, title, EDGE)
        style.save_figure(figure, path)

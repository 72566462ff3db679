"""A simulated quantity over time with the law that it should follow, and the difference below."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from blocksim.view import style
from blocksim.view.history_panels import limits_of
from blocksim.view.layout import OWN, Paper, plain_numbers, write_heading
from blocksim.view.run_data import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_WIDTH, UPPER, LOWER = 7.2, 2.4, 1.0  # inches
_LEFT, _RIGHT, _HEAD, _FOOT, _GAP = 0.75, 0.15, 0.38, 0.42, 0.16  # inches
_LOWEST = 0.5  # inches, of the lower panel on a page whose size was asked for
SIMULATED: dict[str, Any] = {"color": "#0072B2", "linewidth": 3.0, "alpha": 0.55, "solid_capstyle": "butt"}
EXPECTED: dict[str, Any] = {"color": style.INK, "linewidth": 1.0, "linestyle": (0, (4, 2))}


@dataclass(frozen=True, eq=False)
class Law:
    """n values of one quantity: simulated and by a formula, in the unit of `quantity`; NaN where there is no formula.

    `marks` are times (s) worth a thin line, such as impacts.
    """

    quantity: str
    unit: str
    formula: str
    time: Floats  # (n,) s
    simulated: Floats  # (n,)
    expected: Floats  # (n,)
    marks: Sequence[float] = ()

    @property
    def difference(self) -> Floats:
        """Simulated − expected, (n,)."""
        return self.simulated - self.expected

    @property
    def largest(self) -> float:
        """The largest difference, without sign."""
        return float(np.nanmax(np.abs(self.difference)))


def draw_law(law: Law, path: Path | str, title: str, paper: Paper = OWN) -> None:
    """Draw the quantity and the difference and write PNG, SVG or PDF; the same input gives the same bytes.

    Raises InvalidInputError for an unknown picture format or a page that is too small, and OutputError when the file
    cannot be written.
    """
    path = Path(path)
    style.picture_suffix(path)
    width = paper.width(_WIDTH, _LEFT + _RIGHT + 1.0)
    lower = paper.panel(LOWER, 1, _HEAD + UPPER + _GAP + _FOOT, _LOWEST)
    lower = lower if paper.size is None else min(lower, LOWER)
    height = paper.height(_HEAD + UPPER + _GAP + lower + _FOOT)
    upper = height - _HEAD - _GAP - lower - _FOOT
    with style.styled_figure(width, height, paper.dots) as figure:
        inside = (width - _LEFT - _RIGHT) / width
        above = figure.add_axes((_LEFT / width, (_FOOT + lower + _GAP) / height, inside, upper / height))
        below = figure.add_axes((_LEFT / width, _FOOT / height, inside, lower / height))
        above.plot(law.time, law.simulated, label="simulated", **SIMULATED)
        above.plot(law.time, law.expected, label=law.formula, **EXPECTED)
        above.legend(loc="upper right", frameon=False)
        below.plot(law.time, law.difference, color=SIMULATED["color"], linewidth=1.0)
        known = np.concatenate([law.simulated, law.expected[np.isfinite(law.expected)]])
        _finish(above, law, f"{law.quantity} ({law.unit})", known, inside * width)
        _finish(below, law, f"difference ({law.unit})", law.difference[np.isfinite(law.difference)], inside * width)
        above.tick_params(labelbottom=False)
        below.set_xlabel("time (s)", labelpad=2.0)
        write_heading(figure, title, 0.12, 0.08)
        style.save_figure(figure, path)


def _finish(axes: "Axes", law: Law, label: str, values: Floats, inside: float) -> None:
    """Set limits and texts of a panel, `inside` inches wide."""
    for mark in law.marks:
        axes.axvline(mark, color=style.FAINT_INK, linewidth=0.5, zorder=0)
    axes.spines[["right", "top"]].set_visible(False)
    axes.set_xlim(float(law.time[0]), float(law.time[-1]))
    low, high = limits_of(values)
    axes.set_ylim(low, high)
    axes.yaxis.set_label_coords(-0.52 / inside, 0.5)
    axes.set_ylabel(label)
    plain_numbers(axes.yaxis)

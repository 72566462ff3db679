"""Capacity curves: force over displacement of actuators, with the bound of statics, before measured curves."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from blocksim.view import style
from blocksim.view.run_data import MILLIMETRES, Floats
from blocksim.view.time_panels import COLOURS

KILO = 1e-3
PANEL, LEAST = (5.2, 3.3), (1.8, 1.0)  # inches, of the panel, and on a page whose size was asked for
SIDES = 0.70, 0.15, 0.11, 0.44  # inches
MEASURED: dict[str, Any] = {"color": "#9E9E9E", "linewidth": 2.2, "alpha": 0.8}
BOUND: dict[str, Any] = {"linewidth": 1.0, "linestyle": (0, (5, 2))}


@dataclass(frozen=True, eq=False)
class CapacityCurve:
    """The n samples of one actuator, what statics allows in each direction in which it went, and what was measured."""

    name: str
    displacement: Floats  # (n,) m
    force: Floats  # (n,) N
    bounds: Sequence[float]  # N, negative of pulls; NaN where statics has none
    measured: Sequence[tuple[Floats, Floats]]  # m, N of each repeat


def draw_curves(curves: Sequence[CapacityCurve], path: Path | str, title: str, paper: style.Paper) -> None:
    """Draw them into one panel and write PNG, SVG or PDF; the same input gives the same bytes.

    Raises InvalidInputError for an unknown picture format or too small a page, OutputError.
    """
    path = style.picture_path(path)
    with style.open_panels(paper, [1], PANEL, LEAST, SIDES, title=title) as (figure, ((axes,),)):
        axes.spines[["right", "top"]].set_visible(False)
        label = "measured"
        for curve in curves:
            for x, y in curve.measured:
                axes.plot(MILLIMETRES * x, KILO * y, label=label, **MEASURED)
                label = "_"
        for number, curve in enumerate(curves):
            colour = COLOURS[number % len(COLOURS)]
            axes.plot(
                MILLIMETRES * curve.displacement, KILO * curve.force, color=colour, linewidth=1.4, label=curve.name
            )
            for bound in (one for one in curve.bounds if np.isfinite(one)):
                name = f"no equilibrium beyond {KILO * abs(bound):.4g} kN (statics)"
                axes.axhline(KILO * bound, color=colour, label=name, **BOUND)
        axes.axhline(0.0, color=style.INK, linewidth=0.6, zorder=0)
        axes.set_xlabel("displacement (mm)")
        axes.set_ylabel("force (kN)")
        axes.margins(x=0.02, y=0.08)
        axes.legend(loc="best", frameon=False)
        style.save_figure(figure, path)

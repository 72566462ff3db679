"""Histories and maps in a report: the drawings of `view` as SVG, and where their panels lie for cursor and pointer."""

import re
from base64 import b64encode
from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from blocksim.simulation.frames import Frames
from blocksim.view import style
from blocksim.view.history import draw_history_page
from blocksim.view.kinds import SWEEP_KINDS
from blocksim.view.run_data import Support
from blocksim.view.style import OWN
from blocksim.view.sweeps import outcome_map
from blocksim.view.sweeps.data import SweepData, short_names
from blocksim.view.sweeps.outcome_map import OutcomeMap

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_MAPS = 6  # of a sweep, each over two of its inputs
COORDINATES = re.compile(r'(?<= (?:d|x|y)=")[^"]*')
DIGITS = re.compile(r"(\.\d\d)\d+")


class Repeats:
    """The measured ranges of a comparison, as pictures want them."""

    def __init__(self, rows: Sequence[Mapping[str, Any]]) -> None:
        """Take the rows of `Comparison.to_dict`."""
        self.rows = [row for row in rows if row["mean"] is not None]

    def statistics(self) -> "pd.DataFrame":
        """Return one row a block and quantity."""
        import pandas as pd

        return pd.DataFrame(self.rows, columns=["block", "quantity", "mean", "minimum", "maximum"])


def embedded(figure: "Figure") -> str:
    """Return a figure as the address of an SVG within the page; coordinates to a hundredth of a point."""
    svg = style.figure_bytes(figure, ".svg").decode()
    short = COORDINATES.sub(lambda found: DIGITS.sub(r"\1", found[0]).replace("\n", ""), svg)
    return f"data:image/svg+xml;base64,{b64encode(short.encode()).decode()}"


def history_of(frames: Frames, support: Support, measured: Repeats | None) -> tuple[str, list[dict[str, Any]]]:
    """Return the histories of a run, and of each panel its name, place and the ends of its axes."""
    with draw_history_page(frames, None, measured, support) as (figure, panels):
        places = [
            {"name": name, "place": _place(axes), "time": axes.get_xlim(), "values": axes.get_ylim()}
            for name, axes in panels.items()
        ]
        return embedded(figure), places


def pictures_of(sweep: SweepData) -> list[dict[str, Any]]:
    """Return the pictures of a sweep: maps over every two inputs, and all other kinds that suit it.

    A map has where its panels lie, row by row, and for every case the column that it is in and its place there.
    """
    pairs = [] if SWEEP_KINDS["map"].refusal(sweep) else combinations([one for one in sweep.inputs if one.is_number], 2)
    names = dict(zip((one.key for one in sweep.inputs), short_names([one.key for one in sweep.inputs]), strict=True))
    maps = []
    for x, y in [*pairs][:MOST_MAPS]:
        with outcome_map.draw_map(sweep, OWN, (x, y), by_manner=any(sweep.manners)) as (figure, found):
            label = f"map of {names[y.key]} over {names[x.key]}"
            maps.append({"label": label, "source": embedded(figure), "data": _cases(found)})
    others = []
    for name, kind in SWEEP_KINDS.items():
        if name != "map" and not kind.refusal(sweep) and kind.suits(sweep):
            with kind.drawn(sweep, OWN) as figure:
                others.append({"label": name, "source": embedded(figure), "data": None})
    return maps + others


def _cases(found: OutcomeMap) -> dict[str, Any]:
    count = len(found.sweep.finished)
    column, places = np.full(count, -1), np.zeros((count, 2))
    for number, (axes, (_, cases)) in enumerate(zip(found.panels[0], found.columns, strict=True)):
        plane = found.plane(cases)
        points = axes.transData.transform(np.stack([plane.x, plane.y], axis=-1))
        column[cases], places[cases] = number, axes.transAxes.inverted().transform(points)
    x, y = places.round(4).T.tolist()
    return {
        "panels": [[_place(axes) for axes in row] for row in found.panels],
        "column": column.tolist(),
        "x": x,
        "y": y,
    }


def _place(axes: "Axes") -> list[float]:
    """Return left, top, width and height of a panel as shares of the page, y down."""
    box = axes.get_position()
    return [round(float(share), 5) for share in (box.x0, 1.0 - box.y1, box.width, box.height)]

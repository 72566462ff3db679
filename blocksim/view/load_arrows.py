"""Drawing of what acts from outside: arrows of loads and driven bodies, round ones of moments, marks above a panel."""

from typing import Any

import numpy as np

from blocksim.view import style
from blocksim.view.forces import FORCES, LEAST, WIDTH, arrow_parts
from blocksim.view.loads import SPEED, Mark, Outside
from blocksim.view.panel import Canvas
from blocksim.view.run_data import Floats

COLOUR = "#A50026"
ARC_POINTS = 24
_HEAD = 4.0  # points, of round arrows
LEAST_SWEEP = 0.02  # rad
MARK, MARK_SIDE = 9.0, 12.0  # points: length of the arrow of a mark, and room for it
MARK_LETTER = 5.0  # points
MARK_GAP = 8.0  # points between two marks


def draw_outside(canvas: Canvas, found: Outside, index: int, length: float) -> None:
    """Draw the arrows of the frame with this index among the chosen ones; `length` is of the longest (mm)."""
    for one in found.arrows:
        lines = one.lines(length)[index]
        seen = np.hypot(*(lines[:, 1] - lines[:, 0]).T) * canvas.points_per_mm >= LEAST
        for part in arrow_parts(lines[seen], canvas, 1.0, style.INK if one.kind == SPEED else COLOUR):
            canvas.axes.add_collection(part)
    if found.turns is not None:
        turns = found.turns
        for centre, radius, sweep in zip(turns.at[index], turns.radius, turns.sweep[index], strict=True):
            if abs(sweep) >= LEAST_SWEEP:
                _draw_turn(canvas, arc(centre, float(radius), float(sweep)))


def arc(centre: Floats, radius: float, sweep: float) -> Floats:
    """Return points (mm) of a round arrow, which is open at the right, from its start to its tip."""
    angle = (0.25 * np.pi if sweep > 0.0 else -0.25 * np.pi) + np.linspace(0.0, sweep, ARC_POINTS)
    return np.asarray(centre + radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1))


def _draw_turn(canvas: Canvas, points: Floats) -> None:
    from matplotlib.collections import LineCollection, PolyCollection

    way = points[-1] - points[-2]
    way /= np.hypot(*way)
    head = min(_HEAD / canvas.points_per_mm, float(np.hypot(*(points[-1] - points[0]))) or _HEAD)
    across = 0.5 * head * np.array([-way[1], way[0]])
    tip = np.stack([points[-1] + 0.5 * head * way, points[-1] - 0.5 * head * way + across])
    outline = np.stack([*tip, points[-1] - 0.5 * head * way - across])
    at: dict[str, Any] = {"transform": canvas.scene, "zorder": FORCES}
    canvas.axes.add_collection(LineCollection([points], colors="#FFFFFF", linewidths=2.5 * WIDTH, **at))
    canvas.axes.add_collection(LineCollection([points], colors=COLOUR, linewidths=WIDTH, **at))
    canvas.axes.add_collection(PolyCollection([outline], facecolors=COLOUR, linewidths=0.0, **at))


def draw_marks(canvas: Canvas, marks: tuple[Mark, ...], offset: float = 0.0, *, up: float = 4.0) -> None:
    """Write marks with their arrows on a line above a panel: from `offset` right of its left end on, `up` above it.

    Both are in points.
    """
    for mark in marks:
        _draw_mark(canvas, mark, offset, up)
        offset += MARK_SIDE + MARK_LETTER * len(mark.text) + MARK_GAP


def _draw_mark(canvas: Canvas, mark: Mark, offset: float, up: float) -> None:
    scale = canvas.points_per_mm
    left, middle = canvas.extent.left + offset / scale, canvas.extent.top + (up + 5.0) / scale
    way = 0.5 * MARK / scale * np.array(mark.way)
    centre = np.array([left + 0.5 * MARK / scale, middle])
    if way.any():
        canvas.axes.annotate(
            "",
            xy=tuple(centre + way),
            xytext=tuple(centre - way),
            annotation_clip=False,
            arrowprops={
                "arrowstyle": "-|>",
                "shrinkA": 0.0,
                "shrinkB": 0.0,
                "mutation_scale": 6.0,
                "linewidth": WIDTH,
                "color": COLOUR,
            },
        )
    place = left + MARK_SIDE / scale, canvas.extent.top + up / scale
    canvas.axes.text(*place, mark.text, va="bottom", color=COLOUR)

"""Loads, the motion of driven bodies and of the support as data of the player, in millimetres."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from blocksim.scenario import Scenario
from blocksim.simulation.frames import Frames
from blocksim.simulation.happened import Happened
from blocksim.view.loads import SPEED, Arrows, Mark, Turns, length_in, outside, with_room
from blocksim.view.report.packing import listed, pack
from blocksim.view.run_data import Indices, Support, support_of
from blocksim.view.window import MILLIMETRES, Extent, extent_of, turned

MOST_ARROWS = 200_000  # in all frames of a run


class PackedLoads(NamedTuple):
    """What acts from outside, for the page: plain values for JSON, the extent that holds it too, notes."""

    data: dict[str, Any]
    extent: Extent
    notes: list[str]


def pack_loads(frames: Frames, scenario: Scenario, kept: Indices, happened: Sequence[Happened]) -> PackedLoads | None:
    """Return what acts from outside in some frames, with the extent that holds it; None where nothing does.

    The support's displacement is told beside loads on all blocks, as level ground looks the same wherever it is.
    """
    support = support_of(scenario, happened)
    acts, extent = outside(frames, kept, support), extent_of(frames, kept, support)
    length = length_in(extent)
    marks = [*map(list, acts.marks)]
    for row, moved in zip(marks, support.displacement(frames.time[kept]) if support.motion else (), strict=False):
        row.append(_mark_of_support(float(moved), support))
    if acts.is_empty and not any(marks):
        return None
    notes = list(filter(None, [replace(acts, marks=()).explanation]))
    arrows = acts.arrows
    if sum(one.ends_there.size for one in arrows) > MOST_ARROWS:
        arrows, notes = (), ["Loads on blocks are not drawn in this page: there are too many."]
    data = {
        "arrows": [_arrows(one, length) for one in arrows if one.way.any()],
        "turns": None if acts.turns is None else _turns(acts.turns),
        "marks": [[[mark.text, *mark.way] for mark in row] for row in marks],
    }
    return PackedLoads(data, with_room(extent, replace(acts, arrows=arrows), length), notes)


def _mark_of_support(moved: float, support: Support) -> Mark:
    """Return the displacement (m) of the support and its direction in the picture."""
    text = f"support {MILLIMETRES * moved:+.2f} mm".replace("-", "−")
    x, y = turned(np.sign(moved) * np.array(support.direction), support.tilt).tolist()
    return Mark(text, (x, y))


def _arrows(one: Arrows, length: float) -> dict[str, Any]:
    lines = one.lines(length)
    ends = {"x0": lines[..., 0, 0], "y0": lines[..., 0, 1], "x1": lines[..., 1, 0], "y1": lines[..., 1, 1]}
    packed = {name: pack(values, exact=True)[0] for name, values in ends.items()}
    return {"colour": "ink" if one.kind == SPEED else "load", "count": lines.shape[1], **packed}


def _turns(turns: Turns) -> dict[str, Any]:
    columns = {"x": turns.at[..., 0], "y": turns.at[..., 1], "sweep": turns.sweep}
    packed = {name: pack(values, exact=True)[0] for name, values in columns.items()}
    return {"radius": listed(turns.radius), **packed}

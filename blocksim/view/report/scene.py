"""Surroundings of the blocks in the player: ground, walls, the part of the plane that is shown. Millimetres."""

from typing import Any

import numpy as np

from blocksim.scenario import Scenario
from blocksim.simulation.frames import Frames
from blocksim.view import style
from blocksim.view.moments import Indices
from blocksim.view.report.particles import boundary_particles
from blocksim.view.support import support_of
from blocksim.view.window import MILLIMETRES, extent_of

ENDLESS_WIDTHS = 20.0  # of the shown part; how far level ground is drawn to either side


def scene_data(frames: Frames, scenario: Scenario, kept: Indices) -> dict[str, Any]:
    """Return everything but the frames that the player needs, as plain values for JSON."""
    support = support_of(scenario)
    extent = extent_of(frames, kept, support)
    reach = ENDLESS_WIDTHS * (extent.width + extent.height) / MILLIMETRES
    fixed = support.fixed or (False,) * len(frames.names)
    return {
        "extent": [extent.left, extent.right, extent.bottom, extent.top],
        "tilt": support.tilt,
        "ground": (MILLIMETRES * support.line(reach)).round(4).tolist(),
        "walls": [[MILLIMETRES * end for end in (wall.x0, wall.y0, wall.x1, wall.y1)] for wall in support.walls],
        "offset": (MILLIMETRES * support.offset(frames.time[kept])).round(4).tolist() if support.motion else None,
        "fixed": [bool(flag) for flag in fixed],
        "colours": list(style.BLOCK_COLOURS),
        "particles": _particles(frames, scenario),
    }


def _particles(frames: Frames, scenario: Scenario) -> dict[str, Any] | None:
    """Return the outlines by particles, one for each pair of sides, and which of them every block has."""
    sides = np.stack([frames.size_x, frames.size_y], axis=-1)
    kinds, which = np.unique(sides, axis=0, return_inverse=True)
    outlines = [(MILLIMETRES * boundary_particles(scenario, *map(float, kind))).round(4).tolist() for kind in kinds]
    return {"outlines": outlines, "which": which.ravel().tolist()} if any(outlines) else None

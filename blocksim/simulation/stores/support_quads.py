"""Ground and walls as quadrilaterals, for programs that show cells: where they are at rest, and how they move."""

import numpy as np
from numpy.typing import NDArray

from blocksim.scenario import Scenario
from blocksim.scenario.motion import displacement_and_velocity, motion_direction, motion_pieces
from blocksim.scenario.segments import wall_segments
from blocksim.simulation.frames import Frames

Floats = NDArray[np.float64]

BEYOND = 2.0  # diagonals of the largest block; so far the ground reaches beyond all blocks
THICKNESS = 0.25  # of the smallest side of all blocks


def support_quads(scenario: Scenario, frames: Frames) -> Floats:
    """Return the corners (m, (q, 4, 2), counter-clockwise) of ground and walls at rest, in the frames' axes.

    Every straight piece of the ground is filled down to a common depth; a wall has a thickness behind its face.
    """
    thick = THICKNESS * float(min(frames.size_x.min(), frames.size_y.min()))
    line = _ground(scenario, frames)
    floor = float(line[:, 1].min()) - thick
    pieces = [(line[i], line[i + 1]) for i in range(len(line) - 1) if line[i + 1, 0] > line[i, 0]]
    ground = [[[x0, floor], [x1, floor], [x1, y1], [x0, y0]] for (x0, y0), (x1, y1) in pieces]
    return np.array([*ground, *_walls(scenario, thick)]).reshape(-1, 4, 2)


def support_motion(scenario: Scenario, times: Floats) -> tuple[Floats, Floats]:
    """Return displacement (m) and velocity (m/s) of ground and walls along x and y at these times (s), (n, 2) each."""
    if scenario.motion is None:
        return np.zeros((len(times), 2)), np.zeros((len(times), 2))
    along = motion_direction(scenario)
    displacement, velocity = displacement_and_velocity(motion_pieces(scenario), times)
    return np.multiply.outer(displacement, along), np.multiply.outer(velocity, along)


def _ground(scenario: Scenario, frames: Frames) -> Floats:
    """Return the line of the ground (m, (k, 2)) from left to right, beyond all blocks."""
    profile = np.array(scenario.ground.profile or ()).reshape(-1, 2)
    beyond = BEYOND * float(np.hypot(frames.size_x, frames.size_y).max())
    x = np.concatenate([profile[:, 0], frames.x[np.isfinite(frames.x)]])
    first, last = (profile[0, 1], profile[-1, 1]) if len(profile) else (0.0, 0.0)
    return np.concatenate([[[float(x.min()) - beyond, first]], profile, [[float(x.max()) + beyond, last]]])


def _walls(scenario: Scenario, thick: float) -> list[Floats]:
    quads = []
    for wall in wall_segments(scenario):
        start, end = np.array([wall.x0, wall.y0]), np.array([wall.x1, wall.y1])
        back = thick / wall.length * np.array([end[1] - start[1], start[0] - end[0]])  # the solid is on the right hand
        quads.append(np.array([start + back, end + back, end, start]))
    return quads

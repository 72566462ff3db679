"""Supports: the ground, its profile, walls and their prescribed motion, which holds for fixed blocks as well.

Where they are follows from the scenario at any time, so that frames and files keep nothing of them.
"""

import numpy as np

from blocksim.scenario import Scenario
from blocksim.scenario.motion import displacement_and_velocity, motion_direction, motion_pieces
from blocksim.scenario.placement import length_beside
from blocksim.scenario.segments import wall_segments
from blocksim.world.systems.system import Elements, Floats, Indices, Present, Quantity, System, Track

BEYOND = 2.0  # diagonals of the largest block; so far the ground reaches beyond all blocks
THICKNESS = 0.25  # of the smallest side of all blocks
CORNERS = tuple(Quantity(f"{axis}{corner}", "m") for corner in range(4) for axis in "xy")  # at rest
QUANTITIES = (Quantity("dx", "m"), Quantity("dy", "m"), Quantity("vx", "m/s"), Quantity("vy", "m/s"))


def _moved(track: Track, chosen: Indices) -> Floats:
    """Return the corners (m) of pieces of ground and walls in some frames, (f, b, 4, 2)."""
    at_rest = track.present.elements.constants.T.reshape(-1, 4, 2)
    offset = np.stack([track["dx"][chosen], track["dy"][chosen]], axis=-1)
    return np.asarray(at_rest + offset[:, :, None])


def _pieces(scenario: Scenario, blocks: Track) -> Elements:
    quads = support_quads(scenario, blocks)
    walls = len(wall_segments(scenario))
    names = (*("ground" for _ in range(len(quads) - walls)), *(f"wall {k}" for k in range(1, walls + 1)))
    return Elements(names, quads.reshape(-1, 8).T, np.zeros((len(QUANTITIES), len(quads))))


SUPPORTS = System(
    name="supports",
    element="support",
    quantities=QUANTITIES,
    constants=CORNERS,
    outputs=(),
    elements=lambda _: Elements((), np.zeros((len(CORNERS), 0)), np.zeros((len(QUANTITIES), 0))),
    state=lambda _, count: np.zeros((0, count)),
    outlines=_moved,
)


def supports_track(scenario: Scenario, blocks: Track, times: Floats) -> Track:
    """Return the supports of a run at these times (s), as far as its blocks reach."""
    elements = _pieces(scenario, blocks)
    motion = np.concatenate(support_motion(scenario, times), axis=1)
    values = np.repeat(motion[:, :, None], len(elements.names), axis=2)
    return Track(Present(SUPPORTS, elements), values)


def support_quads(scenario: Scenario, blocks: Track) -> Floats:
    """Return the corners (m, (q, 4, 2), counter-clockwise) of ground and walls at rest, in the frames' axes.

    Every straight piece of the ground is filled down to a common depth; a wall has a thickness behind its face.
    """
    thick = THICKNESS * length_beside(np.minimum(blocks["size_x"], blocks["size_y"]).min(initial=np.inf))
    line = _ground(scenario, blocks)
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


def _ground(scenario: Scenario, blocks: Track) -> Floats:
    """Return the line of the ground (m, (k, 2)) from left to right, beyond all blocks."""
    profile = np.array(scenario.ground.profile or ()).reshape(-1, 2)
    beyond = BEYOND * length_beside(np.hypot(blocks["size_x"], blocks["size_y"]).max(initial=-np.inf))
    x = np.concatenate([profile[:, 0], _places(scenario, blocks)])
    first, last = (profile[0, 1], profile[-1, 1]) if len(profile) else (0.0, 0.0)
    return np.concatenate([[[float(x.min()) - beyond, first]], profile, [[float(x.max()) + beyond, last]]])


def _places(scenario: Scenario, blocks: Track) -> Floats:
    """Return where (m) along x blocks have been, or where walls end if there are none."""
    found: Floats = blocks["x"][np.isfinite(blocks["x"])]
    if found.size:
        return found
    return np.array([x for wall in wall_segments(scenario) for x in (wall.x0, wall.x1)] or [0.0])


def _walls(scenario: Scenario, thick: float) -> list[Floats]:
    quads = []
    for wall in wall_segments(scenario):
        start, end = np.array([wall.x0, wall.y0]), np.array([wall.x1, wall.y1])
        back = thick / wall.length * np.array([end[1] - start[1], start[0] - end[0]])  # the solid is on the right hand
        quads.append(np.array([start + back, end + back, end, start]))
    return quads

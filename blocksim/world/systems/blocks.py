"""Blocks and their supports, which stand in the world of every scheme.

Blocks are rigid rectangles and convex polygons. Supports are the ground, its profile, walls and their prescribed
motion, which holds for fixed blocks as well; where they are follows from the scenario at any time, so that frames and
files keep nothing of them.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from blocksim.scenario import Model, PlacedBody, Scenario, motion, placement
from blocksim.world.systems import system

MILLI, DEGREES = 1e3, float(np.degrees(1.0))
# of the centre, the angle that of the body axes, counter-clockwise, never wrapped; sizes are along these axes
QUANTITIES = system.datasets(x="m", y="m", angle="rad", vx="m/s", vy="m/s", spin="rad/s")
CONSTANTS = system.datasets(size_x="m", size_y="m", depth="m", mass="kg", inertia="kg m2")


def kinetic_energy(track: system.Track) -> system.Floats:
    """Return the kinetic energies (J); those of fixed blocks too, which the ledger does not count."""
    speed_squared = track["vx"] ** 2 + track["vy"] ** 2
    return np.asarray(0.5 * (track["mass"] * speed_squared + track["inertia"] * track["spin"] ** 2))


def corners(track: system.Track, chosen: system.Indices) -> system.Floats:
    """Return the corners (m) of blocks in some frames, from the lower left one on, (f, b, 4, 2)."""
    local = system.local_corners(track["size_x"], track["size_y"], track.present.elements.outlines)
    return placed_points(local, track["x"][chosen], track["y"][chosen], track["angle"][chosen])


def placed_points(local: system.Floats, x: system.Floats, y: system.Floats, angle: system.Floats) -> system.Floats:
    """Turn and move points (..., b, k, 2) given along the axes of blocks (..., b), all m and rad."""
    cosine, sine = np.cos(angle)[..., None], np.sin(angle)[..., None]
    along = x[..., None] + cosine * local[..., 0] - sine * local[..., 1]
    up = y[..., None] + sine * local[..., 0] + cosine * local[..., 1]
    return np.stack([along, up], axis=-1)


def distinct(corners: system.Floats) -> system.Floats:
    """Return the corners (k, 2) of one block without repetitions of the last one."""
    is_new = np.any(corners[1:] != corners[:-1], axis=-1)
    return np.asarray(corners[: 1 + int(is_new.sum())])


def boxes_around(
    corners: system.Floats, x: system.Floats, y: system.Floats, cosine: system.Floats, sine: system.Floats
) -> tuple[system.Floats, system.Floats]:
    """Return the lower left and upper right corners (m, (..., b, 2)) of the boxes around turned blocks.

    `corners` (m, (..., b, k, 2)) are along the blocks' own axes, about centres x, y (m).
    """
    low, high = np.full((*x.shape, 2), np.inf), np.full((*x.shape, 2), -np.inf)
    for u, v in np.moveaxis(corners, (-2, -1), (0, 1)):  # corner by corner, as all of many frames take much memory
        corner = np.stack([x + (cosine * u - sine * v), y + (sine * u + cosine * v)], axis=-1)
        np.minimum(low, corner, out=low)
        np.maximum(high, corner, out=high)
    return low, high


def motion_of(bodies: Any) -> system.Floats:
    """Return the quantities (..., 6, b) of bodies (..., b): a removed one is where it was and has no velocity: NaN."""
    from blocksim.kernels.common.arrays import REMOVED  # noqa: PLC0415 - kernels, not for readers

    plain = bodies.view(np.ndarray)  # a record array takes five times as long for a field
    values = np.stack([plain[one.name] for one in QUANTITIES], axis=-2)
    is_gone = plain["is_moved"] == REMOVED
    if is_gone.any():
        values[..., 3:, :] = np.where(is_gone[..., None, :], np.nan, values[..., 3:, :])
    return values


def are_removed(vx: system.Floats) -> Any:
    """Return which blocks have been removed, given their velocities along x in frames (m/s)."""
    return np.isnan(vx)


BLOCKS = system.System(
    name="blocks",
    element="block",
    quantities=QUANTITIES,
    constants=CONSTANTS,
    outputs=(
        system.Channel("x", "m", "centre along the ground", "x_mm", MILLI),
        system.Channel("y", "m", "centre above the ground", "y_mm", MILLI),
        system.Channel(
            "rotation",
            "rad",
            "angle turned since the start, counter-clockwise positive, not wrapped",
            "rotation_deg",
            DEGREES,
            lambda track: track["angle"] - track.at_start("angle"),
        ),
        system.Channel("vx", "m/s", "velocity along the ground", "vx_mm_s", MILLI),
        system.Channel("vy", "m/s", "velocity normal to the ground", "vy_mm_s", MILLI),
        system.Channel("spin", "rad/s", "angular velocity", "spin_deg_s", DEGREES),
        system.Channel("kinetic_energy", "J", "kinetic energy", "kinetic_energy_J", formula=kinetic_energy),
    ),
    elements=lambda model: block_system(model.bodies).elements,
    state=lambda world, count: motion_of(world.bodies[:count]),
    outlines=corners,
)


def block_system(placed: Sequence[PlacedBody]) -> system.SystemInScene:
    """Return the blocks of a scene that were placed so."""
    constants = np.array([[getattr(body, one.name) for body in placed] for one in CONSTANTS], dtype=np.float64)
    start = np.array([[getattr(body, one.name) for body in placed] for one in QUANTITIES], dtype=np.float64)
    names = tuple(body.name for body in placed)
    return system.SystemInScene(BLOCKS, system.Elements(names, constants, start, placement.outlines_of(placed)))


BEYOND = 2.0  # diagonals of the largest block; so far the ground reaches beyond all blocks
THICKNESS = 0.25  # of the smallest side of all blocks
CORNERS = tuple(system.Dataset(f"{axis}{corner}", "m") for corner in range(4) for axis in "xy")  # at rest
SUPPORT_QUANTITIES = system.datasets(dx="m", dy="m", vx="m/s", vy="m/s")


def _moved(track: system.Track, chosen: system.Indices) -> system.Floats:
    """Return the corners (m) of pieces of ground and walls in some frames, (f, b, 4, 2)."""
    at_rest = track.present.elements.constants.T.reshape(-1, 4, 2)
    offset = np.stack([track["dx"][chosen], track["dy"][chosen]], axis=-1)
    return np.asarray(at_rest + offset[:, :, None])


SUPPORTS = system.System(
    name="supports",
    element="support",
    quantities=SUPPORT_QUANTITIES,
    constants=CORNERS,
    outputs=(),
    elements=lambda _: system.Elements((), np.zeros((len(CORNERS), 0)), np.zeros((len(SUPPORT_QUANTITIES), 0))),
    state=lambda _, count: np.zeros((0, count)),
    outlines=_moved,
)


def supports_track(model: Model, blocks: system.Track, times: system.Floats) -> system.Track:
    """Return the supports of a run at these times (s), as far as its blocks reach."""
    quads, walls = support_quads(model.scenario, blocks), len(model.scenario.walls)
    names = (*["ground"] * (len(quads) - walls), *(f"wall {k}" for k in range(1, walls + 1)))
    elements = system.Elements(names, quads.reshape(-1, 8).T, np.zeros((len(SUPPORT_QUANTITIES), len(quads))))
    course = np.concatenate(support_motion(model, times), axis=1)
    values = np.repeat(course[:, :, None], len(names), axis=2)
    return system.Track(system.SystemInScene(SUPPORTS, elements), values)


def support_quads(scenario: Scenario, blocks: system.Track) -> system.Floats:
    """Return the corners (m, (q, 4, 2), counter-clockwise) of ground and walls at rest, in the frames' axes.

    Every straight piece of the ground is filled down to a common depth, and it reaches beyond all places where blocks
    have been, or beyond the ends of walls without any; a wall has a thickness behind its face.
    """
    walls = placement.wall_segments(scenario)
    thick = THICKNESS * placement.reference_length(np.minimum(blocks["size_x"], blocks["size_y"]).min(initial=np.inf))
    beyond = BEYOND * placement.reference_length(np.hypot(blocks["size_x"], blocks["size_y"]).max(initial=-np.inf))
    profile = np.array(scenario.ground.profile or ()).reshape(-1, 2)
    places = blocks["x"][np.isfinite(blocks["x"])]
    if not places.size:
        places = np.array([x for wall in walls for x in (wall.x0, wall.x1)] or [0.0])
    x = np.concatenate([profile[:, 0], places])
    first, last = (profile[0, 1], profile[-1, 1]) if len(profile) else (0.0, 0.0)
    line = np.concatenate([[[float(x.min()) - beyond, first]], profile, [[float(x.max()) + beyond, last]]])
    floor = float(line[:, 1].min()) - thick
    quads = [[[x0, floor], [x1, floor], [x1, y1], [x0, y0]] for (x0, y0), (x1, y1) in pairwise(line) if x1 > x0]
    for wall in walls:
        start, end = np.array([wall.x0, wall.y0]), np.array([wall.x1, wall.y1])
        back = thick / wall.length * np.array([end[1] - start[1], start[0] - end[0]])  # the solid is on the right hand
        quads.append([one.tolist() for one in (start + back, end + back, end, start)])
    return np.array(quads).reshape(-1, 4, 2)


def support_motion(model: Model, times: system.Floats) -> tuple[system.Floats, system.Floats]:
    """Return displacement (m) and velocity (m/s) of ground and walls along x and y at these times (s), (n, 2) each."""
    if model.scenario.motion is None:
        return np.zeros((len(times), 2)), np.zeros((len(times), 2))
    along = motion.motion_direction(model.scenario)
    displacement, velocity = motion.displacement_and_velocity(model.motion, times)
    return np.multiply.outer(displacement, along), np.multiply.outer(velocity, along)

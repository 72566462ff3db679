"""Blocks: rigid rectangles and convex polygons that stand in the world of every scheme."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from blocksim.scenario import PlacedBody, Scenario, place_bodies
from blocksim.world.systems.system import Elements, Floats, Indices, Output, Present, Quantity, System, Track, stored

MILLI, DEGREES = 1e3, float(np.degrees(1.0))
QUANTITIES = (
    Quantity("x", "m"),  # centre
    Quantity("y", "m"),
    Quantity("angle", "rad"),  # of the body axes, counter-clockwise, never wrapped
    Quantity("vx", "m/s"),
    Quantity("vy", "m/s"),
    Quantity("spin", "rad/s"),
)
CONSTANTS = (
    Quantity("size_x", "m"),  # along the body's own axes
    Quantity("size_y", "m"),
    Quantity("depth", "m"),
    Quantity("mass", "kg"),
    Quantity("inertia", "kg m2"),
)
UNIT_CORNERS = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])


def rotation(track: Track) -> Floats:
    """Return the angles turned since the start (rad)."""
    return np.asarray(track["angle"] - track.at_start("angle"))


def kinetic_energy(track: Track) -> Floats:
    """Return the kinetic energies (J); those of fixed blocks too, which the ledger does not count."""
    speed_squared = track["vx"] ** 2 + track["vy"] ** 2
    return np.asarray(0.5 * (track["mass"] * speed_squared + track["inertia"] * track["spin"] ** 2))


def corners(track: Track, chosen: Indices) -> Floats:
    """Return the corners (m) of blocks in some frames, from the lower left one on, (f, b, 4, 2)."""
    local = local_corners(track["size_x"], track["size_y"], track.present.elements.outlines)
    return placed_points(local, track["x"][chosen], track["y"][chosen], track["angle"][chosen])


def local_corners(size_x: Floats, size_y: Floats, outlines: Floats | None) -> Floats:
    """Return the corners (m) of blocks along their own axes, counter-clockwise, (b, k, 2).

    A rectangle (4 corners) begins at its lower left one. Where there are `outlines` they are returned as they are: a
    block with fewer corners than others has its last one several times.
    """
    if outlines is not None:
        return outlines
    return np.asarray(UNIT_CORNERS * np.stack([size_x, size_y], axis=-1)[:, None])


def placed_points(local: Floats, x: Floats, y: Floats, angle: Floats) -> Floats:
    """Turn and move points (..., b, k, 2) given along the axes of blocks (..., b), all m and rad."""
    cosine, sine = np.cos(angle)[..., None], np.sin(angle)[..., None]
    along = x[..., None] + cosine * local[..., 0] - sine * local[..., 1]
    up = y[..., None] + sine * local[..., 0] + cosine * local[..., 1]
    return np.stack([along, up], axis=-1)


def distinct(corners: Floats) -> Floats:
    """Return the corners (k, 2) of one block without repetitions of the last one."""
    is_new = np.any(corners[1:] != corners[:-1], axis=-1)
    return np.asarray(corners[: 1 + int(is_new.sum())])


def boxes_around(outlines: Floats, x: Floats, y: Floats, angle: Floats) -> tuple[Floats, Floats]:
    """Return the lower left and upper right corners (m, (..., b, 2)) of the boxes around turned polygons."""
    cosine, sine = np.cos(angle), np.sin(angle)
    low, high = np.full((*x.shape, 2), np.inf), np.full((*x.shape, 2), -np.inf)
    for u, v in np.moveaxis(outlines, (-2, -1), (0, 1)):  # corner by corner, as all of many frames take much memory
        corner = np.stack([x + cosine * u - sine * v, y + sine * u + cosine * v], axis=-1)
        np.minimum(low, corner, out=low)
        np.maximum(high, corner, out=high)
    return low, high


def least_widths(size_x: Floats, size_y: Floats, outlines: Floats | None) -> Floats:
    """Return the smaller sides (m) of blocks, of polygons the least distance of parallel lines around them, (b,)."""
    if outlines is None:
        return np.minimum(size_x, size_y)
    edges = np.roll(outlines, -1, axis=1) - outlines
    lengths = np.hypot(edges[..., 0], edges[..., 1])
    is_edge = lengths > 0.0
    normals = np.stack([edges[..., 1], -edges[..., 0]], axis=-1) / np.where(is_edge, lengths, 1.0)[..., None]
    heights = np.einsum("bec,bkc->bek", normals, outlines)
    return np.asarray(np.where(is_edge, np.ptp(heights, axis=2), np.inf).min(axis=1))


def radii(size_x: Floats, size_y: Floats, outlines: Floats | None) -> Floats:
    """Return the distances (m) of the farthest corners of blocks from their centroids, (b,)."""
    if outlines is None:
        return np.asarray(0.5 * np.hypot(size_x, size_y))
    return np.asarray(np.hypot(outlines[..., 0], outlines[..., 1]).max(axis=1))


def outlines_of(placed: Sequence[PlacedBody]) -> Floats | None:
    """Return the corners (m, (b, k, 2)) of blocks as `local_corners` takes them; None where all are rectangles."""
    if not any(body.outline for body in placed):
        return None
    most = max(len(body.corners) for body in placed)
    full = [(*body.corners, *body.corners[-1:] * (most - len(body.corners))) for body in placed]
    return np.array(full, dtype=np.float64)


def elements_of(placed: Sequence[PlacedBody]) -> Elements:
    """Return what blocks are that were placed so."""
    constants = np.array([[getattr(body, one.name) for body in placed] for one in CONSTANTS], dtype=np.float64)
    start = np.array([[getattr(body, one.name) for body in placed] for one in QUANTITIES], dtype=np.float64)
    return Elements(tuple(body.name for body in placed), constants, start, outlines_of(placed))


def _elements(scenario: Scenario) -> Elements:
    return elements_of(place_bodies(scenario))


def motion_of(bodies: Any) -> Floats:
    """Return the quantities (..., 6, b) of bodies (..., b): a removed one is where it was and has no velocity: NaN."""
    from blocksim.kernels.common.arrays import REMOVED  # noqa: PLC0415 - kernels, not for readers

    plain = bodies.view(np.ndarray)  # a record array takes five times as long for a field
    values = np.stack([plain[one.name] for one in QUANTITIES], axis=-2)
    is_gone = plain["is_moved"] == REMOVED
    if is_gone.any():
        values[..., 3:, :] = np.where(is_gone[..., None, :], np.nan, values[..., 3:, :])
    return values


def are_removed(vx: Floats) -> Any:
    """Return which blocks have been removed, given their velocities along x in frames (m/s)."""
    return np.isnan(vx)


def _state(world: Any, count: int) -> Floats:
    return motion_of(world.bodies[:count])


BLOCKS = System(
    name="blocks",
    element="block",
    quantities=QUANTITIES,
    constants=CONSTANTS,
    outputs=(
        Output("x", "m", "centre along the ground", "x_mm", stored("x"), MILLI),
        Output("y", "m", "centre above the ground", "y_mm", stored("y"), MILLI),
        Output(
            "rotation",
            "rad",
            "angle turned since the start, counter-clockwise positive, not wrapped",
            "rotation_deg",
            rotation,
            DEGREES,
        ),
        Output("vx", "m/s", "velocity along the ground", "vx_mm_s", stored("vx"), MILLI),
        Output("vy", "m/s", "velocity normal to the ground", "vy_mm_s", stored("vy"), MILLI),
        Output("spin", "rad/s", "angular velocity", "spin_deg_s", stored("spin"), DEGREES),
        Output("kinetic_energy", "J", "kinetic energy", "kinetic_energy_J", kinetic_energy),
    ),
    elements=_elements,
    state=_state,
    outlines=corners,
)


def blocks_placed(placed: Sequence[PlacedBody]) -> Present:
    """Return the blocks of a scene that were placed so."""
    return Present(BLOCKS, elements_of(placed))

"""Data of the player: frames as text that a page can carry, contact forces, and the surroundings of the blocks.

Frames are thinned where there are too many, and rounded where they are large. Lengths in millimetres.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from blocksim.scenario import Scenario
from blocksim.simulation.frames import Frames
from blocksim.simulation.happened import Happened
from blocksim.view import style
from blocksim.view.forces import force_scale, pushing_up
from blocksim.view.report.elements import element_bytes, pack_systems
from blocksim.view.report.packing import EXACT_VALUES, SHORT_BYTES, listed, pack
from blocksim.view.run_data import Floats, Indices, drawable_frames, shortest_sides, support_of
from blocksim.view.scene import upper_sides
from blocksim.view.window import MILLIMETRES, extent_of
from blocksim.world.systems.blocks import are_removed, distinct

MOST_BYTES = 12_000_000  # of the frames of one run, before they become text, which takes a third more
CONTACT_BYTES = 16  # of a contact in a frame
CHANNELS = {"x": "mm", "y": "mm", "rotation": "deg", "vx": "mm/s", "vy": "mm/s", "spin": "deg/s"}

ENDLESS_WIDTHS = 20.0  # of the shown part; how far level ground is drawn to either side

ROUND_OFF = 1e-12


@dataclass(frozen=True)
class Packed:
    """Frames for the page: `data` is plain values for JSON; the errors are the largest of rounding, by channel."""

    data: dict[str, Any]
    kept: int
    recorded: int
    errors: dict[str, float]

    @property
    def notes(self) -> list[str]:
        """Losses of thinning and rounding, in sentences."""
        errors = [f"{name} {error:.1g} {CHANNELS[name]}" for name, error in self.errors.items()]
        thinned = "all" if self.kept == self.recorded else "evenly thinned"
        return [
            f"{self.kept} of {self.recorded} recorded frames are in this page ({thinned}).",
            f"Largest rounding error of a value: {', '.join(errors)}.",
        ]


def pack_frames(frames: Frames, most_bytes: int = MOST_BYTES) -> Packed:
    """Return the drawable frames in mm and degrees. Raises InvalidInputError when there is none."""
    kept = frame_indices(frames, most_bytes)
    lengths = {name: MILLIMETRES * getattr(frames, name)[kept] for name in ("x", "y", "vx", "vy")}
    turns = {name: np.degrees(getattr(frames, name)[kept]) for name in ("rotation", "spin")}
    packed = {name: pack({**lengths, **turns}[name]) for name in CHANNELS}
    data = {
        "time": pack(frames.time[kept], exact=True)[0],
        "names": list(frames.names),
        "size_x": listed(MILLIMETRES * frames.size_x),
        "size_y": listed(MILLIMETRES * frames.size_y),
        "outlines": _outlines(frames),
        "start_angle": listed(np.degrees(frames.start_angle)),
        "channels": {name: part for name, (part, _) in packed.items()},
        "systems": pack_systems(frames, kept),
    }
    return Packed(data, len(kept), len(frames), {name: error for name, (_, error) in packed.items()})


def frame_indices(frames: Frames, most_bytes: int = MOST_BYTES) -> Indices:
    """Return the frames that `pack_frames` keeps: evenly chosen, first and last included, as many as fit."""
    contacts, blocks, drawable = frames.contacts, len(frames.names), drawable_frames(frames)
    more = 0 if contacts is None else CONTACT_BYTES * len(contacts.rows) // len(contacts)
    bytes_each = (4 if len(drawable) * blocks <= EXACT_VALUES else SHORT_BYTES) * blocks * len(CHANNELS)
    most = max(2, most_bytes // max(1, bytes_each + more + element_bytes(frames, drawable)))
    if len(drawable) <= most or not blocks:
        return drawable
    return drawable[np.unique(np.rint(np.linspace(0.0, len(drawable) - 1.0, most)).astype(np.intp))]


def pack_forces(frames: Frames, kept: Indices, tilt: float) -> dict[str, Any] | None:
    """Return the contacts of some frames: places (mm) and forces (N), each on the upper block.

    `ends` counts contacts up to and with each frame; `scale` is mm for a newton, and `longest` (mm) where arrows are
    cut. None where no contacts were stored.
    """
    if frames.contacts is None:
        return None
    tables = [frames.contacts.at(int(frame)) for frame in kept]
    rows, ends = np.concatenate(tables), np.cumsum([len(table) for table in tables]).tolist()
    forces, scale = pushing_up(rows, tilt), force_scale(frames)
    columns = {"x": MILLIMETRES * rows["x"], "y": MILLIMETRES * rows["y"], "fx": forces[:, 0], "fy": forces[:, 1]}
    return {
        "ends": ends,
        "scale": float(f"{scale.mm_per_newton:.5g}"),
        "longest": float(f"{scale.longest:.5g}"),
        "told": scale.explanation,
        **{name: pack(values, exact=True)[0] for name, values in columns.items()},
    }


def _outlines(frames: Frames) -> dict[str, Any] | None:
    """Return corners, upper side and least width (mm) of every shape, and which of them each block has.

    None where all blocks are rectangles, whose sides tell the same.
    """
    if frames.outlines is None:
        return None
    kinds, first, which = np.unique(frames.outlines, axis=0, return_index=True, return_inverse=True)
    uppers, widths = MILLIMETRES * upper_sides(frames)[first], MILLIMETRES * shortest_sides(frames)[first]
    return {
        "corners": [[listed(corner) for corner in MILLIMETRES * distinct(kind)] for kind in kinds],
        "upper": [[listed(end) for end in upper] for upper in uppers],
        "width": listed(widths),
        "which": which.ravel().tolist(),
    }


def scene_data(frames: Frames, scenario: Scenario, kept: Indices, happened: Sequence[Happened] = ()) -> dict[str, Any]:
    """Return everything but the frames that the player needs, as plain values for JSON.

    `gone` and `walls_gone` say from which of the kept frames on a block or wall is not there any more, None for never.
    """
    support = support_of(scenario, happened)
    extent = extent_of(frames, kept, support)
    reach = ENDLESS_WIDTHS * (extent.width + extent.height) / MILLIMETRES
    fixed = support.fixed or (False,) * len(frames.names)
    return {
        "extent": [extent.left, extent.right, extent.bottom, extent.top],
        "tilt": support.tilt,
        "ground": (MILLIMETRES * support.line(reach)).round(4).tolist(),
        "walls": [[MILLIMETRES * end for end in (wall.x0, wall.y0, wall.x1, wall.y1)] for wall in support.walls],
        "gone": _first(are_removed(frames.vx[kept])),
        "walls_gone": _first(frames.time[kept][:, None] >= np.array(support.gone).reshape(1, -1)),
        "offset": (MILLIMETRES * support.offset(frames.time[kept])).round(4).tolist() if support.motion else None,
        "fixed": [bool(flag) for flag in fixed],
        "colours": list(style.BLOCK_COLOURS),
        "particles": _particles(frames, scenario),
    }


def _first(flags: NDArray[np.bool_]) -> list[int | None]:
    """Return the first frame with a flag for each column of (n, b), None where there is none."""
    firsts = np.where(flags.any(axis=0), flags.argmax(axis=0), -1).tolist()
    return [None if first < 0 else first for first in firsts]


def _particles(frames: Frames, scenario: Scenario) -> dict[str, Any] | None:
    """Return the outlines by particles, one for each pair of sides, and which of them every block has."""
    sides = np.stack([frames.size_x, frames.size_y], axis=-1)
    kinds, which = np.unique(sides, axis=0, return_inverse=True)
    outlines = [(MILLIMETRES * boundary_particles(scenario, *map(float, kind))).round(4).tolist() for kind in kinds]
    return {"outlines": outlines, "which": which.ravel().tolist()} if any(outlines) else None


def boundary_particles(scenario: Scenario, size_x: float, size_y: float) -> Floats:
    """Return the particles along the edges of a block of these sides (m), in its own axes (m), (k, 2); drawn only.

    The sides are divided as when the world is built: equal intervals, none longer than the spacing. Discs lie inset by
    half of it, the rows of the kernel model on the edge itself; the surface model has none.
    """
    contact = scenario.contact
    if contact.model == "surface":
        return np.zeros((0, 2))
    inset = 0.0 if contact.model == "kernel" else 0.5 * contact.particle_spacing
    half = np.array([0.5 * size_x - inset, 0.5 * size_y - inset])
    corners = half * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    intervals = 2.0 * np.array([*half, *half]) / contact.particle_spacing * (1.0 - ROUND_OFF)
    sides = [
        start + (end - start) * (np.arange(count) / count)[:, None]
        for start, end, count in zip(corners, np.roll(corners, -1, axis=0), np.ceil(intervals).clip(1.0), strict=True)
    ]
    return np.concatenate(sides)

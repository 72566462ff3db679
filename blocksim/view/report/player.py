"""Data of the player: frames, forces, loads, further systems and surroundings, as text that a page can carry."""

import base64
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.scenario import Scenario
from blocksim.simulation.frames import Frames
from blocksim.simulation.result import EventRecord
from blocksim.view import style
from blocksim.view.arrows import SPEED, Arrows, Mark, Turns, force_scale, length_in, outside, pushing_up, with_room
from blocksim.view.paint import ELEMENT_COLOURS, capped_scale
from blocksim.view.run_data import (
    MILLIMETRES,
    Extent,
    Floats,
    Indices,
    Support,
    drawable_frames,
    extent_of,
    rotate_points,
    shortest_sides,
    support_of,
)
from blocksim.view.scene import upper_sides
from blocksim.world.systems.blocks import are_removed, distinct
from blocksim.world.systems.system import Track

EXACT_VALUES = 200_000  # up to so many values are kept as 32-bit floats
LEVELS = 65_535  # steps of a rounded value
SHORT_BYTES = 2


def pack(values: Floats, *, exact: bool = False) -> tuple[dict[str, Any], float]:
    """Return values as base64 text with the range they are rounded in, and the largest error of that.

    Few values, or all with `exact`, become 32-bit floats; many become 16-bit steps between smallest and largest.
    Values that are not finite stay what they are, or become 0 in steps.
    """
    if exact or values.size <= EXACT_VALUES:
        floats = values.astype("<f4")
        return {"type": "f4", "data": _text(floats)}, _largest(floats.astype(float) - values)
    finite = np.nan_to_num(values, nan=0.0, posinf=0.0, neginf=0.0)
    low, high = float(finite.min()), float(finite.max())
    step = (high - low) / LEVELS or 1.0
    steps = np.rint((finite - low) / step).astype("<u2")
    return {"type": "u2", "low": low, "step": step, "data": _text(steps)}, _largest(low + step * steps - values)


def listed(values: Floats) -> list[float]:
    """Return a few values as plain numbers of seven digits."""
    return [float(f"{value:.7g}") for value in values]


def _largest(errors: Floats) -> float:
    finite = np.abs(errors[np.isfinite(errors)])
    return float(finite.max()) if finite.size else 0.0


def _text(values: NDArray[Any]) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode("ascii")


STEPS = 24  # of the colours of elements: each is one path of the canvas
SAME_SHAPE = 1e-6  # of its size, by which corners of an outline that only moves may be off


def element_bytes(frames: Frames, drawable: Indices) -> int:
    """Return about how many bytes the elements of all systems take in one frame."""
    ends = drawable[[0, -1]]
    tracks = frames.others
    return sum(SHORT_BYTES * (_numbers(track, ends) + len(track.system.shades)) * len(track.names) for track in tracks)


def _numbers(track: Track, ends: Indices) -> int:
    """Return how many numbers an element has in a frame, judged by two of them."""
    outlines = np.concatenate([_outlines(track, frame) for frame in ends])
    return 2 if _only_move(outlines.reshape(len(ends), -1, *outlines.shape[1:])) else 2 * outlines.shape[1]


def _outlines(track: Track, frame: int) -> Floats:
    """Return the outlines (mm) in one frame, (b, k, 2)."""
    return np.asarray(MILLIMETRES * track.system.outlines(track, np.array([frame]))[0])


def _only_move(outlines: Floats) -> bool:
    """Return True if no element turns or changes its shape, (f, b, k, 2)."""
    shapes = outlines - outlines.mean(axis=2, keepdims=True)
    size = np.ptp(shapes[0], axis=(0, 1)).max(initial=0.0)
    return bool(np.abs(shapes - shapes[:1]).max(initial=0.0) <= SAME_SHAPE * size)


def pack_systems(frames: Frames, kept: Indices) -> list[dict[str, Any]]:
    """Return every system with its name, colour, number of elements and corners, and places in the kept frames.

    `x` and `y` are those of centres (f, b), with a `shape` of one outline for each element, or for all; without it
    those of all corners (f, b, k). `shades` are what elements can be coloured by: labels, values (f, b), and the value
    of the last of the `palette`.
    """
    return [
        {
            "name": track.system.name,
            "colour": style.block_colour(number),
            **_packed(track, kept),
            "shades": [
                {"label": shade.label, "high": capped_scale(shade.label, values).high, "values": pack(values)[0]}
                for shade in track.system.shades
                for values in [shade.of(track.some(kept))]
            ],
            "palette": palette() if track.system.shades else [],
        }
        for number, track in enumerate(frames.others, start=1)
    ]


def palette() -> list[str]:
    """Return the colours of elements, in even steps from none to most."""
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    return [to_hex(colour) for colour in colormaps[ELEMENT_COLOURS](np.linspace(0.0, 1.0, STEPS))]


def _packed(track: Track, kept: Indices) -> dict[str, Any]:
    first = _outlines(track, int(kept[0]))
    sizes = {"count": first.shape[0], "corners": first.shape[1]}
    places = np.empty((len(kept), *first.shape[:1], 2))
    for number, frame in enumerate(kept):
        outlines = _outlines(track, int(frame))
        if not _only_move(np.stack([first, outlines])):
            every = np.stack([_outlines(track, int(one)) for one in kept])
            return {**sizes, "shape": None, **_axes(every)}
        places[number] = outlines.mean(axis=1)
    shapes = first - first.mean(axis=1, keepdims=True)
    is_one = _only_move(np.stack([shapes, np.broadcast_to(shapes[:1], shapes.shape)]))
    return {**sizes, "shape": pack(shapes[:1] if is_one else shapes, exact=True)[0], **_axes(places)}


def _axes(places: Floats) -> dict[str, Any]:
    return {axis: pack(places[..., number])[0] for number, axis in enumerate(("x", "y"))}


MOST_ARROWS = 200_000  # in all frames of a run


class PackedLoads(NamedTuple):
    """What acts from outside, for the page: plain values for JSON, the extent that holds it too, notes."""

    data: dict[str, Any]
    extent: Extent
    notes: list[str]


def pack_loads(
    frames: Frames, scenario: Scenario, kept: Indices, happened: Sequence[EventRecord]
) -> PackedLoads | None:
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
    x, y = rotate_points(np.sign(moved) * np.array(support.direction), support.tilt).tolist()
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


MOST_BYTES = 12_000_000  # of the frames of one run, before they become text, which takes a third more
CONTACT_BYTES = 16  # of a contact in a frame
CHANNELS = {"x": "mm", "y": "mm", "rotation": "deg", "vx": "mm/s", "vy": "mm/s", "spin": "deg/s"}

ENDLESS_WIDTHS = 20.0  # of the shown part; how far level ground is drawn to either side

ROUND_OFF = 1e-12


@dataclass(frozen=True)
class PackedFrames:
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


def pack_frames(frames: Frames, most_bytes: int = MOST_BYTES) -> PackedFrames:
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
        "outlines": _outlines_player(frames),
        "start_angle": listed(np.degrees(frames.start_angle)),
        "channels": {name: part for name, (part, _) in packed.items()},
        "systems": pack_systems(frames, kept),
    }
    return PackedFrames(data, len(kept), len(frames), {name: error for name, (_, error) in packed.items()})


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


def _outlines_player(frames: Frames) -> dict[str, Any] | None:
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


def scene_data(
    frames: Frames, scenario: Scenario, kept: Indices, happened: Sequence[EventRecord] = ()
) -> dict[str, Any]:
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

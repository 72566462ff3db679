"""Data of the player: frames, forces, loads, further systems and surroundings, as text that a page can carry."""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.scenario import Model, Scenario
from blocksim.simulation import results, trajectory
from blocksim.view import arrows, paints, run_data, scene, style
from blocksim.view.run_data import MILLIMETRES, Extent, Floats, Indices
from blocksim.world.systems.blocks import are_removed, distinct
from blocksim.world.systems.system import Track

if TYPE_CHECKING:
    from blocksim.simulation.instruments import ProbeSeries

EXACT_VALUES = 200_000  # up to so many values are kept as 32-bit floats
LEVELS = 65_535  # steps of a rounded value
SHORT_BYTES = 2


def pack(values: Floats, *, exact: bool = False) -> tuple[dict[str, Any], float]:
    """Return values as base64 text with the range they are rounded in, and the largest error of that.

    Few values, or all with `exact`, become 32-bit floats; many become 16-bit steps between smallest and largest.
    Values that are not finite stay what they are, or become 0 in steps.
    """
    if exact or values.size <= EXACT_VALUES:
        kept: NDArray[Any] = values.astype("<f4")
        kind: dict[str, Any] = {"type": "f4"}
        back = kept.astype(float)
    else:
        finite = np.nan_to_num(values, nan=0.0, posinf=0.0, neginf=0.0)
        low, high = float(finite.min()), float(finite.max())
        step = (high - low) / LEVELS or 1.0
        kept = np.rint((finite - low) / step).astype("<u2")
        kind, back = {"type": "u2", "low": low, "step": step}, low + step * kept
    errors = np.abs(back - values)
    text = base64.b64encode(np.ascontiguousarray(kept).tobytes()).decode("ascii")
    return {**kind, "data": text}, float(errors[np.isfinite(errors)].max(initial=0.0))


def _exact(**columns: Floats) -> dict[str, Any]:
    """Return columns by name as 32-bit floats."""
    return {name: pack(values, exact=True)[0] for name, values in columns.items()}


def to_numbers(values: Floats) -> list[float]:
    """Return a few values as plain numbers of seven digits."""
    return [float(f"{value:.7g}") for value in values]


STEPS = 24  # of the colours of elements: each is one path of the canvas
SAME_SHAPE = 1e-6  # of its size, by which corners of an outline that only moves may be off


def element_bytes(frames: trajectory.Frames, drawable: Indices) -> int:
    """Return about how many bytes the elements of all systems take in one frame, judged by two of them."""
    total = 0
    for track in frames.others:
        outlines = np.stack([_outlines(track, int(frame)) for frame in drawable[[0, -1]]])
        numbers = 2 if _only_move(outlines) else 2 * outlines.shape[2]
        total += SHORT_BYTES * (numbers + len(track.system.shades)) * len(track.names)
    return total


def _outlines(track: Track, frame: int) -> Floats:
    """Return the outlines (mm) in one frame, (b, k, 2)."""
    return np.asarray(MILLIMETRES * track.system.outlines(track, np.array([frame]))[0])


def _only_move(outlines: Floats) -> bool:
    """Return True if no element turns or changes its shape, (f, b, k, 2)."""
    shapes = outlines - outlines.mean(axis=2, keepdims=True)
    size = np.ptp(shapes[0], axis=(0, 1)).max(initial=0.0)
    return bool(np.abs(shapes - shapes[:1]).max(initial=0.0) <= SAME_SHAPE * size)


def pack_systems(frames: trajectory.Frames, kept: Indices) -> list[dict[str, Any]]:
    """Return every system with its name, colour, number of elements and corners, and places in the kept frames.

    `x` and `y` are those of centres (f, b), with a `shape` of one outline for each element, or for all; without it
    those of all corners (f, b, k). `shades` are what elements can be coloured by: labels, values (f, b), and the value
    of the last of the `palette`.
    """
    from matplotlib import colormaps, colors

    palette = [colors.to_hex(colour) for colour in colormaps[paints.ELEMENT_COLOURS](np.linspace(0.0, 1.0, STEPS))]
    systems = []
    for number, track in enumerate(frames.others, start=1):
        shades = []
        for shade in track.system.shades:
            values = shade.of(track.some(kept))
            high = paints.scale_from_zero(shade.label, values).high
            shades.append({"label": shade.label, "high": high, "values": pack(values)[0]})
        look = {"name": track.system.name, "colour": style.block_colour(number)}
        systems.append({**look, **_places(track, kept), "shades": shades, "palette": palette if shades else []})
    return systems


def _places(track: Track, kept: Indices) -> dict[str, Any]:
    first = _outlines(track, int(kept[0]))
    shape, places = None, np.empty((len(kept), len(first), 2))
    for number, frame in enumerate(kept.tolist()):
        outlines = _outlines(track, frame)
        if not _only_move(np.stack([first, outlines])):
            places = np.stack([_outlines(track, one) for one in kept.tolist()])
            break
        places[number] = outlines.mean(axis=1)
    else:
        shapes = first - first.mean(axis=1, keepdims=True)
        is_one = _only_move(np.stack([shapes, np.broadcast_to(shapes[:1], shapes.shape)]))
        shape = pack(shapes[:1] if is_one else shapes, exact=True)[0]
    axes = {axis: pack(places[..., number])[0] for number, axis in enumerate(("x", "y"))}
    return {"count": first.shape[0], "corners": first.shape[1], "shape": shape, **axes}


def pack_loads(
    frames: trajectory.Frames,
    model: Model,
    kept: Indices,
    happened: Sequence[results.EventRecord],
    probes: "Mapping[str, ProbeSeries]",
) -> tuple[dict[str, Any], Extent, list[str]] | None:
    """Return what acts from outside in some frames, the extent that holds it, and notes; None where nothing does.

    The support's displacement is told beside loads on all blocks, as level ground looks the same wherever it is.
    """
    support = run_data.support_of(model, happened, probes)
    acts, extent = arrows.actions_on(frames, kept, support), run_data.extent_of(frames, kept, support)
    room, length = arrows.with_room(extent, acts)
    marks = [[[mark.text, *mark.way] for mark in row] for row in acts.marks]
    for row, moved in zip(marks, support.displacement(frames.time[kept]) if support.motion else (), strict=False):
        text = f"support {MILLIMETRES * moved:+.2f} mm".replace("-", "−")
        row.append([text, *run_data.rotate_points(np.sign(moved) * np.array(support.direction), support.tilt).tolist()])
    if not acts.arrows and acts.turns is None and not any(marks):
        return None
    notes = [note for note in [replace(acts, marks=()).explanation] if note]
    if sum(one.ends_there.size for one in acts.arrows) > 200_000:  # in all frames of a run
        acts, notes = replace(acts, arrows=()), ["Loads on blocks are not drawn in this page: there are too many."]
    shown: list[dict[str, Any]] = []
    for one in acts.arrows:
        if one.way.any():
            lines = one.lines(length)
            (x0, y0), (x1, y1) = np.moveaxis(lines, (2, 3), (0, 1))
            colour = "ink" if one.kind == arrows.SPEED else "load"
            shown.append({"colour": colour, "count": lines.shape[1], **_exact(x0=x0, y0=y0, x1=x1, y1=y1)})
    turns = acts.turns and {
        "radius": to_numbers(acts.turns.radius),
        **_exact(x=acts.turns.at[..., 0], y=acts.turns.at[..., 1], sweep=acts.turns.sweep),
    }
    return {"arrows": shown, "turns": turns, "marks": marks}, room if acts.arrows else extent, notes


MOST_BYTES = 12_000_000  # of the frames of one run, before they become text, which takes a third more
CHANNELS = {"x": "mm", "y": "mm", "rotation": "deg", "vx": "mm/s", "vy": "mm/s", "spin": "deg/s"}

ENDLESS_WIDTHS = 20.0  # of the shown part; how far level ground is drawn to either side

ROUND_OFF = 1e-12


class PackedFrames(NamedTuple):
    """Frames for the page: `data` is plain values for JSON, `kept` are those chosen, `notes` say what was lost."""

    data: dict[str, Any]
    kept: Indices
    notes: list[str]


def pack_frames(frames: trajectory.Frames, most_bytes: int = MOST_BYTES) -> PackedFrames:
    """Return the drawable frames in mm and degrees: evenly chosen, first and last included, as many as fit.

    Raises InvalidInputError when there is none.
    """
    contacts, blocks, kept = frames.contacts, len(frames.names), run_data.drawable_frames(frames)
    more = 0 if contacts is None else 16 * len(contacts.rows) // len(contacts)  # of a contact in a frame
    bytes_each = (4 if len(kept) * blocks <= EXACT_VALUES else SHORT_BYTES) * blocks * len(CHANNELS)
    most = max(2, most_bytes // max(1, bytes_each + more + element_bytes(frames, kept)))
    if len(kept) > most and blocks:
        kept = kept[np.unique(np.rint(np.linspace(0.0, len(kept) - 1.0, most)).astype(np.intp))]
    factors = {name: MILLIMETRES if unit.startswith("mm") else np.degrees(1.0) for name, unit in CHANNELS.items()}
    packed = {name: pack(factor * getattr(frames, name)[kept]) for name, factor in factors.items()}
    kinds, first, which = np.unique(frames.corners, axis=0, return_index=True, return_inverse=True)
    uppers = MILLIMETRES * scene.upper_sides(frames)[first]
    outlines = {
        "corners": [[to_numbers(corner) for corner in MILLIMETRES * distinct(kind)] for kind in kinds],
        "upper": [[to_numbers(end) for end in upper] for upper in uppers],
        "width": to_numbers(MILLIMETRES * frames.least_widths[first]),
        "which": which.ravel().tolist(),
    }
    data = {
        "time": pack(frames.time[kept], exact=True)[0],
        "names": list(frames.names),
        "outlines": outlines,
        "start_angle": to_numbers(np.degrees(frames.start_angle)),
        "channels": {name: part for name, (part, _) in packed.items()},
        "systems": pack_systems(frames, kept),
    }
    errors = [f"{name} {error:.1g} {CHANNELS[name]}" for name, (_, error) in packed.items()]
    thinned = "all" if len(kept) == len(frames) else "evenly thinned"
    notes = [
        f"{len(kept)} of {len(frames)} recorded frames are in this page ({thinned}).",
        f"Largest rounding error of a value: {', '.join(errors)}.",
    ]
    return PackedFrames(data, kept, notes)


def pack_forces(frames: trajectory.Frames, kept: Indices, tilt: float) -> dict[str, Any] | None:
    """Return the contacts of some frames: places (mm) and forces (N), each on the upper block.

    `ends` counts contacts up to and with each frame; `scale` is mm for a newton, and `longest` (mm) where arrows are
    cut. None where no contacts were stored.
    """
    if frames.contacts is None:
        return None
    tables = [frames.contacts.at(int(frame)) for frame in kept]
    rows, ends = np.concatenate(tables), np.cumsum([len(table) for table in tables]).tolist()
    forces, scale = arrows.forces_on_upper(rows, tilt), arrows.force_scale(frames)
    return {
        "ends": ends,
        "scale": float(f"{scale.mm_per_newton:.5g}"),
        "longest": float(f"{scale.longest:.5g}"),
        "told": scale.explanation,
        **_exact(x=MILLIMETRES * rows["x"], y=MILLIMETRES * rows["y"], fx=forces[:, 0], fy=forces[:, 1]),
    }


def scene_data(
    frames: trajectory.Frames, model: Model, kept: Indices, happened: Sequence[results.EventRecord] = ()
) -> dict[str, Any]:
    """Return everything but the frames that the player needs, as plain values for JSON.

    `gone` and `walls_gone` say from which of the kept frames on a block or wall is not there any more, None for never.
    """
    support = run_data.support_of(model, happened)
    extent = run_data.extent_of(frames, kept, support)
    reach = ENDLESS_WIDTHS * (extent.width + extent.height) / MILLIMETRES
    sides = np.stack([frames.size_x, frames.size_y], axis=-1)
    kinds, which = np.unique(sides, axis=0, return_inverse=True)
    particles = [
        (MILLIMETRES * boundary_particles(model.scenario, *map(float, kind))).round(4).tolist() for kind in kinds
    ]
    return {
        "extent": [extent.left, extent.right, extent.bottom, extent.top],
        "tilt": support.tilt,
        "ground": (MILLIMETRES * support.line(reach)).round(4).tolist(),
        "walls": [[MILLIMETRES * end for end in (wall.x0, wall.y0, wall.x1, wall.y1)] for wall in support.walls],
        "gone": _first(are_removed(frames.vx[kept])),
        "walls_gone": _first(frames.time[kept][:, None] >= np.array(support.gone).reshape(1, -1)),
        "offset": (MILLIMETRES * support.offset(frames.time[kept])).round(4).tolist() if support.motion else None,
        "fixed": run_data.is_fixed(frames, support).tolist(),
        "colours": list(style.BLOCK_COLOURS),
        "particles": {"outlines": particles, "which": which.ravel().tolist()} if any(particles) else None,
    }


def _first(flags: NDArray[np.bool_]) -> list[int | None]:
    """Return the first frame with a flag for each column of (n, b), None where there is none."""
    firsts = np.where(flags.any(axis=0), flags.argmax(axis=0), -1).tolist()
    return [None if first < 0 else first for first in firsts]


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

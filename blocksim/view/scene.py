"""One moment of a run as a drawing: support, numbered blocks, measured positions. Millimetres."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from blocksim.view import style
from blocksim.view.ground import draw_shift, draw_start, draw_support
from blocksim.view.paint import Paint
from blocksim.view.panel import Canvas
from blocksim.view.run_data import Floats, FramesLike, Support, corners_of, others_of, outlines_of, shortest_sides
from blocksim.view.window import MILLIMETRES
from blocksim.world.systems.blocks import are_removed, placed_points
from blocksim.world.systems.system import Track

Flags = NDArray[np.bool_]
EDGE_INSET = 0.86  # where the mark of the upper side runs, as a part of half the height
TOP = "Thick line inside a block: top face at the start."
NAME_ROOM = 0.85, 0.7  # width and height for a block's name, as parts of its smaller side
LEAST_SINE = 1e-9  # between two edges that are not parallel
LETTERS = 100  # of a name; longer ones have no room anywhere
FIXED_HATCH = "////"
HALO = 2.0  # points around a name, so that paths of centres do not strike through it
LEAST_HATCHED = 12.0  # points; on smaller blocks hatching is a few stray lines
SMALL, CLOSED = 6.0, 0.42  # points, of discs drawn without gaps; share of a size that closes those of a square lattice


@dataclass(frozen=True)
class MeasuredRange:
    """Measured centre of one block (mm) and the row below the ground it is drawn in."""

    block: str
    mean: float
    minimum: float
    maximum: float
    row: int


def corners(frames: FramesLike, frame: int) -> Floats:
    """Return the corners (mm) of every block in one frame, (b, k, 2), counter-clockwise, the last one repeated."""
    (found,) = corners_of(frames, np.array([frame]))
    return np.asarray(MILLIMETRES * found)


def readable_scale(frames: FramesLike) -> float:
    """Return the least scale (points a mm) at which the name of every block fits into it."""
    wide, tall = (letter * style.SMALLEST_FONT / room for letter, room in zip(style.LETTER, NAME_ROOM, strict=True))
    sizes = MILLIMETRES * shortest_sides(frames)
    lengths = np.array([len(name) for name in frames.names])
    return float((np.maximum(wide * lengths, tall) / sizes).max(initial=0.0))


@dataclass(frozen=True)
class Scene:
    """Frames of a run on their support, and the colours of the blocks.

    `with_tops` marks the top face that each free block had at the start, `with_others` draws the systems beside them.
    """

    frames: FramesLike
    support: Support
    paint: Paint
    with_tops: bool = True
    with_others: bool = True

    @property
    def fixed(self) -> Flags:
        """Whether each block is fixed or driven, (b,)."""
        return np.array(self.support.fixed or (False,) * len(self.frames.names), dtype=bool)


def draw_scene(canvas: Canvas, scene: Scene, frame: int) -> None:
    """Draw the support and the blocks of one frame."""
    draw_standing(canvas, scene, frame)
    draw_blocks(canvas, scene, frame)


def draw_standing(canvas: Canvas, scene: Scene, frame: int) -> None:
    """Draw ground and walls at the time of one frame, and where they were at the start."""
    frames = scene.frames
    offset = MILLIMETRES * scene.support.offset(frames.time[frame : frame + 1])[0]
    support = scene.support.at(float(frames.time[frame]))
    draw_support(canvas, support, offset)
    carried = scene.fixed & ~np.array(support.driven or (False,) * len(frames.names), dtype=bool)
    draw_start(canvas, support, offset, corners(frames, frame)[carried & are_there(frames, frame)])
    draw_shift(canvas, support, offset, MILLIMETRES * (float(frames.x[0].mean()) if frames.names else 0.0))


def draw_blocks(canvas: Canvas, scene: Scene, frame: int) -> None:
    """Draw the blocks of one frame with their names, free ones each in its colour, fixed ones hatched in the ground's.

    Other systems lie below the blocks, each in one colour, or each element in that of the paint.
    """
    from matplotlib.collections import LineCollection, PolyCollection

    frames, paint, fixed, there = scene.frames, scene.paint, scene.fixed, are_there(scene.frames, frame)
    for number, track in enumerate(others_of(frames) if scene.with_others else ()):
        of_elements = paint.elements[number] if number < len(paint.elements) else None
        _draw_system(
            canvas, track, frame, style.block_colour(number + 1) if of_elements is None else of_elements(frame)
        )
    fills = [style.GROUND_COLOUR if held else fill for held, fill in zip(fixed, paint.fills(frame), strict=True)]
    outlines = corners(frames, frame)
    smallest = MILLIMETRES * canvas.points_per_mm * float(shortest_sides(frames).min(initial=np.inf))
    thin = min(style.LINE_WIDTH, 0.05 * smallest)
    edge: dict[str, Any] = {"edgecolors": style.INK, "linewidths": thin, "transform": canvas.scene}
    hatch = FIXED_HATCH if smallest >= LEAST_HATCHED else None
    colours = [fill for fill, is_free in zip(fills, ~fixed & there, strict=True) if is_free]
    held = PolyCollection(list(outlines[fixed & there]), facecolors=style.GROUND_COLOUR, hatch=hatch, **edge)
    canvas.axes.add_collection(held)
    canvas.axes.add_collection(PolyCollection(list(outlines[~fixed & there]), facecolors=colours, **edge))
    if scene.with_tops:
        lines = placed_points(upper_sides(frames), frames.x[frame], frames.y[frame], frames.angle[frame])
        shown = list(MILLIMETRES * lines[~fixed & there])
        tops = LineCollection(shown, colors=style.INK, linewidths=2.0 * thin, transform=canvas.scene)
        canvas.axes.add_collection(tops)
    for kind in (fixed & there, ~fixed & there):
        _draw_names(canvas, frames, frame, kind, fills)


def _draw_system(canvas: Canvas, track: Track, frame: int, colours: str | Sequence[str]) -> None:
    """Draw the elements of a system in one frame; where each has a colour of its own, edges have it too."""
    from matplotlib.collections import PolyCollection

    (outlines,) = MILLIMETRES * outlines_of(track, np.array([frame]))
    size = canvas.points_per_mm * float(np.ptp(outlines[:, :, 0], axis=1).min(initial=1.0))
    thin = min(style.LINE_WIDTH, 0.05 * size)
    edges = style.INK if isinstance(colours, str) else "face"
    if edges == "face" and size < SMALL:  # gaps between small discs make a pattern that is none of the soil
        thin = CLOSED * size
    drawn = PolyCollection(list(outlines), facecolors=colours, edgecolors=edges, linewidths=thin)
    drawn.set_transform(canvas.scene)
    canvas.axes.add_collection(drawn)


def are_there(frames: FramesLike, frame: int) -> Flags:
    """Return for every block whether it has not been removed by a frame, (b,): what is not there has no velocity."""
    vx = getattr(frames, "vx", None)
    return np.ones(len(frames.names), dtype=bool) if vx is None else np.asarray(~are_removed(vx[frame]))


def draw_centres(canvas: Canvas, frames: FramesLike, frame: int) -> None:
    """Mark the centre of every block by a line through the ground below it."""
    for x in MILLIMETRES * frames.x[frame, are_there(frames, frame)]:
        ends = [canvas.floor, canvas.extent.base]
        canvas.axes.plot([x, x], ends, color=style.INK, linewidth=1.2, transform=canvas.scene)


def draw_measured(canvas: Canvas, measured: list[MeasuredRange], row_height: float) -> None:
    """Draw measured mean and range of each block in rows of `row_height` (points) below the ground."""
    line: dict[str, Any] = {"color": style.MEASURED_COLOUR, "transform": canvas.scene}
    for item in measured:
        y = canvas.floor - (item.row + 0.6) * row_height / canvas.points_per_mm
        cap = 2.2 / canvas.points_per_mm
        canvas.axes.plot([item.minimum, item.maximum], [y, y], linewidth=1.2, **line)
        for end in (item.minimum, item.maximum):
            canvas.axes.plot([end, end], [y - cap, y + cap], linewidth=1.2, **line)
        canvas.axes.plot(item.mean, y, marker="o", markersize=3.2, **line)
        font = style.fitting_font(item.block, (30.0, row_height), 6.0)
        if font:
            canvas.axes.text(
                item.maximum + 3.0 / canvas.points_per_mm,
                y,
                style.shortened(item.block, LETTERS),
                fontsize=font,
                rotation=float(np.degrees(canvas.extent.tilt)),
                rotation_mode="anchor",
                va="center",
                **line,
            )


def _draw_names(canvas: Canvas, frames: FramesLike, frame: int, chosen: Flags, fills: Sequence[str]) -> None:
    """Write the names of some blocks at their middles, of polygons their centroids, where there is room for all.

    Names on some blocks only would look like a difference between the blocks.
    """
    from matplotlib.patheffects import withStroke

    sizes = MILLIMETRES * canvas.points_per_mm * shortest_sides(frames)
    fonts = {
        int(index): style.fitting_font(frames.names[index], (NAME_ROOM[0] * sizes[index], NAME_ROOM[1] * sizes[index]))
        for index in np.flatnonzero(chosen)
    }
    if not all(fonts.values()):
        return
    places = MILLIMETRES * np.stack([frames.x[frame], frames.y[frame]], axis=-1)
    if frames.outlines is None:
        places = corners(frames, frame).mean(axis=1)
    for index, font in fonts.items():
        canvas.axes.text(
            float(places[index, 0]),
            float(places[index, 1]),
            style.shortened(frames.names[index], LETTERS),
            fontsize=font,
            color=style.text_colour(fills[index]),
            ha="center",
            va="center_baseline",
            clip_on=True,
            transform=canvas.scene,
            path_effects=[withStroke(linewidth=HALO, foreground=fills[index])],
            bbox={"facecolor": fills[index], "linewidth": 0.0, "pad": 0.8}
            if fills[index] == style.GROUND_COLOUR
            else None,
        )


def upper_sides(frames: FramesLike) -> Floats:
    """Return a line inside each block along its upper side, which shows turns, in its own axes (m, (b, 2, 2))."""
    if frames.outlines is not None:
        return _upper_sides_of_polygons(frames.outlines, 0.5 * (1.0 - EDGE_INSET) * shortest_sides(frames))
    half_x, half_y = 0.5 * frames.size_x, 0.5 * frames.size_y
    inset = half_y - (1.0 - EDGE_INSET) * np.minimum(half_x, half_y)
    reach = half_x - (half_y - inset)
    return np.stack([np.stack([-reach, inset], axis=-1), np.stack([reach, inset], axis=-1)], axis=1)


def _upper_sides_of_polygons(outlines: Floats, inset: Floats) -> Floats:
    """Return the lines (m) that are an inset (m, (b,)) inside the edges whose normals point up most, and all others."""
    edges = np.roll(outlines, -1, axis=1) - outlines
    lengths = np.hypot(edges[..., 0], edges[..., 1])
    is_edge = lengths > 0.0
    normals = np.stack([edges[..., 1], -edges[..., 0]], axis=-1) / np.where(is_edge, lengths, 1.0)[..., None]
    depth = np.einsum("bec,bec->be", normals, outlines) - inset[:, None]
    blocks = np.arange(len(outlines))
    upper = np.argmax(np.where(is_edge, normals[..., 1], -np.inf), axis=1)
    normal = normals[blocks, upper]
    start = outlines[blocks, upper] - inset[:, None] * normal
    along = np.stack([-normal[:, 1], normal[:, 0]], axis=-1)
    across = np.einsum("bec,bc->be", normals, along)
    room = depth - np.einsum("bec,bc->be", normals, start)
    others = is_edge & (np.abs(across) > LEAST_SINE)
    shares = room / np.where(others, across, 1.0)
    last = np.where(others & (across > 0.0), shares, np.inf).min(axis=1)
    first = np.minimum(np.where(others & (across < 0.0), shares, -np.inf).max(axis=1), last)
    return np.asarray(start[:, None] + np.stack([first, last], axis=1)[..., None] * along[:, None])

"""One moment of a run as a drawing: canvas and axis, ground and walls, blocks with their names. Millimetres."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from blocksim.scenario import PlacedSegment
from blocksim.scenario.placement import TOLERANCE
from blocksim.view import style
from blocksim.view.paint import Paint
from blocksim.view.run_data import (
    MILLIMETRES,
    Extent,
    Floats,
    FramesLike,
    Support,
    corners_of,
    others_of,
    outlines_of,
    parts_within,
    rotate_points,
    shortest_sides,
)
from blocksim.world.systems.blocks import are_removed, placed_points
from blocksim.world.systems.system import Track

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.transforms import Transform


GROUND_THICKNESS = 5.0  # points, below the lowest ground
RULER_EDGE = 10.0  # points; no number is nearer to the edge of a panel
TICK_SPACING = 36.0  # points along the ruler
TICK_LENGTH = 2.5  # points
RULER_HEIGHT = 14.0  # points, with the numbers
TICK_ROOM = 0.4  # inches along the axis for one number
ROW_HEIGHT = 9.0  # points, of one row of measured ranges


@dataclass(frozen=True)
class Canvas:
    """Canvas of one moment: axes in the picture's millimetres, all on one scale."""

    axes: "Axes"
    extent: Extent
    points_per_mm: float

    @cached_property
    def scene(self) -> "Transform":
        """From the scene's millimetres to the paper."""
        from matplotlib.transforms import Affine2D

        return Affine2D().rotate(self.extent.tilt) + self.axes.transData

    @property
    def floor(self) -> float:
        """Where the drawn ground ends (mm, scene)."""
        return self.extent.base - GROUND_THICKNESS / self.points_per_mm

    def box(self) -> tuple[Floats, Floats]:
        """Return lower left and upper right (mm, scene) of all that can be seen, and a little more."""
        sides, ends = (self.extent.left, self.extent.right), (self.extent.lowest, self.extent.top)
        corners = rotate_points(np.array([[x, y] for x in sides for y in ends]), -self.extent.tilt)
        more = 0.1 * (self.extent.width + self.extent.height)
        low, high = corners.min(axis=0) - more, corners.max(axis=0) + more
        return np.array([low[0], self.floor]), high


@dataclass(frozen=True)
class Page:
    """A page with one panel as wide as the page allows, in inches; `points_per_mm` is the panel's scale."""

    width: float
    height: float
    panel_height: float
    side: float
    foot: float
    points_per_mm: float
    extent: Extent

    @property
    def panel_width(self) -> float:
        """Width of the panel."""
        return self.width - 2.0 * self.side

    @property
    def place(self) -> tuple[float, float, float, float]:
        """Return left, bottom, width, height of the panel as parts of the page."""
        across, up = self.width, self.height
        return self.side / across, self.foot / up, self.panel_width / across, self.panel_height / up


def page_for(extent: Extent, width: float, tallest: float, margins: tuple[float, float, float]) -> Page:
    """Return a page of this width for an extent, which is widened where the panel would be higher than `tallest`.

    `margins` are those at the sides, above and below the panel. All in inches.
    """
    side, head, foot = margins
    across = width - 2.0 * side
    missing = max(extent.height * across / tallest - extent.width, 0.0)
    extent = replace(extent, left=extent.left - 0.5 * missing, right=extent.right + 0.5 * missing)
    scale = across / extent.width  # inches per mm
    below = max((extent.lowest - extent.bottom) * scale, room_below(extent, 0) / style.POINTS_PER_INCH)
    panel_height = (extent.top - extent.lowest) * scale + below
    height = head + panel_height + foot
    return Page(width, height, panel_height, side, foot, scale * style.POINTS_PER_INCH, extent)


def depth_of(rows: int) -> float:
    """Return how far rows of measured ranges reach below the lowest ground (points)."""
    return GROUND_THICKNESS + (rows + 0.4) * ROW_HEIGHT


def room_below(extent: Extent, rows: int) -> float:
    """Return how far the picture continues below the lowest ground (points)."""
    depth = depth_of(rows)
    return (depth + RULER_HEIGHT) / float(np.cos(extent.tilt)) if extent.tilt else depth


def finish_panel(canvas: Canvas, size: tuple[float, float], *, labelled: bool) -> None:
    """Fix the scale of a panel of this size (inches) and leave only its x axis; tilted ground has its own ruler."""
    from matplotlib.ticker import MaxNLocator

    axes, extent = canvas.axes, canvas.extent
    axes.set_xlim(extent.left, extent.right)
    axes.set_ylim(extent.top - size[1] * style.POINTS_PER_INCH / canvas.points_per_mm, extent.top)
    axes.spines[["left", "right", "top"]].set_visible(False)
    axes.yaxis.set_visible(False)
    axes.xaxis.set_major_locator(MaxNLocator(nbins=max(2, int(size[0] / TICK_ROOM)), steps=[1, 2, 5, 10]))
    axes.tick_params(axis="x", length=2.5, pad=1.5)
    axes.xaxis.set_visible(not extent.tilt)
    axes.spines["bottom"].set_visible(not extent.tilt)
    if labelled:
        axes.set_xlabel("x (mm)", labelpad=1.0)


def draw_ruler(canvas: Canvas, depth: float) -> None:
    """Draw numbers of x (mm) along tilted ground, `depth` (points) below its lowest part."""
    from matplotlib.ticker import MaxNLocator

    y = canvas.extent.base - depth / canvas.points_per_mm
    low, high = canvas.extent.span(y)
    edge = RULER_EDGE / canvas.points_per_mm
    room = (high - low) * canvas.points_per_mm
    locator = MaxNLocator(nbins=max(2, int(room / TICK_SPACING)), steps=[1, 2, 5, 10])
    tick = TICK_LENGTH / canvas.points_per_mm
    canvas.axes.plot([low, high], [y, y], color=style.FAINT_INK, linewidth=style.LINE_WIDTH, transform=canvas.scene)
    ticks = [float(x) for x in locator.tick_values(low, high) if low + edge <= x <= high - edge]
    for x in ticks:
        colour, width = style.FAINT_INK, style.LINE_WIDTH
        canvas.axes.plot([x, x], [y - tick, y], color=colour, linewidth=width, transform=canvas.scene)
        _write_number(canvas, x, y - 1.6 * tick, " mm" if x == ticks[-1] else "")


def _write_number(canvas: Canvas, x: float, y: float, unit: str) -> None:
    """Write a number, with its unit if any, below (x, y), along the ground."""
    canvas.axes.text(
        x,
        y,
        f"{x:g}{unit}".replace("-", "−"),
        rotation=float(np.degrees(canvas.extent.tilt)),
        rotation_mode="anchor",
        ha="center",
        va="top",
        transform=canvas.scene,
    )


WALL_THICKNESS = 4.0  # points; less than the ground, which covers the feet of walls
WALLS, GROUND, START, SHIFT = 0.5, 0.6, 0.7, 3.0  # order of drawing; blocks are at 1, lines at 2
START_LINE: dict[str, Any] = {"colors": style.FAINT_INK, "linewidths": style.LINE_WIDTH, "linestyles": [(0, (3, 2))]}
LEAST_SHIFT = 0.7  # points; what moved less is at the start's place to the eye
ARROW_LENGTH = 3.0  # points; a displacement along the ground gets an arrow from here on
MOST_ALIGNED = -0.8  # cosine between two walls that turn back so sharply that a mitre would be a needle


def draw_support(canvas: Canvas, support: Support, offset: Floats) -> None:
    """Draw ground and walls, displaced by `offset` (mm) along x and y."""
    from matplotlib.collections import LineCollection

    low, high = canvas.box()
    deep = [ground_line(support, canvas)[[-1, 0]] * [1.0, 0.0] + [0.0, low[1] - canvas.extent.height]]
    solid = np.concatenate([ground_line(support, canvas) + offset, *deep])
    for outline in wall_outlines(support.walls, WALL_THICKNESS / canvas.points_per_mm):
        _fill(canvas, outline + offset, zorder=WALLS)
    _fill(canvas, solid, zorder=GROUND)
    lines = [parts_within(line + offset, low, high) for line in _faces(support, canvas)]
    canvas.axes.add_collection(
        LineCollection(
            list(np.concatenate(lines)), colors=style.INK, linewidths=style.LINE_WIDTH, transform=canvas.scene
        )
    )


def draw_start(canvas: Canvas, support: Support, offset: Floats, outlines: Floats) -> None:
    """Draw dashed where ground, walls and fixed bodies (outlines in mm, (f, 4, 2)) were before they moved.

    Pieces that have moved along themselves, such as level ground on a shaking table, look the same and are left out.
    """
    from matplotlib.collections import LineCollection

    least = LEAST_SHIFT / canvas.points_per_mm
    if float(np.hypot(*offset)) < least:
        return
    low, high = canvas.box()
    parts = np.concatenate([parts_within(line, low, high) for line in _faces(support, canvas)])
    ways = parts[:, 1] - parts[:, 0]
    apart = np.abs(ways[:, 0] * offset[1] - ways[:, 1] * offset[0]) > least * np.hypot(*ways.T)
    closed = [np.concatenate([outline, outline[:1]]) - offset for outline in outlines]
    lines = LineCollection([*parts[apart], *closed], **START_LINE, zorder=START, transform=canvas.scene)
    canvas.axes.add_collection(lines)


def draw_shift(canvas: Canvas, support: Support, offset: Floats, x: float) -> None:
    """Draw an arrow within the ground from x (mm) to the x at which this place of the ground is now."""
    if abs(float(offset[0])) * canvas.points_per_mm < ARROW_LENGTH:
        return
    surface = MILLIMETRES * float(support.height(np.array([x / MILLIMETRES]))[0]) + offset[1]
    y = surface - 0.5 * GROUND_THICKNESS / canvas.points_per_mm
    canvas.axes.annotate(
        "",
        xy=(x + offset[0], y),
        xytext=(x, y),
        xycoords=canvas.scene,
        textcoords=canvas.scene,
        arrowprops={"arrowstyle": "->", "shrinkA": 0.0, "shrinkB": 0.0, "mutation_scale": 5.0, "color": style.INK},
        zorder=SHIFT,
    )


def ground_line(support: Support, canvas: Canvas) -> Floats:
    """Return the ground at rest (mm), with level ends beyond all that can be seen, (k, 2)."""
    low, high = canvas.box()
    line = MILLIMETRES * support.line(0.0)
    shown = np.abs(np.concatenate([low, high, line[0], line[-1]])).max() + canvas.extent.width
    line[0, 0] -= 2.0 * shown
    line[-1, 0] += 2.0 * shown
    return line


def wall_outlines(walls: tuple[PlacedSegment, ...], thickness: float) -> list[Floats]:
    """Return the outline (mm, (4, 2)) of each wall, `thickness` (mm) on the right of its face, mitred at joints."""
    faces = MILLIMETRES * np.array([[[wall.x0, wall.y0], [wall.x1, wall.y1]] for wall in walls]).reshape(-1, 2, 2)
    ways = np.diff(faces, axis=1)[:, 0]
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    outlines = []
    for wall, face, way in zip(walls, faces, ways, strict=True):
        before = [other for other, (_, end) in zip(ways, faces, strict=True) if _is_one(end, face[0])]
        after = [other for other, (start, _) in zip(ways, faces, strict=True) if _is_one(start, face[1])]
        first = face[0] + thickness * _depth(way, before, -way * wall.extends_start)
        last = face[1] + thickness * _depth(way, after, way * wall.extends_end)
        outlines.append(np.stack([face[0], face[1], last, first]))
    return outlines


def _depth(way: Floats, others: list[Floats], beyond: Floats) -> Floats:
    """Return the way to a wall's back at one end, for a thickness of 1: the mitre, or square and `beyond` the end."""
    right = _right(way)
    if others and float(right @ _right(others[0])) > MOST_ALIGNED:
        other = _right(others[0])
        return np.asarray((right + other) / (1.0 + right @ other))
    return right + beyond


def _is_one(point: Floats, other: Floats) -> bool:
    return bool(np.hypot(*(point - other)) <= MILLIMETRES * TOLERANCE)


def _right(way: Floats) -> Floats:
    return np.array([way[1], -way[0]])


def _faces(support: Support, canvas: Canvas) -> list[Floats]:
    """Return the lines (mm) of ground and walls at rest, (k, 2) each."""
    walls = [MILLIMETRES * np.array([[wall.x0, wall.y0], [wall.x1, wall.y1]]) for wall in support.walls]
    return [ground_line(support, canvas), *walls]


def _fill(canvas: Canvas, outline: Floats, zorder: float) -> None:
    """Fill the part of an outline (mm, scene) that can be seen."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path
    from matplotlib.transforms import Bbox

    seen = Path(np.concatenate([outline, outline[:1]]), closed=True).clip_to_bbox(Bbox(np.stack(canvas.box())))
    patch = PathPatch(seen, facecolor=style.GROUND_COLOUR, linewidth=0.0, zorder=zorder, transform=canvas.scene)
    canvas.axes.add_artist(patch)


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

"""One moment of a run as a drawing: canvas and axis, ground and walls, blocks with their names. Millimetres."""

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from blocksim.scenario import PlacedSegment, geometry, placement
from blocksim.simulation.trajectory import Frames
from blocksim.view import paints, run_data, style
from blocksim.world.systems.blocks import are_removed, placed_points

GROUND_THICKNESS = 5.0  # points, below the lowest ground
TICK_SPACING = 36.0  # points along the ruler
TICK_LENGTH = 2.5  # points
TICK_ROOM = 0.4  # inches along the axis for one number
ROW_HEIGHT = 9.0  # points, of one row of measured ranges


@dataclass(frozen=True)
class Canvas:
    """Canvas of one moment: axes in the picture's millimetres, all on one scale."""

    axes: "style.Axes"
    extent: run_data.Extent
    points_per_mm: float

    @cached_property
    def scene(self) -> Any:
        """From the scene's millimetres to the paper."""
        from matplotlib.transforms import Affine2D

        return Affine2D().rotate(self.extent.tilt) + self.axes.transData

    @property
    def along(self) -> dict[str, Any]:
        """What makes text run along the ground."""
        turn = float(np.degrees(self.extent.tilt))
        return {"rotation": turn, "rotation_mode": "anchor", "transform": self.scene}

    @property
    def floor(self) -> float:
        """Where the drawn ground ends (mm, scene)."""
        return self.extent.base - GROUND_THICKNESS / self.points_per_mm

    def box(self) -> tuple[run_data.Floats, run_data.Floats]:
        """Return lower left and upper right (mm, scene) of all that can be seen, and a little more."""
        sides, ends = (self.extent.left, self.extent.right), (self.extent.lowest, self.extent.top)
        corners = run_data.rotate_points(np.array([[x, y] for x in sides for y in ends]), -self.extent.tilt)
        more = 0.1 * (self.extent.width + self.extent.height)
        low, high = corners.min(axis=0) - more, corners.max(axis=0) + more
        return np.array([low[0], self.floor]), high


@dataclass(frozen=True)
class Page:
    """A page with one panel as wide as the page allows, in inches; `points_per_mm` is the panel's scale."""

    width: float
    height: float
    panel_width: float
    panel_height: float
    side: float
    foot: float
    points_per_mm: float
    extent: run_data.Extent

    def canvas(self, figure: "style.Figure", left: float | None = None, bottom: float | None = None) -> Canvas:
        """Return the panel in a figure; `left` and `bottom` are its lower left corner where it is not the page's."""
        place = self.side if left is None else left, self.foot if bottom is None else bottom
        axes = style.add_axes(figure, *place, self.panel_width, self.panel_height)
        return Canvas(axes, self.extent, self.points_per_mm)


def page_for(
    extent: run_data.Extent, width: float, tallest: float, margins: tuple[float, float, float], rows: int = 0
) -> Page:
    """Return a page of this width for an extent, which is widened where the panel would be higher than `tallest`.

    `margins` are those at the sides, above and below the panel; `rows` of measured ranges lie in it. All in inches.
    """
    side, head, foot = margins
    across = width - 2.0 * side
    missing = max(extent.height * across / tallest - extent.width, 0.0)
    extent = replace(extent, left=extent.left - 0.5 * missing, right=extent.right + 0.5 * missing)
    scale = across / extent.width  # inches per mm
    height = panel_height(extent, scale, rows)
    return Page(width, head + height + foot, across, height, side, foot, scale * style.POINTS_PER_INCH, extent)


def panel_height(extent: run_data.Extent, scale: float, rows: int) -> float:
    """Return the height (inches) of a panel at a scale (inches per mm), with room for what stands below the ground."""
    below = max((extent.lowest - extent.bottom) * scale, room_below(extent, rows) / style.POINTS_PER_INCH)
    return (extent.top - extent.lowest) * scale + below


def depth_of(rows: int) -> float:
    """Return how far rows of measured ranges reach below the lowest ground (points)."""
    return GROUND_THICKNESS + (rows + 0.4) * ROW_HEIGHT


def room_below(extent: run_data.Extent, rows: int) -> float:
    """Return how far the picture continues below the lowest ground (points)."""
    depth = depth_of(rows)
    return (depth + 14.0) / float(np.cos(extent.tilt)) if extent.tilt else depth  # points, with the numbers


def finish_panel(canvas: Canvas, *, labelled: bool, is_numbered: bool = True, rows: int = 0) -> None:
    """Fix the scale of a panel and leave only its x axis; on tilted ground a ruler below `rows` of measured ranges."""
    from matplotlib.ticker import MaxNLocator

    axes, extent, points = canvas.axes, canvas.extent, canvas.points_per_mm
    width, height = style.size_of(axes)
    axes.set_xlim(extent.left, extent.right)
    axes.set_ylim(extent.top - height * style.POINTS_PER_INCH / points, extent.top)
    axes.spines[["left", "right", "top"]].set_visible(False)
    axes.yaxis.set_visible(False)
    axes.xaxis.set_major_locator(MaxNLocator(nbins=max(2, int(width / TICK_ROOM)), steps=[1, 2, 5, 10]))
    axes.tick_params(axis="x", length=2.5, pad=1.5)
    axes.xaxis.set_visible(is_numbered and not extent.tilt)
    axes.spines["bottom"].set_visible(not extent.tilt)
    if labelled:
        axes.set_xlabel("x (mm)", labelpad=1.0)
    if not is_numbered or not extent.tilt:
        return
    y = extent.base - depth_of(rows) / points
    low, high = extent.span(y)
    edge, tick = 10.0 / points, TICK_LENGTH / points  # points; no number is nearer to the edge of a panel
    locator = MaxNLocator(nbins=max(2, int((high - low) * points / TICK_SPACING)), steps=[1, 2, 5, 10])
    line: dict[str, Any] = {"color": style.FAINT_INK, "linewidth": style.LINE_WIDTH, "transform": canvas.scene}
    axes.plot([low, high], [y, y], **line)
    ticks = [float(x) for x in locator.tick_values(low, high) if low + edge <= x <= high - edge]
    for x in ticks:
        axes.plot([x, x], [y - tick, y], **line)
        text = f"{x:g}{' mm' if x == ticks[-1] else ''}".replace("-", "−")
        axes.text(x, y - 1.6 * tick, text, ha="center", va="top", **canvas.along)


WALL_THICKNESS = 4.0  # points; less than the ground, which covers the feet of walls
WALLS, GROUND, START, SHIFT = 0.5, 0.6, 0.7, 3.0  # order of drawing; blocks are at 1, lines at 2
START_LINE: dict[str, Any] = {"colors": style.FAINT_INK, "linewidths": style.LINE_WIDTH, "linestyles": [(0, (3, 2))]}
ARROW_LENGTH = 3.0  # points; a displacement along the ground gets an arrow from here on
MOST_ALIGNED = -0.8  # cosine between two walls that turn back so sharply that a mitre would be a needle


def draw_support(canvas: Canvas, support: run_data.Support, offset: run_data.Floats) -> None:
    """Draw the part of ground and walls that can be seen, displaced by `offset` (mm) along x and y."""
    from matplotlib import patches, path, transforms

    low, high = canvas.box()
    ground, *faces = _faces(support, canvas)
    deep = ground[[-1, 0]] * [1.0, 0.0] + [0.0, low[1] - canvas.extent.height]
    walls = [(WALLS, one + offset) for one in wall_outlines(support.walls, WALL_THICKNESS / canvas.points_per_mm)]
    for zorder, outline in (*walls, (GROUND, np.concatenate([ground + offset, deep]))):
        seen = path.Path(np.concatenate([outline, outline[:1]]), closed=True).clip_to_bbox(transforms.Bbox([low, high]))
        patch = patches.PathPatch(
            seen, facecolor=style.GROUND_COLOUR, linewidth=0.0, zorder=zorder, transform=canvas.scene
        )
        canvas.axes.add_artist(patch)
    lines = np.concatenate([run_data.parts_within(line + offset, low, high) for line in (ground, *faces)])
    look: dict[str, Any] = {"colors": style.INK, "linewidths": style.LINE_WIDTH}
    style.add_lines(canvas.axes, lines, **look, transform=canvas.scene)


def draw_start(canvas: Canvas, support: run_data.Support, offset: run_data.Floats, outlines: run_data.Floats) -> None:
    """Draw dashed where ground, walls and fixed bodies (outlines in mm, (f, 4, 2)) were before they moved.

    Pieces that have moved along themselves, such as level ground on a shaking table, look the same and are left out.
    """
    least = 0.7 / canvas.points_per_mm  # points; what moved less is at the start's place to the eye
    if float(np.hypot(*offset)) < least:
        return
    low, high = canvas.box()
    parts = np.concatenate([run_data.parts_within(line, low, high) for line in _faces(support, canvas)])
    ways = parts[:, 1] - parts[:, 0]
    apart = np.abs(ways[:, 0] * offset[1] - ways[:, 1] * offset[0]) > least * np.hypot(*ways.T)
    closed = [np.concatenate([outline, outline[:1]]) - offset for outline in outlines]
    style.add_lines(canvas.axes, [*parts[apart], *closed], **START_LINE, zorder=START, transform=canvas.scene)


def draw_shift(canvas: Canvas, support: run_data.Support, offset: run_data.Floats, x: float) -> None:
    """Draw an arrow within the ground from x (mm) to the x at which this place of the ground is now."""
    if abs(float(offset[0])) * canvas.points_per_mm < ARROW_LENGTH:
        return
    surface = run_data.MILLIMETRES * float(support.height(np.array([x / run_data.MILLIMETRES]))[0]) + offset[1]
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


def _faces(support: run_data.Support, canvas: Canvas) -> list[run_data.Floats]:
    """Return the lines (mm) of ground, with level ends beyond all that can be seen, and of walls at rest, (k, 2)."""
    low, high = canvas.box()
    line = run_data.MILLIMETRES * support.line(0.0)
    shown = np.abs(np.concatenate([low, high, line[0], line[-1]])).max() + canvas.extent.width
    line[0, 0] -= 2.0 * shown
    line[-1, 0] += 2.0 * shown
    return [
        line,
        *(run_data.MILLIMETRES * np.array([[wall.x0, wall.y0], [wall.x1, wall.y1]]) for wall in support.walls),
    ]


def wall_outlines(walls: tuple[PlacedSegment, ...], thickness: float) -> list[run_data.Floats]:
    """Return the outline (mm, (4, 2)) of each wall, `thickness` (mm) on the right of its face, mitred at joints."""
    faces = run_data.MILLIMETRES * np.array([[[wall.x0, wall.y0], [wall.x1, wall.y1]] for wall in walls]).reshape(
        -1, 2, 2
    )
    ways = np.diff(faces, axis=1)[:, 0]
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    rights = np.stack([ways[:, 1], -ways[:, 0]], axis=-1)
    outlines = []
    for number, (wall, face) in enumerate(zip(walls, faces, strict=True)):
        backs = []  # the way from each end to the wall's back, for a thickness of 1
        for end, beyond in ((0, -ways[number] * wall.extends_start), (1, ways[number] * wall.extends_end)):
            others = rights[np.hypot(*(faces[:, 1 - end] - face[end]).T) <= run_data.MILLIMETRES * placement.TOLERANCE]
            is_mitred = len(others) and float(rights[number] @ others[0]) > MOST_ALIGNED
            back = rights[number] + (others[0] if is_mitred else beyond)
            backs.append(back / (1.0 + rights[number] @ others[0]) if is_mitred else back)
        outlines.append(np.stack([*face, face[1] + thickness * backs[1], face[0] + thickness * backs[0]]))
    return outlines


EDGE_INSET = 0.86  # where the mark of the upper side runs, as a part of half the height
TOP = "Thick line inside a block: top face at the start."
NAME_ROOM = 0.85, 0.7  # width and height for a block's name, as parts of its smaller side
LETTERS = 100  # of a name; longer ones have no room anywhere
FIXED_HATCH = "////"
HALO = 2.0  # points around a name, so that paths of centres do not strike through it
SMALL, CLOSED = 6.0, 0.42  # points, of discs drawn without gaps; share of a size that closes those of a square lattice


@dataclass(frozen=True)
class MeasuredRange:
    """Measured centre of one block (mm) and the row below the ground it is drawn in."""

    block: str
    mean: float
    minimum: float
    maximum: float
    row: int


def corners(frames: Frames, frame: int) -> run_data.Floats:
    """Return the corners (mm) of every block in one frame, (b, k, 2), counter-clockwise, the last one repeated."""
    places = placed_points(frames.corners, frames.x[frame], frames.y[frame], frames.angle[frame])
    return np.asarray(run_data.MILLIMETRES * places)


def readable_scale(frames: Frames) -> float:
    """Return the least scale (points a mm) at which the name of every block fits into it."""
    wide, tall = (letter * style.SMALLEST_FONT / room for letter, room in zip(style.LETTER, NAME_ROOM, strict=True))
    sizes = run_data.MILLIMETRES * frames.least_widths
    lengths = np.array([len(name) for name in frames.names])
    return float((np.maximum(wide * lengths, tall) / sizes).max(initial=0.0))


@dataclass(frozen=True)
class Scene:
    """Frames of a run on their support, and the colours of the blocks.

    `with_tops` marks the top face that each free block had at the start, `with_others` draws the systems beside them.
    """

    frames: Frames
    support: run_data.Support
    paint: paints.Paint
    with_tops: bool = True
    with_others: bool = True


@dataclass(frozen=True)
class PictureOptions:
    """What a picture of a run shows beside its blocks, and on which page.

    `measured` is drawn beside the final state, `support` is what the blocks stand on: level ground at rest if it is not
    given. `forces` draws those of all contacts, `paint` colours the blocks. `times` (s) selects frames, `count` is the
    largest number of panels of a strip. A history has these panels (by default the usual ones) and blocks (those that
    move farthest), `relative` to the moving ground or not.
    """

    title: str | None = None
    measured: run_data.Repeats | None = None
    support: run_data.Support = run_data.LEVEL
    _: KW_ONLY
    forces: bool = False
    times: Sequence[float] | None = None
    count: int | None = None
    panels: Sequence[str] = ()
    blocks: Sequence[str] = ()
    relative: bool = False
    paint: paints.Paint | None = None
    paper: style.Paper = style.OWN


PLAIN = PictureOptions()


def draw_scene(canvas: Canvas, scene: Scene, frame: int) -> None:
    """Draw the support and the blocks of one frame."""
    draw_surroundings(canvas, scene, frame)
    draw_blocks(canvas, scene, frame)


def draw_surroundings(canvas: Canvas, scene: Scene, frame: int) -> None:
    """Draw ground and walls at the time of one frame, and where they were at the start."""
    frames, fixed = scene.frames, run_data.is_fixed(scene.frames, scene.support)
    offset = run_data.MILLIMETRES * scene.support.offset(frames.time[frame : frame + 1])[0]
    support = scene.support.at(float(frames.time[frame]))
    draw_support(canvas, support, offset)
    carried = fixed & ~np.array(support.driven or (False,) * len(frames.names), dtype=bool)
    draw_start(canvas, support, offset, corners(frames, frame)[carried & ~are_removed(frames.vx[frame])])
    draw_shift(canvas, support, offset, run_data.MILLIMETRES * (float(frames.x[0].mean()) if frames.names else 0.0))


def draw_blocks(canvas: Canvas, scene: Scene, frame: int) -> None:
    """Draw the blocks of one frame with their names, free ones each in its colour, fixed ones hatched in the ground's.

    Other systems lie below the blocks, each in one colour, or each element and its edge in that of the paint.
    """
    frames, paint = scene.frames, scene.paint
    for number, track in enumerate(frames.others if scene.with_others else ()):
        fills = paint.elements[number] if number < len(paint.elements) else None
        (shapes,) = run_data.MILLIMETRES * track.system.outlines(track, np.array([frame]))
        size = canvas.points_per_mm * float(np.ptp(shapes[:, :, 0], axis=1).min(initial=1.0))
        thin = min(style.LINE_WIDTH, 0.05 * size)
        if fills is not None and size < SMALL:  # gaps between small discs make a pattern that is none of the soil
            thin = CLOSED * size
        colours: dict[str, Any] = {"facecolors": style.block_colour(number + 1), "edgecolors": style.INK}
        colours = colours if fills is None else {"facecolors": fills(frame), "edgecolors": "face"}
        style.add_polygons(canvas.axes, shapes, **colours, linewidths=thin, transform=canvas.scene)
    there, fixed = ~are_removed(frames.vx[frame]), run_data.is_fixed(frames, scene.support)
    held, free = fixed & there, ~fixed & there
    own = [style.GROUND_COLOUR if held else fill for held, fill in zip(fixed, paint.fills(frame), strict=True)]
    outlines = corners(frames, frame)
    smallest = run_data.MILLIMETRES * canvas.points_per_mm * float(frames.least_widths.min(initial=np.inf))
    thin = min(style.LINE_WIDTH, 0.05 * smallest)
    edge: dict[str, Any] = {"edgecolors": style.INK, "linewidths": thin, "transform": canvas.scene}
    hatch = FIXED_HATCH if smallest >= 12.0 else None  # points; on smaller blocks hatching is a few stray lines
    for kind, lines in ((held, hatch), (free, None)):
        shown = [own[block] for block in np.flatnonzero(kind)]
        style.add_polygons(canvas.axes, outlines[kind], facecolors=shown, hatch=lines, **edge)
    if scene.with_tops:
        tops = placed_points(upper_sides(frames), frames.x[frame], frames.y[frame], frames.angle[frame])
        line: dict[str, Any] = {"colors": style.INK, "linewidths": 2.0 * thin, "transform": canvas.scene}
        style.add_lines(canvas.axes, run_data.MILLIMETRES * tops[free], **line)
    for kind in (held, free):
        _draw_names(canvas, frames, frame, kind, own)


def draw_centres(canvas: Canvas, frames: Frames, frame: int) -> None:
    """Mark the centre of every block by a line through the ground below it."""
    ends = [canvas.floor, canvas.extent.base]
    for x in run_data.MILLIMETRES * frames.x[frame, ~are_removed(frames.vx[frame])]:
        canvas.axes.plot([x, x], ends, color=style.INK, linewidth=1.2, transform=canvas.scene)


def draw_repeats(canvas: Canvas, measured: list[MeasuredRange]) -> None:
    """Draw measured mean and range of each block in rows below the ground."""
    line: dict[str, Any] = {"color": style.MEASURED_COLOUR, "linewidth": 1.2, "transform": canvas.scene}
    point = 1.0 / canvas.points_per_mm
    for item in measured:
        y = canvas.floor - (item.row + 0.6) * ROW_HEIGHT * point
        canvas.axes.plot([item.minimum, item.maximum], [y, y], **line)
        for end in (item.minimum, item.maximum):
            canvas.axes.plot([end, end], [y - 2.2 * point, y + 2.2 * point], **line)
        canvas.axes.plot(item.mean, y, marker="o", markersize=3.2, **line)
        font = style.fitting_font(item.block, (30.0, ROW_HEIGHT), 6.0)
        if font:
            look = canvas.along | {"fontsize": font, "color": style.MEASURED_COLOUR, "va": "center"}
            canvas.axes.text(item.maximum + 3.0 * point, y, style.shorten(item.block, LETTERS), **look)


def _draw_names(canvas: Canvas, frames: Frames, frame: int, chosen: run_data.Flags, fills: Sequence[str]) -> None:
    """Write the names of some blocks at their centroids, where there is room for all.

    Names on some blocks only would look like a difference between the blocks.
    """
    from matplotlib.patheffects import withStroke

    sizes = run_data.MILLIMETRES * canvas.points_per_mm * frames.least_widths
    fonts = {
        int(index): style.fitting_font(frames.names[index], (NAME_ROOM[0] * sizes[index], NAME_ROOM[1] * sizes[index]))
        for index in np.flatnonzero(chosen)
    }
    if not all(fonts.values()):
        return
    places = run_data.MILLIMETRES * np.stack([frames.x[frame], frames.y[frame]], axis=-1)
    at: dict[str, Any] = {"ha": "center", "va": "center_baseline", "clip_on": True, "transform": canvas.scene}
    for index, font in fonts.items():
        fill, name = fills[index], style.shorten(frames.names[index], LETTERS)
        box = {"facecolor": fill, "linewidth": 0.0, "pad": 0.8} if fill == style.GROUND_COLOUR else None
        halo = [withStroke(linewidth=HALO, foreground=fill)]
        look: dict[str, Any] = {"fontsize": font, "color": style.text_colour(fill), "path_effects": halo, "bbox": box}
        canvas.axes.text(float(places[index, 0]), float(places[index, 1]), name, **look, **at)


def upper_sides(frames: Frames) -> run_data.Floats:
    """Return a line inside each block along its upper side, which shows turns, in its own axes (m, (b, 2, 2)).

    It is a share of the width inside the edge whose normal points up most, and all others.
    """
    outlines = frames.corners
    inset = 0.5 * (1.0 - EDGE_INSET) * frames.least_widths
    normals, is_edge = geometry.outward_normals(outlines)
    depth = np.einsum("bec,bec->be", normals, outlines) - inset[:, None]
    blocks = np.arange(len(outlines))
    upper = np.argmax(np.where(is_edge, normals[..., 1], -np.inf), axis=1)
    normal = normals[blocks, upper]
    start = outlines[blocks, upper] - inset[:, None] * normal
    along = np.stack([-normal[:, 1], normal[:, 0]], axis=-1)
    across = np.einsum("bec,bc->be", normals, along)
    room = depth - np.einsum("bec,bc->be", normals, start)
    others = is_edge & (np.abs(across) > 1e-9)  # between two edges that are not parallel
    shares = room / np.where(others, across, 1.0)
    last = np.where(others & (across > 0.0), shares, np.inf).min(axis=1)
    first = np.minimum(np.where(others & (across < 0.0), shares, -np.inf).max(axis=1), last)
    return np.asarray(start[:, None] + np.stack([first, last], axis=1)[..., None] * along[:, None])

"""Ground and walls of one moment, where they were at the start, and a ruler along tilted ground. Millimetres."""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from blocksim.scenario import PlacedSegment
from blocksim.scenario.segments import TOLERANCE
from blocksim.view import style
from blocksim.view.moments import Floats
from blocksim.view.support import Support
from blocksim.view.window import MILLIMETRES, Extent, parts_within, turned

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.transforms import Transform

GROUND_THICKNESS = 5.0  # points, below the lowest ground
WALL_THICKNESS = 4.0  # points; less than the ground, which covers the feet of walls
WALLS, GROUND, START, SHIFT = 0.5, 0.6, 0.7, 3.0  # order of drawing; blocks are at 1, lines at 2
START_LINE: dict[str, Any] = {"colors": style.FAINT_INK, "linewidths": style.LINE_WIDTH, "linestyles": [(0, (3, 2))]}
LEAST_SHIFT = 0.7  # points; what moved less is at the start's place to the eye
ARROW_LENGTH = 3.0  # points; a displacement along the ground gets an arrow from here on
RULER_EDGE = 10.0  # points; no number is nearer to the edge of a panel
TICK_SPACING = 36.0  # points along the ruler
TICK_LENGTH = 2.5  # points
RULER_HEIGHT = 14.0  # points, with the numbers
MOST_ALIGNED = -0.8  # cosine between two walls that turn back so sharply that a mitre would be a needle


@dataclass(frozen=True)
class Canvas:
    """Canvas of one moment: axes in the picture's millimetres, all on one scale."""

    axes: "Axes"
    extent: Extent
    points_per_mm: float

    @cached_property
    def scene(self) -> "Transform":
        """From the scene's millimetres to the paper."""
        from matplotlib.transforms import Affine2D  # noqa: PLC0415 - see style

        return Affine2D().rotate(self.extent.tilt) + self.axes.transData

    @property
    def floor(self) -> float:
        """Where the drawn ground ends (mm, scene)."""
        return self.extent.base - GROUND_THICKNESS / self.points_per_mm

    def box(self) -> tuple[Floats, Floats]:
        """Return lower left and upper right (mm, scene) of all that can be seen, and a little more."""
        sides, ends = (self.extent.left, self.extent.right), (self.extent.lowest, self.extent.top)
        corners = turned(np.array([[x, y] for x in sides for y in ends]), -self.extent.tilt)
        more = 0.1 * (self.extent.width + self.extent.height)
        low, high = corners.min(axis=0) - more, corners.max(axis=0) + more
        return np.array([low[0], self.floor]), high


def draw_support(canvas: Canvas, support: Support, offset: Floats) -> None:
    """Draw ground and walls, displaced by `offset` (mm) along x and y."""
    from matplotlib.collections import LineCollection  # noqa: PLC0415 - see style

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
    from matplotlib.collections import LineCollection  # noqa: PLC0415 - see style

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


def draw_ruler(canvas: Canvas, depth: float) -> None:
    """Draw numbers of x (mm) along tilted ground, `depth` (points) below its lowest part."""
    from matplotlib.ticker import MaxNLocator  # noqa: PLC0415 - see style

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
        _number(canvas, x, y - 1.6 * tick, " mm" if x == ticks[-1] else "")


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
    from matplotlib.patches import PathPatch  # noqa: PLC0415 - see style
    from matplotlib.path import Path  # noqa: PLC0415
    from matplotlib.transforms import Bbox  # noqa: PLC0415

    seen = Path(np.concatenate([outline, outline[:1]]), closed=True).clip_to_bbox(Bbox(np.stack(canvas.box())))
    patch = PathPatch(seen, facecolor=style.GROUND_COLOUR, linewidth=0.0, zorder=zorder, transform=canvas.scene)
    canvas.axes.add_artist(patch)


def _number(canvas: Canvas, x: float, y: float, unit: str) -> None:
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

"""Ground and walls of one moment, and where they were at the start. Millimetres."""

from typing import Any

import numpy as np

from blocksim.scenario import PlacedSegment
from blocksim.scenario.segments import TOLERANCE
from blocksim.view import style
from blocksim.view.panel import GROUND_THICKNESS, Canvas
from blocksim.view.run_data import Floats, Support
from blocksim.view.window import MILLIMETRES, parts_within

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

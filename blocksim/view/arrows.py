"""Arrows of a picture: contact forces on a scale that is printed, loads, moments and velocities of driven bodies."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from blocksim.errors import InvalidInputError
from blocksim.scenario.models.actuators import Actuator
from blocksim.scenario.models.loads import Force, Gravity, Horizontal, Moment, Pressure
from blocksim.simulation.trajectory import Contacts, Frames, Rows, forces_on_a
from blocksim.view import style
from blocksim.view.run_data import MILLIMETRES, Extent, Floats, Indices, Support, rotate_points
from blocksim.view.scene import Canvas
from blocksim.world.systems.blocks import are_removed

USUAL = 0.9  # share of all recorded forces that are no larger than the one the scale is made for
USUAL_LENGTH = 0.6  # of the mean side of the blocks: length of the arrow of that force
LONGEST = 2.0  # of that length; longer arrows are cut
HEAD = 4.0, 1.7  # points: length and half width of a head
LEAST = 0.5  # points; shorter arrows are left out
WIDTH, HALO = 1.1, 2.6  # points: of a shaft, and of the light line below it
WHOLE = 24.0  # points: where the longest arrow is shorter, all of that is smaller in proportion
FORCES, BELOW, VEIL = 3.6, 3.5, 3.4  # order of drawing: above everything else
VEIL_ALPHA = 0.6  # of the white over many small blocks, whose colours would hide small arrows
ROUND = (1.0, 2.0, 5.0, 10.0)
MISSING = (
    "this run has stored no contacts, so their forces cannot be shown; run it again with --set output.contacts=true"
)


@dataclass(frozen=True)
class ForceScale:
    """Scale of arrows: `mm_per_newton` of the scene, and the length (mm) beyond which they are cut."""

    mm_per_newton: float
    longest: float

    @property
    def explanation(self) -> str:
        """Explanation of the arrows for the reader."""
        most = self.longest / self.mm_per_newton
        return f"Arrows: contact forces, drawn on the upper block; {self.example} long, capped at {most:.3g} N."

    @property
    def example(self) -> str:
        """Length of the arrow of a round force."""
        most = 0.5 * self.longest / self.mm_per_newton
        power = 10.0 ** np.floor(np.log10(most))
        force = float(max(part * power for part in ROUND if part * power <= most * (1.0 + 1e-9)))
        return f"{force:g} N is {force * self.mm_per_newton:.3g} mm"


def contacts_of(frames: Frames) -> Contacts:
    """Return the contacts of a run. Raises InvalidInputError, with advice, where none were stored."""
    if frames.contacts is None:
        raise InvalidInputError(MISSING)
    return frames.contacts


def force_scale(frames: Frames) -> ForceScale:
    """Return the scale for all frames of a run. Raises InvalidInputError where no contacts were stored."""
    force = np.hypot(*forces_on_a(contacts_of(frames).rows).T)
    force = force[np.isfinite(force) & (force > 0.0)]
    usual = float(np.quantile(force, USUAL)) if len(force) else 1.0
    length = USUAL_LENGTH * MILLIMETRES * float(np.mean([frames.size_x.mean(), frames.size_y.mean()]))
    return ForceScale(length / usual, LONGEST * length)


def forces_on_upper(rows: Rows, tilt: float) -> Floats:
    """Return the forces (N, (k, 2)) of contacts on the body that they push up in the picture, turned by `tilt`."""
    forces = forces_on_a(rows)
    up = forces @ np.array([np.sin(tilt), np.cos(tilt)])
    return np.asarray(forces * np.where(up < 0.0, -1.0, 1.0)[:, None])


def arrows(rows: Rows, scale: ForceScale, tilt: float) -> Floats:
    """Return start and end (mm, scene, (k, 2, 2)) of the arrow of every contact; those not finite are left out."""
    starts = MILLIMETRES * np.stack([rows["x"], rows["y"]], axis=-1)
    ways = scale.mm_per_newton * forces_on_upper(rows, tilt)
    shown = np.isfinite(starts).all(axis=1) & np.isfinite(ways).all(axis=1)
    starts, ways = starts[shown], ways[shown]
    lengths = np.hypot(*ways.T)
    ways *= np.minimum(1.0, scale.longest / np.maximum(lengths, 1e-12))[:, None]
    return np.stack([starts, starts + ways], axis=1)


def draw_forces(canvas: Canvas, frames: Frames, frame: int, scale: ForceScale) -> None:
    """Draw the forces of all contacts of one frame."""
    found, extent = arrows(contacts_of(frames).at(frame), scale, canvas.extent.tilt), canvas.extent
    size = min(1.0, scale.longest * canvas.points_per_mm / WHOLE)
    if size < 1.0:  # make everything above the ground paler
        left, right, low, top = extent.left, extent.right, extent.lowest, extent.top
        corners = [(left, low), (right, low), (right, top), (left, top)]
        look: dict[str, Any] = {"facecolors": "#FFFFFF", "alpha": VEIL_ALPHA, "linewidths": 0.0, "zorder": VEIL}
        style.add_polygons(canvas.axes, [corners], **look)
    draw_arrows(canvas, found, size)


def draw_arrows(canvas: Canvas, found: Floats, size: float, colour: str = style.INK) -> None:
    """Draw shafts and heads of arrows, with a light line around them that keeps them apart from dark blocks.

    `size` is that of heads and lines over their usual one.
    """
    ways = found[:, 1] - found[:, 0]
    lengths = np.hypot(*ways.T)
    found, ways, lengths = (one[lengths * canvas.points_per_mm >= LEAST] for one in (found, ways, lengths))
    along = ways / lengths[:, None]
    head = np.minimum(size * HEAD[0] / canvas.points_per_mm, lengths)
    necks = found[:, 1] - head[:, None] * along
    across = np.stack([-along[:, 1], along[:, 0]], axis=-1) * (head * HEAD[1] / HEAD[0])[:, None]
    heads, shafts = (
        np.stack([found[:, 1], necks + across, necks - across], axis=1),
        np.stack([found[:, 0], necks], axis=1),
    )
    for fill, width, edge, zorder in (("#FFFFFF", HALO, HALO - WIDTH, BELOW), (colour, WIDTH, 0.0, FORCES)):
        at: dict[str, Any] = {"zorder": zorder, "transform": canvas.scene}
        style.add_lines(canvas.axes, shafts, colors=fill, linewidths=size * width, **at)
        style.add_polygons(canvas.axes, heads, facecolors=fill, edgecolors=fill, linewidths=size * edge, **at)


UNIFORM, DEEP = 5, 9  # arrows along a face under uniform pressure, and along one under water
FORCE, PRESSURE, MOMENT, SPEED = "force", "pressure", "moment", "speed"
UNITS = {FORCE: "N", PRESSURE: "Pa", MOMENT: "N m", SPEED: "m/s"}
PREFIXES = ((1e6, "M"), (1e3, "k"))
LENGTH = 0.13  # of the larger side of a panel: the longest arrow
SWEEP = 1.5 * np.pi  # of the largest moment
RADIUS = 0.32  # of the smaller side of its body
MARGIN = 0.02  # of the larger side, beyond the ends of arrows


@dataclass(frozen=True)
class Arrows:
    """Arrows of k places in f frames: where they touch a body (mm, scene), their way over the longest, (f, k, 2)."""

    kind: str
    at: Floats
    way: Floats
    ends_there: Floats  # (f, k) 1 where an arrow ends at its place, 0 where it begins

    def lines(self, length: float) -> Floats:
        """Return start and end (mm, scene) of all arrows, (f, k, 2, 2), where the longest has this length (mm)."""
        ways = length * self.way
        starts = self.at - self.ends_there[..., None] * ways
        return np.stack([starts, starts + ways], axis=2)


@dataclass(frozen=True)
class Turns:
    """Round arrows of k moments in f frames: centres (mm, (f, k, 2)), radii (mm, (k,)), sweeps (rad, (f, k))."""

    at: Floats
    radius: Floats
    sweep: Floats


@dataclass(frozen=True)
class Mark:
    """What holds for all of a frame: words, and a direction in the picture, (0, 0) for no arrow."""

    text: str
    way: tuple[float, float]


@dataclass(frozen=True)
class Actions:
    """All that acts from outside in f frames; `largest` of each kind there is, in SI."""

    arrows: tuple[Arrows, ...] = ()
    turns: Turns | None = None
    marks: tuple[tuple[Mark, ...], ...] = ()  # of each frame
    largest: dict[str, float] = field(default_factory=dict)

    @property
    def sizes(self) -> str:
        """The largest load of each kind that has arrows, in words; empty where there is none."""
        kinds = [kind for kind in (FORCE, PRESSURE) if kind in self.largest]
        straight = ", ".join(in_words(self.largest[kind], UNITS[kind]) for kind in kinds)
        parts = [f"the longest {straight}"] if straight else []
        parts += [f"round {in_words(self.largest[MOMENT], UNITS[MOMENT])}"] if MOMENT in self.largest else []
        return ", ".join(parts)

    @property
    def explanation(self) -> str:
        """Explanation of all arrows for the reader; empty where there is none."""
        texts = [f"Red arrows: loads, {self.sizes}."] if self.sizes else []
        texts += ["Above the panels: loads on all blocks."] if any(self.marks) else []
        if SPEED in self.largest:
            texts.append(f"Black arrows: velocity of driven bodies, the longest {self.largest[SPEED]:.3g} m/s.")
        return " ".join(texts)


def actions_on(frames: Frames, chosen: Indices, support: Support) -> Actions:
    """Return what acts from outside in the chosen frames."""
    poses = _Poses(frames, chosen)
    raw = [*_loads_and_speeds(poses, support)]
    largest: dict[str, float] = {}
    for one in raw:
        size = float(np.hypot(one.way[..., 0], one.way[..., 1]).max(initial=0.0))
        largest[one.kind] = max(size, largest.get(one.kind, 0.0))
    scaled = tuple(replace(one, way=one.way / (largest[one.kind] or 1.0)) for one in raw)
    found = [
        (one.body, one.load.magnitude * one.values(poses.time) * poses.is_there[:, one.body])
        for one in support.loads
        if isinstance(one.load, Moment)
    ]
    turns, moments = None, np.stack([values for _, values in found], axis=1) if found else np.zeros((len(chosen), 0))
    largest[MOMENT] = float(np.abs(moments).max(initial=0.0))
    if found:
        bodies = [body for body, _ in found]
        radius = MILLIMETRES * RADIUS * np.minimum(frames.size_x, frames.size_y)[bodies]
        turns = Turns(MILLIMETRES * poses.places[:, bodies], radius, SWEEP * moments / (largest[MOMENT] or 1.0))
    present = {kind: size for kind, size in largest.items() if size > 0.0}
    return Actions(scaled, turns, _marks(poses.time, support), present)


def in_words(value: float, unit: str) -> str:
    """Return a positive value with its unit, in thousands or millions where it is large."""
    factor, prefix = next(((size, name) for size, name in PREFIXES if value >= size), (1.0, ""))
    return f"{value / factor:.3g} {prefix}{unit}"


def with_room(extent: Extent, found: Actions) -> tuple[Extent, float]:
    """Return an extent that also holds all arrows, but for what is below it, and the length (mm) of the longest."""
    length = LENGTH * max(extent.width, extent.height)
    lines = [rotate_points(one.lines(length), extent.tilt).reshape(-1, 2) for one in found.arrows if one.way.any()]
    if not lines:
        return extent, length
    points = np.concatenate(lines)
    margin = MARGIN * max(extent.width, extent.height)
    low, high = points.min(axis=0) - margin, points.max(axis=0) + margin
    left, right = min(extent.left, float(low[0])), max(extent.right, float(high[0]))
    return replace(extent, left=left, right=right, top=max(extent.top, float(high[1]))), length


class _Poses:
    """Times (s, (f,)) of frames, and of all bodies places (m, (f, b, 2)), angles, sides and whether they are there."""

    def __init__(self, frames: Frames, chosen: Indices) -> None:
        self.time, self.angle = frames.time[chosen], frames.angle[chosen]
        self.places = np.stack([frames.x[chosen], frames.y[chosen]], axis=-1)
        self.velocities = np.stack([frames.vx[chosen], frames.vy[chosen]], axis=-1)
        self.corners = frames.corners  # (b, k, 2) m, along axes of the bodies
        self.sides = np.stack([frames.size_x, frames.size_y], axis=-1)  # (b, 2)
        self.is_there = 1.0 - are_removed(frames.vx[chosen])  # (f, b) 1 or 0

    def to_scene(self, body: int, vectors: Floats) -> Floats:
        """Return vectors (k, 2) of a body's own axes in those of the scene, (f, k, 2)."""
        cosine, sine = np.cos(self.angle[:, body])[:, None], np.sin(self.angle[:, body])[:, None]
        x, y = vectors[:, 0], vectors[:, 1]
        return np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=-1)

    def arrows(self, kind: str, body: int, arms: Floats, ways: Floats) -> Arrows:
        """Return arrows on a body at arms (m, (f, k, 2)) from its centre."""
        ways = ways * self.is_there[:, body, None, None]
        pushes = (ways * arms).sum(axis=-1) < 0.0
        return Arrows(kind, MILLIMETRES * (self.places[:, body, None] + arms), ways, pushes.astype(float))


def _loads_and_speeds(poses: _Poses, support: Support) -> Iterator[Arrows]:
    """Yield forces (N) and pressures (Pa), then the velocities (m/s) of driven bodies, from where these leave blocks.

    Water is deep below its level, against gravity.
    """
    for one in support.loads:
        load, factor = one.load, one.values(poses.time)[:, None]
        if isinstance(load, Force | Actuator):
            size = factor * (load.magnitude if isinstance(load, Force) else 1.0)
            way = np.array([[np.cos(load.direction), np.sin(load.direction)]])
            ways = poses.to_scene(one.body, way) if getattr(load, "axes", "world") == "body" else way[None]
            arms = poses.to_scene(one.body, np.array([load.point]))
            yield poses.arrows(FORCE, one.body, arms, size[..., None] * ways)
        elif isinstance(load, Pressure):
            is_water = load.water_level is not None
            begin, end, normal = map(np.array, one.edge)
            along = np.linspace(0.0, 1.0, DEEP) if is_water else (np.arange(UNIFORM) + 0.5) / UNIFORM
            arms = poses.to_scene(one.body, begin + np.outer(along, end - begin))
            up = np.array([np.sin(support.tilt), np.cos(support.tilt)])
            heights = (poses.places[:, one.body, None] + arms) @ up
            size = np.broadcast_to(factor * (load.magnitude or 0.0), heights.shape)
            if load.water_level is not None:
                size = load.unit_weight * np.maximum(load.water_level * factor - heights, 0.0)
            inwards = poses.to_scene(one.body, -normal[None])
            yield poses.arrows(PRESSURE, one.body, arms, size[..., None] * inwards)
    driven = np.flatnonzero(support.driven)
    if not len(driven):
        return
    ways, half = np.nan_to_num(poses.velocities[:, driven]), 0.5 * poses.sides[driven]
    size = np.hypot(ways[..., 0], ways[..., 1])
    direction = np.arctan2(ways[..., 1], ways[..., 0]) - poses.angle[:, driven]
    with np.errstate(divide="ignore"):
        reach = np.minimum(half[:, 0] / np.abs(np.cos(direction)), half[:, 1] / np.abs(np.sin(direction)))
    at = poses.places[:, driven] + ways * (reach / np.where(size > 0.0, size, np.inf))[..., None]
    yield Arrows(SPEED, MILLIMETRES * at, ways, np.zeros(at.shape[:2]))


def _marks(times: Floats, support: Support) -> tuple[tuple[Mark, ...], ...]:
    """Return what loads on all bodies are in each frame: their sum, and gravity that turns."""
    fields = [(one, one.load) for one in support.loads if isinstance(one.load, Horizontal)]
    rows: list[list[Mark]] = [[] for _ in times]
    if fields:
        total = np.sum([load.magnitude * one.values(times) for one, load in fields], axis=0)
        for row, value in zip(rows, total.tolist(), strict=True):
            row.append(Mark(f"{abs(value):.3g} g", (float(np.sign(value)), 0.0)))
    for one in support.loads:
        if isinstance(one.load, Gravity):
            for row, tilt in zip(rows, one.values(times).tolist(), strict=True):
                off = tilt - support.tilt
                text = f"tilt {np.degrees(tilt):.2f}°".replace("-", "−")
                row.append(Mark(text, (-float(np.sin(off)), -float(np.cos(off)))))
    return tuple(tuple(row) for row in rows)


COLOUR = "#A50026"
ROUND_HEAD = 4.0  # points, of round arrows
MARK, MARK_SIDE = 9.0, 12.0  # points: length of the arrow of a mark, and room for it
MARK_GAP = 8.0  # points between two marks


def draw_actions(canvas: Canvas, found: Actions, index: int, length: float) -> None:
    """Draw the arrows of the frame with this index among the chosen ones; `length` is of the longest (mm)."""
    for one in found.arrows:
        draw_arrows(canvas, one.lines(length)[index], 1.0, style.INK if one.kind == SPEED else COLOUR)
    turns = found.turns
    for number in range(0 if turns is None else len(turns.radius)):
        if turns is not None and abs(turns.sweep[index, number]) >= 0.02:  # rad
            _draw_turn(canvas, turns.at[index, number], float(turns.radius[number]), float(turns.sweep[index, number]))


def _draw_turn(canvas: Canvas, centre: Floats, radius: float, sweep: float) -> None:
    """Draw a round arrow (mm, rad), which is open at the right."""
    angle = (0.25 * np.pi if sweep > 0.0 else -0.25 * np.pi) + np.linspace(0.0, sweep, 24)
    points = centre + radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    way = (points[-1] - points[-2]) / np.hypot(*(points[-1] - points[-2]))
    chord = float(np.hypot(*(points[-1] - points[0])))
    head = 0.5 * min(ROUND_HEAD / canvas.points_per_mm, chord or ROUND_HEAD)
    across = head * np.array([-way[1], way[0]])
    outline = points[-1] + np.stack([head * way, across - head * way, -across - head * way])
    at: dict[str, Any] = {"transform": canvas.scene, "zorder": FORCES}
    for colour, width in (("#FFFFFF", 2.5 * WIDTH), (COLOUR, WIDTH)):
        style.add_lines(canvas.axes, [points], colors=colour, linewidths=width, **at)
    style.add_polygons(canvas.axes, [outline], facecolors=COLOUR, linewidths=0.0, **at)


def draw_marks(canvas: Canvas, marks: tuple[Mark, ...], offset: float = 0.0, *, up: float = 4.0) -> None:
    """Write marks with their arrows on a line above a panel: from `offset` right of its left end on, `up` above it.

    Both are in points.
    """
    arrow: dict[str, Any] = {"arrowstyle": "-|>", "shrinkA": 0.0, "shrinkB": 0.0, "mutation_scale": 6.0}
    arrow |= {"linewidth": WIDTH, "color": COLOUR}
    point = 1.0 / canvas.points_per_mm
    for mark in marks:
        left, top, way = canvas.extent.left + offset * point, canvas.extent.top, 0.5 * MARK * point * np.array(mark.way)
        if way.any():
            centre = np.array([left + 0.5 * MARK * point, top + (up + 5.0) * point])
            ends = {"xy": tuple(centre + way), "xytext": tuple(centre - way)}
            canvas.axes.annotate("", **ends, annotation_clip=False, arrowprops=arrow)
        canvas.axes.text(left + MARK_SIDE * point, top + up * point, mark.text, va="bottom", color=COLOUR)
        offset += MARK_SIDE + 5.0 * len(mark.text) + MARK_GAP  # points

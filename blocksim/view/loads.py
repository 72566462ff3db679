"""What acts on blocks from outside, in some frames: loads, and the motion of driven bodies, as arrows on one scale.

Arrows of a kind (forces, pressures, speeds) are long in proportion to the largest of the kind in all these frames. A
load that pushes ends at the point where it acts, one that pulls begins there, so that arrows lie outside of their body.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from blocksim.scenario.load_places import NORMALS
from blocksim.scenario.models.loads import Force, Gravity, Horizontal, Moment, Pressure
from blocksim.view.acting import Acting
from blocksim.view.run_data import Floats, FramesLike, Indices, Support
from blocksim.view.window import MILLIMETRES, Extent, turned
from blocksim.world.systems.blocks import are_removed

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
class Outside:
    """All that acts from outside in f frames; `largest` of each kind there is, in SI."""

    arrows: tuple[Arrows, ...] = ()
    turns: Turns | None = None
    marks: tuple[tuple[Mark, ...], ...] = ()  # of each frame
    largest: dict[str, float] = field(default_factory=dict)

    @property
    def is_empty(self) -> bool:
        """Whether there is nothing to draw."""
        return not self.arrows and self.turns is None and not any(self.marks)

    @property
    def sizes(self) -> str:
        """The largest load of each kind that has arrows, in words; empty where there is none."""
        straight = ", ".join(in_words(self.largest[kind], UNITS[kind]) for kind in (FORCE, PRESSURE) if self._has(kind))
        parts = [f"the longest {straight}"] if straight else []
        parts += [f"round {in_words(self.largest[MOMENT], UNITS[MOMENT])}"] if self._has(MOMENT) else []
        return ", ".join(parts)

    @property
    def explanation(self) -> str:
        """Explanation of all arrows for the reader; empty where there is none."""
        texts = [f"Red arrows: loads, {self.sizes}."] if self.sizes else []
        texts += ["Above the panels: loads on all blocks."] if any(self.marks) else []
        if self._has(SPEED):
            texts.append(f"Black arrows: velocity of driven bodies, the longest {self.largest[SPEED]:.3g} m/s.")
        return " ".join(texts)

    def _has(self, kind: str) -> bool:
        return self.largest.get(kind, 0.0) > 0.0


def outside(frames: FramesLike, chosen: Indices, support: Support) -> Outside:
    """Return what acts from outside in the chosen frames."""
    poses = _Poses.of(frames, chosen)
    raw = [*_forces(poses, support.loads), *_pressures(poses, support), *_speeds(frames, chosen, support)]
    sizes = [float(np.hypot(one.way[..., 0], one.way[..., 1]).max(initial=0.0)) for one in raw]
    turns, moment = _moments(frames, poses, support.loads)
    largest = {
        kind: max(sizes[number] for number, one in enumerate(raw) if one.kind == kind)
        for kind in {one.kind for one in raw}
    }
    scaled = [replace(one, way=one.way / (largest[one.kind] or 1.0)) for one in raw]
    marks = _marks(frames.time[chosen], support)
    return Outside(tuple(scaled), turns, marks, {**largest, MOMENT: moment})


def in_words(value: float, unit: str) -> str:
    """Return a positive value with its unit, in thousands or millions where it is large."""
    factor, prefix = next(((size, name) for size, name in PREFIXES if value >= size), (1.0, ""))
    return f"{value / factor:.3g} {prefix}{unit}"


def length_in(extent: Extent) -> float:
    """Return the length (mm) of the longest arrow in a panel."""
    return LENGTH * max(extent.width, extent.height)


def with_room(extent: Extent, found: Outside, length: float) -> Extent:
    """Return an extent that also holds all arrows, but for what is below it."""
    lines = [turned(one.lines(length), extent.tilt).reshape(-1, 2) for one in found.arrows if one.way.any()]
    if not lines:
        return extent
    points = np.concatenate(lines)
    margin = MARGIN * max(extent.width, extent.height)
    low, high = points.min(axis=0) - margin, points.max(axis=0) + margin
    return replace(
        extent,
        left=min(extent.left, float(low[0])),
        right=max(extent.right, float(high[0])),
        top=max(extent.top, float(high[1])),
    )


@dataclass(frozen=True)
class _Poses:
    """Times (s, (f,)) of frames, and of all bodies places (m, (f, b, 2)), angles, sides and whether they are there."""

    time: Floats
    places: Floats
    angle: Floats
    sides: Floats  # (b, 2)
    is_there: Floats  # (f, b) 1 or 0

    @classmethod
    def of(cls, frames: FramesLike, chosen: Indices) -> "_Poses":
        places = np.stack([frames.x[chosen], frames.y[chosen]], axis=-1)
        vx = getattr(frames, "vx", None)
        there = np.ones(places.shape[:2]) if vx is None else 1.0 - are_removed(vx[chosen])
        sides = np.stack([frames.size_x, frames.size_y], axis=-1)
        return cls(frames.time[chosen], places, frames.angle[chosen], sides, there)

    def turned(self, body: int, vectors: Floats) -> Floats:
        """Return vectors (k, 2) of a body's own axes in those of the scene, (f, k, 2)."""
        cosine, sine = np.cos(self.angle[:, body])[:, None], np.sin(self.angle[:, body])[:, None]
        x, y = vectors[:, 0], vectors[:, 1]
        return np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=-1)

    def arrows(self, kind: str, body: int, arms: Floats, ways: Floats) -> Arrows:
        """Return arrows on a body at arms (m, (f, k, 2)) from its centre."""
        ways = ways * self.is_there[:, body, None, None]
        pushes = (ways * arms).sum(axis=-1) < 0.0
        return Arrows(kind, MILLIMETRES * (self.places[:, body, None] + arms), ways, pushes.astype(float))


def _forces(poses: _Poses, loads: Sequence[Acting]) -> Iterator[Arrows]:
    for one in loads:
        if isinstance(one.load, Force):
            load = one.load
            way = np.array([[np.cos(load.direction), np.sin(load.direction)]])
            ways = poses.turned(one.body, way) if load.axes == "body" else way[None]
            sizes = (load.magnitude * one.values(poses.time))[:, None, None]
            yield poses.arrows(FORCE, one.body, poses.turned(one.body, np.array([load.point])), sizes * ways)


def _pressures(poses: _Poses, support: Support) -> Iterator[Arrows]:
    for one in support.loads:
        if isinstance(one.load, Pressure):
            normal, half = np.array(NORMALS[one.load.face]), 0.5 * poses.sides[one.body]
            count = UNIFORM if one.load.water_level is None else DEEP
            along = (np.arange(count) + 0.5) / count if one.load.water_level is None else np.linspace(0.0, 1.0, count)
            points = half * (normal + np.outer(2.0 * along - 1.0, np.abs(normal[::-1])))
            arms = poses.turned(one.body, points)
            inwards = poses.turned(one.body, -normal[None])
            yield poses.arrows(PRESSURE, one.body, arms, _pressure(poses, one, arms, support.tilt)[..., None] * inwards)


def _pressure(poses: _Poses, one: Acting, arms: Floats, tilt: float) -> Floats:
    """Return the pressures (Pa, (f, k)) at points of a face; water is deep below its level, against gravity."""
    load, factor = one.load, one.values(poses.time)[:, None]
    assert isinstance(load, Pressure)  # noqa: S101 - for the type checker
    if load.water_level is None:
        return np.broadcast_to(factor * (load.magnitude or 0.0), arms.shape[:2])
    heights = (poses.places[:, one.body, None] + arms) @ np.array([np.sin(tilt), np.cos(tilt)])
    return np.asarray(load.unit_weight * np.maximum(load.water_level * factor - heights, 0.0))


def _speeds(frames: FramesLike, chosen: Indices, support: Support) -> Iterator[Arrows]:
    """Yield the velocities of driven bodies, where frames know any."""
    vx, vy = getattr(frames, "vx", None), getattr(frames, "vy", None)
    driven = np.flatnonzero(support.driven)
    if vx is None or vy is None or not len(driven):
        return
    pick = np.ix_(chosen, driven)
    ways = np.nan_to_num(np.stack([vx[pick], vy[pick]], axis=-1))
    places = np.stack([frames.x[pick], frames.y[pick]], axis=-1)
    at = places + _to_edge(ways, frames.angle[pick], 0.5 * frames.size_x[driven], 0.5 * frames.size_y[driven])
    yield Arrows(SPEED, MILLIMETRES * at, ways, np.zeros(at.shape[:2]))


def _to_edge(ways: Floats, angle: Floats, half_x: Floats, half_y: Floats) -> Floats:
    """Return what leads from the centre of a block to its edge in some directions; nothing where there is none."""
    size = np.hypot(ways[..., 0], ways[..., 1])
    direction = np.arctan2(ways[..., 1], ways[..., 0]) - angle
    with np.errstate(divide="ignore"):
        reach = np.minimum(half_x / np.abs(np.cos(direction)), half_y / np.abs(np.sin(direction)))
    return np.asarray(ways * (reach / np.where(size > 0.0, size, np.inf))[..., None])


def _moments(frames: FramesLike, poses: _Poses, loads: Sequence[Acting]) -> tuple[Turns | None, float]:
    """Return round arrows, and the largest moment (N m)."""
    found = [(one, one.load) for one in loads if isinstance(one.load, Moment)]
    if not found:
        return None, 0.0
    bodies = [one.body for one, _ in found]
    sizes = [load.magnitude * one.values(poses.time) * poses.is_there[:, one.body] for one, load in found]
    moments = np.stack(sizes, axis=1)
    largest = float(np.abs(moments).max(initial=0.0))
    radius = MILLIMETRES * RADIUS * np.minimum(frames.size_x, frames.size_y)[bodies]
    return Turns(MILLIMETRES * poses.places[:, bodies], radius, SWEEP * moments / (largest or 1.0)), largest


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

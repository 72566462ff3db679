"""A run as its pictures need it: frames and the choice among them, support, loads, and what of the plane is shown."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.errors import InvalidInputError
from blocksim.scenario import Model, PlacedSegment, events, geometry, open_faces, placement
from blocksim.scenario.models.actuators import Actuator
from blocksim.scenario.models.loads import AnyLoad, Stretch, joined, stretches_of
from blocksim.scenario.motion import MotionPieces, displacement_and_velocity, motion_direction
from blocksim.simulation.results import EventRecord
from blocksim.simulation.trajectory import Frames
from blocksim.world.systems.blocks import boxes_around

if TYPE_CHECKING:
    from blocksim.simulation.instruments import ProbeSeries

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Indices = NDArray[np.intp]
Repeats = Sequence[Any]
"""What was measured: block, quantity, mean, minimum and maximum (mm or degrees) of each, such as `Statistics`."""
PRINTED = 0.000501  # s; half of the last digit of a printed time, and round-off
LEAST_ANGLE = 0.05  # degrees; motion closer to x is along x


class LoadOverTime(NamedTuple):
    """A load, where it acts, its factor or tilt (rad) over time, or force (N) of an actuator, and when (s) it ends."""

    load: AnyLoad | Actuator
    body: int  # -1: all free ones
    edge: geometry.Edge  # m, of a pressure
    stretches: tuple[Stretch, ...]
    end: float

    def values(self, times: Floats) -> Floats:
        """Return its factor, or the tilt (rad) of gravity, at these times (s)."""
        starts, *terms = np.array(self.stretches).T
        piece = (np.searchsorted(starts, times, side="right") - 1).clip(min=0)
        value, rate, acceleration, jerk = (one[piece] for one in terms)
        since = times - starts[piece]
        change = since * (rate + since * (0.5 * acceleration + since * jerk / 6.0))
        return np.where(times < self.end, value + change, 0.0)


BEYOND_REACH = 1e34
"""Metres or radians: ten thousand times the largest simulated value, and finite as 32-bit millimetres."""


def drawable_frames(frames: Frames) -> Indices:
    """Return the indices of the frames in which every number is finite (a failed run may end in others).

    Values beyond all reach, as in a damaged file, do not count: millimetres and areas would overflow.
    Raises InvalidInputError when there is none, or nothing in it.
    """
    if len(frames.names) == 0 and not frames.others:
        raise InvalidInputError("nothing to draw")
    finite = np.isfinite(frames.time)
    for field in (frames.x, frames.y, frames.angle):
        finite &= (np.abs(field) < BEYOND_REACH).all(axis=1)  # false for what is not finite
    for track in frames.others:
        finite &= (np.abs(track.values) < BEYOND_REACH).all(axis=(1, 2))
    indices = np.flatnonzero(finite)
    if len(indices) == 0:
        raise InvalidInputError("no frame to draw")
    return indices


def path_lengths(frames: Frames, chosen: Indices, carried: Floats | None = None) -> Floats:
    """Return the path (m) up to each chosen frame, summed over the blocks; (len(chosen),), never falling.

    A turn counts as the way of a corner: the angle times half the diagonal. `carried` is how far the support has moved
    along x and y (m) at the chosen frames, (len(chosen), 2): only the way relative to the support counts. The elements
    of every system beside the blocks count as much as all blocks, with their mean way.
    """
    radius = np.hypot(frames.corners[..., 0], frames.corners[..., 1]).max(axis=1)
    places = np.stack([frames.x[chosen], frames.y[chosen]], axis=-1)
    if carried is not None:
        places -= carried[:, None]
    moved = np.hypot(*np.moveaxis(np.diff(places, axis=0), -1, 0))
    turned = radius * np.abs(np.diff(frames.angle[chosen], axis=0))
    way = (moved + turned).sum(axis=1)
    for track in frames.others:
        steps = np.hypot(*(np.diff(track[name][chosen], axis=0) for name in ("x", "y")))
        way += max(1, len(frames.names)) * steps.mean(axis=1)
    return np.concatenate([[0.0], np.cumsum(way)])


def moments_by_motion(frames: Frames, chosen: Indices, count: int, carried: Floats | None = None) -> Indices:
    """Return at most `count` of the chosen frames, even in the path travelled, first and last included.

    Even spacing in time would show the release and the rest several times and the impacts hardly. Where
    nothing moves, the first and the last frame are left. `carried` as for `path_lengths`.
    """
    path = path_lengths(frames, chosen, carried)
    wanted = np.linspace(0.0, path[-1], count)[1:-1]
    between = np.searchsorted(path, wanted) if path[-1] > 0.0 else np.array([], dtype=np.intp)
    last = len(chosen) - 1
    return chosen[np.unique(np.concatenate([[0], between, [last]]).astype(np.intp))]


def moments_at(frames: Frames, chosen: Indices, times: Sequence[float]) -> Indices:
    """Return, for every time (s), the chosen frame nearest to it.

    The last frame's time as pictures print it, rounded to milliseconds, means the last frame, though it may lie outside
    or another frame may be nearer. Raises InvalidInputError where there is no time, or one outside the recorded span.
    """
    recorded = frames.time[chosen]
    first, last = float(recorded[0]), float(recorded[-1])
    outside = [time for time in times if not first - PRINTED <= time <= last + PRINTED]
    if outside:
        raise InvalidInputError(f"time {outside[0]:g} s lies outside the recorded span, {first:g} to {last:g} s")
    if len(times) == 0:
        raise InvalidInputError("no times to draw were given")
    wanted = [last if time == round(last, 3) else time for time in times]  # of a time in s
    return chosen[[int(np.argmin(np.abs(recorded - time))) for time in wanted]]


@dataclass(frozen=True)
class Support:
    """Ground, walls and fixed bodies of one run; x runs along the ground, all in SI. The default: level and at rest.

    `profile` is the surface towards +x, level beyond both ends. `fixed` states for every body whether it moves with the
    support or by a motion of its own (`driven`). A tilt raises the +x end. Without `motion` all rest. `weight` (N) is
    that of all free bodies. `gone` are the times (s) at which walls are removed, infinite for those that stay. `loads`
    are those on the blocks.
    """

    profile: tuple[tuple[float, float], ...] = ((0.0, 0.0), (1.0, 0.0))
    walls: tuple[PlacedSegment, ...] = ()
    fixed: tuple[bool, ...] = ()
    driven: tuple[bool, ...] = ()
    gone: tuple[float, ...] = ()
    tilt: float = 0.0
    direction: tuple[float, float] = (1.0, 0.0)
    motion: MotionPieces | None = None
    weight: float = 0.0
    loads: tuple[LoadOverTime, ...] = ()

    @property
    def way(self) -> str:
        """The direction of motion in words."""
        turn = float(np.degrees(np.arctan2(*self.direction[::-1])))
        return "along x" if abs(turn) < LEAST_ANGLE else f"at {turn:.3g}° to x".replace("-", "−")

    def at(self, time: float) -> "Support":
        """Return the support with the walls that are there at a time (s)."""
        if not np.isfinite(self.gone).any():
            return self
        walls = (wall for wall, gone in zip(self.walls, self.gone, strict=True) if time < gone)
        return replace(self, walls=tuple(walls), gone=())

    def displacement(self, times: Floats, order: int = 0) -> Floats:
        """Return the displacement (m) along `direction` at these times (s), of `order` 1 its velocity (m/s)."""
        return np.zeros_like(times) if self.motion is None else displacement_and_velocity(self.motion, times)[order]

    def offset(self, times: Floats) -> Floats:
        """Return the displacement (m) along x and y at these times (s), (n, 2)."""
        return np.multiply.outer(self.displacement(times), self.direction)

    def height(self, x: Floats) -> Floats:
        """Return the height (m) of the ground at rest at these places (m)."""
        places, heights = np.array(self.profile).T
        return np.asarray(np.interp(x, places, heights))

    def line(self, reach: float) -> Floats:
        """Return the points (m) of the ground at rest, with level ends of length `reach` (m); (k, 2)."""
        points = np.array(self.profile)
        level = np.array([reach, 0.0])
        return np.concatenate([points[:1] - level, points, points[-1:] + level])

    def corners(self) -> Floats:
        """Return the points (m) at which the ground at rest turns, (k, 2)."""
        line = self.line(1.0)
        before, after = np.diff(line, axis=0)[:-1], np.diff(line, axis=0)[1:]
        turns = before[:, 0] * after[:, 1] != before[:, 1] * after[:, 0]
        return np.asarray(line[1:-1][turns])


LEVEL = Support()


def is_fixed(frames: Frames, support: Support) -> Flags:
    """Return for every block whether it moves with the support or by a motion of its own, (b,)."""
    return np.array(support.fixed or (False,) * len(frames.names), dtype=bool)


def support_of(
    model: Model, happened: Sequence[EventRecord] = (), probes: "Mapping[str, ProbeSeries] | None" = None
) -> Support:
    """Return the support of a scenario's runs, or of one in which these events have happened.

    Of events that wait for rest only a run knows the time: until then it is infinite. Forces of actuators are those of
    its `probes`.
    """
    scenario, placed = model.scenario, model.bodies
    times = [np.inf if event.at is None else event.at for event in scenario.events]
    for one in happened:
        times[one.event] = one.time_s
    timeline = list(zip(scenario.events, times, strict=True))
    numbers = {body.name: number for number, body in enumerate(placed)}
    loads = tuple(
        LoadOverTime(
            *one,
            stretches_of(one.load, scenario.ground.tilt),
            min((at for event, at in timeline if one.load.name in event.unload), default=math.inf),
        )
        for one in model.acting_loads
    )
    for name, jack in zip(events.actuator_names(scenario), scenario.actuators, strict=True):
        if (series := (probes or {}).get(name)) is not None and len(series):
            forces = joined(series.time.tolist(), series["force"].tolist())
            loads += (LoadOverTime(jack, numbers[jack.body], open_faces.NO_FACE, forces, math.inf),)
    return Support(
        profile=scenario.ground.profile or Support.profile,
        walls=placement.wall_segments(scenario),
        fixed=tuple(body.fixed and not body.freed for body in placed),
        driven=tuple(body.driven for body in placed) if any(body.driven for body in placed) else (),
        gone=tuple(
            min((at for event, at in timeline if name in event.remove), default=np.inf)
            for name in events.wall_names(scenario)
        ),
        tilt=scenario.ground.tilt,
        direction=motion_direction(scenario),
        motion=None if scenario.motion is None else model.motion,
        loads=loads,
        weight=scenario.gravity.size * sum(body.mass for body in placed if not body.fixed or body.freed),
    )


MILLIMETRES = 1e3  # per metre
MARGIN = 0.04  # of the larger side, around everything
FEW_LEFT_OUT, MANY = 0.05, 20  # share of blocks that may be left out of an animation's window; number of many blocks
GAP, WIDE_GAP = 0.2, 1.5  # over the reach of all others: how far off a block has to be, of many and of few
LEAST_TOGETHER = 3  # blocks, of which one can be far from the others
NEAR = 0.15  # of a side: what of the support is this near is shown as well; at least the largest block's diagonal


@dataclass(frozen=True)
class Extent:
    """The part of the picture that is shown (mm).

    `base` is the lowest ground in it (mm, scene); the ground is drawn down to a little below. The picture is turned
    against the scene by `tilt` (rad).
    """

    left: float
    right: float
    bottom: float
    top: float
    base: float = 0.0
    tilt: float = 0.0

    @property
    def width(self) -> float:
        """Width (mm)."""
        return self.right - self.left

    @property
    def height(self) -> float:
        """Height (mm)."""
        return self.top - self.bottom

    @property
    def lowest(self) -> float:
        """Where a line along the ground through `base` is lowest in the picture (mm)."""
        slope = float(np.tan(self.tilt))
        return self.base / float(np.cos(self.tilt)) + min(self.left * slope, self.right * slope)

    def span(self, y: float) -> tuple[float, float]:
        """Return from which to which x a line along the ground at height y can be seen (mm, scene)."""
        cosine, shift = float(np.cos(self.tilt)), float(np.sin(self.tilt)) * y
        return (self.left + shift) / cosine, (self.right + shift) / cosine


def extent_of(frames: Frames, chosen: Indices, support: Support | None = None, blocks: Flags | None = None) -> Extent:
    """Return the extent in which no block, and no other system, is cut in any chosen frame, with a small margin.

    The ground below every block is shown, and the corners of the ground and the walls that are near. `blocks` (b,)
    selects the blocks that count, by default all.
    """
    support = support or LEVEL
    tilt, reached = support.tilt, _reached(frames, chosen, support)
    if blocks is not None:
        reached = reached[:, blocks]
    others = [rotate_points(one.system.outlines(one, chosen), tilt).reshape(-1, 2) for one in frames.others]
    reached = np.concatenate([reached.reshape(-1, 2), *others])
    low, high = reached.min(axis=0), reached.max(axis=0)
    displacement = support.displacement(frames.time[chosen])
    farthest = np.unique([0.0, displacement.min(), displacement.max()])  # of the support: at its start, to either side
    shifts = np.multiply.outer(farthest, support.direction)
    diagonal = float(np.hypot(frames.size_x, frames.size_y).max(initial=0.0))
    reach = np.maximum(diagonal, NEAR * (high - low))
    near_low, near_high, points = low - reach, high + reach, [np.array([low, high])]
    for shift in shifts:
        corners = rotate_points(support.corners() + shift, tilt)
        points.append(corners[((near_low <= corners) & (corners <= near_high)).all(axis=1)])
        for wall in support.walls:
            line = rotate_points(np.array([[wall.x0, wall.y0], [wall.x1, wall.y1]]) + shift, tilt)
            points.append(parts_within(line, near_low, near_high).reshape(-1, 2))
    low, high = np.concatenate(points).min(axis=0), np.concatenate(points).max(axis=0)
    margin = MARGIN * float((high - low).max())
    low, high = low - margin, high + margin
    line = support.line(placement.ENDLESS)
    ground = np.concatenate([parts_within(rotate_points(line + shift, tilt), low, high) for shift in shifts])
    base = MILLIMETRES * float(rotate_points(ground, -tilt)[..., 1].min())
    (left, bottom), (right, top) = MILLIMETRES * low, MILLIMETRES * high
    return Extent(float(left), float(right), float(bottom), float(top), base, tilt)


def blocks_in_view(frames: Frames, chosen: Indices, support: Support | None = None) -> Flags:
    """Return True for every block that stays with the others, (b,); those that fly far off would make a window vast.

    Far off is what leaves a gap to the reach of all others, to a side or upwards, of a fifth of their width or height;
    with few blocks, of which each matters, of one and a half times that. At most a twentieth of the blocks are left
    out, or one, and never a fixed one; of two, each as far from the other, none.
    """
    count = len(frames.names)
    if count < LEAST_TOGETHER:
        return np.ones(count, dtype=bool)
    support = support or LEVEL
    reached = _reached(frames, chosen, support)
    low, high = reached.min(axis=0), reached.max(axis=0)
    most, share = max(1, int(FEW_LEFT_OUT * count)), GAP if count >= MANY else WIDE_GAP
    stays = np.ones(count, dtype=bool)
    for reach, other in ((high[:, 0], low[:, 0]), (-low[:, 0], -high[:, 0]), (high[:, 1], low[:, 1])):
        order = np.argsort(reach, kind="stable")
        for last in range(max(count - most, 1), count):
            near, far = order[:last], order[last:]
            if stays[far].sum() + (~stays).sum() > most:
                continue
            if reach[far[0]] - reach[near].max() > share * float(reach[near].max() - other[near].min()):
                stays[far] = False
                break
    return np.asarray(stays | is_fixed(frames, support))


def rotate_points(points: Floats, angle: float) -> Floats:
    """Return points (..., 2) turned counter-clockwise about the origin by an angle (rad)."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.asarray(points @ np.array([[cosine, sine], [-sine, cosine]]))


def parts_within(line: Floats, low: Floats, high: Floats) -> Floats:
    """Return the parts (m, 2, 2) of a line's straight pieces that lie within a box; after Liang and Barsky (1984)."""
    starts, ways = line[:-1], np.diff(line, axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        shares = np.stack([(low - starts) / ways, (high - starts) / ways])
    enter = np.fmin(*shares).max(axis=1).clip(min=0.0)
    leave = np.fmax(*shares).min(axis=1).clip(max=1.0)
    ends = starts[:, None] + ways[:, None] * np.stack([enter, leave], axis=1)[:, :, None].clip(0.0, 1.0)
    return np.asarray(ends[enter <= leave])


def _reached(frames: Frames, chosen: Indices, support: Support) -> Floats:
    """Return points (m, picture) around all that each block and the ground below it take up, (3 n, b, 2)."""
    x = frames.x[chosen]
    centres = np.stack([x, frames.y[chosen]], axis=-1)
    offsets = support.offset(frames.time[chosen])[:, None]
    below = np.stack([x, support.height(x - offsets[..., 0]) + offsets[..., 1]], axis=-1)
    centres, below = rotate_points(centres, support.tilt), rotate_points(below, support.tilt)
    angle = frames.angle[chosen] + support.tilt
    boxes = boxes_around(frames.corners, centres[..., 0], centres[..., 1], np.cos(angle), np.sin(angle))
    return np.concatenate([*boxes, below])

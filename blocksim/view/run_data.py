"""A run as its pictures need it: frames and the choice among them, ground, walls and fixed bodies with their motion."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from blocksim.errors import InvalidInputError
from blocksim.scenario import PlacedSegment, Scenario, place_bodies
from blocksim.scenario.events import wall_names
from blocksim.scenario.motion import MotionPieces, displacement_and_velocity, motion_direction, motion_pieces
from blocksim.scenario.segments import wall_segments
from blocksim.simulation.happened import Happened
from blocksim.view.acting import Acting, acting_loads
from blocksim.world.systems.blocks import least_widths, local_corners, placed_points, radii
from blocksim.world.systems.system import Track

PRINTED_DIGITS = 3  # of a time in s
PRINTED = 0.000501  # s; half of the last digit of a printed time, and round-off
LEAST_ANGLE = 0.05  # degrees; motion closer to x is along x
Floats = NDArray[np.float64]
Indices = NDArray[np.intp]


class FramesLike(Protocol):
    """The part of a run's frames that pictures need: n frames of b blocks, SI, counter-clockwise positive."""

    @property
    def time(self) -> Floats:
        """Time of each frame (s), (n,)."""
        ...

    @property
    def x(self) -> Floats:
        """Centres along the ground (m), (n, b)."""
        ...

    @property
    def y(self) -> Floats:
        """Centres above the ground (m), (n, b)."""
        ...

    @property
    def angle(self) -> Floats:
        """Angles of the blocks' own axes (rad), (n, b)."""
        ...

    @property
    def rotation(self) -> Floats:
        """Angles turned since the blocks were placed (rad), (n, b), as in the final table."""
        ...

    @property
    def size_x(self) -> Floats:
        """Sizes along the blocks' own x axis (m), (b,)."""
        ...

    @property
    def size_y(self) -> Floats:
        """Sizes along the blocks' own y axis (m), (b,)."""
        ...

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the blocks."""
        ...

    @property
    def outlines(self) -> Floats | None:
        """Corners (m) along the blocks' own axes, the last repeated, (b, k, 2); None where all are rectangles."""
        ...


def corners_of(frames: FramesLike, chosen: Indices) -> Floats:
    """Return the corners (m) of all blocks in some frames, counter-clockwise, (f, b, k, 2)."""
    local = local_corners(frames.size_x, frames.size_y, frames.outlines)
    return placed_points(local, frames.x[chosen], frames.y[chosen], frames.angle[chosen])


def shortest_sides(frames: FramesLike) -> Floats:
    """Return the smaller sides (m) of blocks, of polygons their least widths, (b,)."""
    return least_widths(frames.size_x, frames.size_y, frames.outlines)


def others_of(frames: FramesLike) -> tuple[Track, ...]:
    """Return the systems beside the blocks over time; frames that know none have none."""
    found: tuple[Track, ...] = getattr(frames, "others", ())
    return found


def outlines_of(track: Track, chosen: Indices) -> Floats:
    """Return the outlines (m) of all elements of a system in some frames, (f, b, k, 2)."""
    return track.system.outlines(track, chosen)


BEYOND_REACH = 1e34
"""Metres or radians: ten thousand times the largest simulated value, and finite as 32-bit millimetres."""


def drawable_frames(frames: FramesLike) -> Indices:
    """Return the indices of the frames in which every number is finite (a failed run may end in others).

    Values beyond all reach, as in a damaged file, do not count: millimetres and areas would overflow.
    Raises InvalidInputError when there is none, or nothing in it.
    """
    if len(frames.names) == 0 and not others_of(frames):
        message = "nothing to draw"
        raise InvalidInputError(message)
    finite = np.isfinite(frames.time)
    for field in (frames.x, frames.y, frames.angle):
        finite &= (np.abs(field) < BEYOND_REACH).all(axis=1)  # false for what is not finite
    for track in others_of(frames):
        finite &= (np.abs(track.values) < BEYOND_REACH).all(axis=(1, 2))
    indices = np.flatnonzero(finite)
    if len(indices) == 0:
        message = "no frame to draw"
        raise InvalidInputError(message)
    return indices


def path_travelled(frames: FramesLike, chosen: Indices, carried: Floats | None = None) -> Floats:
    """Return the path (m) up to each chosen frame, summed over the blocks; (len(chosen),), never falling.

    A turn counts as the way of a corner: the angle times half the diagonal. `carried` is how far the support has moved
    along x and y (m) at the chosen frames, (len(chosen), 2): only the way relative to the support counts. The elements
    of every system beside the blocks count as much as all blocks, with their mean way.
    """
    radius = radii(frames.size_x, frames.size_y, frames.outlines)
    places = np.stack([frames.x[chosen], frames.y[chosen]], axis=-1)
    if carried is not None:
        places -= carried[:, None]
    moved = np.hypot(*np.moveaxis(np.diff(places, axis=0), -1, 0))
    turned = radius * np.abs(np.diff(frames.angle[chosen], axis=0))
    way = (moved + turned).sum(axis=1)
    for track in others_of(frames):
        steps = np.hypot(*(np.diff(track[name][chosen], axis=0) for name in ("x", "y")))
        way += max(1, len(frames.names)) * steps.mean(axis=1)
    return np.concatenate([[0.0], np.cumsum(way)])


def moments_by_motion(frames: FramesLike, chosen: Indices, count: int, carried: Floats | None = None) -> Indices:
    """Return at most `count` of the chosen frames, even in the path travelled, first and last included.

    Even spacing in time would show the release and the rest several times and the impacts hardly. Where
    nothing moves, the first and the last frame are left. `carried` as for `path_travelled`.
    """
    path = path_travelled(frames, chosen, carried)
    wanted = np.linspace(0.0, path[-1], count)[1:-1]
    between = np.searchsorted(path, wanted) if path[-1] > 0.0 else np.array([], dtype=np.intp)
    last = len(chosen) - 1
    return chosen[np.unique(np.concatenate([[0], between, [last]]).astype(np.intp))]


def moments_at(frames: FramesLike, chosen: Indices, times: Sequence[float]) -> Indices:
    """Return, for every time (s), the chosen frame nearest to it.

    The last frame's time as pictures print it, rounded to milliseconds, means the last frame, though it may lie outside
    or another frame may be nearer. Raises InvalidInputError when there is no
    time or one lies outside the recorded span.
    """
    recorded = frames.time[chosen]
    first, last = float(recorded[0]), float(recorded[-1])
    outside = [time for time in times if not first - PRINTED <= time <= last + PRINTED]
    if outside:
        message = f"time {outside[0]:g} s lies outside the recorded span, {first:g} to {last:g} s"
        raise InvalidInputError(message)
    if len(times) == 0:
        message = "no times to draw were given"
        raise InvalidInputError(message)
    wanted = [last if time == round(last, PRINTED_DIGITS) else time for time in times]
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
    loads: tuple[Acting, ...] = ()

    @property
    def way(self) -> str:
        """The direction of motion in words."""
        turn = float(np.degrees(np.arctan2(*self.direction[::-1])))
        return "along x" if abs(turn) < LEAST_ANGLE else f"at {turn:.3g}° to x".replace("-", "−")

    @property
    def is_still(self) -> bool:
        """Whether ground and walls are the same at all times."""
        return self.motion is None and not np.isfinite(self.gone).any()

    def at(self, time: float) -> "Support":
        """Return the support with the walls that are there at a time (s)."""
        if not np.isfinite(self.gone).any():
            return self
        there = [time < gone for gone in self.gone]
        return replace(self, walls=tuple(wall for wall, stays in zip(self.walls, there, strict=True) if stays), gone=())

    def displacement(self, times: Floats) -> Floats:
        """Return the displacement (m) along `direction` at these times (s)."""
        return np.zeros_like(times) if self.motion is None else displacement_and_velocity(self.motion, times)[0]

    def velocity(self, times: Floats) -> Floats:
        """Return the velocity (m/s) along `direction` at these times (s)."""
        return np.zeros_like(times) if self.motion is None else displacement_and_velocity(self.motion, times)[1]

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


def event_times(scenario: Scenario, happened: Sequence[Happened] = ()) -> list[float]:
    """Return when (s) each event of a scenario has happened in a run, or will; infinite where nobody knows.

    Of events that wait for rest only a run knows the time.
    """
    times = [np.inf if event.at is None else event.at for event in scenario.events]
    for one in happened:
        times[one.event] = one.time_s
    return times


def support_of(scenario: Scenario, happened: Sequence[Happened] = ()) -> Support:
    """Return the support of a scenario's runs, or of one in which these events have happened."""
    placed, times = place_bodies(scenario), event_times(scenario, happened)
    return Support(
        profile=scenario.ground.profile or Support.profile,
        walls=wall_segments(scenario),
        fixed=tuple(body.fixed and not body.freed for body in placed),
        driven=tuple(body.driven for body in placed) if any(body.driven for body in placed) else (),
        gone=tuple(
            min((at for event, at in zip(scenario.events, times, strict=True) if name in event.remove), default=np.inf)
            for name in wall_names(scenario)
        ),
        tilt=scenario.ground.tilt,
        direction=motion_direction(scenario),
        motion=None if scenario.motion is None else motion_pieces(scenario),
        loads=acting_loads(scenario, times),
        weight=scenario.gravity * sum(body.mass for body in placed if not body.fixed or body.freed),
    )

"""Straight segments of a ground profile and walls, and their joints.

A piece runs from (x0, y0) to (x1, y1) with the solid on its right hand, as the profile does when it is walked towards
+x. Where two pieces join, walking turns left at a valley (concave) and right at an edge (convex).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from blocksim.scenario.models.scenario import Scenario

ENDLESS = 1e5
"""m; how far the level ground beyond the ends of a profile is drawn."""
STRAIGHT = 1e-12
"""Sine of the turn below which two pieces are in one line."""
TOLERANCE = 1e-9
"""m; things at this distance touch, and ends at this distance are one."""

Point = tuple[float, float]
Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class PlacedSegment:
    """One piece of boundary in m, solid on the right hand from start to end.

    `material` is None where it is as the ground. `extends_*`: a neighbour or the ground covers this end, so that
    the piece may reach a little beyond it and no crack opens. `touches_*`: this end is an edge that blocks can land
    on; where two pieces share an edge, it belongs to the first. `sharp_*`: that edge has less than a right angle of
    solid behind it, or is the end of a wall.
    """

    x0: float
    y0: float
    x1: float
    y1: float
    material: str | None
    extends_start: bool
    extends_end: bool
    touches_start: bool
    touches_end: bool
    sharp_start: bool = False
    sharp_end: bool = False

    @property
    def length(self) -> float:
        """Length in m."""
        return math.hypot(self.x1 - self.x0, self.y1 - self.y0)


def place_segments(scenario: Scenario) -> tuple[PlacedSegment, ...]:
    """Return the pieces of the profile towards +x, the level ends included, then the walls in the order of the file.

    Without a profile there are none for the ground: it is the half-plane y < 0.
    """
    return (*profile_segments(scenario), *wall_segments(scenario))


def surface_height(scenario: Scenario, x: float) -> float:
    """Return the height (m) of the ground at x, the upper one at a vertical segment."""
    return float(surface_heights(scenario, np.array([x]))[0])


def surface_heights(scenario: Scenario, x: Floats) -> Floats:
    """Return the heights (m) of the ground at many places x (n,)."""
    points = scenario.ground.profile
    if points is None:
        return np.zeros(x.shape)
    xs, ys = np.array(points).T
    heights = np.interp(x, xs, ys)
    places, begins = np.unique(xs, return_index=True)
    tops = np.maximum.reduceat(ys, begins)
    nearest = np.minimum(np.searchsorted(places, x), places.size - 1)
    return np.where(places[nearest] == x, tops[nearest], heights)


def profile_segments(scenario: Scenario) -> tuple[PlacedSegment, ...]:
    """Return the pieces of the ground's profile; points within a straight line are left out."""
    points = scenario.ground.profile
    if points is None:
        return ()
    (x_first, y_first), (x_last, y_last) = points[0], points[-1]
    line = _corners([(x_first - ENDLESS, y_first), *points, (x_last + ENDLESS, y_last)])
    joints = list(zip(line, line[1:], line[2:], strict=False))
    turns = [0.0, *(_turn(*joint) for joint in joints), 0.0]
    sharp = [*(_is_sharp(*joint) for joint in joints), False]
    return tuple(
        PlacedSegment(
            *one,
            *other,
            material=None,
            extends_start=before > 0.0,
            extends_end=after > 0.0,
            touches_start=False,
            touches_end=after < 0.0,
            sharp_end=is_sharp,
        )
        for (one, other), (before, after), is_sharp in zip(pairwise(line), pairwise(turns), sharp, strict=True)
    )


def _corners(points: Sequence[Point]) -> list[Point]:
    """Leave out the points where the line does not turn."""
    kept = [points[0]]
    for middle, other in pairwise(points[1:]):
        if abs(_turn(kept[-1], middle, other)) > STRAIGHT:
            kept.append(middle)
    return [*kept, points[-1]]


def _turn(before: Point, joint: Point, after: Point) -> float:
    """Return the sine of the turn at a joint, positive to the left; -1 where it goes back."""
    x0, y0 = joint[0] - before[0], joint[1] - before[1]
    x1, y1 = after[0] - joint[0], after[1] - joint[1]
    sine = (x0 * y1 - y0 * x1) / (math.hypot(x0, y0) * math.hypot(x1, y1))
    return -1.0 if abs(sine) <= STRAIGHT and x0 * x1 + y0 * y1 < 0.0 else sine


def _is_sharp(before: Point, joint: Point, after: Point) -> bool:
    """Return True at an edge with less than a right angle of solid behind it."""
    back = (joint[0] - before[0]) * (after[0] - joint[0]) + (joint[1] - before[1]) * (after[1] - joint[1]) < 0.0
    return back and _turn(before, joint, after) < 0.0


def wall_segments(scenario: Scenario) -> tuple[PlacedSegment, ...]:
    """Return one piece for every wall."""
    walls = scenario.walls
    starts, ends = (np.array([getattr(wall, end) for wall in walls]).reshape(-1, 2) for end in ("start", "end"))
    pieces = []
    for number, wall in enumerate(walls):
        others = np.arange(len(walls)) != number
        before, after = _neighbour(ends, wall.start, number), _neighbour(starts, wall.end, number)
        into = None if before is None else _turn(walls[before].start, walls[before].end, wall.end)
        onwards = None if after is None else _turn(wall.start, wall.end, walls[after].end)
        # ends without a neighbour: covered by the ground or the middle of another wall, or not
        is_start_free, is_end_free = (
            end[1] > surface_height(scenario, end[0]) + TOLERANCE and not _touches(end, starts[others], ends[others])
            for end in (wall.start, wall.end)
        )
        piece = PlacedSegment(
            *wall.start,
            *wall.end,
            material=wall.material,
            extends_start=not is_start_free if into is None else into > STRAIGHT,
            extends_end=not is_end_free if onwards is None else onwards > STRAIGHT,
            touches_start=into is None and is_start_free,
            touches_end=is_end_free if onwards is None else onwards < -STRAIGHT,
            sharp_start=into is None and is_start_free,
            sharp_end=is_end_free if after is None else _is_sharp(wall.start, wall.end, walls[after].end),
        )
        pieces.append(piece)
    return tuple(pieces)


def _neighbour(points: Floats, end: Point, number: int) -> int | None:
    """Return the first other wall with an end at the same point; ends are (n, 2)."""
    near = np.flatnonzero(np.hypot(points[:, 0] - end[0], points[:, 1] - end[1]) <= TOLERANCE)
    return next((int(other) for other in near if other != number), None)


def _touches(point: Point, starts: Floats, ends: Floats) -> bool:
    """Return True if a point is on any of these walls."""
    along, beyond = ends - starts, np.array(point) - starts
    share = np.clip(np.sum(beyond * along, axis=1) / np.sum(along * along, axis=1), 0.0, 1.0)
    distance = beyond - share[:, np.newaxis] * along
    return bool(np.any(np.hypot(distance[:, 0], distance[:, 1]) <= TOLERANCE))

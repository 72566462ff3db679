"""The straight pieces that a ground profile and walls consist of, and how they join.

A piece runs from (x0, y0) to (x1, y1) with the solid on its right hand, as the profile does when it is walked towards
+x. Where two pieces join, walking turns left at a valley (concave) and right at an edge (convex).
"""

import math
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

from blocksim.scenario.models.boundary import Wall
from blocksim.scenario.models.scenario import Scenario

ENDLESS = 1e5
"""m; how far the level ground beyond the ends of a profile is drawn."""
STRAIGHT = 1e-12
"""Sine of the turn below which two pieces are in one line."""
TOLERANCE = 1e-9
"""m; what is this near touches, and ends this near to each other are one."""

Point = tuple[float, float]


@dataclass(frozen=True, slots=True)
class PlacedSegment:
    """One piece of boundary in m, solid on the right hand from start to end.

    `material` is None where it is as the ground. `extends_*`: a neighbour or the ground covers this end, so that
    the piece may reach a little beyond it and no crack opens. `touches_*`: this end is an edge that blocks can land
    on; where two pieces share an edge, it belongs to the first.
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
    """Return the height (m) of the ground at x, the upper one where it is vertical."""
    points = scenario.ground.profile
    if points is None:
        return 0.0
    xs = [point[0] for point in points]
    first, after = bisect_left(xs, x), bisect_right(xs, x)
    if first < after:
        return max(point[1] for point in points[first:after])
    if first in (0, len(points)):
        return points[max(0, first - 1)][1]
    (x0, y0), (x1, y1) = points[first - 1], points[first]
    return y0 + (y1 - y0) * (x - x0) / (x1 - x0)


def profile_segments(scenario: Scenario) -> tuple[PlacedSegment, ...]:
    """Return the pieces of the ground's profile; points within a straight line are left out."""
    points = scenario.ground.profile
    if points is None:
        return ()
    (x_first, y_first), (x_last, y_last) = points[0], points[-1]
    line = _corners([(x_first - ENDLESS, y_first), *points, (x_last + ENDLESS, y_last)])
    turns = [0.0, *(_turn(a, b, c) for a, b, c in zip(line, line[1:], line[2:], strict=False)), 0.0]
    return tuple(
        PlacedSegment(
            *one,
            *other,
            material=None,
            extends_start=turn_before > 0.0,
            extends_end=turn_after > 0.0,
            touches_start=False,
            touches_end=turn_after < 0.0,
        )
        for (one, other), (turn_before, turn_after) in zip(pairwise(line), pairwise(turns), strict=True)
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


class _End(NamedTuple):
    extends: bool
    touches: bool


def wall_segments(scenario: Scenario) -> tuple[PlacedSegment, ...]:
    """Return one piece for every wall."""
    return tuple(_wall(scenario, wall) for wall in scenario.walls)


def _wall(scenario: Scenario, wall: Wall) -> PlacedSegment:
    others = [other for other in scenario.walls if other is not wall]
    before = next((other for other in others if _is_near(other.end, wall.start)), None)
    after = next((other for other in others if _is_near(wall.end, other.start)), None)
    start = _free_end(scenario, wall.start, others) if before is None else _joint(before, wall, is_first=False)
    end = _free_end(scenario, wall.end, others) if after is None else _joint(wall, after, is_first=True)
    return PlacedSegment(
        *wall.start,
        *wall.end,
        material=wall.material,
        extends_start=start.extends,
        extends_end=end.extends,
        touches_start=start.touches,
        touches_end=end.touches,
    )


def _joint(before: Wall, after: Wall, *, is_first: bool) -> _End:
    turn = _turn(before.start, before.end, after.end)
    return _End(extends=turn > STRAIGHT, touches=is_first and turn < -STRAIGHT)


def _free_end(scenario: Scenario, point: Point, others: Sequence[Wall]) -> _End:
    """Tell whether the ground or another wall covers an end."""
    is_covered = point[1] <= surface_height(scenario, point[0]) + TOLERANCE
    is_covered = is_covered or any(_distance(point, other) <= TOLERANCE for other in others)
    return _End(extends=is_covered, touches=not is_covered)


def _is_near(one: Point, other: Point) -> bool:
    return math.dist(one, other) <= TOLERANCE


def _distance(point: Point, wall: Wall) -> float:
    """Return the distance of a point from a wall."""
    along_x, along_y = wall.end[0] - wall.start[0], wall.end[1] - wall.start[1]
    from_x, from_y = point[0] - wall.start[0], point[1] - wall.start[1]
    share = (from_x * along_x + from_y * along_y) / (along_x * along_x + along_y * along_y)
    share = min(1.0, max(0.0, share))
    return math.hypot(from_x - share * along_x, from_y - share * along_y)

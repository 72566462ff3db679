"""Support of a run's blocks, as pictures need it: ground, walls, fixed bodies, and their motion."""

from dataclasses import dataclass

import numpy as np

from blocksim.scenario import PlacedSegment, Scenario, place_bodies
from blocksim.scenario.motion import MotionPieces, displacement_and_velocity, motion_direction, motion_pieces
from blocksim.scenario.segments import wall_segments
from blocksim.view.moments import Floats


@dataclass(frozen=True)
class Support:
    """Ground, walls and fixed bodies of one run; x runs along the ground, all in SI. The default: level and at rest.

    `profile` is the surface towards +x, level beyond both ends. `fixed` states for every body whether it moves with the
    support. A tilt raises the +x end. Without `motion` all rest. `weight` (N) is that of all free bodies.
    """

    profile: tuple[tuple[float, float], ...] = ((0.0, 0.0), (1.0, 0.0))
    walls: tuple[PlacedSegment, ...] = ()
    fixed: tuple[bool, ...] = ()
    tilt: float = 0.0
    direction: tuple[float, float] = (1.0, 0.0)
    motion: MotionPieces | None = None
    weight: float = 0.0

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


def support_of(scenario: Scenario) -> Support:
    """Return the support of a scenario's runs."""
    placed = place_bodies(scenario)
    return Support(
        profile=scenario.ground.profile or Support.profile,
        walls=wall_segments(scenario),
        fixed=tuple(body.fixed for body in placed),
        tilt=scenario.ground.tilt,
        direction=motion_direction(scenario),
        motion=None if scenario.motion is None else motion_pieces(scenario),
        weight=scenario.gravity * sum(body.mass for body in placed if not body.fixed),
    )

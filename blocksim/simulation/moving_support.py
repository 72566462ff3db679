"""Motion of ground, walls and fixed bodies, a moment at a time, in plain numbers: what moves relative to them."""

from bisect import bisect_right

from blocksim.scenario import Scenario
from blocksim.scenario.motion import motion_direction, motion_pieces


class MovingSupport:
    """Motion of the support."""

    def __init__(self, scenario: Scenario | None) -> None:
        """Work out the pieces of its motion once; without a scenario, or without a motion, it rests."""
        self.times: list[float] = []
        self.coefficients: list[list[float]] = []
        self.direction = (1.0, 0.0)
        if scenario is not None and scenario.motion is not None:
            pieces = motion_pieces(scenario)
            self.direction = motion_direction(scenario)
            self.times, self.coefficients = pieces.times.tolist(), pieces.coefficients.tolist()

    @property
    def moves(self) -> bool:
        """Whether it does not rest all the time."""
        return bool(self.coefficients)

    def at(self, time: float) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return displacement (m) and velocity (m/s) along x and y at a time (s)."""
        if not self.coefficients:
            return (0.0, 0.0), (0.0, 0.0)
        piece = min(max(bisect_right(self.times, time) - 1, 0), len(self.coefficients) - 1)
        s = time - self.times[piece]
        c0, c1, c2, c3 = self.coefficients[piece]
        moved, speed = c0 + s * (c1 + s * (c2 + s * c3)), c1 + s * (2.0 * c2 + 3.0 * s * c3)
        (x, y) = self.direction
        return (moved * x, moved * y), (speed * x, speed * y)

    def way(self, time: float) -> tuple[float, float]:
        """Return how far (m) it has come along x and y since the start, at a time (s)."""
        (x, y), _ = self.at(time)
        (x0, y0), _ = self.at(0.0)
        return x - x0, y - y0


AT_REST = MovingSupport(None)

"""A block that rocks on level ground without slipping, event by event: exact times of impacts, no time step.

An independent answer to what rigid contacts have to find: Newton's restitution at every corner that meets the ground
faster than a threshold, no rebound below it, a corner that stands on the ground at an impact is held by it.
"""

from __future__ import annotations

from itertools import product
from math import atan2, cos, sin
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.integrate import solve_ivp

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

G = 9.81
THRESHOLD = 0.01  # m/s
ROUND_OFF = 1e-9  # m, m/s
LIFT = 1e-12  # m: of a corner that leaves the ground, so that it is seen to come back
LONGEST = 2e-4  # s: between two looks for impacts


class Rocker:
    """A block of unit mass that is let go on one corner, half as far tilted as it takes to topple."""

    def __init__(self, width: float, height: float, restitution: float) -> None:
        """Take the sides (m) and the restitution of an impact."""
        self.restitution = restitution
        self.inertia = (width**2 + height**2) / 12.0
        self.corners = np.array([[-width / 2, -height / 2], [width / 2, -height / 2]])
        tilt = -0.5 * atan2(width, height)
        self.state = np.array([0.0, 0.0, tilt, 0.0, 0.0, 0.0])  # x, y, angle, and their rates
        self.state[:2] = -self.arms(self.state)[1]
        self.pivot: int | None = 1  # the corner that it turns about

    def arms(self, state: Floats) -> Floats:
        """Return from the centre to the lower corners (m)."""
        c, s = cos(state[2]), sin(state[2])
        turned: Floats = self.corners @ np.array([[c, s], [-s, c]])
        return turned

    def gap(self, corner: int, state: Floats) -> float:
        """Return how high (m) a corner is."""
        return float(state[1] + self.arms(state)[corner, 1])

    def pull(self, state: Floats) -> tuple[Floats, float]:
        """Return the accelerations of centre and angle, and the force of the ground on the pivot along its normal."""
        if self.pivot is None:
            return np.array([0.0, -G, 0.0]), 0.0
        x, y = self.arms(state)[self.pivot]
        spin = state[5]
        turn = G * x / (self.inertia + x * x + y * y)
        force = G - turn * x + spin * spin * y
        return np.array([turn * y + spin * spin * x, force - G, turn]), force

    def fall(self) -> list[float]:
        """Move until a corner meets the ground or the pivot leaves it; return the angles at which it turned back."""
        free = [k for k in (0, 1) if k != self.pivot]
        events: list[Any] = [lambda _, state, k=k: self.gap(k, state) for k in free]
        if self.pivot is not None:
            events.append(lambda _, state: self.pull(state)[1])
        for event in events:
            event.terminal, event.direction = True, -1.0
        events.append(lambda _, state: state[5])
        found = solve_ivp(
            lambda _, state: np.concatenate([state[3:], self.pull(state)[0]]),
            (0.0, 1.0),
            self.state,
            "DOP853",
            events=events,
            rtol=1e-12,
            atol=1e-14,
            max_step=LONGEST,
        )
        self.state = found.y[:, -1]
        turns = zip(found.t_events[-1], found.y_events[-1], strict=True)
        return [float(state[2]) for time, state in turns if time > 0.0]

    def rows(self, corners: list[int]) -> Floats:
        """Return how the upward velocities of corners depend on the rates."""
        return np.array([[0.0, 1.0, self.arms(self.state)[k, 0]] for k in corners])

    def meet(self) -> None:
        """Go through the impacts of all corners on the ground, until none approaches it."""
        touching = [k for k in (0, 1) if k == self.pivot or self.gap(k, self.state) < ROUND_OFF]
        while (self.rows(touching) @ self.state[3:]).min() < -ROUND_OFF:
            speeds = self.rows(touching) @ self.state[3:]
            chosen = [k for k, speed in zip(touching, speeds, strict=True) if speed <= THRESHOLD]
            speeds = self.rows(chosen) @ self.state[3:]
            self.strike(chosen, np.where(speeds < -THRESHOLD, -self.restitution * speeds, 0.0))
        speeds = self.rows(touching) @ self.state[3:]
        held = [k for k, speed in zip(touching, speeds, strict=True) if abs(speed) < ROUND_OFF]
        self.pivot = held[0] if len(held) == 1 else None
        if self.pivot is not None and self.pull(self.state)[1] < 0.0:
            self.pivot = None
        leaving = [k for k in touching if k != self.pivot]
        self.state[1] += max(0.0, LIFT - min((self.gap(k, self.state) for k in leaving), default=LIFT))

    def strike(self, corners: list[int], targets: Floats) -> None:
        """Find the impulses that bring corners to their least upward velocities (m/s) and stop their slip."""
        slip = np.array([[1.0, 0.0, -self.arms(self.state)[corners[0], 1]]])
        compliance = np.array([1.0, 1.0, 1.0 / self.inertia])
        for is_active in product([True, False], repeat=len(corners)):
            active = [k for k, it_is in zip(corners, is_active, strict=True) if it_is]
            if active:
                rows = np.vstack([self.rows(active), slip])
                wanted = np.append(targets[list(is_active)], 0.0) - rows @ self.state[3:]
                impulses = np.linalg.solve(rows * compliance @ rows.T, wanted)
                after = self.state[3:] + compliance * (rows.T @ impulses)
                if impulses[:-1].min() >= 0.0 and (self.rows(corners) @ after - targets).min() >= -ROUND_OFF:
                    self.state[3:] = after
                    return
        message = "no impulses found"
        raise RuntimeError(message)


def rocking_peaks(width: float, height: float, restitution: float, count: int = 4) -> Floats:
    """Return how far (rad) a block turns, each of the first times that it turns back."""
    block = Rocker(width, height, restitution)
    found: list[float] = []
    while len(found) < count:
        found += block.fall()
        before = block.state.copy()
        block.meet()
        if before[5] * block.state[5] < 0.0:
            found.append(float(before[2]))
    return np.abs(found[:count])

"""Speed of a domino wave: the collective model of J. M. J. van Leeuwen, Am. J. Phys. 78 (2010) 721-727.

Dominoes of height h and thickness d stand with free gaps s. They turn about their lower front edges, which do not slip;
faces are frictionless and collisions lose everything: a domino that has struck the next continues leaning on it. So all
fallen dominoes and the foremost one move with one degree of freedom, the foremost one's angle. Between two collisions
their energy is kept. In a collision the velocities are projected, in the metric of the kinetic energy, on those that
the new contact allows; impulses between leaning dominoes are what makes the projection.

Lengths in units of h, time in units of sqrt(h/g); angles from the vertical.
"""

from dataclasses import dataclass
from math import asin, cos, sin, sqrt

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
STEPS = 400  # of the foremost domino's angle between two collisions


@dataclass(frozen=True)
class Dominoes:
    """A row of dominoes, in units of their height."""

    thickness: float
    gap: float

    @property
    def inertia(self) -> float:
        """Moment of inertia about the lower edge, per mass."""
        return (1.0 + self.thickness**2) / 3.0

    @property
    def strike(self) -> float:
        """Angle (rad) at which a domino strikes the next, still upright one."""
        return asin(self.gap)

    def height(self, angles: Floats) -> float:
        """Return the sum of the heights of all centres."""
        return float(0.5 * np.sum(np.cos(angles) + self.thickness * np.sin(angles)))

    def leaning(self, foremost: float, count: int) -> tuple[Floats, Floats]:
        """Return angles of `count` dominoes that lean on one another, foremost first, and d angle/d foremost.

        The upper front edge of one touches the back of the next: sin(a - b) = (s + d) cos b - d, a behind b.
        """
        angles, rates = [foremost], [1.0]
        pitch = self.gap + self.thickness
        for _ in range(count - 1):
            front = angles[-1]
            reach = pitch * cos(front) - self.thickness
            slope = 1.0 - pitch * sin(front) / sqrt(1.0 - reach**2)
            angles.append(front + asin(reach))
            rates.append(slope * rates[-1])
        return np.array(angles), np.array(rates)


def collision_times(dominoes: Dominoes, count: int, spin: float) -> Floats:
    """Return the times at which domino 1, 2, ... `count` strikes the next; domino 1 starts upright with `spin`."""
    time, times = 0.0, []
    for fallen in range(1, count + 1):
        taken, spin = _turn(dominoes, fallen, spin)
        time += taken
        times.append(time)
        spin = _strike(dominoes, fallen, spin)
    return np.array(times)


def _turn(dominoes: Dominoes, fallen: int, spin: float) -> tuple[float, float]:
    """Let the foremost of `fallen` dominoes turn from upright to the next one; return the time taken and its spin."""
    nodes = dominoes.strike * np.linspace(0.0, 1.0, STEPS + 1)
    states = [dominoes.leaning(float(angle), fallen) for angle in nodes]
    masses = np.array([0.5 * dominoes.inertia * float(rates @ rates) for _, rates in states])
    heights = np.array([dominoes.height(angles) for angles, _ in states])
    squares = (masses[0] * spin**2 + heights[0] - heights) / masses
    if squares.min() <= 0.0:
        message = f"the row stops at domino {fallen}"
        raise ValueError(message)
    slowness = 1.0 / np.sqrt(squares)
    return float(np.sum(0.5 * (slowness[1:] + slowness[:-1]) * np.diff(nodes))), float(np.sqrt(squares[-1]))


def _strike(dominoes: Dominoes, fallen: int, spin: float) -> float:
    """Return the spin of the domino that is struck by the foremost of `fallen` ones turning with `spin`."""
    _, before = dominoes.leaning(dominoes.strike, fallen)
    _, after = dominoes.leaning(0.0, fallen + 1)
    return spin * float(before @ after[1:]) / float(after @ after)


def wave_speed(dominoes: Dominoes, first: int, last: int, spin: float) -> float:
    """Return the speed of the wave between two collisions, in units of sqrt(g h)."""
    times = collision_times(dominoes, last, spin)
    return (last - first) * (dominoes.gap + dominoes.thickness) / float(times[last - 1] - times[first - 1])

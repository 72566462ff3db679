"""V18: a row of dominoes falls as fast as the collective model of J. M. J. van Leeuwen says.

Dominoes of height h and thickness d stand with free gaps s. They turn about their lower front edges, which do not slip;
faces are frictionless and collisions lose everything: a domino that has struck the next continues leaning on it. So all
fallen dominoes and the foremost one move with one degree of freedom, the foremost one's angle. Between two collisions
their energy is kept. In a collision the velocities are projected, in the metric of the kinetic energy, on those that
the new contact allows; impulses between leaning dominoes are what makes the projection. (Am. J. Phys. 78 (2010)
721-727.)

Lengths of the model in units of h, time in units of sqrt(h/g); angles from the vertical.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import asin, cos, sin, sqrt
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from blocksim.verification.case import Row, Setting, relative

if TYPE_CHECKING:
    from collections.abc import Iterator

    from blocksim.verification.scene import Simulation

Floats = NDArray[np.float64]
STEPS = 400  # of the foremost domino's angle between two collisions of the model
TALL, THICK = 0.048, 0.0075  # m
COUNT = 24
GAPS = (0.2, 0.3, 0.5, 0.7)  # of the height
FIRST, LAST = 10, 20
PUSH = 6.5  # spin of the first domino in units of sqrt(g/h): near that of the stationary wave for every gap
NO_SLIP = 5.0  # friction coefficient
GRAVITY = 9.81  # m/s2
SOFT = 0.01  # stiffness scale of the quick size
POLL = 2e-4  # s
LONGEST = 2.0  # s


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


def dominoes(setting: Setting) -> Iterator[Row]:
    """Push the first of 24 dominoes; time the wave from the collision of domino 10 to that of domino 20."""
    for gap in GAPS[:2] if setting.quick else GAPS:
        model = wave_speed(Dominoes(THICK / TALL, gap), FIRST, LAST, PUSH) * sqrt(GRAVITY * TALL)
        times = strike_times(row(setting, gap))
        speed = (LAST - FIRST) * (gap * TALL + THICK) / (times[LAST - 1] - times[FIRST - 1])
        yield relative(f"gap {gap:g} h, speed", "m/s", model, speed, 0.05)


def row(setting: Setting, gap: float) -> Simulation:
    """Start the row; the first domino turns about its lower front edge."""
    spin = -PUSH * sqrt(GRAVITY / TALL)  # clockwise
    pitch = gap * TALL + THICK
    bodies: list[dict[str, object]] = [
        {"x": i * pitch, "y": TALL / 2, "width": THICK, "height": TALL} for i in range(COUNT)
    ]
    bodies[0] |= {"spin": spin, "velocity": [-spin * TALL / 2, -spin * -THICK / 2]}
    contact = {"stiffness_scale": SOFT if setting.quick else 1.0}
    return setting.start(bodies, restitution=0.0, friction=0.0, ground_friction=NO_SLIP, contact=contact)


def strike_times(scene: Simulation) -> list[float]:
    """Return when each domino strikes the next: when that one starts to turn. NaN where it does not."""
    moving = 1e-2 * sqrt(GRAVITY / TALL)  # rad/s
    times = [np.nan] * (COUNT - 1)
    while scene.time < LONGEST and np.isnan(times[LAST - 1]):
        scene.to_time(scene.time + POLL)
        for i in np.flatnonzero(scene.bodies.spin[1:] < -moving):
            times[i] = scene.time if np.isnan(times[i]) else times[i]
    return times

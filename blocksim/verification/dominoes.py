"""V18: a row of dominoes falls as fast as the collective model says."""

from __future__ import annotations

from math import sqrt
from typing import TYPE_CHECKING

import numpy as np

from blocksim.verification.case import Row, Setting, relative
from blocksim.verification.domino_train import Dominoes, wave_speed

if TYPE_CHECKING:
    from collections.abc import Iterator

    from blocksim.verification.scene import Simulation

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


def dominoes(setting: Setting) -> Iterator[Row]:
    """Push the first of 24 dominoes; time the wave from the collision of domino 10 to that of domino 20."""
    for gap in GAPS[:2] if setting.quick else GAPS:
        model = wave_speed(Dominoes(THICK / TALL, gap), FIRST, LAST, PUSH) * sqrt(GRAVITY * TALL)
        times = collision_times(row(setting, gap))
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


def collision_times(scene: Simulation) -> list[float]:
    """Return when each domino strikes the next: when that one starts to turn. NaN where it does not."""
    moving = 1e-2 * sqrt(GRAVITY / TALL)  # rad/s
    times = [np.nan] * (COUNT - 1)
    while scene.time < LONGEST and np.isnan(times[LAST - 1]):
        scene.to_time(scene.time + POLL)
        for i in np.flatnonzero(scene.bodies.spin[1:] < -moving):
            times[i] = scene.time if np.isnan(times[i]) else times[i]
    return times

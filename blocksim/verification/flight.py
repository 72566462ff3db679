"""V1 free flight and V3 bounces."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from blocksim.verification import closed_forms as forms
from blocksim.verification.case import Row, Setting, absolute, farthest, relative
from blocksim.verification.scene import HEIGHT, Simulation

if TYPE_CHECKING:
    from collections.abc import Iterator

SPACINGS = (5e-4, 1e-3, 2e-3, 4e-3)  # m, of boundary particles
DROP, RESTITUTION = 0.1, 0.5  # m, -
POLL = 5e-5  # s
LARGEST = 10.0  # m, m/s: the numbers of the flight are smaller
BOUNCE_TOLERANCES = (0.01, 0.02, 0.04)
LONGEST = 0.6  # s; all bounces are over by then


def free_flight(setting: Setting) -> Iterator[Row]:
    """Compare a flight with a parabola and its spin with a constant, to round-off times steps."""
    flight = setting.start([{"y": 2.0, "velocity": [1.5, 2.5], "spin": 30.0, "angle": 0.4}]).to_time(0.2)
    t, body = flight.time, flight.bodies[0]
    round_off = LARGEST * flight.steps * float(np.finfo(float).eps)
    aside, above = body.x - 1.5 * t, body.y - (2.0 + 2.5 * t - forms.fall_distance(t))
    yield absolute("off the parabola", "m", 0.0, max(abs(aside), abs(above)), round_off)
    yield absolute("off the speed", "m/s", 0.0, max(abs(body.vx - 1.5), abs(body.vy - 2.5 + 9.81 * t)), round_off)
    yield absolute("off the angle", "rad", 0.0, abs(body.angle - 0.4 - 30.0 * t), round_off)
    yield absolute("change of spin", "rad/s", 0.0, abs(body.spin - 30.0), round_off)


def bounces(setting: Setting) -> Iterator[Row]:
    """Drop a block flat; apexes and flight time at four particle spacings, the farthest off counts."""
    found = [observed(dropped(setting, spacing), 3) for spacing in setting.distinct(SPACINGS)]
    for impact, tolerance in enumerate(BOUNCE_TOLERANCES, start=1):
        expected = forms.apex_height(DROP, RESTITUTION, impact)
        apex = farthest(expected, [apexes[impact - 1] for _, apexes in found])
        yield relative(f"apex {impact}", "mm", 1e3 * expected, 1e3 * apex, tolerance)
    expected = forms.flight_time(DROP, RESTITUTION, 1)
    flight = farthest(expected, [times[1] - times[0] for times, _ in found])
    yield relative("first flight", "s", expected, flight, BOUNCE_TOLERANCES[0])


def dropped(setting: Setting, spacing: float) -> Simulation:
    """Drop a block flat from 0.1 m."""
    body = {"y": HEIGHT / 2 + DROP}
    return setting.start([body], restitution=RESTITUTION, contact={"particle_spacing": spacing})


def observed(fall: Simulation, impacts: int) -> tuple[list[float], list[float]]:
    """Return the times (s) of so many impacts and one more, and the apexes (m) between them; NaN where there is none.

    The time of an impact is that of the steepest change of speed, half a poll either way.
    """
    times: list[float] = []
    apexes = [0.0]
    falling = True
    poll = max(POLL, fall.step)
    while len(times) <= impacts and fall.time < LONGEST:
        fall.to_time(fall.time + poll)
        body = fall.bodies[0]
        if falling and body.vy > 0.0:
            times.append(fall.time - poll / 2)
            apexes.append(0.0)
        falling = body.vy < 0.0
        apexes[-1] = max(apexes[-1], float(body.y) - HEIGHT / 2)
    missing = impacts + 1 - len(times)
    return times + [np.nan] * missing, [*apexes[1:-1], *([np.nan] * missing)]

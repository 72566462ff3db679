"""Equations 10 and 13 over a simulated bounce and a simulated slide."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.simulation.result import Result
from blocksim.verification import closed_forms as forms
from blocksim.view.law import Law

Floats = NDArray[np.float64]
MILLI = 1e3
LEAST_APEX = 2e-5  # m; lower bounces are not distinguished from rest


class Bounce(NamedTuple):
    """Apexes (mm) and times of flight (ms) of bounce number p, simulated and by Eq. 12."""

    number: int
    apex: float
    eq12_apex: float
    flight: float
    eq12_flight: float


def bounce_law(result: Result) -> Law:
    """Return the height (mm) of the lower face over a bounce, and Eq. 10 from its start.

    The second form of Eq. 10 as printed gives the remaining rise: the height is the apex of Eq. 12 less
    that.
    """
    frames, scenario = result.frames, result.scenario
    clearance = frames.y[:, 0] - 0.5 * frames.size_y[0]
    start, restitution = float(clearance[0]), scenario.contact.restitution.block_ground
    impacts = impact_times(start, restitution, scenario.gravity)
    expected = np.array([_height(float(time), start, restitution, scenario.gravity, impacts) for time in frames.time])
    marks = [time for time in impacts if time < float(frames.time[-1])]
    return Law("height", "mm", "Eq. 10", frames.time, MILLI * clearance, MILLI * expected, marks)


def impact_times(height: float, restitution: float, gravity: float) -> list[float]:
    """Return the times (s) of the impacts of a body dropped from a height (m), as long as it rises between them."""
    times = [forms.fall_time(height, gravity)]
    while forms.apex_height(height, restitution, len(times)) > LEAST_APEX:
        times.append(times[-1] + forms.flight_time(height, restitution, len(times), gravity))
    return times


def bounces(result: Result) -> list[Bounce]:
    """Return apex and flight time of each bounce, simulated and by Eq. 12.

    In free flight height and speed of any frame give the apex and the instant of landing; the simulated flight time is
    that between two landings, the time in contact included.
    """
    frames, gravity = result.frames, result.scenario.gravity
    clearance, speed = frames.y[:, 0] - 0.5 * frames.size_y[0], frames.vy[:, 0]
    restitution, start = result.scenario.contact.restitution.block_ground, float(clearance[0])
    turns = np.flatnonzero((speed[:-1] < 0.0) & (speed[1:] > 0.0)) + 1
    tops, landings = [], []
    for first, last in pairwise([0, *turns]):
        flight = slice(first, last)
        rise = speed[flight] ** 2 / (2.0 * gravity)
        free = clearance[flight] > 0.0
        top = (clearance[flight] + rise)[free]
        landing = (frames.time[flight] + speed[flight] / gravity)[free] + np.sqrt(2.0 * top / gravity)
        tops.append(float(np.median(top)))
        landings.append(float(np.median(landing)))
    return [
        Bounce(
            number,
            MILLI * tops[number],
            MILLI * forms.apex_height(start, restitution, number),
            MILLI * (landings[number] - landings[number - 1]),
            MILLI * forms.flight_time(start, restitution, number, gravity),
        )
        for number in range(1, len(tops))
        if forms.apex_height(start, restitution, number) > LEAST_APEX
    ]


def slide_law(result: Result) -> Law:
    """Return the speed (mm/s) of a sliding block, and Eq. 13 with the ground's friction."""
    frames, scenario = result.frames, result.scenario
    friction = scenario.friction.block_ground.kinetic
    start = float(frames.vx[0, 0])
    expected = np.array([forms.sliding_speed(float(time), start, friction, scenario.gravity) for time in frames.time])
    marks = [forms.sliding_stop_time(start, friction, scenario.gravity)]
    return Law("speed", "mm/s", "Eq. 13", frames.time, MILLI * frames.vx[:, 0], MILLI * expected, marks)


def _height(time: float, start: float, restitution: float, gravity: float, impacts: list[float]) -> float:
    """Return the height (m) of the lower face by Eqs 10 and 12, 0 after the last bounce."""
    if time < impacts[0]:
        return start - forms.fall_distance(time, gravity)
    number = sum(impact <= time for impact in impacts)
    if number == len(impacts):
        return 0.0
    since = time - impacts[number - 1]
    still = forms.remaining_rise(since, start, restitution, number, gravity)
    return forms.apex_height(start, restitution, number) - still

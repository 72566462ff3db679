"""Largest acceleration, velocity and displacement of the supports (PGA, PGV, PGD), exact for their cubic pieces."""

import math
from typing import NamedTuple

import numpy as np

from blocksim.scenario.models.motion import Harmonic
from blocksim.scenario.models.pulse import Pulse
from blocksim.scenario.models.scenario import Scenario
from blocksim.scenario.motion import Floats, MotionPieces, displacement_and_velocity, motion_pieces


class Peak(NamedTuple):
    """The largest absolute value of a quantity, SI, and when it occurs (s)."""

    value: float
    time: float


class MotionPeaks(NamedTuple):
    """Peaks of acceleration (m/s²), velocity (m/s) and displacement (m) until an end, and the velocity (m/s) there."""

    acceleration: Peak
    velocity: Peak
    displacement: Peak
    final_velocity: float


def acceleration_ends(pieces: MotionPieces) -> tuple[Floats, Floats]:
    """Return times (s) and accelerations (m/s²) at both ends of every piece, (2 k,): linear between, with jumps."""
    _, _, c2, c3 = pieces.coefficients.T
    first = 2.0 * c2
    last = first + 6.0 * c3 * np.diff(pieces.times)
    times = np.stack([pieces.times[:-1], pieces.times[1:]], axis=1)
    return times.ravel(), np.stack([first, last], axis=1).ravel()


def motion_peaks(pieces: MotionPieces, end: float) -> MotionPeaks:
    """Return the peaks from 0 to `end` (s), which lies within the pieces; the supports move."""
    times, accelerations = acceleration_ends(pieces)
    within = times <= end
    moments = _moments(pieces, end)
    displacement, velocity = displacement_and_velocity(pieces, moments)
    return MotionPeaks(
        _largest(accelerations[within], times[within]),
        _largest(velocity, moments),
        _largest(displacement, moments),
        float(displacement_and_velocity(pieces, np.array([end]))[1][0]),
    )


def shortest_cycle(scenario: Scenario) -> float:
    """Return the shortest cycle (s) of harmonic motions and pulses, of supports or bodies; infinite without any."""
    motions = (scenario.motion, *(body.motion for body in scenario.bodies))
    return min((motion.cycle for motion in motions if isinstance(motion, Harmonic | Pulse)), default=math.inf)


def shortest_period(scenario: Scenario) -> float:
    """Return the shortest period (s) of what moves as prescribed; infinite where nothing does.

    That is the shortest cycle, or 2 pi times the peak velocity of the supports over their peak acceleration: with a
    harmonic motion the same, with a steep ramp or a table the time in which it does what matters.
    """
    shortest = shortest_cycle(scenario)
    if scenario.motion is None:
        return shortest
    peaks = motion_peaks(motion_pieces(scenario), scenario.time.end)
    if not peaks.acceleration.value > 0.0:
        return shortest
    return min(shortest, 2.0 * math.pi * peaks.velocity.value / peaks.acceleration.value)


def _largest(values: Floats, times: Floats) -> Peak:
    place = int(np.argmax(np.abs(values)))
    return Peak(abs(float(values[place])), float(times[place]))


def _moments(pieces: MotionPieces, end: float) -> Floats:
    """Return all times (s) at which velocity or displacement may be largest: joints, and where their rates vanish."""
    _, c1, c2, c3 = pieces.coefficients.T
    length = np.diff(pieces.times)
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(c2 * c2 - 3.0 * c1 * c3)
        inner = [-c2 / (3.0 * c3), (-c2 + root) / (3.0 * c3), (-c2 - root) / (3.0 * c3), -0.5 * c1 / c2]
    inside = [pieces.times[:-1] + np.clip(np.nan_to_num(one, posinf=0.0, neginf=0.0), 0.0, length) for one in inner]
    moments = np.concatenate([pieces.times, *inside, [end]])
    return np.unique(moments[moments <= end])

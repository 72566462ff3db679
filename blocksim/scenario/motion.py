"""Prescribed motion of the supports over time: displacement along one direction as a piecewise cubic polynomial."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.scenario.accelerations import pulse_samples, record_samples
from blocksim.scenario.models.motion import FromTable, Harmonic
from blocksim.scenario.models.pulse import Pulse
from blocksim.scenario.models.scenario import Scenario

Floats = NDArray[np.float64]

BEYOND = 1.01
"""Extent of the pieces, in ends of the scenario: the last step may end a little later."""
SHORTEST_SHARE = 1e-9
"""Joints closer together than this share of a cycle are one."""


class MotionPieces(NamedTuple):
    """Displacement c0 + c1 s + c2 s² + c3 s³ of piece i, with s = t - times[i] from 0 to times[i + 1] - times[i].

    The pieces join with equal displacement and velocity, from 0 to a little beyond the end of the scenario. If the
    motion ends before, the last piece is constant, or linear where accelerations leave a velocity.
    """

    times: Floats  # (k + 1,) s, increasing from 0
    coefficients: Floats  # (k, 4) m, m/s, m/s², m/s³
    final_velocity: float  # m/s, at the end of the last piece


def motion_direction(scenario: Scenario) -> tuple[float, float]:
    """Return the unit vector along which the supports move."""
    angle = 0.0 if scenario.motion is None else scenario.motion.direction
    return math.cos(angle), math.sin(angle)


def settles(scenario: Scenario) -> bool:
    """Return True where blocks come to rest before time zero: asked to, or under a pulse at its peak from there on.

    Unasked only with springs: rigid contacts carry the force of the first substep at once.
    """
    motion = scenario.motion
    is_abrupt = isinstance(motion, Pulse) and motion.is_abrupt and motion.start == 0.0
    with_springs = scenario.time.has_springs
    return scenario.start.settle or (is_abrupt and with_springs and not scenario.systems)


def motion_pieces(scenario: Scenario) -> MotionPieces:
    """Return the displacement of the supports; no pieces (k = 0) if they rest."""
    motion, end = scenario.motion, BEYOND * scenario.time.end
    if motion is None:
        return MotionPieces(np.zeros(1), np.zeros((0, 4)), 0.0)
    match motion:
        case Harmonic():
            pieces = _harmonic(motion, end)
        case FromTable():
            times, values = motion.start + np.array(motion.table.times), motion.scale * np.array(motion.table.values)
            if motion.table.quantity == "acceleration":
                pieces = _integrated(times, values)
            else:
                displacement = values - values[0]
                pieces = through(times, displacement, spline_slopes(times, displacement))
        case Pulse():
            pieces = through(*pulse_samples(motion))
        case _:
            pieces = _integrated(*record_samples(motion))
    return from_zero_to(end, pieces)


def displacement_and_velocity(pieces: MotionPieces, times: Floats) -> tuple[Floats, Floats]:
    """Return displacement (m) and velocity (m/s) at these times (s), for reports; kernels have their own."""
    count = len(pieces.coefficients)
    if count == 0:
        return np.zeros_like(times), np.zeros_like(times)
    piece = np.clip(np.searchsorted(pieces.times, times, side="right") - 1, 0, count - 1)
    s = times - pieces.times[piece]
    c0, c1, c2, c3 = pieces.coefficients[piece].T
    return c0 + s * (c1 + s * (c2 + s * c3)), c1 + s * (2.0 * c2 + 3.0 * s * c3)


def _harmonic(motion: Harmonic, end: float) -> MotionPieces:
    """Sample displacement and velocity until `end` (s); pieces begin where the ramps begin and end."""
    samples = [np.linspace(first, last, 1 + count) for first, last, count in motion.sections(end)]
    times = np.unique(np.concatenate([[0.0, end], *samples]))
    times = times[np.append(True, np.diff(times) > SHORTEST_SHARE / motion.frequency)]
    since = np.maximum(times - motion.start, 0.0)
    rise, rate = _ramp(since / motion.resolved_ramp)
    if motion.duration is not None:
        fall, fall_rate = _ramp((motion.duration - since) / motion.resolved_ramp)
        rise, rate = rise * fall, rate * fall - rise * fall_rate
    speed = 2.0 * math.pi * motion.frequency
    sine, cosine = np.sin(speed * since + motion.phase), np.cos(speed * since + motion.phase)
    velocity = motion.amplitude * (rate / motion.resolved_ramp * sine + rise * speed * cosine)
    return through(times, motion.amplitude * rise * sine, velocity)


def _ramp(share: Floats) -> tuple[Floats, Floats]:
    """Return 10 s³ - 15 s⁴ + 6 s⁵ and its slope, 0 before s = 0 and 1 after s = 1."""
    s = np.clip(share, 0.0, 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s * s), 30.0 * (s * (1.0 - s)) ** 2


def _integrated(times: Floats, acceleration: Floats) -> MotionPieces:
    """Integrate straight lines between samples of acceleration (m/s²) twice, from rest."""
    step = np.diff(times)
    change = np.diff(acceleration)
    velocity = np.concatenate([[0.0], np.cumsum(step * (acceleration[:-1] + 0.5 * change))])
    advance = step * (velocity[:-1] + step * (0.5 * acceleration[:-1] + change / 6.0))
    displacement = np.concatenate([[0.0], np.cumsum(advance)])
    columns = [displacement[:-1], velocity[:-1], 0.5 * acceleration[:-1], change / (6.0 * step)]
    return MotionPieces(times, np.column_stack(columns), float(velocity[-1]))


def through(times: Floats, displacement: Floats, velocity: Floats) -> MotionPieces:
    """Return the cubic pieces with these displacements (m) and velocities (m/s) at the joints (Hermite)."""
    step = np.diff(times)
    secant = np.diff(displacement) / step
    one, other = velocity[:-1], velocity[1:]
    square = (3.0 * secant - 2.0 * one - other) / step
    cube = (one + other - 2.0 * secant) / step**2
    return MotionPieces(times, np.column_stack([displacement[:-1], one, square, cube]), float(other[-1]))


def spline_slopes(x: Floats, y: Floats) -> Floats:
    """Return the slopes at the joints of the cubic spline through (x, y) that is level at both ends.

    Its second derivative is continuous: m[i-1]/h[i-1] + 2 (1/h[i-1] + 1/h[i]) m[i] + m[i+1]/h[i] =
    3 (d[i-1]/h[i-1] + d[i]/h[i]) with the steps h and secants d. The matrix is dominated by its diagonal, so the
    elimination needs no pivots. C. de Boor, A Practical Guide to Splines (1978), chapter IV.
    """
    inverse = 1.0 / np.diff(x)
    secant = np.diff(y) * inverse
    diagonal = 2.0 * (inverse[:-1] + inverse[1:])
    right = 3.0 * (secant[:-1] * inverse[:-1] + secant[1:] * inverse[1:])
    slopes = np.zeros(x.size)
    for i in range(1, diagonal.size):
        factor = inverse[i] / diagonal[i - 1]
        diagonal[i] -= factor * inverse[i]
        right[i] -= factor * right[i - 1]
    for i in range(diagonal.size - 1, -1, -1):
        slopes[i + 1] = (right[i] - inverse[i + 1] * slopes[i + 2]) / diagonal[i]
    return slopes


def from_zero_to(end: float, pieces: MotionPieces) -> MotionPieces:
    """Add rest before the first piece, and after the last one its final velocity until `end` (s)."""
    times, coefficients, velocity = pieces
    if times[0] > 0.0:
        times = np.concatenate([[0.0], times])
        coefficients = np.concatenate([np.zeros((1, 4)), coefficients])
    if times[-1] < end:
        (displacement,), _ = displacement_and_velocity(MotionPieces(times, coefficients, velocity), times[-1:])
        times = np.append(times, end)
        coefficients = np.concatenate([coefficients, [[displacement, velocity, 0.0, 0.0]]])
    return MotionPieces(times, coefficients, velocity)

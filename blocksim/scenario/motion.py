"""Prescribed motion of supports and bodies over time, as piecewise cubics, and its peaks."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from blocksim.scenario import geometry, placement
from blocksim.scenario.models.motion import UNITS, Baseline, FromTable, Harmonic, Pulse, Ramp, Rotation
from blocksim.scenario.models.scenario import Scenario
from blocksim.scenario.models.soil import SoilTable
from blocksim.scenario.placement import PlacedBody

Floats = NDArray[np.float64]

PIECES_PER_CYCLE = 1000
"""Their displacement is off by less than (2 pi/1000)^4/384 = 4e-12 of A/w², their acceleration by 3.3e-6 A."""


def pulse_samples(pulse: Pulse) -> tuple[Floats, Floats, Floats]:
    """Return times (s), displacement (m) and velocity (m/s) of a pulse from its start to its end.

    They are exact, integrated from rest: with A and w for a sine v = A/w (1 - cos wt), u = A/w (t - sin wt/w); for a
    cosine v = A/w sin wt, u = A/w² (1 - cos wt); for a rectangle v = A t, u = A t²/2. Cubic pieces through them are
    exact for a rectangle.
    """
    count = 1 if pulse.shape == "rectangular" else min(200_000, math.ceil(PIECES_PER_CYCLE * pulse.resolved_cycles))
    t = np.linspace(0.0, pulse.resolved_duration, 1 + count)
    w, a = 2.0 * math.pi * pulse.resolved_cycles / pulse.resolved_duration, pulse.amplitude
    if pulse.shape == "rectangular":
        return pulse.start + t, 0.5 * a * t * t, a * t
    half = np.sin(0.5 * w * t)
    versine = 2.0 * half * half  # 1 - cos wt, without its cancellation
    if pulse.shape == "cosine":
        return pulse.start + t, a / w**2 * versine, a / w * np.sin(w * t)
    return pulse.start + t, a / w * (t - np.sin(w * t) / w), a / w * versine


def correct_baseline(times: Floats, acceleration: Floats, baseline: Baseline) -> Floats:
    """Return accelerations (m/s², (n,)) at these times (s) with their baseline corrected.

    `rest` subtracts c0 + c1 t, t from the first sample to T: the velocity V and the displacement U that the record
    leaves vanish with c0 = (6 U - 2 V T)/T², c1 = (6 V T - 12 U)/T³. `parabolic` subtracts c0 + c1 t + c2 t², chosen so
    that the sum of the squared velocities of all samples is least: G. V. Berg and G. W. Housner, Integrated velocity
    and displacement of strong earthquake ground motion, Bull. Seism. Soc. Am. 51 (1961) 175-189.
    """
    if baseline == "none":
        return acceleration
    t = times - times[0]
    step, end = np.diff(t), float(t[-1])
    velocity = np.concatenate([[0.0], np.cumsum(0.5 * step * (acceleration[:-1] + acceleration[1:]))])
    if baseline == "rest":
        advances = step * (velocity[:-1] + step * (2.0 * acceleration[:-1] + acceleration[1:]) / 6.0)
        left, moved = float(velocity[-1]) * end, float(advances.sum())
        return np.asarray(acceleration - ((6.0 * moved - 2.0 * left) + (6.0 * left - 12.0 * moved) * t / end) / end**2)
    s = t / end
    terms = np.stack([s, s**2 / 2.0, s**3 / 3.0], axis=1)
    parts, *_ = np.linalg.lstsq(terms, velocity / end, rcond=None)
    return np.asarray(acceleration - (parts[0] + s * (parts[1] + s * parts[2])))


BEYOND = 1.01  # extent of the pieces, in ends of the scenario: the last step may end a little later
SHORTEST_SHARE = 1e-9  # joints closer together than this share of a cycle are one


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


def settles(scenario: Scenario, placed: Sequence[PlacedBody]) -> bool:
    """Return True where a scene comes to rest before time zero.

    Where `start.settle` says so, where it does not say and a free block is beside soil that begins with its stresses,
    and under a pulse at its peak from time zero on. That only with springs: rigid contacts carry the force of the first
    substep at once.
    """
    motion = scenario.motion
    if scenario.systems:
        is_asked = scenario.start.settle
        soils = () if is_asked is not None or motions_at_start(scenario, placed) else placement.soil_tables(scenario)
        return bool(is_asked) or any(touches_free_block(soil, placed) for soil in soils)
    is_abrupt = isinstance(motion, Pulse) and motion.is_abrupt and motion.start == 0.0
    with_springs = scenario.time.has_springs
    return bool(scenario.start.settle) or (is_abrupt and with_springs)


def motions_at_start(scenario: Scenario, placed: Sequence[PlacedBody]) -> str:
    """Return what keeps a scene with soil from settling; nothing without soil, or where nothing does."""
    soils = placement.soil_tables(scenario)
    for soil in soils:
        if soil.start == "ramp":
            return f'soil {soil.name} has start = "ramp"'
    moving = [body.name for body in placed if body.driven or body.vx or body.vy or body.spin]
    if soils and moving:
        return f"body {moving[0]} moves"
    return f"body {scenario.start.hold[0]} is held" if soils and scenario.start.hold else ""


def touches_free_block(soil: SoilTable, placed: Sequence[PlacedBody]) -> bool:
    """Return True if a block that may move is less than a spacing beside, below or above a soil, or in it."""
    low, high = soil.corners.min(axis=0) - soil.spacing, soil.corners.max(axis=0) + soil.spacing
    shifts = soil.spacing * np.array([(-1.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.0, 1.0)])
    for body in placed:
        corners = np.array([body.ground_point(*corner) for corner in body.corners])
        is_near = not body.fixed and np.all(corners.max(axis=0) > low) and np.all(corners.min(axis=0) < high)
        if is_near and any(geometry.overlap(soil.corners + shift, corners) for shift in shifts):
            return True
    return False


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
                pieces = hermite_pieces(times, displacement, spline_slopes(times, displacement))
        case Pulse():
            pieces = hermite_pieces(*pulse_samples(motion))
        case _:
            unit = motion.unit if motion.table.unit is None else None  # samples are in m/s² where the file says theirs
            acceleration = (1.0 if unit is None else UNITS[unit]) * np.array(motion.table.values)
            acceleration = correct_baseline(np.array(motion.table.times), acceleration, motion.baseline)
            peak = float(np.abs(acceleration).max())
            scale = motion.scale if motion.pga is None else motion.pga / peak if peak > 0.0 else 0.0
            pieces = _integrated(motion.start + np.array(motion.table.times), scale * acceleration)
    return extend_pieces(end, pieces)


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
    return hermite_pieces(times, motion.amplitude * rise * sine, velocity)


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


def hermite_pieces(times: Floats, displacement: Floats, velocity: Floats) -> MotionPieces:
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


def extend_pieces(end: float, pieces: MotionPieces) -> MotionPieces:
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
    cycles = [math.inf]
    for motion in (scenario.motion, *(body.motion for body in scenario.bodies)):
        if isinstance(motion, Harmonic):
            cycles.append(1.0 / motion.frequency)
        elif isinstance(motion, Pulse):
            cycles.append(motion.resolved_duration / motion.resolved_cycles)
    return min(cycles)


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


PIECES_OF_A_RAMP = 200
"""Of a smooth one, which is of fifth order: they are off by less than 1e-9 of the way."""
STILL = MotionPieces(np.zeros(2), np.zeros((1, 4)), 0.0)


class Drive(NamedTuple):
    """Motion of one body: pieces as in blocksim.scenario.motion, of its shift (m) and its turn (rad)."""

    body: int  # its place among all bodies
    along: tuple[float, float]  # unit vector of the shift
    shift: MotionPieces
    about: tuple[float, float]  # m: the point about which it turns, which is shifted with it
    turn: MotionPieces

    @property
    def rest_time(self) -> float:
        """Time (s) from when on the body rests, infinite where it never does."""
        ends = [0.0]
        for pieces in (self.shift, self.turn):
            moving = np.flatnonzero(pieces.coefficients[:, 1:].any(axis=1))
            is_endless = moving.size > 0 and moving[-1] == len(pieces.coefficients) - 1
            ends += [math.inf] if is_endless else pieces.times[moving[-1:] + 1].tolist()
        return max(ends)


def drives_of(scenario: Scenario) -> tuple[Drive, ...]:
    """Return the motions of all driven bodies, in the order of the bodies."""
    if all(body.motion is None for body in scenario.bodies):
        return ()
    first, end = sum(structure.size for structure in scenario.structures), BEYOND * scenario.time.end
    drives = []
    for number, body in enumerate(scenario.bodies, start=first):
        motion, centre = body.motion, (body.x, body.y)
        if isinstance(motion, Rotation):
            turn = _course(motion, motion.angle, end)
            drives.append(Drive(number, (1.0, 0.0), STILL, motion.about or centre, turn))
        elif motion is not None:
            alone = scenario.model_copy(update={"motion": motion})  # as if it were that of the supports
            shift = _course(motion, motion.distance, end) if isinstance(motion, Ramp) else motion_pieces(alone)
            drives.append(Drive(number, motion_direction(alone), shift, centre, STILL))
    return tuple(drives)


def _course(motion: Ramp | Rotation, way: float, end: float) -> MotionPieces:
    """Return the pieces of a way (m or rad) from the start of a motion on, until `end` (s) at least."""
    count = PIECES_OF_A_RAMP if motion.course == "smooth" else 1
    share = np.linspace(0.0, 1.0, count + 1)
    duration = motion.resolved_duration
    times = motion.start + duration * share
    if count == 1:
        pieces = MotionPieces(times, np.array([[0.0, way / duration, 0.0, 0.0]]), 0.0)
    else:
        values = way * share**3 * (10.0 - 15.0 * share + 6.0 * share * share)
        rates = way / duration * 30.0 * (share * (1.0 - share)) ** 2
        pieces = hermite_pieces(times, values, rates)
    pieces = extend_pieces(end, pieces)
    last = pieces.coefficients[-1]
    if not last[1:].any():  # constant: exactly at the end of the way
        last[0] = way
    return pieces


def greatest_rate(pieces: MotionPieces) -> float:
    """Return the greatest speed (m/s, or rad/s) of a motion."""
    _, c1, c2, c3 = pieces.coefficients.T
    length = np.diff(pieces.times)[: len(c1)]
    with np.errstate(divide="ignore", invalid="ignore"):  # straight and parabolic pieces are fastest at an end
        middle = np.nan_to_num(-c2 / (3.0 * c3), posinf=0.0, neginf=0.0)
    rates = [np.abs(c1 + s * (2.0 * c2 + 3.0 * s * c3)) for s in (0.0 * length, np.clip(middle, 0.0, length), length)]
    return float(max(np.max(rate, initial=0.0) for rate in rates))

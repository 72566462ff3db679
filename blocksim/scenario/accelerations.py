"""Prescribed accelerations of the supports as samples: pulses in closed form, records with their baseline corrected."""

import math

import numpy as np
from numpy.typing import NDArray

from blocksim.scenario.models.pulse import Pulse
from blocksim.scenario.models.record import Baseline, Record

Floats = NDArray[np.float64]

PIECES_PER_CYCLE = 1000
"""Their displacement is off by less than (2 pi/1000)^4/384 = 4e-12 of A/w², their acceleration by 3.3e-6 A."""
MOST_PIECES = 200_000


def pulse_samples(pulse: Pulse) -> tuple[Floats, Floats, Floats]:
    """Return times (s), displacement (m) and velocity (m/s) of a pulse from its start to its end.

    They are exact, integrated from rest: with A and w for a sine v = A/w (1 - cos wt), u = A/w (t - sin wt/w); for a
    cosine v = A/w sin wt, u = A/w² (1 - cos wt); for a rectangle v = A t, u = A t²/2. Cubic pieces through them are
    exact for a rectangle.
    """
    count = 1 if pulse.shape == "rectangular" else min(MOST_PIECES, math.ceil(PIECES_PER_CYCLE * pulse.resolved_cycles))
    t = np.linspace(0.0, pulse.resolved_duration, 1 + count)
    w, a = pulse.angular_frequency, pulse.amplitude
    if pulse.shape == "rectangular":
        return pulse.start + t, 0.5 * a * t * t, a * t
    half = np.sin(0.5 * w * t)
    versine = 2.0 * half * half  # 1 - cos wt, without its cancellation
    if pulse.shape == "cosine":
        return pulse.start + t, a / w**2 * versine, a / w * np.sin(w * t)
    return pulse.start + t, a / w * (t - np.sin(w * t) / w), a / w * versine


def record_samples(record: Record) -> tuple[Floats, Floats]:
    """Return times (s) and accelerations (m/s²) of a record, corrected and scaled; straight lines join them."""
    times = np.array(record.table.times)
    values = corrected(times, record.factor * np.array(record.table.values), record.baseline)
    peak = float(np.abs(values).max())
    scale = record.scale if record.pga is None else record.pga / peak if peak > 0.0 else 0.0
    return record.start + times, scale * values


def corrected(times: Floats, acceleration: Floats, baseline: Baseline) -> Floats:
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

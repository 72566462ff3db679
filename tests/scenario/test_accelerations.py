"""Pulses and records as displacements of the supports, against closed forms and quadrature."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from blocksim.scenario.motion import MotionPieces, correct_baseline, motion_peaks, motion_pieces
from tests.scenario.test_motion import END, assert_smooth, at, scenario

A, F = 4.0, 2.0
W = 2 * math.pi * F
G = 9.80665


def pulse(shape: str, **keys: object) -> MotionPieces:
    where = keys if "duration" in keys else {"frequency": F, **keys}
    pieces = motion_pieces(scenario({"kind": "pulse", "shape": shape, "amplitude": A, **where}))
    assert_smooth(pieces)
    return pieces


@pytest.mark.parametrize(
    ("shape", "keys", "length", "speed", "moved"),
    [
        ("sine", {}, 1 / F, 0.0, A / W / F),
        ("sine", {"cycles": 3}, 3 / F, 0.0, 3 * A / W / F),
        ("cosine", {"cycles": 2}, 2 / F, 0.0, 0.0),
        ("cosine", {"cycles": 0.25}, 0.25 / F, A / W, A / W**2),
        ("half-sine", {}, 0.5 / F, 2 * A / W, A / W * 0.5 / F),
        ("half-sine", {"duration": 0.25}, 0.25, 2 * A / W, A / W * 0.25),
        ("rectangular", {"duration": 0.1}, 0.1, 0.1 * A, 0.005 * A),
    ],
)
def test_what_a_pulse_leaves(shape: str, keys: dict[str, object], length: float, speed: float, moved: float) -> None:
    displacement, velocity = at(pulse(shape, start=0.3, **keys), 0.3, 0.3 + length, 1.3 + length)
    np.testing.assert_allclose(velocity, [0, speed, speed], rtol=1e-12, atol=1e-12 * A / W)
    np.testing.assert_allclose(displacement, [0, moved, moved + speed], rtol=1e-12, atol=1e-12 * A / W**2)


def test_the_bound_of_the_cubic_pieces_holds_between_their_joints() -> None:
    t = np.linspace(0, 1 / F, 3001)
    sine, cosine = at(pulse("sine"), *t)[0], at(pulse("cosine"), *t)[0]
    bound = (2 * math.pi / 1000) ** 4 / 384 * A / W**2 * 1.01
    assert np.abs(sine - A / W * (t - np.sin(W * t) / W)).max() < bound
    assert np.abs(cosine - A / W**2 * (1 - np.cos(W * t))).max() < bound


def test_an_amplitude_in_g_is_that_of_standard_gravity() -> None:
    keys = {"kind": "pulse", "shape": "rectangular", "amplitude": "0.5 g", "duration": "100 ms"}
    assert motion_pieces(scenario(keys)).final_velocity == pytest.approx(0.05 * G, rel=1e-14)


def shaken(folder: Path, rows: np.ndarray, **keys: object) -> MotionPieces:
    lines = ["time_s,acceleration_m_s2", *(f"{time!r},{value!r}" for time, value in rows.tolist())]
    (folder / "r.csv").write_text("\n".join(lines))
    return motion_pieces(scenario({"kind": "record", "table": "r.csv", **keys}, folder))


@pytest.fixture
def rows() -> np.ndarray:
    t = 0.01 * np.arange(201)
    noise = np.random.default_rng(5).standard_normal(t.size)
    return np.stack([t, noise + 0.3 - 0.2 * t], axis=1)


def test_a_record_is_integrated_exactly_between_its_samples(tmp_path: Path, rows: np.ndarray) -> None:
    pieces = shaken(tmp_path, rows, baseline="none", scale=0.5)
    assert_smooth(pieces)
    fine = np.linspace(0, 2, 40001)  # the samples are among them, so that the trapezoids lose nothing of velocity
    velocity = cumulative_trapezoid(0.5 * np.interp(fine, *rows.T), fine, initial=0)
    np.testing.assert_allclose(at(pieces, *fine)[1], velocity, rtol=0, atol=1e-12)
    np.testing.assert_allclose(at(pieces, *fine)[0], cumulative_trapezoid(velocity, fine, initial=0), atol=1e-8)
    assert pieces.final_velocity == pytest.approx(velocity[-1])


def test_with_the_baseline_rest_the_supports_end_at_rest_where_they_began(tmp_path: Path, rows: np.ndarray) -> None:
    pieces = shaken(tmp_path, rows, start=0.25)
    assert_smooth(pieces)
    displacement, velocity = at(pieces, 2.25, 3.0)
    assert np.abs(displacement).max() < 1e-13
    assert np.abs(velocity).max() < 1e-13
    removed = rows[:, 1] - correct_baseline(rows[:, 0], rows[:, 1], "rest")
    assert np.abs(np.diff(removed, 2)).max() < 1e-12  # a straight line


def test_the_parabolic_baseline_makes_the_velocities_least(rows: np.ndarray) -> None:
    t, before = rows.T
    after = correct_baseline(t, before, "parabolic")
    removed = before - after
    assert np.abs(np.diff(removed, 3)).max() < 1e-12  # a parabola

    def energy(acceleration: np.ndarray) -> float:
        return float((cumulative_trapezoid(acceleration, t, initial=0) ** 2).sum())

    least = energy(after)
    assert least < 0.5 * energy(before)
    for term in (np.ones_like(t), t, t * t):
        assert min(energy(after + 1e-2 * term), energy(after - 1e-2 * term)) > least


def test_a_record_is_scaled_to_its_largest_acceleration_after_the_correction(tmp_path: Path, rows: np.ndarray) -> None:
    pieces = shaken(tmp_path, rows, pga="0.4 g")
    begins = 2 * pieces.coefficients[:, 2]
    assert np.abs(begins).max() == pytest.approx(0.4 * G, rel=1e-12)


def test_peaks_of_a_cosine_pulse_until_any_end() -> None:
    amplitude, speed = 3.0, 4 * math.pi
    pulse = {"kind": "pulse", "shape": "cosine", "amplitude": amplitude, "frequency": "2 Hz"}
    pieces = motion_pieces(scenario({**pulse, "start": 0.25}))
    whole = motion_peaks(pieces, END)
    assert whole.acceleration.value == pytest.approx(amplitude, rel=1e-5)
    assert whole.velocity == pytest.approx((amplitude / speed, 0.375), rel=1e-5)
    assert whole.displacement == pytest.approx((2 * amplitude / speed**2, 0.5), rel=1e-5)
    assert whole.final_velocity == pytest.approx(0.0, abs=1e-12)
    early = motion_peaks(pieces, 0.3125)  # an eighth of the cycle
    assert early.velocity == pytest.approx((amplitude / speed * math.sin(math.pi / 4), 0.3125), rel=1e-5)
    assert early.final_velocity == early.velocity.value


def test_peaks_between_the_joints_of_a_coarse_piece_are_found() -> None:
    # u = s^3 - 1.5 s^2 on 0..2: u' = 3 s (s - 1) is least, -0.75, at 0.5; u is least, -0.5, at 1 and 2 at the end
    pieces = MotionPieces(np.array([0.0, 2.0]), np.array([[0.0, 0.0, -1.5, 1.0]]), 6.0)
    assert motion_peaks(pieces, 1.4).displacement == pytest.approx((0.5, 1.0))
    assert motion_peaks(pieces, 1.0).velocity == pytest.approx((0.75, 0.5))
    assert motion_peaks(pieces, 2.0).acceleration == pytest.approx((9.0, 2.0))

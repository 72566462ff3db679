"""Peaks of the supports' motion, exact between the joints of its pieces."""

import math

import numpy as np
import pytest

from blocksim.scenario.motion import MotionPieces, motion_peaks, motion_pieces
from tests.scenario.test_motion import END, scenario


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

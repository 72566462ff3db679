"""What the cases of toppling compare with: limits by bisection, closed forms, and the collective domino model."""

import math
from itertools import pairwise
from math import cos, radians, sin, sqrt

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from blocksim.verification import closed_forms as forms
from blocksim.verification.toppling import DominoModel, limit

G = 9.81
ROW = DominoModel(thickness=7.5 / 48.0, gap=0.3)
UNIT = sqrt(9.81 * 0.048)  # m/s


def test_limit_is_found_to_half_of_the_last_interval_where_the_outcome_changes() -> None:
    assert limit(lambda value: value > 0.3, 0.0, 1.0, 10) == pytest.approx(0.3, abs=2.0**-11)
    assert math.isnan(limit(lambda value: value > -1.0, 0.0, 1.0, 10))
    assert math.isnan(limit(lambda value: value > 2.0, 0.0, 1.0, 10))


@pytest.mark.parametrize(("width", "height", "slope"), [(0.025, 0.032, radians(60)), (0.032, 0.025, radians(55))])
def test_friction_needed_to_topple_is_that_of_newton_and_euler(width: float, height: float, slope: float) -> None:
    # unknowns: acceleration along (down the slope) and away from it, spin rate, friction (up the slope), normal force;
    # the lower edge lies at (width/2, -height/2) from the centre and does not move
    x, y, inertia = width / 2, -height / 2, (width**2 + height**2) / 12
    rows = [[1, 0, 0, 1, 0], [0, 1, 0, 0, -1], [0, 0, inertia, -y, -x], [1, 0, -y, 0, 0], [0, 1, x, 0, 0]]
    weight = np.array([G * sin(slope), -G * cos(slope), 0.0, 0.0, 0.0])
    *_, friction, normal = np.linalg.solve(np.array(rows), weight)
    assert forms.rolling_friction_limit(width, height, slope) == pytest.approx(friction / normal)
    assert width / height < friction / normal < np.tan(slope)
    limit = forms.toppling_slope(width, height)
    assert forms.rolling_friction_limit(width, height, limit) == pytest.approx(np.tan(limit))


def test_ladder_is_in_balance_with_the_friction_it_needs() -> None:
    slope, length, thickness = radians(60), 1.0, 0.01
    # corners of the ladder's under side touch ground and wall; coordinates from the foot, the wall to the left
    axis, across = np.array([-cos(slope), sin(slope)]), np.array([sin(slope), cos(slope)])
    head, centre = length * axis, 0.5 * (length * axis + thickness * across)
    wall = -centre[0] * G / head[1]  # moments about the foot, per mass
    assert forms.ladder_friction(slope, thickness / length) == pytest.approx(wall / G)
    assert forms.ladder_friction(slope, 0.0) == pytest.approx(0.2887, abs=5e-5)


def test_housner_ratio_keeps_angular_momentum_of_every_particle() -> None:
    part = (np.arange(200) + 0.5) / 200 - 0.5
    x, y = np.meshgrid(part * 0.010, part * 0.040)  # points of the rectangle's mass about its centre, all alike
    old_x, new_x, up = x - 0.005, x + 0.005, y + 0.020  # arms from the old pivot (right) and the new one (left)
    before = float(np.sum(new_x * old_x + up * up))  # arms from the new pivot, velocities about the old one
    after = float(np.sum(new_x**2 + up**2))
    assert forms.housner_ratio(0.010, 0.040) == pytest.approx(before / after, rel=1e-4)
    assert forms.housner_ratio(0.010, 0.040) == pytest.approx(0.9118, abs=5e-5)


@pytest.mark.parametrize("foremost", [0.0, 0.1, 0.3])
def test_upper_edges_lie_on_the_backs_of_the_next(foremost: float) -> None:
    angles, _ = ROW.lean(foremost, 6)
    for next_one, behind in pairwise(angles):
        edge = np.array([sin(behind), cos(behind)]) - (ROW.gap + ROW.thickness, 0.0)  # from the next one's foot
        assert edge @ (-cos(next_one), sin(next_one)) == pytest.approx(ROW.thickness)
        assert behind > next_one


def test_rates_are_derivatives_of_the_angles() -> None:
    (low, _), (high, _) = (ROW.lean(0.2 + d, 6) for d in (-1e-6, 1e-6))
    assert ROW.lean(0.2, 6)[1] == pytest.approx((high - low) / 2e-6, rel=1e-6)


def test_the_first_domino_falls_as_integrated() -> None:
    def strikes(_: float, state: np.ndarray) -> float:
        return float(state[0] - ROW.strike)

    strikes.terminal = True  # type: ignore[attr-defined]
    torque = solve_ivp(
        lambda _, y: [y[1], 0.5 * (sin(y[0]) - ROW.thickness * cos(y[0])) / ROW.inertia],
        (0.0, 10.0),
        [0.0, 1.0],
        events=strikes,
        rtol=1e-10,
        atol=1e-12,
    )
    assert ROW.collision_times(1, 1.0)[0] == pytest.approx(float(torque.t_events[0][0]), rel=1e-5)


def test_a_plastic_strike_on_an_upright_domino_leaves_both_half_of_the_spin() -> None:
    # edge and face meet at one height and continue together, so both get the same spin; the impulse is horizontal and
    # has the same arm about both feet, so the sum of the spins is kept
    assert ROW.struck_spin(1, 3.0) == pytest.approx(1.5)


@pytest.mark.parametrize("fallen", [2, 5, 9])
def test_a_strike_loses_energy_and_no_other_spin_would_be_nearer_to_the_old_ones(fallen: int) -> None:
    before = np.append(0.0, ROW.lean(ROW.strike, fallen)[1])  # the struck domino first, at rest
    rates = ROW.lean(0.0, fallen + 1)[1]
    spin = ROW.struck_spin(fallen, 1.0)
    left = [float(np.sum((before - other * rates) ** 2)) for other in (0.99 * spin, spin, 1.01 * spin)]
    assert left[1] < min(left[0], left[2])
    assert spin**2 * float(rates @ rates) < float(before @ before)


@pytest.mark.parametrize(("gap", "speed"), [(0.2, 1.35), (0.7, 1.09)])
def test_stationary_speeds_of_the_verification_table_whatever_the_push(gap: float, speed: float) -> None:
    slow, fast = (DominoModel(7.5 / 48.0, gap).wave_speed(32, 36, push) for push in (1.0, 5.0))
    assert slow * UNIT == pytest.approx(speed, rel=5e-3)
    assert slow == pytest.approx(fast, rel=2e-3)


def test_a_row_that_is_pushed_too_gently_does_not_fall() -> None:
    with pytest.raises(ValueError, match="domino 1"):
        ROW.collision_times(1, 0.01)

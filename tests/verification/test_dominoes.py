"""The collective domino model: its geometry, one domino integrated, collisions, and the published speeds."""

from itertools import pairwise
from math import cos, sin, sqrt

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from blocksim.verification.toppling import DominoModel

ROW = DominoModel(thickness=7.5 / 48.0, gap=0.3)
UNIT = sqrt(9.81 * 0.048)  # m/s


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


@pytest.mark.parametrize(("gap", "speed"), [(0.2, 1.35), (0.3, 1.26), (0.5, 1.16), (0.7, 1.09)])
def test_stationary_speeds_of_the_verification_table_whatever_the_push(gap: float, speed: float) -> None:
    slow, fast = (DominoModel(7.5 / 48.0, gap).wave_speed(32, 36, push) for push in (1.0, 5.0))
    assert slow * UNIT == pytest.approx(speed, rel=5e-3)
    assert slow == pytest.approx(fast, rel=2e-3)


def test_a_row_that_is_pushed_too_gently_does_not_fall() -> None:
    with pytest.raises(ValueError, match="domino 1"):
        ROW.collision_times(1, 0.01)

"""Closed form of the clipped restitution against numerical integration, and its inverse."""

from math import sqrt

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.integrate import solve_ivp

from blocksim.world.interactions import SMALLEST_RESTITUTION, damping_ratio, restitution_of


def integrated(ratio: float) -> float:
    """Return the rebound speed of x'' = -x - 2 z x' from x = 0, x' = 1 until the force comes back to zero."""

    def force(_: float, state: np.ndarray) -> float:
        return float(state[0] + 2.0 * ratio * state[1])

    force.terminal, force.direction = True, -1  # type: ignore[attr-defined]
    motion = solve_ivp(
        lambda t, state: [state[1], -force(t, state)],
        (0.0, 200.0),
        [0.0, 1.0],
        events=force,
        method="DOP853",
        rtol=1e-11,
        atol=1e-13,
    )
    return -float(motion.y_events[0][0][1])


@pytest.mark.parametrize("ratio", [0.01, 0.1, 0.3, 0.5, 0.7, 0.72, 0.9, 0.999, 1.0, 1.001, 1.5, 3.0, 5.3])
def test_closed_form_is_the_rebound_of_a_contact_that_cannot_pull(ratio: float) -> None:
    assert restitution_of(ratio) == pytest.approx(integrated(ratio), abs=1e-8)


@given(e=st.floats(SMALLEST_RESTITUTION, 0.999999))
def test_damping_ratio_is_the_inverse_of_the_restitution(e: float) -> None:
    assert restitution_of(damping_ratio(e)) == pytest.approx(e, abs=1e-12)


def test_undamped_contact_gives_everything_back() -> None:
    assert restitution_of(0.0) == 1.0
    assert damping_ratio(1.0) == 0.0


def test_no_restitution_is_a_rebound_of_less_than_one_percent() -> None:
    assert damping_ratio(0.0) == damping_ratio(SMALLEST_RESTITUTION)
    assert 0.0 < restitution_of(damping_ratio(0.0)) < 0.01


def rebound_of_hertz(ratio: float) -> float:
    """Return the rebound speed of x'' = -x^(3/2) - 2 z (3/2)^(1/2) x^(1/4) x' from x = 0, x' = 1, clipped as above.

    In w = x^(5/4) the force is smooth at x = 0: dw/ds = 5/4 x', dx'/ds = -(w + 2 z (3/2)^(1/2) x'), ds = x^(1/4) dt.
    """

    def force(_: float, state: np.ndarray) -> float:
        return float(state[0] + 2.0 * ratio * sqrt(1.5) * state[1])

    force.terminal, force.direction = True, -1  # type: ignore[attr-defined]
    motion = solve_ivp(
        lambda s, state: [1.25 * state[1], -force(s, state)],
        (0.0, 500.0),
        [0.0, 1.0],
        events=force,
        method="DOP853",
        rtol=1e-11,
        atol=1e-13,
    )
    return -float(motion.y_events[0][0][1])


@pytest.mark.parametrize("e", [SMALLEST_RESTITUTION, 0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9, 0.99])
def test_hertzian_contact_rebounds_as_asked(e: float) -> None:
    assert rebound_of_hertz(damping_ratio(e, "hertz-mindlin")) == pytest.approx(e, abs=1e-4)


def test_hertzian_limits_are_those_of_the_linear_law() -> None:
    assert damping_ratio(1.0, "hertz-mindlin") == 0.0
    assert damping_ratio(0.0, "hertz-mindlin") == damping_ratio(SMALLEST_RESTITUTION, "hertz-mindlin")


@pytest.mark.parametrize("e", [-1e-9, 1.0000001, 2.0, float("nan")])
def test_restitution_outside_zero_to_one_is_refused(e: float) -> None:
    with pytest.raises(ValueError, match="between 0 and 1"):
        damping_ratio(e)

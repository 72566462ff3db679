"""Closed form of the clipped restitution against numerical integration, and its inverse."""

from math import sqrt

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.integrate import solve_ivp

from blocksim.world.interactions import SMALLEST_RESTITUTION, damping_ratio, restitution_of


def rebound(ratio: float, exponent: float = 1.0) -> float:
    """Return the speed at which x'' = -x^n - 2 z (n x^(n-1))^(1/2) x' from x = 0, x' = 1 has no force any more.

    In w = x^m, m = (n + 1)/2, the force is smooth: dw/ds = m x', dx'/ds = -(w + 2 z n^(1/2) x'), ds = x^(m-1) dt.
    """

    def force(_: float, state: np.ndarray) -> float:
        return float(state[0] + 2.0 * ratio * sqrt(exponent) * state[1])

    force.terminal, force.direction = True, -1  # type: ignore[attr-defined]
    motion = solve_ivp(
        lambda s, state: [0.5 * (exponent + 1.0) * state[1], -force(s, state)],
        (0.0, 500.0),
        [0.0, 1.0],
        events=force,
        method="DOP853",
        rtol=1e-11,
        atol=1e-13,
    )
    return -float(motion.y_events[0][0][1])


@pytest.mark.parametrize("ratio", [0.01, 0.1, 0.3, 0.5, 0.7, 0.72, 0.9, 0.999, 1.0, 1.001, 1.5, 3.0, 5.3])
def test_closed_form_is_the_rebound_of_a_contact_that_cannot_pull(ratio: float) -> None:
    assert restitution_of(ratio) == pytest.approx(rebound(ratio), abs=1e-8)


@given(e=st.floats(SMALLEST_RESTITUTION, 0.999999))
def test_damping_ratio_is_the_inverse_of_the_restitution(e: float) -> None:
    assert restitution_of(damping_ratio(e)) == pytest.approx(e, abs=1e-12)


@pytest.mark.parametrize("law", ["linear", "hertz-mindlin"])
def test_limits_are_an_undamped_contact_and_a_rebound_of_less_than_one_percent(law: str) -> None:
    assert restitution_of(0.0) == 1.0
    assert damping_ratio(1.0, law) == 0.0
    assert damping_ratio(0.0, law) == damping_ratio(SMALLEST_RESTITUTION, law)
    assert 0.0 < restitution_of(damping_ratio(0.0)) < 0.01


@pytest.mark.parametrize("e", [SMALLEST_RESTITUTION, 0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9, 0.99])
def test_hertzian_contact_rebounds_as_asked(e: float) -> None:
    assert rebound(damping_ratio(e, "hertz-mindlin"), 1.5) == pytest.approx(e, abs=1e-4)


@pytest.mark.parametrize("e", [-1e-9, 1.0000001, 2.0, float("nan")])
def test_restitution_outside_zero_to_one_is_refused(e: float) -> None:
    with pytest.raises(ValueError, match="between 0 and 1"):
        damping_ratio(e)

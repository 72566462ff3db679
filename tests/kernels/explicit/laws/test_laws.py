"""Every law: the force is the slope of the stored energy, the stiffness the slope of the force."""

import pytest
from hypothesis import given, strategies as st

from blocksim.kernels.explicit.laws import elastic_force, stored_energy, tangent_stiffness
from blocksim.scenario.laws import LAWS

K = 9.5e8
DEPTHS = st.floats(1e-10, 1e-3)


@pytest.mark.parametrize("law", LAWS)
@given(depth=DEPTHS)
def test_force_is_the_slope_of_the_stored_energy(law: str, depth: float) -> None:
    exponent, h = LAWS[law].exponent, 1e-3 * depth
    slope = (stored_energy(exponent, K, depth + h) - stored_energy(exponent, K, depth - h)) / (2.0 * h)
    assert elastic_force(exponent, K, depth) == pytest.approx(slope, rel=1e-6)


@pytest.mark.parametrize("law", LAWS)
@given(depth=DEPTHS)
def test_stiffness_is_the_slope_of_the_force(law: str, depth: float) -> None:
    exponent, h = LAWS[law].exponent, 1e-3 * depth
    slope = (elastic_force(exponent, K, depth + h) - elastic_force(exponent, K, depth - h)) / (2.0 * h)
    assert tangent_stiffness(exponent, K, depth) == pytest.approx(slope, rel=1e-6)

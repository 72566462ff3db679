"""Friction coefficient between its static and its kinetic value, and the Coulomb limit."""

from math import exp

import pytest
from hypothesis import given
from hypothesis import strategies as st

from blocksim.kernels.arrays import INTERACTION, zeros
from blocksim.kernels.friction import coulomb_limit, friction_coefficient

STATIC, KINETIC, SPEED = 0.31, 0.19, 0.005


def test_friction_at_rest_is_static() -> None:
    assert friction_coefficient(STATIC, KINETIC, SPEED, 0.0) == STATIC


def test_friction_of_fast_sliding_is_kinetic() -> None:
    assert friction_coefficient(STATIC, KINETIC, SPEED, 1.0) == KINETIC
    assert friction_coefficient(STATIC, KINETIC, SPEED, 39.9 * SPEED) == pytest.approx(KINETIC, abs=1e-15)


@given(speed=st.floats(-0.3, 0.3))
def test_friction_falls_exponentially_with_speed_either_way(speed: float) -> None:
    expected = KINETIC + (STATIC - KINETIC) * exp(-abs(speed) / SPEED)
    assert friction_coefficient(STATIC, KINETIC, SPEED, speed) == pytest.approx(expected, rel=1e-14)


def test_one_number_is_both_at_any_speed() -> None:
    assert friction_coefficient(0.38, 0.38, SPEED, 0.002) == 0.38


@given(force=st.floats(0.0, 1e3), speed=st.floats(-0.05, 0.05), needed=st.floats(0.0, 1e3))
def test_limit_decides_as_the_full_formula_does(force: float, speed: float, needed: float) -> None:
    values = zeros(1, INTERACTION)[0]
    values.static_friction, values.kinetic_friction, values.transition_speed = STATIC, KINETIC, SPEED
    exact = friction_coefficient(STATIC, KINETIC, SPEED, speed) * force
    limit = coulomb_limit(values, force, speed, needed)
    assert (needed > limit) == (needed > exact)
    if needed > limit:
        assert limit == exact
    assert limit <= STATIC * force

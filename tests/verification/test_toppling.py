"""Limits found by bisection."""

import math

import pytest

from blocksim.verification.toppling import limit


def test_limit_is_found_to_half_of_the_last_interval() -> None:
    assert limit(lambda value: value > 0.3, 0.0, 1.0, 10) == pytest.approx(0.3, abs=2.0**-11)


@pytest.mark.parametrize("threshold", [-1.0, 2.0])
def test_an_outcome_that_does_not_change_in_the_bracket_has_no_limit(threshold: float) -> None:
    assert math.isnan(limit(lambda value: value > threshold, 0.0, 1.0, 10))

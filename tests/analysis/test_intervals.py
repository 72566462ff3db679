"""Exact limits of a probability against the binomial distribution itself; Student's quantiles against scipy."""

from math import comb

import pytest
from scipy import stats

from blocksim.analysis.compare import interval, lower_bound, quantile


def at_least(count: int, total: int, p: float) -> float:
    return sum(comb(total, k) * p**k * (1 - p) ** (total - k) for k in range(count, total + 1))


@pytest.mark.parametrize(("count", "total"), [(1, 1), (1, 6), (3, 6), (5, 6), (17, 40), (39, 40)])
def test_limits_leave_just_the_tails(count: int, total: int) -> None:
    low, high = interval(count, total)
    assert at_least(count, total, low) == pytest.approx(0.025, abs=1e-9)
    assert 1.0 - at_least(count + 1, total, high) == pytest.approx(0.025 if count < total else 1.0, abs=1e-9)


@pytest.mark.parametrize("total", [1, 6, 1000])
def test_none_and_all_have_the_limits_of_pencil_and_paper(total: int) -> None:
    # nobody of n: (1 - p)^n = 0.025; all of n: p^n = 0.025
    assert interval(0, total) == pytest.approx((0.0, 1.0 - 0.025 ** (1 / total)), abs=1e-12)
    assert interval(total, total) == pytest.approx((0.025 ** (1 / total), 1.0), abs=1e-12)


def test_six_of_six_are_at_least_61_percent() -> None:
    assert lower_bound(6, 6) == pytest.approx(0.05 ** (1 / 6), abs=1e-12)
    assert lower_bound(6, 6) == pytest.approx(0.61, abs=0.005)
    assert lower_bound(0, 6) == 0.0
    assert interval(0, 0) == (0.0, 1.0)
    assert at_least(5, 6, lower_bound(5, 6)) == pytest.approx(0.05, abs=1e-9)


@pytest.mark.parametrize("degrees", [1, 2, 3, 4, 5, 6, 9, 30, 101])
@pytest.mark.parametrize("probability", [0.001, 0.3, 0.5, 0.75, 0.975, 0.9995])
def test_quantile_agrees_with_scipy(degrees: int, probability: float) -> None:
    expected = float(stats.t.ppf(probability, degrees))
    assert quantile(probability, degrees) == pytest.approx(expected, rel=1e-11, abs=1e-12)


@pytest.mark.parametrize(("probability", "degrees"), [(0.0, 5), (1.0, 5), (0.975, 0)])
def test_quantile_without_meaning_is_refused(probability: float, degrees: int) -> None:
    with pytest.raises(ValueError, match="degree of freedom"):
        quantile(probability, degrees)


def test_large_numbers_agree_with_scipy() -> None:
    expected = stats.binomtest(9_700, 10_000).proportion_ci(method="exact")
    assert interval(9_700, 10_000) == pytest.approx((expected.low, expected.high), abs=1e-9)

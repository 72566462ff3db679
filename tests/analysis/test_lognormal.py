"""The lognormal curve of counts: intervals hold what they say, and a curve that does not exist is not invented."""

import math

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.stats import norm

from blocksim.analysis.lognormal import Counts, Curve, NoCurve, fit, inflation_of

X = np.array([0.4, 0.55, 0.7, 0.85, 1.0, 1.2, 1.5, 1.9])
MEDIAN, DISPERSION, MEMBERS = 1.0, 0.4, 32
P = norm.cdf(np.log(X / MEDIAN) / DISPERSION)
DRAWN = [5, 9, 15, 19, 16, 23, 30, 32]


def found(failed: list[int], members: int = MEMBERS) -> Curve | NoCurve:
    return fit(Counts.of(X.tolist(), failed, [members] * len(X)))


def test_the_curve_is_the_most_likely_one_and_its_intervals_are_those_of_the_profile() -> None:
    one = found(DRAWN)
    assert isinstance(one, Curve)
    k = np.array(DRAWN)

    def loss(median: float, dispersion: float) -> float:
        z = np.log(X / median) / dispersion
        return -float((k * norm.logcdf(z) + (MEMBERS - k) * norm.logcdf(-z)).sum())

    best = minimize(
        lambda v: loss(*np.exp(v)), [0.0, -1.0], method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-12}
    )
    assert (one.median, one.dispersion) == pytest.approx(np.exp(best.x), rel=1e-6)
    for end in one.median_interval:
        profile = minimize(lambda v, end=end: loss(end, math.exp(v[0])), [-1.0], method="Nelder-Mead")
        assert 2.0 * (profile.fun - best.fun) == pytest.approx(3.8415, abs=2e-3)
    for end in one.dispersion_interval:
        profile = minimize(lambda v, end=end: loss(math.exp(v[0]), end), [0.0], method="Nelder-Mead")
        assert 2.0 * (profile.fun - best.fun) == pytest.approx(3.8415, abs=2e-3)


@pytest.mark.parametrize(
    ("failed", "low", "high", "why"),
    [
        ([0] * 8, 1.9, math.inf, "no sample fails"),
        ([32] * 8, 0.0, 0.4, "all samples fail"),
        ([0] * 4 + [32] * 4, 0.85, 1.0, "all stand up to 0.85 and all fail from 1"),
        ([0] * 4 + [7] + [32] * 3, 1.0, 1.0, "both occur at 1 only"),
        ([32] * 4 + [0] * 4, 0.0, math.inf, "do not become more frequent"),
        ([9, 8, 7, 6, 5, 4, 3, 2], 0.0, math.inf, "do not become more frequent"),
    ],
)
def test_counts_without_a_finite_dispersion_have_no_curve(failed: list[int], low: float, high: float, why: str) -> None:
    none = found(failed)
    assert isinstance(none, NoCurve)
    assert why in none.reason
    assert (none.low, none.high) == (low, high)


def test_counts_that_jump_up_and_down_do_not_pass_for_a_curve() -> None:
    curve, jumps = found(DRAWN), found([0, 32, 0, 32, 9, 28, 15, 32])
    assert isinstance(curve, Curve)
    assert isinstance(jumps, Curve)
    assert curve.fits > 0.05
    assert jumps.fits < 1e-6


def test_intervals_of_a_curve_hold_what_they_say_where_all_intensities_share_their_records() -> None:
    stream, records, held = np.random.default_rng(7), 20, np.zeros(2)
    for _ in range(120):
        strength = MEDIAN * np.exp(DISPERSION * stream.standard_normal(records))
        failed = (strength[:, None] < X).astype(float)  # a record that is fatal at one intensity is so at all above
        counts = Counts.of(X.tolist(), failed.sum(axis=0).astype(int).tolist(), [records] * len(X))
        shared = inflation_of(counts, failed, np.ones_like(failed))
        assert shared >= 1.0
        for place, inflation in enumerate((None, shared)):
            curve = fit(counts, inflation=inflation)
            assert isinstance(curve, Curve)
            held[place] += curve.median_interval[0] <= MEDIAN <= curve.median_interval[1]
    assert held[0] < 0.85 * 120  # as if independent: 95 % are asked for
    assert held[1] > 0.92 * 120


def test_independent_draws_widen_no_interval_by_much() -> None:
    stream = np.random.default_rng(3)
    failed = (stream.random((200, len(X))) < P).astype(float)
    counts = Counts.of(X.tolist(), failed.sum(axis=0).astype(int).tolist(), [200] * len(X))
    assert inflation_of(counts, failed, np.ones_like(failed)) == pytest.approx(1.0, abs=0.25)
    assert inflation_of(counts, failed[:1], np.ones((1, len(X)))) == 1.0


@pytest.mark.filterwarnings("error")
def test_a_median_that_counts_hardly_bound_is_infinite_without_a_warning() -> None:
    curve = fit(Counts.of([0.2595391074269312, 2.1758645130121113], [1, 21], [2, 40]))
    assert isinstance(curve, Curve)
    assert curve.median_interval == (0.0, math.inf)
    flat = fit(Counts.of([0.6869940416447975, 1.0008499195306126], [2, 1], [10, 5]))
    assert isinstance(flat, NoCurve)

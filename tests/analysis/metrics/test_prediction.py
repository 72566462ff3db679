"""The prediction interval for the next test."""

import numpy as np
import pytest
from scipy import stats

from tests.analysis.metrics.conftest import found_by

X = ("a", "x")


def test_interval_of_two_repeats_by_hand() -> None:
    # repeats 0, 2: mean 1, s = sqrt 2, t_1 = tan(0.475 pi): 1 -+ t sqrt 2 sqrt 1.5
    half = np.tan(0.475 * np.pi) * np.sqrt(3.0)
    found = found_by("prediction", {X: [1 - half + 1e-9, 1 + half + 1e-9, 1.0]}, {X: [0, 2]})
    assert found.rows[0]["prediction"] == pytest.approx((1 - half, 1 + half), abs=1e-6)
    assert (found.rows[0]["inside"], found.rows[0]["of"]) == (2, 3)


def test_one_more_test_of_a_normal_experiment_falls_inside_19_times_in_20() -> None:
    random = np.random.default_rng(11)
    hits = 0
    for _ in range(1_000):
        *repeats, one_more = random.normal(50.0, 3.0, 7)
        hits += found_by("prediction", {X: [one_more]}, {X: repeats}).rows[0]["inside"] == 1
    assert stats.binomtest(hits, 1_000, 0.95).pvalue > 0.001


@pytest.mark.parametrize("repeats", [[3.0], [3.0, 3.0]])
def test_repeats_without_scatter_predict_nothing(repeats: list[float]) -> None:
    found = found_by("prediction", {X: [3.0]}, {X: repeats})
    assert found.rows == ()
    assert found.messages == ("x of block a: repeats without scatter predict nothing",)

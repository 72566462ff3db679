"""The area between two distributions, exact; its interval, by simulation."""

from math import nan

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy import stats

from blocksim.analysis.metrics import area_between, area_interval
from tests.analysis.metrics.conftest import found_by

X = ("a", "x")


numbers = st.lists(st.integers(-50, 50).map(lambda n: n / 4), min_size=1, max_size=12)


@given(one=numbers, other=numbers)
def test_area_is_the_wasserstein_distance_ties_included(one: list[float], other: list[float]) -> None:
    expected = stats.wasserstein_distance(one, other)
    assert area_between(np.array(one), np.array(other)) == pytest.approx(expected, abs=1e-12)


def test_interval_is_the_same_every_time_and_holds_the_area() -> None:
    random = np.random.default_rng(5)
    members, repeats = random.normal(1.0, 1.0, 50), random.normal(0.0, 1.0, 6)
    row = found_by("area", {X: members.tolist()}, {X: repeats.tolist()}).rows[0]
    low, high = area_interval(members, repeats)
    assert row["interval"] == (low, high)
    assert row["area"] == area_between(members, repeats)
    assert 0.0 <= low < area_between(members, repeats) < high


@pytest.mark.parametrize(("apart", "least"), [(1.0, 0.92), (3.0, 0.90)])
def test_interval_covers_the_true_area(apart: float, least: float) -> None:
    random = np.random.default_rng(2)
    covered = 0
    for trial in range(100):
        members, repeats = random.normal(apart, 1.0, 60), random.normal(0.0, 1.0, 6)
        low, high = area_interval(members, repeats, resamples=100, seed=trial)
        covered += low <= apart <= high  # equal shapes: the area is the shift
    assert least <= covered / 100 <= 1.0


def test_member_values_that_are_missing_are_not_counted() -> None:
    row = found_by("area", {X: [2.0, nan, 2.0]}, {X: [1, 4]}).rows[0]
    assert (row["members"], row["repeats"], row["area"]) == (2, 2, 1.5)


@pytest.mark.parametrize("repeats", [[3.0], [3.0, 3.0]])
def test_repeats_without_scatter_give_an_area_and_no_interval(repeats: list[float]) -> None:
    found = found_by("area", {X: [5.0, 6.0]}, {X: repeats})
    assert (found.rows[0]["area"], found.rows[0]["interval"]) == (2.5, None)
    assert found.messages == ("x of block a: no interval, as the repeats do not scatter",)


@pytest.mark.parametrize(("members", "repeats"), [(3, 6), (6, 3), (1, 6)])
def test_small_samples_have_no_interval(members: int, repeats: int) -> None:
    found = found_by("area", {X: [float(n) for n in range(members)]}, {X: [float(n) for n in range(repeats)]})
    assert found.rows[0]["interval"] is None
    assert found.messages == ("x of block a: no interval, which needs 4 samples and 4 repeats",)
    assert np.isnan(area_interval(np.arange(members, dtype=float), np.arange(repeats, dtype=float))).all()


def test_members_that_do_not_scatter_leave_the_scatter_of_the_repeats() -> None:
    low, high = area_interval(np.full(4, 5.0), np.array([0.0, 1.0, 2.0, 3.0]), 500)
    # the area is 5 minus the mean of the repeats: between 5 - 3 and 5 - 0 for any resample
    assert 2.0 <= low < 3.5 < high <= 5.0

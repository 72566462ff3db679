"""Metrics of single quantities: shares inside measured limits, areas between distributions, errors of V&V 20."""

from math import nan, sqrt

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy import stats

from blocksim.analysis.metrics import area_between, area_interval, repeat_passes_all
from tests.analysis.metrics.conftest import found_by

X, ANGLE = ("a", "x"), ("a", "rotation")


def test_ends_count_as_inside_and_failed_members_as_outside() -> None:
    """So does a member without the block."""
    statuses = ["finished"] * 5 + ["failed"]
    found = found_by("inside", {X: [1.0, 3.0, 2.0, 0.99, nan, 2.0]}, {X: [3.0, 1.0]}, statuses)
    row, everything = found.rows
    assert (row["inside"], row["of"], row["share"]) == (3, 6, 0.5)
    assert row["limits"] == (1.0, 3.0)
    assert everything["share"] == 0.5
    assert found.messages == ("shares are of all 6 samples; 1 did not finish and count as outside",)


def test_inside_in_everything_needs_the_same_member_inside_everywhere() -> None:
    found = found_by("inside", {X: [1.0, 2.0, 9.0], ANGLE: [0.0, -90.0, -90.0]}, {X: [1, 3], ANGLE: [-90, -90]})
    assert [row["inside"] for row in found.rows] == [2, 2, 1]
    assert found.rows[-1]["block"] == "all"


def test_one_repeat_and_equal_repeats_are_judged_at_the_reading_as_a_single_run_is() -> None:
    for repeats in ([2.0], [2.0, 2.0, 2.0]):
        row = found_by("inside", {X: [1.5, 2.5, 1.49, 2.51]}, {X: repeats}).rows[0]
        assert (row["inside"], row["repeat_passes"]) == (2, None)


def test_worth_of_passing_for_six_repeats() -> None:
    six = [71.69, 76.57, 72.70, 73.22, 73.73, 78.53]
    found = found_by("inside", {X: [75.0], ("b", "x"): [75.0]}, {X: six, ("b", "x"): six})
    assert [row["repeat_passes"] for row in found.rows[:2]] == [pytest.approx(5 / 7)] * 2
    assert found.rows[2]["repeat_passes"] == pytest.approx((3 / 7, 5 / 7))


def test_bounds_for_several_tests_are_reached_by_dependent_ones() -> None:
    assert repeat_passes_all([]) is None
    assert repeat_passes_all([6]) == pytest.approx(5 / 7)
    assert repeat_passes_all([2, 2, 2]) == pytest.approx((0.0, 1 / 3))
    # upper bound: three times the same quantity; lower bound: failures that exclude each other
    assert repeat_passes_all([6, 9]) == pytest.approx((1 - 2 / 7 - 2 / 10, 5 / 7))


def test_prediction_of_two_repeats_by_hand() -> None:
    # repeats 0, 2: mean 1, s = sqrt 2, t_1 = tan(0.475 pi): 1 -+ t sqrt 2 sqrt 1.5
    half = np.tan(0.475 * np.pi) * np.sqrt(3.0)
    found = found_by("prediction", {X: [1 - half + 1e-9, 1 + half + 1e-9, 1.0]}, {X: [0, 2]})
    assert found.rows[0]["prediction"] == pytest.approx((1 - half, 1 + half), abs=1e-6)
    assert (found.rows[0]["inside"], found.rows[0]["of"]) == (2, 3)


@pytest.mark.parametrize("repeats", [[3.0], [3.0, 3.0]])
def test_repeats_without_scatter_predict_nothing(repeats: list[float]) -> None:
    found = found_by("prediction", {X: [3.0]}, {X: repeats})
    assert found.rows == ()
    assert found.messages == ("x of block a: repeats without scatter predict nothing",)


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


def test_numbers_by_hand() -> None:
    # members 2, 4, 6: mean 4, s 2; repeats 1, 2, 3, 6: mean 3, s^2 = (4 + 1 + 0 + 9)/3 = 14/3
    row = found_by("validation", {X: [2.0, 4.0, 6.0]}, {X: [1, 2, 3, 6]}, u_num=0.7).rows[0]
    u_data = sqrt(14 / 3 / 4 + 0.25)
    assert (row["S"], row["D"], row["E"], row["u_input"], row["u_num"]) == pytest.approx((4, 3, 1, 2, 0.7), abs=1e-12)
    assert row["u_D"] == pytest.approx(u_data, abs=1e-12)
    assert row["u_val"] == pytest.approx(sqrt(0.49 + 4 + u_data**2), abs=1e-12)
    assert row["within"] is True


@pytest.mark.parametrize(("shift", "within"), [(2.0 - 1e-9, True), (2.0 + 1e-9, False)])
def test_error_is_held_against_twice_its_uncertainty(shift: float, within: bool) -> None:
    # equal repeats and equal members: u_val = u_D = sqrt(0^2 + 0.5^2), with u_num = sqrt(0.75) it is 1
    row = found_by("validation", {X: [10 + shift] * 2}, {X: [10, 10]}, u_num=sqrt(0.75)).rows[0]
    assert row["u_val"] == pytest.approx(1.0)
    assert row["within"] is within


def test_one_member_or_one_repeat_gives_an_error_and_no_verdict() -> None:
    one_member = found_by("validation", {X: [5.0]}, {X: [4, 6]})
    assert (one_member.rows[0]["E"], one_member.rows[0]["within"]) == (0.0, None)
    assert "u_input needs two samples with a value" in one_member.messages
    one_repeat = found_by("validation", {X: [5.0, 6.0]}, {X: [4]})
    assert (one_repeat.rows[0]["E"], one_repeat.rows[0]["within"]) == (1.5, None)
    assert "u_D needs two repeats" in one_repeat.messages


def test_failed_and_absent_members_are_not_in_the_mean() -> None:
    row = found_by(
        "validation", {X: [1.0, 3.0, 99.0, nan]}, {X: [4, 6]}, ["finished", "finished", "failed", "finished"]
    ).rows[0]
    assert (row["members"], row["S"]) == (2, 2.0)


def test_angles_are_left_to_the_outcome() -> None:
    found = found_by("validation", {("a", "rotation"): [0.0]}, {("a", "rotation"): [0.0]})
    assert (found.rows, found.messages) == ((), ("no length was measured",))

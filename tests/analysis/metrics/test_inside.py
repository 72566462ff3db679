"""Shares inside the measured limits, what passing is worth, and the prediction interval for the next test."""

from math import nan

import numpy as np
import pytest

from blocksim.analysis.metrics import repeat_passes_all
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

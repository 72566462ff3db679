"""Error and uncertainties of V&V 20, by hand."""

from math import nan, sqrt

import pytest

from tests.analysis.metrics.conftest import found_by

X = ("a", "x")


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

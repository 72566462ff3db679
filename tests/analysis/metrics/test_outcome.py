"""Outcome classes and their probabilities."""

from math import nan

import pytest

from blocksim.analysis.metrics import outcome
from tests.analysis.metrics.conftest import found_by

ONE, TWO = ("1", "rotation"), ("2", "rotation")


@pytest.mark.parametrize(
    ("angles", "name"),
    [
        ((0.3, -89.0, -91.0), "0, -90, -90"),
        ((-0.1, 44.9, -44.9), "0, 0, 0"),
        ((45.1, -45.1, 170.0), "90, -90, 180"),
        ((45.0, -45.0, 135.0), "0, 0, 180"),
        ((-360.0, 450.0, nan), "-360, 450, ?"),
    ],
)
def test_rotations_go_to_the_nearest_quarter_turn_alike_on_both_sides(angles: tuple[float, ...], name: str) -> None:
    assert outcome(angles) == name


def test_classes_are_counted_beside_the_measured_one() -> None:
    members = {ONE: [0.0, 1.0, -1.0, 0.0, 0.0], TWO: [-90.0, -91.0, -180.0, -89.0, -90.0]}
    found = found_by("outcome", members, {ONE: [0] * 6, TWO: [-90] * 6}, ["finished"] * 4 + ["failed"])
    assert [(row["outcome"], row["members"], row["of"]) for row in found.rows] == [
        ("0, -90", 3, 5),
        ("0, -180", 1, 5),
        ("did not finish", 1, 5),
    ]
    first = found.rows[0]
    assert (first["share"], first["measured"], first["repeats"]) == (0.6, 6, 6)
    assert first["lower_bound"] == pytest.approx(0.05 ** (1 / 6))
    assert first["interval"] == pytest.approx((0.146633, 0.947255), abs=1e-6)  # 3 of 5, from tables of Clopper-Pearson
    assert found.rows[1]["measured"] is None


def test_measured_class_that_no_member_reaches_is_listed() -> None:
    found = found_by("outcome", {ONE: [0.0, 0.0]}, {ONE: [-90, -90]})
    assert [(row["outcome"], row["members"], row["measured"]) for row in found.rows] == [("0", 2, None), ("-90", 0, 2)]


def test_repeat_without_all_rotations_is_left_out_and_named() -> None:
    found = found_by("outcome", {ONE: [0.0], TWO: [-90.0]}, {ONE: [0, 0, 0], TWO: [-90, nan, -90]})
    assert (found.rows[0]["measured"], found.rows[0]["repeats"]) == (2, 2)
    assert "left out, as not all rotations were measured: replicate 2" in found.messages


def test_without_measured_rotations_all_blocks_make_the_class() -> None:
    found = found_by("outcome", {("1", "x"): [3.0], ONE: [-88.0], TWO: [2.0]}, {("1", "x"): [3.0]})
    assert found.rows[0]["outcome"] == "-90, 0"
    assert found.messages == ("blocks: 1, 2",)


def test_sweep_without_rotations_has_no_outcomes() -> None:
    found = found_by("outcome", {("1", "x"): [3.0]}, {("1", "x"): [3.0]})
    assert (found.rows, found.messages) == ((), ("not computed: the sweep has no rotations",))

"""Findings of all metrics for samples as small as they can be: numbers, and words where there are none."""

import tomllib
from math import nan
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy import stats

from blocksim.analysis.evidence import Findings
from blocksim.analysis.metrics import area_between, area_interval, outcome, repeat_passes_all
from tests.analysis.metrics.conftest import Key, found_by
from tests.golden import Golden

CASES: dict[str, dict[str, Any]] = tomllib.loads(Path(__file__).with_name("cases.toml").read_text())
X = ("a", "x")


def text_of(found: Findings) -> str:
    rows = [", ".join(f"{name} {value}" for name, value in row.items()) for row in found.rows]
    return "\n".join([*rows, *(f"({message})" for message in found.messages)])


def of_blocks(values: dict[str, list[float]]) -> dict[Key, list[float]]:
    """Return values by block and quantity."""
    return {(key.split()[0], key.split()[1]): found for key, found in values.items()}


def test_findings_of_small_samples(golden: Golden) -> None:
    told = []
    for name, case in CASES.items():
        samples = of_blocks(case["members"]), of_blocks(case["repeats"])
        found = found_by(name.split(",")[0], *samples, case.get("statuses", ()), case.get("u_num", 0.0))
        told.append(f"{name}\n{text_of(found)}")
    golden("\n\n".join(told), rules=["digits"])


TURNS = [(0.3, -89.0, -91.0), (-0.1, 44.9, -44.9), (45.1, -45.1, 170.0), (45.0, -45.0, 135.0), (-360.0, 450.0, nan)]


def test_rotations_go_to_the_nearest_quarter_turn_alike_on_both_sides(golden: Golden) -> None:
    golden("\n".join(f"{angles}: {outcome(angles)}" for angles in TURNS))


def test_bounds_for_several_tests_are_reached_by_dependent_ones() -> None:
    assert repeat_passes_all([]) is None
    assert repeat_passes_all([6]) == pytest.approx(5 / 7)
    assert repeat_passes_all([2, 2, 2]) == pytest.approx((0.0, 1 / 3))
    # upper bound: three times the same quantity; lower bound: failures that exclude each other
    assert repeat_passes_all([6, 9]) == pytest.approx((1 - 2 / 7 - 2 / 10, 5 / 7))


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


def test_members_that_do_not_scatter_leave_the_scatter_of_the_repeats() -> None:
    low, high = area_interval(np.full(4, 5.0), np.array([0.0, 1.0, 2.0, 3.0]), 500)
    # the area is 5 minus the mean of the repeats: between 5 - 3 and 5 - 0 for any resample
    assert 2.0 <= low < 3.5 < high <= 5.0
    assert np.isnan(area_interval(np.arange(3.0), np.arange(6.0))).all()

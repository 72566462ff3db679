"""Hotelling's T2: exact small cases, limits that are known otherwise, and its size by simulation."""

from math import nan

import numpy as np
import pytest
from scipy import stats

from blocksim.analysis.metrics import Hotelling, hotelling
from tests.analysis.metrics.conftest import found_by

ONE, TWO, THREE = ("1", "x"), ("2", "x"), ("3", "x")
CROSS = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])


def hotelling_of(repeats: object, members: object) -> Hotelling:
    found = hotelling(np.asarray(repeats, dtype=float), np.asarray(members, dtype=float))
    assert found is not None
    return found


def test_one_member_is_the_one_sample_test_by_hand() -> None:
    # n = 4, p = 2, covariance diag(2/3): T2 = 4 (1 + 1) 3/2 = 12; F = T2 (n - p)/(p (n - 1)) = 4 with 2 and 2 degrees,
    # where P(F > f) = 1/(1 + f) = 0.2 and F is above 19 in 5 %: T2 above 19 * 3 = 57
    found = hotelling_of(CROSS, [[1.0, 1.0]])
    assert found == pytest.approx((12.0, 4.0, 2.0, 2.0, 57.0, 0.2), abs=1e-9)


def test_one_position_is_welch_s_test() -> None:
    random = np.random.default_rng(5)
    repeats, members = random.normal(0.0, 1.0, 6), random.normal(1.0, 4.0, 9)
    found, expected = (
        hotelling_of(repeats[:, None], members[:, None]),
        stats.ttest_ind(repeats, members, equal_var=False),
    )
    assert pytest.approx(expected.statistic**2, abs=1e-9) == found.T2
    assert found.dof_2 == pytest.approx(expected.df, abs=1e-9)
    assert found.p_value == pytest.approx(expected.pvalue, abs=1e-9)


def test_units_and_mixtures_of_the_positions_do_not_matter() -> None:
    random = np.random.default_rng(6)
    repeats, members = random.normal(size=(7, 3)), random.normal(1.0, 2.0, (20, 3))
    mixture = random.normal(size=(3, 3)) * 25.4
    assert hotelling_of(repeats @ mixture, members @ mixture) == pytest.approx(hotelling_of(repeats, members), rel=1e-9)


@pytest.mark.parametrize(("members", "scatter"), [(10, 1.0), (10, 5.0), (100, 0.3)])
def test_equal_means_are_refused_in_5_percent_of_experiments(members: int, scatter: float) -> None:
    random, trials = np.random.default_rng(members), 1_000
    shape = np.array([[1.0, 0.8], [0.0, 0.6]])  # correlated repeats
    refused = sum(
        hotelling_of(random.normal(size=(6, 2)) @ shape, scatter * random.normal(size=(members, 2))).p_value < 0.05
        for _ in range(trials)
    )
    assert refused / trials == pytest.approx(0.05, abs=0.02)  # the distribution of F is an approximation


def test_row_names_what_went_into_it() -> None:
    """Angles are left out."""
    angle = ("1", "rotation")
    members = {ONE: [16.0, 16.0], angle: [1.0, 2.0], TWO: [2.0, 2.0], THREE: [3.0, 5.0]}
    repeats = {ONE: [16] * 5, angle: [1, 2, 3, 4, 5], TWO: [1, 2, 3, nan, 5], THREE: [4, 4, 5, 6, 3]}
    found = found_by("joint", members, repeats)
    row = found.rows[0]
    assert (row["positions"], row["repeats"], row["members"]) == ("2 x, 3 x", 4, 2)
    assert found.messages == (
        "x of block 1: repeats without scatter are left out",
        "left out, as not all positions were measured: replicate 4",
    )
    rest = [[1, 4], [2, 4], [3, 5], [5, 3]]
    assert row["T2"] == hotelling_of(rest, [[2, 3], [2, 5]]).T2


def test_distant_means_do_not_agree() -> None:
    row = found_by("joint", {ONE: [100.0]}, {ONE: [1, 2, 3]}).rows[0]
    assert (row["within"], found_by("joint", {ONE: [2.1]}, {ONE: [1, 2, 3]}).rows[0]["within"]) == (False, True)


@pytest.mark.parametrize(
    ("members", "repeats", "told"),
    [
        (
            {ONE: [1.0], TWO: [1.0]},
            {ONE: [1, 2], TWO: [3, 5]},
            "2 complete repeats for 2 positions, at least 3 are needed",
        ),
        ({ONE: [1.0], TWO: [1.0]}, {ONE: [1, 2, nan], TWO: [nan, 5, 6]}, "1 complete repeats for 2 positions"),
        ({ONE: [1.0]}, {ONE: [1]}, "no measured position scatters"),
        ({ONE: [nan]}, {ONE: [1, 2]}, "no sample has all positions"),
        ({ONE: [1.0], TWO: [1.0]}, {ONE: [1, 2, 4, 5], TWO: [2, 4, 8, 10]}, "their covariance is singular"),
        ({ONE: [1.0], TWO: [1.0]}, {ONE: [1, 1, 1, 2], TWO: [1, 2, 3, nan]}, "a position does not scatter"),
    ],
)
def test_what_cannot_be_computed_is_said(
    members: dict[tuple[str, str], list[float]], repeats: dict[tuple[str, str], list[float]], told: str
) -> None:
    found = found_by("joint", members, repeats)
    assert found.rows == ()
    assert found.messages[-1].startswith("not computed: ")
    assert told in found.messages[-1]

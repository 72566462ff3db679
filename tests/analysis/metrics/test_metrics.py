"""Findings of all metrics for samples as small as they can be: numbers, and words where there are none."""

from math import nan, sqrt
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy import stats

from blocksim.analysis.evidence import Findings
from blocksim.analysis.metrics import Hotelling, area_between, area_interval, hotelling, outcome, repeat_passes_all
from tests.analysis.metrics.conftest import found_by
from tests.golden import Golden

X, TURN, UP = ("a", "x"), ("a", "rotation"), ("b", "x")
SIX = [71.69, 76.57, 72.70, 73.22, 73.73, 78.53]
ENDED = ["finished"] * 4 + ["failed"]
EQUAL = {X: [10, 10]}  # u_val is u_D, sqrt(0^2 + 0.5^2), with u_num = sqrt(0.75) it is 1
ONE, TWO, THREE, TURNS = ("1", "x"), ("2", "x"), ("3", "x"), (("1", "rotation"), ("2", "rotation"))
CASES: dict[str, tuple[Any, ...]] = {
    # ends count as inside; failed members, and those without the block, as outside
    "inside, ends": ("inside", {X: [1.0, 3.0, 2.0, 0.99, nan, 2.0]}, {X: [3.0, 1.0]}, ["finished", *ENDED]),
    "inside, the same member everywhere": (
        "inside",
        {X: [1.0, 2.0, 9.0], TURN: [0, -90, -90]},
        {X: [1, 3], TURN: [-90] * 2},
    ),
    **{
        f"inside, {count} equal repeats": ("inside", {X: [1.5, 2.5, 1.49, 2.51]}, {X: [2.0] * count})
        for count in (1, 3)
    },
    "inside, worth of passing": ("inside", {X: [75.0], UP: [75.0]}, {X: SIX, UP: SIX}),  # 5/7; both 3/7 to 5/7
    # repeats 0, 2: mean 1, s = sqrt 2, t_1 = tan(0.475 pi) = 12.706: 1 -+ t sqrt 2 sqrt 1.5 = 1 -+ 22.008
    "prediction": ("prediction", {X: [-21.0077, 23.0078, 1.0]}, {X: [0, 2]}),
    "prediction, one repeat": ("prediction", {X: [3.0]}, {X: [3.0]}),
    "prediction, equal repeats": ("prediction", {X: [3.0]}, {X: [3.0, 3.0]}),
    "area, a member without a value": ("area", {X: [2.0, nan, 2.0]}, {X: [1, 4]}),
    "area, one repeat": ("area", {X: [5.0, 6.0]}, {X: [3.0]}),
    "area, equal repeats": ("area", {X: [5.0, 6.0]}, {X: [3.0, 3.0]}),
    "area, few members": ("area", {X: [0.0, 1.0, 2.0]}, {X: [0, 1, 2, 3, 4, 5]}),
    "area, few repeats": ("area", {X: [0.0, 1.0, 2.0, 3.0]}, {X: [0, 1, 2]}),
    # members 2, 4, 6: mean 4, s 2; repeats 1, 2, 3, 6: mean 3, s^2 = (4 + 1 + 0 + 9)/3 = 14/3
    "validation": ("validation", {X: [2.0, 4.0, 6.0]}, {X: [1, 2, 3, 6]}, (), 0.7),
    "validation, just within": ("validation", {X: [12.0 - 1e-9] * 2}, EQUAL, (), sqrt(0.75)),
    "validation, just beyond": ("validation", {X: [12.0 + 1e-9] * 2}, EQUAL, (), sqrt(0.75)),
    "validation, one member": ("validation", {X: [5.0]}, {X: [4, 6]}),
    "validation, one repeat": ("validation", {X: [5.0, 6.0]}, {X: [4]}),
    "validation, failed and absent": ("validation", {X: [1, 3, 2, nan, 99]}, {X: [4, 6]}, ENDED),
    "validation, angles": ("validation", {TURN: [0.0]}, {TURN: [0.0]}),
    # 3 of 5: 0.146633 to 0.947255 in tables of Clopper and Pearson
    "outcome": (
        "outcome",
        {TURNS[0]: [0.0, 1.0, -1.0, 0.0, 0.0], TURNS[1]: [-90.0, -91.0, -180.0, -89.0, -90.0]},
        {TURNS[0]: [0] * 6, TURNS[1]: [-90] * 6},
        ENDED,
    ),
    "outcome, measured and reached by none": ("outcome", {TURN: [0.0, 0.0]}, {TURN: [-90, -90]}),
    "outcome, a repeat lacks one": (
        "outcome",
        {TURNS[0]: [0], TURNS[1]: [-90]},
        {TURNS[0]: [0] * 3, TURNS[1]: [-90, nan, -90]},
    ),
    "outcome, none measured": ("outcome", {X: [3.0], TURNS[0]: [-88.0], TURNS[1]: [2.0]}, {X: [3.0]}),
    "outcome, no rotations": ("outcome", {X: [3.0]}, {X: [3.0]}),
    "joint": (  # of 2 x and 3 x, repeats 1, 2, 3 and 5
        "joint",
        {ONE: [16.0, 16.0], TURNS[0]: [1.0, 2.0], TWO: [2.0, 2.0], THREE: [3.0, 5.0]},
        {ONE: [16] * 5, TURNS[0]: [1, 2, 3, 4, 5], TWO: [1, 2, 3, nan, 5], THREE: [4, 4, 5, 6, 3]},
    ),
    "joint, distant means": ("joint", {ONE: [100.0]}, {ONE: [1, 2, 3]}),
    "joint, near means": ("joint", {ONE: [2.1]}, {ONE: [1, 2, 3]}),
    "joint, few repeats": ("joint", {ONE: [1.0], TWO: [1.0]}, {ONE: [1, 2], TWO: [3, 5]}),
    "joint, one complete repeat": ("joint", {ONE: [1.0], TWO: [1.0]}, {ONE: [1, 2, nan], TWO: [nan, 5, 6]}),
    "joint, one repeat": ("joint", {ONE: [1.0]}, {ONE: [1]}),
    "joint, no sample": ("joint", {ONE: [nan]}, {ONE: [1, 2]}),
    "joint, singular": ("joint", {ONE: [1.0], TWO: [1.0]}, {ONE: [1, 2, 4, 5], TWO: [2, 4, 8, 10]}),
    "joint, no scatter": ("joint", {ONE: [1.0], TWO: [1.0]}, {ONE: [1, 1, 1, 2], TWO: [1, 2, 3, nan]}),
}


def text_of(found: Findings) -> str:
    rows = [", ".join(f"{name} {value}" for name, value in row.items()) for row in found.rows]
    return "\n".join([*rows, *(f"({message})" for message in found.messages)])


def test_findings_of_small_samples(golden: Golden) -> None:
    golden("\n\n".join(f"{name}\n{text_of(found_by(*case))}" for name, case in CASES.items()), rules=["digits"])


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


@pytest.mark.parametrize(("apart", "least"), [(1.0, 0.92), (3.0, 0.90)])
def test_interval_covers_the_true_area(apart: float, least: float) -> None:
    random = np.random.default_rng(2)
    covered = 0
    for trial in range(100):
        members, repeats = random.normal(apart, 1.0, 60), random.normal(0.0, 1.0, 6)
        low, high = area_interval(members, repeats, resamples=100, seed=trial)
        covered += low <= apart <= high  # equal shapes: the area is the shift
    assert least <= covered / 100 <= 1.0


def test_members_that_do_not_scatter_leave_the_scatter_of_the_repeats() -> None:
    low, high = area_interval(np.full(4, 5.0), np.array([0.0, 1.0, 2.0, 3.0]), 500)
    # the area is 5 minus the mean of the repeats: between 5 - 3 and 5 - 0 for any resample
    assert 2.0 <= low < 3.5 < high <= 5.0
    assert np.isnan(area_interval(np.arange(3.0), np.arange(6.0))).all()


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

"""Verdicts about a run against repeats, exact limits of a probability, Student's quantiles beside scipy."""

import json
from math import comb, isnan, sqrt
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, strategies as st
from scipy import stats

from blocksim.analysis.compare import Comparison, ComparisonRow, Verdict, compare_final, interval, lower_bound, quantile
from blocksim.analysis.experiment import ExperimentTable, Measurement, load_table
from blocksim.errors import InvalidInputError
from tests.golden import Golden

TABLE = load_table(Path(__file__).parents[2] / "scenarios" / "experiments" / "three_blocks.csv")
UP = 1e-9  # mm: the smallest step beyond a limit that must count


def final_table(
    x: tuple[float, ...] = (16.0, 74.0, 131.0), rotation: tuple[float, ...] = (0.0, -90.0, -90.0)
) -> pd.DataFrame:
    names = [str(number) for number in range(1, len(x) + 1)]
    return pd.DataFrame({"block": names, "x_mm": x, "rotation_deg": rotation})


def row(comparison: Comparison, block: str, quantity: str) -> ComparisonRow:
    return next(row for row in comparison.rows if (row.block, row.quantity) == (block, quantity))


def table_of(*values: float) -> ExperimentTable:
    repeats = tuple(Measurement("1", "x", "mm", number, value) for number, value in enumerate(values, 1))
    return ExperimentTable(repeats, source="made up")


def test_one_block_short_of_its_range_is_outside_by_that_much() -> None:
    comparison = compare_final(final_table(x=(16.0, 67.0, 128.8)), TABLE)
    assert not comparison.inside
    short = row(comparison, "2", "x")
    assert short.verdict is Verdict.OUTSIDE
    assert short.distance == pytest.approx(71.69 - 67.0)
    assert short.error == pytest.approx(67.0 - 74.406667, abs=1e-6)
    assert row(comparison, "3", "x").verdict is Verdict.INSIDE


@pytest.mark.parametrize(("block", "ends"), [("2", (71.69, 78.53)), ("1", (15.5, 16.5))])
def test_ends_of_a_range_are_inside_and_it_is_widened_to_the_reading_for_equal_repeats_only(
    block: str, ends: tuple[float, float]
) -> None:
    low, high = ends
    for value, inside in ((low, True), (high, True), (low - UP, False), (high + UP, False)):
        x = (16.0, value, 131.0) if block == "2" else (value, 74.0, 131.0)
        verdict = Verdict.INSIDE if inside else Verdict.OUTSIDE
        assert row(compare_final(final_table(x=x), TABLE), block, "x").verdict is verdict


@pytest.mark.parametrize(
    ("angle", "verdict"),
    [(-85.0, "inside"), (-95.0, "inside"), (-84.9, "outside"), (-95.1, "outside"), (270.0, "outside")],
)
def test_rotation_is_judged_within_five_degrees_and_not_wrapped(angle: float, verdict: str) -> None:
    comparison = compare_final(final_table(rotation=(0.0, angle, -90.0)), TABLE)
    assert row(comparison, "2", "rotation").verdict.value == verdict


def test_a_failed_run_is_outside_and_still_json() -> None:
    comparison = compare_final(final_table(x=(16.0, float("nan"), 131.0)), TABLE)
    assert not comparison.inside
    plain = json.loads(json.dumps(comparison.to_dict(), allow_nan=False))
    assert plain["rows"][2]["verdict"] == "outside"
    assert plain["rows"][2]["simulated"] is None


def test_uncertainties_of_the_measured_centres() -> None:
    second = row(compare_final(final_table(), TABLE), "2", "x")
    values = TABLE.values("2", "x").to_numpy()
    assert second.u_data == pytest.approx(np.hypot(stats.sem(values), 0.5))
    half = stats.t.ppf(0.975, 5) * np.std(values, ddof=1) * sqrt(7 / 6)
    assert second.prediction == pytest.approx(half)
    assert second.prediction == pytest.approx(7.2, abs=0.05)
    assert row(compare_final(final_table(), TABLE), "3", "x").prediction == pytest.approx(7.9, abs=0.05)


def test_rotations_and_single_repeats_have_no_uncertainty_of_the_mean() -> None:
    assert isnan(row(compare_final(final_table(), TABLE), "2", "rotation").u_data)
    single = compare_final(final_table(x=(5.0,), rotation=(0.0,)), table_of(5.2)).rows[0]
    assert isnan(single.prediction)
    assert isnan(single.u_data)
    assert single.verdict is Verdict.INSIDE


def test_an_unmeasured_block_is_named_and_not_judged() -> None:
    final = final_table(x=(16.0, 74.0, 131.0, 500.0), rotation=(0.0, -90.0, -90.0, 0.0))
    comparison = compare_final(final, TABLE)
    assert comparison.inside
    assert row(comparison, "4", "x").verdict is Verdict.NO_DATA
    assert comparison.messages == (f"block '4' is not in {TABLE.source}; it is not compared",)
    assert repr(comparison) == f"<Comparison with {TABLE.source}: 6 of 6 quantities inside>"
    many = final_table(x=(16.0, 67.0, 131.0, *[500.0] * 12), rotation=(0.0, -90.0, -90.0, *[0.0] * 12))
    found = compare_final(many, TABLE)
    assert repr(found) == f"<Comparison with {TABLE.source}: 5 of 6 quantities inside>"
    assert found.messages[0].startswith("blocks '4', '5', ")
    assert found.messages[0].endswith(f"and 4 more are not in {TABLE.source}; they are not compared")


def test_final_tables_that_cannot_be_compared_are_refused(golden: Golden, tmp_path: Path) -> None:
    """Blocks that a run lacks are shown where the table first names them."""
    path = tmp_path / "table.csv"
    path.write_text("block,quantity,unit,replicate,value\n# a\n1,x,mm,1,3\nleft,x,mm,1,4\n9,x,mm,1,4\n9,x,mm,2,4\n")
    cases = {
        "blocks that the run lacks": (final_table(x=(1.0, 2.0), rotation=(0.0, 0.0)), load_table(path)),
        "quantity that the run lacks": (final_table().drop(columns="rotation_deg"), TABLE),
        "blocks twice": (pd.concat([final_table(), final_table()]), TABLE),
    }
    for name, (final, table) in cases.items():
        with pytest.raises(InvalidInputError) as caught:
            compare_final(final, table)
        golden(str(caught.value), name)


finite = st.floats(-1e4, 1e4)


@given(repeats=st.lists(finite, min_size=2, max_size=6, unique=True), value=finite)
def test_distance_is_what_it_takes_to_come_inside(repeats: list[float], value: float) -> None:
    judged = compare_final(final_table(x=(value,), rotation=(0.0,)), table_of(*repeats)).rows[0]
    nearest = min(max(value, min(repeats)), max(repeats))
    assert judged.distance == pytest.approx(abs(value - nearest), abs=1e-9)
    assert (judged.verdict is Verdict.INSIDE) == (min(repeats) <= value <= max(repeats))


def at_least(count: int, total: int, p: float) -> float:
    return sum(comb(total, k) * p**k * (1 - p) ** (total - k) for k in range(count, total + 1))


@pytest.mark.parametrize(("count", "total"), [(1, 1), (1, 6), (3, 6), (5, 6), (17, 40), (39, 40)])
def test_limits_leave_just_the_tails(count: int, total: int) -> None:
    low, high = interval(count, total)
    assert at_least(count, total, low) == pytest.approx(0.025, abs=1e-9)
    assert 1.0 - at_least(count + 1, total, high) == pytest.approx(0.025 if count < total else 1.0, abs=1e-9)


@pytest.mark.parametrize("total", [1, 6, 1000])
def test_none_and_all_have_the_limits_of_pencil_and_paper(total: int) -> None:
    # nobody of n: (1 - p)^n = 0.025; all of n: p^n = 0.025
    assert interval(0, total) == pytest.approx((0.0, 1.0 - 0.025 ** (1 / total)), abs=1e-12)
    assert interval(total, total) == pytest.approx((0.025 ** (1 / total), 1.0), abs=1e-12)


def test_six_of_six_are_at_least_61_percent() -> None:
    assert lower_bound(6, 6) == pytest.approx(0.05 ** (1 / 6), abs=1e-12)
    assert lower_bound(6, 6) == pytest.approx(0.61, abs=0.005)
    assert lower_bound(0, 6) == 0.0
    assert interval(0, 0) == (0.0, 1.0)
    assert at_least(5, 6, lower_bound(5, 6)) == pytest.approx(0.05, abs=1e-9)


@pytest.mark.parametrize("degrees", [1, 2, 3, 4, 5, 6, 9, 30, 101])
@pytest.mark.parametrize("probability", [0.001, 0.3, 0.5, 0.75, 0.975, 0.9995])
def test_quantile_agrees_with_scipy(degrees: int, probability: float) -> None:
    expected = float(stats.t.ppf(probability, degrees))
    assert quantile(probability, degrees) == pytest.approx(expected, rel=1e-11, abs=1e-12)


@pytest.mark.parametrize(("probability", "degrees"), [(0.0, 5), (1.0, 5), (0.975, 0)])
def test_quantile_without_meaning_is_refused(probability: float, degrees: int) -> None:
    with pytest.raises(ValueError, match="degree of freedom"):
        quantile(probability, degrees)


def test_large_numbers_agree_with_scipy() -> None:
    expected = stats.binomtest(9_700, 10_000).proportion_ci(method="exact")
    assert interval(9_700, 10_000) == pytest.approx((expected.low, expected.high), abs=1e-9)

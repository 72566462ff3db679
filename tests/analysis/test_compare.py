"""Verdicts about a run against repeats, exact limits of a probability, Student's quantiles beside scipy."""

import json
from math import sqrt
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from blocksim.analysis.compare import Comparison, ComparisonRow, compare_final, interval, lower_bound, quantile
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


def ending(first: float = 16.0, second: float = 74.0, third: float = 131.0, turn: float = -90.0) -> pd.DataFrame:
    """Return the end of three blocks (mm, the turn of the second in degrees)."""
    return final_table((first, second, third), (0.0, turn, -90.0))


NAN = float("nan")
LOW, HIGH = 71.69, 78.53  # mm, of block 2; of block 1, equal repeats at 16, the reading: half a millimetre
ENDS = {
    "inside": ending(),
    "one block short of its range": ending(second=67.0, third=128.8),
    **{f"at {name} of a range": ending(second=end) for name, end in (("the low end", LOW), ("the high end", HIGH))},
    **{f"beyond {end} mm": ending(second=end + beyond) for end, beyond in ((LOW, -UP), (HIGH, UP))},
    **{f"a reading off, at {end} mm": ending(end) for end in (15.5, 16.5, 15.5 - UP, 16.5 + UP)},
    **{f"turned by {angle} degrees": ending(turn=angle) for angle in (-85.0, -95.0, -84.9, -95.1, 270.0)},
    "a failed run": ending(second=NAN),
    "a block that was not measured": final_table((16.0, 74.0, 131.0, 500.0), (0.0, -90.0, -90.0, 0.0)),
    "many such blocks": final_table((16.0, 67.0, 131.0, *[500.0] * 12), (0.0, -90.0, -90.0, *[0.0] * 12)),
    "a single repeat": final_table((5.0,), (0.0,)),
}


def test_ends_are_judged_as_they_were_read(golden: Golden) -> None:
    """A range is widened to the reading for equal repeats only; angles are not wrapped; rows are told once."""
    texts: list[str] = []
    for name, final in ENDS.items():
        found = compare_final(final, table_of(5.2) if name == "a single repeat" else TABLE)
        plain = json.loads(json.dumps(found.to_dict(), allow_nan=False))
        rows = [", ".join(f"{key} {value}" for key, value in row.items()) for row in plain["rows"]]
        texts += [f"\n{name}: {found!r}", *(text for text in rows if text not in texts), *found.messages]
        assert found.to_frame()["verdict"].tolist() == [row["verdict"] for row in plain["rows"]]
    golden("\n".join(texts), rules=["digits"])


def test_uncertainties_of_the_measured_centres() -> None:
    second = row(compare_final(final_table(), TABLE), "2", "x")
    values = TABLE.values("2", "x").to_numpy()
    assert second.u_data == pytest.approx(np.hypot(stats.sem(values), 0.5))
    half = stats.t.ppf(0.975, 5) * np.std(values, ddof=1) * sqrt(7 / 6)
    assert second.prediction == pytest.approx(half)


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


@pytest.mark.parametrize(("count", "total"), [(0, 1), (1, 1), (0, 6), (3, 6), (6, 6), (17, 40), (9_700, 10_000)])
def test_limits_of_a_share_agree_with_scipy(count: int, total: int) -> None:
    expected = stats.binomtest(count, total).proportion_ci(method="exact")
    assert interval(count, total) == pytest.approx((expected.low, expected.high), abs=1e-9)
    one_sided = stats.binomtest(count, total, alternative="greater").proportion_ci(method="exact")
    assert lower_bound(count, total) == pytest.approx(one_sided.low, abs=1e-9)
    assert interval(0, 0) == (0.0, 1.0)


@pytest.mark.parametrize("degrees", [1, 2, 3, 4, 30, 101])
@pytest.mark.parametrize("probability", [0.001, 0.5, 0.75, 0.9995])
def test_quantile_agrees_with_scipy(degrees: int, probability: float) -> None:
    expected = float(stats.t.ppf(probability, degrees))
    assert quantile(probability, degrees) == pytest.approx(expected, rel=1e-11, abs=1e-12)


@pytest.mark.parametrize(("probability", "degrees"), [(0.0, 5), (1.0, 5), (0.975, 0)])
def test_quantile_without_meaning_is_refused(probability: float, degrees: int) -> None:
    with pytest.raises(ValueError, match="degree of freedom"):
        quantile(probability, degrees)

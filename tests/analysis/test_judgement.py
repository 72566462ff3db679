"""The table of a sweep, good and bad, and all metrics of it together."""

import functools
import json
import sys
from math import nan
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from blocksim.analysis.evidence import Failure, Members
from blocksim.analysis.experiment import load_table
from blocksim.analysis.metrics import METRICS, Judgement, Settings, judge
from blocksim.errors import InvalidInputError, UnavailableError
from tests.analysis.metrics.conftest import members_of, table_of

PAPER = load_table(Path(__file__).parents[2] / "scenarios" / "experiments" / "three_blocks.csv")
BLOCKS = ("1", "2", "3")


@functools.cache
def judged(settings: Settings | None = None) -> Judgement:
    random = np.random.default_rng(1)
    values = {(block, "x"): random.normal(mean, 1.0, 40) for block, mean in zip(BLOCKS, (16, 74, 131), strict=True)}
    values |= {(block, "rotation"): np.full(40, turn) for block, turn in zip(BLOCKS, (0.0, -90.0, -90.0), strict=True)}
    statuses = ["finished"] * 39 + ["failed"]
    return judge(members_of({key: value.tolist() for key, value in values.items()}, statuses), PAPER, settings)


def test_every_number_has_a_meaning_and_json_carries_it() -> None:
    plain = json.loads(json.dumps(judged().to_dict(), allow_nan=False))
    assert set(plain["metrics"]) == set(METRICS)
    for told in plain["metrics"].values():
        assert told["meaning"]
        for row in told["rows"]:
            assert set(row) <= set(told["columns"])
    assert all(meaning for told in plain["metrics"].values() for meaning in told["columns"].values())


def test_failed_members_are_counted_and_named() -> None:
    plain = judged().to_dict()
    assert (plain["members"], plain["finished"]) == (40, 39)
    assert plain["failed"] == [{"row": 40, "case": "c40", "status": "failed", "reason": "as it is"}]
    assert judged().share_inside == judged().inside_all / 40


def test_threshold_that_is_just_met_is_met() -> None:
    share = judged().share_inside
    assert 0.0 < share < 1.0
    assert judged(Settings(threshold=share)).inside
    assert not judged(Settings(threshold=np.nextafter(share, 1.0))).inside
    assert {row["u_num"] for row in judged(Settings(u_num=3.0)).findings["validation"].rows} == {3.0}


@pytest.mark.parametrize("metric", METRICS)
def test_findings_as_frames_have_the_columns_of_the_metric(metric: str) -> None:
    frame = judged().to_frame(metric)
    assert list(frame.columns) == [column.name for column in METRICS[metric].columns]
    assert len(frame) == len(judged().findings[metric].rows)


@pytest.mark.parametrize("wrong", [{"threshold": 1.1}, {"threshold": nan}, {"u_num": -1.0}, {"u_num": nan}])
def test_settings_that_mean_nothing_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(InvalidInputError, match=next(iter(wrong))):
        Settings(**wrong)


def test_blocks_that_are_not_measured_or_not_there_are_reported() -> None:
    members = members_of({("1", "x"): [1.0, nan], ("2", "x"): [1.0, 1.0]})
    found = judge(members, table_of({("1", "x"): [1, 2]}))
    assert found.messages == (
        "block '2' is not in repeats.csv; it is not compared",
        "1 finished samples have no x of block 1: they count as outside",
    )
    with pytest.raises(InvalidInputError, match=r"repeats\.csv measures block '3', but the sweep has only '1', '2'"):
        judge(members, table_of({("3", "x"): [1, 2]}))


def test_one_member_and_one_repeat_are_enough_for_an_answer() -> None:
    found = judge(members_of({("1", "x"): [1.0], ("1", "rotation"): [0.0]}), table_of({("1", "x"): [1.2]}))
    assert found.inside
    assert found.findings["joint"].rows == ()


def test_missing_scipy_is_reported_with_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "scipy.special", None)
    with pytest.raises(UnavailableError, match=r"blocksim\[study\]"):
        judged.__wrapped__()


def swept() -> pd.DataFrame:
    return pd.DataFrame(
        {
            "case": ["a", "b", None],
            "friction.static": [0.1, 0.2, 0.3],
            "status": ["finished", "failed", "invalid"],
            "reason": ["at rest", "too deep", None],
            "left.wing.x_mm": [1.0, 2.0, np.nan],
            "2.rotation_deg": [3.0, np.inf, np.nan],
        }
    )


def test_members_that_did_not_finish_are_named_and_have_no_values() -> None:
    members = Members(swept(), "sweep.csv")
    assert members.blocks == ("left.wing", "2")
    assert (len(members.table), members.has_ended.tolist()) == (3, [True, False, False])
    assert members.failures == (Failure(2, "b", "failed", "too deep"), Failure(3, "", "invalid", ""))
    assert Members(swept().drop(columns="reason"), "sweep.csv").failures[0].reason == ""
    assert np.array_equal(members.values("left.wing", "x"), [1.0, np.nan, np.nan], equal_nan=True)


def test_values_that_are_not_finite_are_no_values() -> None:
    changed = swept().assign(**{"2.rotation_deg": [np.inf, 1.0, 1.0]})
    assert np.isnan(Members(changed, "sweep.csv").values("2", "rotation")).all()


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        (swept().drop(columns=["case", "status"]), "sweep.csv: not the table of a sweep: no column case and status"),
        (swept().iloc[1:], "sweep.csv: none of the 2 cases has finished; nothing to compare"),
        (swept().iloc[:0], "sweep.csv: none of the 0 cases has finished; nothing to compare"),
    ],
)
def test_table_that_is_of_no_use_is_refused(changed: pd.DataFrame, message: str) -> None:
    with pytest.raises(InvalidInputError) as caught:
        Members(changed, "sweep.csv")
    assert str(caught.value) == message


def test_measured_quantity_without_a_column_is_named() -> None:
    with pytest.raises(InvalidInputError, match=r"no column 2\.left_mm, which the measured left of block '2'"):
        Members(swept(), "sweep.csv").values("2", "left")


def test_text_among_the_numbers_is_shown_with_its_row() -> None:
    changed = swept().assign(**{"2.rotation_deg": pd.Series(["3", "x y", None])})
    with pytest.raises(InvalidInputError, match=r"sweep\.csv: 2\.rotation_deg: 'x y' in row 2 is not a number"):
        Members(changed, "sweep.csv").values("2", "rotation")

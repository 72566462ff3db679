"""The table of a sweep, good and bad, and all metrics of it together."""

import functools
from collections.abc import Callable
from math import nan
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from blocksim.analysis.evidence import Failure, Members
from blocksim.analysis.experiment import load_table
from blocksim.analysis.metrics import METRICS, Judgement, Settings, judge
from blocksim.errors import InvalidInputError
from tests.analysis.metrics.conftest import members_of, table_of
from tests.golden import Golden

PAPER = load_table(Path(__file__).parents[2] / "scenarios" / "experiments" / "three_blocks.csv")
BLOCKS = ("1", "2", "3")


@functools.cache
def judged(settings: Settings | None = None) -> Judgement:
    random = np.random.default_rng(1)
    values = {(block, "x"): random.normal(mean, 1.0, 40) for block, mean in zip(BLOCKS, (16, 74, 131), strict=True)}
    values |= {(block, "rotation"): np.full(40, turn) for block, turn in zip(BLOCKS, (0.0, -90.0, -90.0), strict=True)}
    statuses = ["finished"] * 39 + ["failed"]
    return judge(members_of({key: value.tolist() for key, value in values.items()}, statuses), PAPER, settings)


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
    endless = Members(swept().assign(**{"2.rotation_deg": [np.inf, 1.0, 1.0]}), "sweep.csv")
    assert np.isnan(endless.values("2", "rotation")).all()


def test_tables_of_sweeps_that_are_of_no_use_are_refused(golden: Golden) -> None:
    one = members_of({("1", "x"): [1.0, nan], ("2", "x"): [1.0, 1.0]})
    text = swept().assign(**{"2.rotation_deg": pd.Series(["3", "x y", None])})
    asked: list[Callable[[], object]] = [
        lambda: Members(swept().drop(columns=["case", "status"]), "sweep.csv"),
        lambda: Members(swept().iloc[1:], "sweep.csv"),
        lambda: Members(swept().iloc[:0], "sweep.csv"),
        lambda: Members(swept(), "sweep.csv").values("2", "left"),
        lambda: Members(text, "sweep.csv").values("2", "rotation"),
        lambda: judge(one, table_of({("3", "x"): [1, 2]})),
    ]
    texts = [*judge(one, table_of({("1", "x"): [1, 2]})).messages]
    for ask in asked:
        with pytest.raises(InvalidInputError) as caught:
            ask()
        texts.append(str(caught.value))
    golden("\n".join(texts))

"""The table of a sweep, good and bad."""

import numpy as np
import pandas as pd
import pytest

from blocksim.analysis.evidence import Failure, Members
from blocksim.errors import InvalidInputError


def table() -> pd.DataFrame:
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
    members = Members(table(), "sweep.csv")
    assert members.blocks == ("left.wing", "2")
    assert (len(members.table), members.has_ended.tolist()) == (3, [True, False, False])
    assert members.failures == (Failure(2, "b", "failed", "too deep"), Failure(3, "", "invalid", ""))
    assert Members(table().drop(columns="reason"), "sweep.csv").failures[0].reason == ""
    assert np.array_equal(members.values("left.wing", "x"), [1.0, np.nan, np.nan], equal_nan=True)


def test_values_that_are_not_finite_are_no_values() -> None:
    changed = table().assign(**{"2.rotation_deg": [np.inf, 1.0, 1.0]})
    assert np.isnan(Members(changed, "sweep.csv").values("2", "rotation")).all()


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        (table().drop(columns=["case", "status"]), "sweep.csv: not the table of a sweep: no column case and status"),
        (table().iloc[1:], "sweep.csv: none of the 2 cases has finished; nothing to compare"),
        (table().iloc[:0], "sweep.csv: none of the 0 cases has finished; nothing to compare"),
    ],
)
def test_table_that_is_of_no_use_is_refused(changed: pd.DataFrame, message: str) -> None:
    with pytest.raises(InvalidInputError) as caught:
        Members(changed, "sweep.csv")
    assert str(caught.value) == message


def test_measured_quantity_without_a_column_is_named() -> None:
    with pytest.raises(InvalidInputError, match=r"no column 2\.left_mm, which the measured left of block '2'"):
        Members(table(), "sweep.csv").values("2", "left")


def test_text_among_the_numbers_is_shown_with_its_row() -> None:
    changed = table().assign(**{"2.rotation_deg": pd.Series(["3", "x y", None])})
    with pytest.raises(InvalidInputError, match=r"sweep\.csv: 2\.rotation_deg: 'x y' in row 2 is not a number"):
        Members(changed, "sweep.csv").values("2", "rotation")

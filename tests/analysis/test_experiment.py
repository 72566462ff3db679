"""Measured tables: the numbers printed in the paper, and what a person reads when a table is broken."""

from decimal import ROUND_HALF_UP, Decimal
from pathlib import Path

import numpy as np
import pytest

from blocksim.analysis.experiment import ExperimentTable, load_table
from blocksim.errors import InvalidInputError
from tests.analysis.broken import Mistake, rendered, written

EXPERIMENTS = Path(__file__).parents[2] / "scenarios" / "experiments"
HEADER = "block,quantity,unit,replicate,value\n"
HUNDREDTH = Decimal("0.01")


@pytest.fixture(name="centres", scope="module")
def fixture_centres() -> ExperimentTable:
    return load_table(EXPERIMENTS / "three_blocks.csv")


@pytest.fixture(name="edges", scope="module")
def fixture_edges() -> ExperimentTable:
    return load_table(EXPERIMENTS / "three_blocks_edges.csv")


def mean_of(table: ExperimentTable, block: str, quantity: str) -> float:
    rows = table.statistics().set_index(["block", "quantity"])["mean"].to_dict()
    return float(rows[block, quantity])


def midpoints(edges: ExperimentTable, block: str) -> list[Decimal]:
    """Return the midpoints of the edges as a person with pencil and paper gets them."""
    pairs = zip(edges.values(block, "left"), edges.values(block, "right"), strict=True)
    sums = [Decimal(str(left)) + Decimal(str(right)) for left, right in pairs]
    return [(total / 2).quantize(HUNDREDTH, ROUND_HALF_UP) for total in sums]


@pytest.mark.parametrize(("block", "printed"), [("1", 16.0), ("2", 74.41), ("3", 131.33)])
def test_centres_average_to_what_table_3_prints(centres: ExperimentTable, block: str, printed: float) -> None:
    assert mean_of(centres, block, "x") == pytest.approx(printed, abs=0.005)


@pytest.mark.parametrize(
    ("block", "quantity", "printed"),
    [
        ("1", "left", 0.0),
        ("2", "left", 49.01),
        ("3", "left", 111.15),
        ("1", "right", 32.0),
        ("2", "right", 99.8),
        ("3", "right", 151.51),
    ],
)
def test_edges_average_to_what_table_2_prints(
    edges: ExperimentTable, block: str, quantity: str, printed: float
) -> None:
    assert mean_of(edges, block, quantity) == pytest.approx(printed, abs=0.005 + 1e-9)  # 151.505 became 151.51


@pytest.mark.parametrize("block", ["1", "2", "3"])
def test_every_centre_is_the_midpoint_of_its_edges_rounded_half_up(
    centres: ExperimentTable, edges: ExperimentTable, block: str
) -> None:
    printed = [Decimal(str(value)) for value in centres.values(block, "x")]
    assert printed == midpoints(edges, block)


def test_statistics_of_the_paper_match_numpy_and_the_design(centres: ExperimentTable) -> None:
    statistics = centres.statistics().set_index(["block", "quantity"]).to_dict(orient="index")
    second, third = statistics["2", "x"], statistics["3", "x"]
    assert (second["n"], second["minimum"], second["maximum"]) == (6, 71.69, 78.53)
    assert (third["n"], third["minimum"], third["maximum"]) == (6, 128.55, 136.05)
    assert second["s"] == pytest.approx(np.std(centres.values("2", "x"), ddof=1), rel=1e-12)
    assert second["s"] == pytest.approx(2.60, abs=0.005)
    assert third["s"] == pytest.approx(2.84, abs=0.005)


def test_units_become_millimetres_and_degrees(tmp_path: Path) -> None:
    rows = "1,x,cm,1,2.5\n1,y,m,1,-0.001\n1,rotation,rad,1,-1.5707963267948966\n1,left,in,1,1\n"
    table = load_table(written(tmp_path, HEADER + rows))
    assert list(table.data["value"]) == pytest.approx([25.0, -1.0, -90.0, 25.4], rel=1e-15)
    assert list(table.data["unit"]) == ["mm", "mm", "deg", "mm"]


def test_spreadsheet_habits_are_understood(tmp_path: Path) -> None:
    text = '\ufeff# a "note"\r\n\r\nvalue , block,quantity,unit,replicate\r\n 1.5e1, "left, ""L""" ,x,mm, 2\r\n'
    table = load_table(written(tmp_path, text))
    assert table.blocks == ('left, "L"',)
    assert list(table.values('left, "L"', "x").items()) == [(2, 15.0)]
    assert table.notes == ('a "note"',)


def test_a_single_repeat_has_no_scatter(tmp_path: Path) -> None:
    statistics = load_table(written(tmp_path, HEADER + "1,x,mm,1,3\n")).statistics()
    assert list(statistics.columns) == ["block", "quantity", "unit", "mean", "s", "n", "minimum", "maximum"]
    assert np.isnan(statistics["s"].iloc[0])
    assert list(statistics["n"]) == [1]


@pytest.mark.parametrize("cell", ["", " ", "NaN", "nan", "NA"])
def test_a_repeat_without_a_value_is_left_out_and_told(tmp_path: Path, cell: str) -> None:
    rows = f"1,x,mm,1,3\n1,x,mm,2,{cell}\n1,x,mm,3,5\n"
    path = written(tmp_path, HEADER + rows)
    table = load_table(path)
    assert (list(table.values("1", "x").items()), table.summaries()[0].n) == ([(1, 3.0), (3, 5.0)], 2)
    assert table.messages == (f"{path}: replicate 2 has no x of block '1'",)
    table = load_table(written(tmp_path, HEADER + rows + f"1,x,mm,4,{cell}\n1,x,mm,5,\n2,x,mm,2,7\n"))
    assert table.messages[0].endswith("replicate 2 has no x of block '1' (and 2 more such rows)")
    assert [row.n for row in table.summaries()] == [2, 1]  # a row that is absent is no mistake


def test_blocks_that_a_run_lacks_are_shown_where_they_are_first_named(tmp_path: Path) -> None:
    rows = "# source\n1,x,mm,1,3\nleft,x,mm,1,4\n9,x,mm,1,4\n9,x,mm,2,4\n"
    table = load_table(written(tmp_path, HEADER + rows))
    with pytest.raises(InvalidInputError) as caught:
        table.refuse_unknown(("1", "2"), "the run")
    path = tmp_path / "table.csv"
    assert str(caught.value) == (
        f"{path}:4: block: the table measures block 'left', but the run has only '1', '2'\n"
        "    4 | left,x,mm,1,4\n"
        "      | ^^^^\n"
        f"{path}:5: block: the table measures block '9', but the run has only '1', '2'\n"
        "    5 | 9,x,mm,1,4\n"
        "      | ^"
    )


NO_NUMBER = "is not a number, write it as 71.69 or 7.169e1"
NO_REPEAT = "is not a repeat number; count repeats as 1, 2, 3, ..."
QUANTITIES = "allowed: x, y, rotation, left, right"
LENGTH, ANGLE = "is not the unit of a length; write mm, cm or m", "is not the unit of an angle; write deg or rad"
BROKEN: dict[str, tuple[str, *tuple[Mistake, ...]]] = {
    "unit of another kind": ("1,x,kg,1,16", (2, "unit", f"'kg' {LENGTH}", "kg")),
    "unit that does not exist": ("1,x,millimetrs,1,16", (2, "unit", f"'millimetrs' {LENGTH}", "millimetrs")),
    "no unit": ("1,rotation,,1,16", (2, "unit", "no unit; write deg or rad", ",1,16")),
    "pure number as an angle": ("1,rotation,1,2,16", (2, "unit", f"'1' {ANGLE}", "1,2")),
    "unit with a tower of powers": ("1,x,mm**9**9**9,1,16", (2, "unit", f"'mm**9**9**9' {LENGTH}", "mm**9**9**9")),
    "word for a number": ("1,x,mm,1,about 16", (2, "value", f"'about 16' {NO_NUMBER}", "about 16")),
    "no value in any repeat": (
        "1,x,mm,1,nan\n1,x,mm,2,\n2,x,mm,1,3",
        (2, "value", "block '1', x has no value in any replicate", "nan"),
    ),
    "dash for a missing value": ("1,x,mm,1,-", (2, "value", f"'-' {NO_NUMBER}", "-")),
    "missing value given twice": (
        "1,x,mm,1,3\n1,x,mm,1,",
        (3, "replicate", "block '1', x, replicate 1 is already given in line 2", "1"),
    ),
    "infinite after reading": ("1,x,mm,1,1e999", (2, "value", "'1e999' is too large", "1e999")),
    "too far away": ("1,x,m,1,1e7", (2, "value", "'1e7' is too large, at most 1e+09 mm or degrees", "1e7")),
    "mistyped quantity": (
        "1,rotaton,deg,1,16",
        (2, "quantity", "unknown quantity 'rotaton', did you mean 'rotation'?", "rotaton"),
    ),
    "foreign quantity": ("1,mass,kg,1,16", (2, "quantity", f"unknown quantity 'mass', {QUANTITIES}", "mass")),
    "repeat is no number": ("1,x,mm,first,16", (2, "replicate", f"'first' {NO_REPEAT}", "first")),
    "repeat zero": ("1,x,mm,0,16", (2, "replicate", f"'0' {NO_REPEAT}", "0")),
    "nameless block": (" ,x,mm,1,16", (2, "block", "the block has no name", ",x")),
    "long name": ("b" * 101 + ",x,mm,1,16", (2, "block", "the name has 101 characters, at most 100", "b" * 101)),
    "no rows": ("", (1, "", "the table has a header and no rows", HEADER.strip())),
    "measured twice": (
        "1,x,mm,1,16\n2,x,mm,1,70\n1,x,cm,1,17",
        (4, "replicate", "block '1', x, replicate 1 is already given in line 2", "1,17"),
    ),
    "several mistakes, by line": (
        "1,x,mm,1,a\n1,z,mm,2,b\n1,x,mm",
        (2, "value", f"'a' {NO_NUMBER}", "a"),
        (3, "quantity", f"unknown quantity 'z', {QUANTITIES}", "z"),
        (3, "value", f"'b' {NO_NUMBER}", "b"),
        (4, "", "3 cells where the header has 5 columns", "1,x,mm"),
    ),
}


@pytest.mark.parametrize(("rows", "mistakes"), [(rows, told) for rows, *told in BROKEN.values()], ids=BROKEN.keys())
def test_a_broken_table_is_explained_where_it_is_broken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rows: str, mistakes: list[Mistake]
) -> None:
    written(tmp_path, HEADER + rows)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InvalidInputError) as caught:
        load_table("table.csv")
    assert str(caught.value) == rendered(HEADER + rows, mistakes)

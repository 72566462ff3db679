"""Verdicts from rows are those of `compare`."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from blocksim.analysis.compare import compare_final
from blocksim.analysis.experiment import load_table
from blocksim.study.rows import Ranges
from tests.study.conftest import SCENARIOS

TABLE = SCENARIOS / "experiments" / "three_blocks.csv"
NAMES = ("1", "2", "3")


def final(rng: np.random.Generator) -> dict[str, list[object]]:
    x = np.array([16.0, 75.0, 132.0]) + rng.normal(0.0, 0.4, 3) * [1.0, 6.0, 6.0]
    rotation = np.array([0.0, -90.0, -90.0]) + rng.normal(0.0, 2.0, 3)
    return {"block": list(NAMES), "x_mm": x.tolist(), "rotation_deg": rotation.tolist()}


def row_of(columns: dict[str, list[object]]) -> dict[str, object]:
    return {f"{name}.{key}": columns[key][i] for key in ("x_mm", "rotation_deg") for i, name in enumerate(NAMES)}


def test_rows_and_tables_are_judged_as_compare_does() -> None:
    rng, measured, ranges = np.random.default_rng(1), load_table(TABLE), Ranges.read(TABLE)
    finals = [final(rng) for _ in range(200)]
    expected = [compare_final(one, measured).inside for one in finals]
    assert 20 < sum(expected) < 180
    rows = [row_of(one) for one in finals]
    assert [ranges.hold(row) for row in rows] == expected
    assert ranges.count(pd.DataFrame(rows)) == sum(expected)


@pytest.mark.parametrize("value", [None, float("nan")])
def test_block_without_a_position_is_not_inside(tmp_path: Path, value: float | None) -> None:
    table = tmp_path / "table.csv"
    table.write_text("block,quantity,unit,replicate,value\n1,x,mm,1,16\n")
    ranges = Ranges.read(table)
    assert ranges.hold({"1.x_mm": 16.2})
    assert not ranges.hold({"1.x_mm": value})
    assert not ranges.hold({})

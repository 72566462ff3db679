"""The table of a sensitivity study, read back as bars."""

from pathlib import Path

import numpy as np
import pytest

from blocksim.errors import InvalidInputError
from blocksim.study.pictures import read_indices

SOBOL = "output,unit,key,S1,± S1,ST,± ST\nx of block 2,mm,a,0.1,0.2,0.7,0.3\nx of block 2,mm,b,0.2,nan,0.4,\n"
MORRIS = "output,unit,key,mu*,±,mu,sigma\nx of block 2,mm,a,5,1,-5,0\nmeasured outcome,share,a,0.5,0.1,0.5,0\n"


def written(folder: Path, text: str) -> Path:
    path = folder / "indices.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_sobol_bars_are_total_indices_with_those_of_the_key_alone(tmp_path: Path) -> None:
    (bars,), labels = read_indices(written(tmp_path, SOBOL))
    assert (bars.title, bars.keys) == ("x of block 2", ("a", "b"))
    assert bars.values.tolist() == [0.7, 0.4]
    assert bars.part is not None
    assert bars.part.tolist() == [0.1, 0.2]
    assert bars.half_widths[0] == 0.3
    assert np.isnan(bars.half_widths[1])
    assert "variance" in labels[0]


def test_morris_bars_have_the_unit_of_their_result(tmp_path: Path) -> None:
    (x, outcome), labels = read_indices(written(tmp_path, MORRIS))
    assert (x.title, x.values.tolist(), x.part) == ("x of block 2 (mm)", [5.0], None)
    assert outcome.title == "measured outcome"
    assert labels[1] == ""


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("block,quantity\n1,x\n", "not the table of `blocksim sensitivity --out`"),
        (SOBOL.replace("0.7", "much"), "indices.csv:2"),
        (SOBOL.splitlines()[0] + "\n", "no result varies"),
    ],
)
def test_other_tables_are_refused(tmp_path: Path, text: str, told: str) -> None:
    with pytest.raises(InvalidInputError, match=told):
        read_indices(written(tmp_path, text))

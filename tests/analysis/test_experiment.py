"""Measured tables and tables of properties: the numbers that the paper prints, and what is said of broken ones."""

from pathlib import Path

import numpy as np
import pytest

from blocksim.analysis.curves import load_curves
from blocksim.analysis.experiment import load_properties, load_table
from blocksim.errors import InvalidInputError
from tests.golden import Golden, read

EXPERIMENTS = Path(__file__).parents[2] / "scenarios" / "experiments"
HEADER = "block,quantity,unit,replicate,value\n"


def written(folder: Path, text: str) -> Path:
    path = folder / "table.csv"
    path.write_bytes(text.encode())
    return path


def test_statistics_of_the_paper_match_numpy_and_the_design() -> None:
    centres = load_table(EXPERIMENTS / "three_blocks.csv")
    statistics = centres.statistics().set_index(["block", "quantity"]).to_dict(orient="index")
    second, third = statistics["2", "x"], statistics["3", "x"]
    assert (second["n"], second["minimum"], second["maximum"]) == (6, 71.69, 78.53)
    assert (third["n"], third["minimum"], third["maximum"]) == (6, 128.55, 136.05)
    assert second["s"] == pytest.approx(np.std(centres.values("2", "x"), ddof=1), rel=1e-12)
    assert second["s"] == pytest.approx(2.60, abs=0.005)
    assert third["s"] == pytest.approx(2.84, abs=0.005)


TABLES = {
    "units": "1,x,cm,1,2.5\n1,y,m,1,-0.001\n1,rotation,rad,1,-1.5707963267948966\n1,left,in,1,1\n",
    **{f"a cell of {cell!r}": f"1,x,mm,1,3\n1,x,mm,2,{cell}\n1,x,mm,3,5\n" for cell in ("", " ", "NaN", "nan", "NA")},
    "three of them, and a row that is absent": "1,x,mm,1,3\n1,x,mm,2,\n1,x,mm,3,5\n1,x,mm,4,\n1,x,mm,5,\n2,x,mm,2,7\n",
}
HABITS = '\ufeff# a "note"\r\n\r\nvalue , block,quantity,unit,replicate\r\n 1.5e1, "left, ""L""" ,x,mm, 2\r\n'


def test_tables_are_understood_as_they_were_read(golden: Golden, tmp_path: Path) -> None:
    """In millimetres and degrees, with the habits of spreadsheets; repeats without a value are left out and told."""
    texts = []
    for name, text in {"habits": HABITS, **{name: HEADER + rows for name, rows in TABLES.items()}}.items():
        table = load_table(written(tmp_path, text))
        rows = [", ".join(str(cell) for cell in row) for row in table.data.itertuples(index=False)]
        counts = f"repeats {[row.n for row in table.summaries()]}"
        texts.append("\n".join([f"{name}: {counts}", *rows, *table.messages, *table.notes]))
    golden("\n\n".join(texts), rules=["digits"])


def test_table_1_and_the_sizes_arrive_in_si(golden: Golden) -> None:
    values = load_properties(EXPERIMENTS / "three_blocks_properties.csv").values
    golden("\n".join(f"{name}: {value}" for name, value in values.items()), rules=["digits"])


SPOILT = {
    "nothing in it": b"",
    "null characters": b"block\0\n",
    "terminal codes": f"{HEADER}1,x,\x1b[31mred,1,1\n".encode(),
    "flood of mistakes": (HEADER + "1,x,kg,1,1\n" * 50).encode(),
    "UTF-16": HEADER.encode("utf-16"),
    "huge line": (HEADER + "1,x,mm,1," + "9" * 100_000).encode(),
    "huge file": (HEADER + "1,x,mm,1,16\n" * 90_000).encode(),
}


def test_broken_tables_are_explained_where_they_are_broken(
    golden: Golden, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    broken = {name: f"{text}\n".encode() for name, text in read(Path(__file__).with_name("broken.txt")).items()}
    for name, content in (broken | SPOILT).items():
        load = {b"prop": load_properties, b"prob": load_curves}.get(content[:4], load_table)
        Path("table.csv").write_bytes(content)
        with pytest.raises(InvalidInputError) as caught:
            load(Path("table.csv"))
        golden(str(caught.value), name)

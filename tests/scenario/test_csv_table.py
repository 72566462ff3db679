"""Reading comma-separated text: files that are no table, and rows and headers of the wrong shape."""

from pathlib import Path

import pytest

from blocksim.analysis.experiment import load_table
from blocksim.errors import InputMissingError, InvalidInputError
from tests.golden import Golden

HEADER = "block,quantity,unit,replicate,value\n"
GOOD = "1,x,mm,1,16\n"


BROKEN = {
    "decimal comma": HEADER + "1,x,mm,1,71,69\n",
    "cell missing": HEADER + "1,x,mm,16\n",
    "open quote": HEADER + '"1,x,mm,1,16\n',
    "open quote in the header": '"' + HEADER + GOOD,
    "mistyped column": "block,quantity,units,replicate,value\n" + GOOD,
    "two mistyped columns": "block,quantities,unit,repeat,value\n" + GOOD,
    "mistyped column beside mistakes in its rows": "block,quantity,units,replicate,value\n1,x,kg,1,16\n1,x,mm,2,wide\n",
    "column twice": "block,quantity,unit,replicate,value,block\n" + GOOD,
    "semicolons": "block;quantity;unit\n" + GOOD,
    "semicolons and decimal commas": HEADER.replace(",", ";") + "1;x;mm;1;71,69\n",
    "nothing in it": "",
    "comments only": "# only\n\n  # notes\n",
    "header only": "# source\n" + HEADER,
    "null characters": "block\0",
    "terminal codes": HEADER + "1,x,\x1b[31mred,1,1\n",
    "flood of mistakes": HEADER + "1,x,kg,1,1\n" * 50,
    "UTF-16": HEADER.encode("utf-16"),
    "huge line": HEADER + "1,x,mm,1," + "9" * 100_000 + "\n",
    "huge file": HEADER + "1,x,mm,1,16\n" * 90_000,
}


@pytest.mark.parametrize("content", BROKEN.values(), ids=BROKEN)
def test_a_broken_table_is_explained_where_it_is_broken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, golden: Golden, content: str | bytes
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("table.csv").write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(InvalidInputError) as caught:
        load_table("table.csv")
    assert "\x1b" not in str(caught.value)
    golden(str(caught.value))


@pytest.mark.parametrize("name", ["none.csv", "folder"])
def test_what_is_no_file_is_named(tmp_path: Path, golden: Golden, name: str) -> None:
    (tmp_path / "folder").mkdir()
    with pytest.raises(InputMissingError) as caught:
        load_table(tmp_path / name)
    golden(str(caught.value))

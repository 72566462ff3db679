"""Reading comma-separated text: files that are no table, and rows and headers of the wrong shape."""

from pathlib import Path

import pytest

from blocksim.analysis.experiment import load_table
from blocksim.errors import InputMissingError, InvalidInputError

HEADER = "block,quantity,unit,replicate,value\n"
GOOD = "1,x,mm,1,16\n"


def write(folder: Path, text: str) -> Path:
    path = folder / "table.csv"
    path.write_bytes(text.encode())
    return path


BROKEN = {
    "decimal comma": (
        HEADER + "1,x,mm,1,71,69\n",
        (
            "table.csv:2: 6 cells where the header has 5 columns (decimals are written with a point)\n"
            "    2 | 1,x,mm,1,71,69\n"
            "      | ^^^^^^^^^^^^^^"
        ),
    ),
    "cell missing": (
        HEADER + "1,x,mm,16\n",
        "table.csv:2: 4 cells where the header has 5 columns\n    2 | 1,x,mm,16\n      | ^^^^^^^^^",
    ),
    "open quote": (
        HEADER + '"1,x,mm,1,16\n',
        'table.csv:2: quotes do not match\n    2 | "1,x,mm,1,16\n      | ^^^^^^^^^^^^',
    ),
    "mistyped column": (
        "block,quantity,units,replicate,value\n" + GOOD,
        (
            "table.csv:1: missing column unit; its first line must be block,quantity,unit,replicate,value\n"
            "    1 | block,quantity,units,replicate,value\n"
            "      | ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^\n"
            "table.csv:1: units: unknown column, did you mean 'unit'?\n"
            "    1 | block,quantity,units,replicate,value\n"
            "      |                ^^^^^"
        ),
    ),
    "two mistyped columns": (
        "block,quantities,unit,repeat,value\n" + GOOD,
        (
            "table.csv:1: missing columns quantity, replicate; "
            "its first line must be block,quantity,unit,replicate,value\n"
            "    1 | block,quantities,unit,repeat,value\n"
            "      | ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^\n"
            "table.csv:1: quantities: unknown column, did you mean 'quantity'?\n"
            "    1 | block,quantities,unit,repeat,value\n"
            "      |       ^^^^^^^^^^\n"
            "table.csv:1: repeat: unknown column, did you mean 'replicate'?\n"
            "    1 | block,quantities,unit,repeat,value\n"
            "      |                       ^^^^^^"
        ),
    ),
    "mistyped column beside mistakes in its rows": (
        "block,quantity,units,replicate,value\n1,x,kg,1,16\n1,x,mm,2,wide\n",
        (
            "table.csv:1: missing column unit; its first line must be block,quantity,unit,replicate,value\n"
            "    1 | block,quantity,units,replicate,value\n"
            "      | ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^\n"
            "table.csv:1: units: unknown column, did you mean 'unit'?\n"
            "    1 | block,quantity,units,replicate,value\n"
            "      |                ^^^^^\n"
            "table.csv:2: unit: 'kg' is not the unit of a length; write mm, cm or m\n"
            "    2 | 1,x,kg,1,16\n"
            "      |     ^^\n"
            "table.csv:3: value: 'wide' is not a number, write it as 71.69 or 7.169e1\n"
            "    3 | 1,x,mm,2,wide\n"
            "      |          ^^^^"
        ),
    ),
    "column twice": (
        "block,quantity,unit,replicate,value,block\n" + GOOD,
        (
            "table.csv:1: block: column given twice\n"
            "    1 | block,quantity,unit,replicate,value,block\n"
            "      |                                     ^^^^^"
        ),
    ),
    "semicolons": (
        "block;quantity;unit\n" + GOOD,
        (
            "table.csv:1: block;quantity;unit: unknown column, "
            "allowed: block, quantity, unit, replicate, value\n"
            "    1 | block;quantity;unit\n"
            "      | ^^^^^^^^^^^^^^^^^^^\n"
            "table.csv:1: missing columns block, quantity, unit, replicate, value; "
            "its first line must be block,quantity,unit,replicate,value\n"
            "    1 | block;quantity;unit\n"
            "      | ^^^^^^^^^^^^^^^^^^^"
        ),
    ),
    "nothing in it": (
        "",
        "table.csv: the table is empty, its first line must be block,quantity,unit,replicate,value",
    ),
    "comments only": (
        "# only\n\n  # notes\n",
        "table.csv: the table is empty, its first line must be block,quantity,unit,replicate,value",
    ),
    "header only": (
        "# source\n" + HEADER,
        (
            "table.csv:2: the table has a header and no rows\n"
            "    2 | block,quantity,unit,replicate,value\n"
            "      | ^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^^"
        ),
    ),
    "null characters": ("block\0", "table.csv: not a text file (a table is UTF-8 text)"),
}


@pytest.mark.parametrize(("text", "message"), BROKEN.values(), ids=BROKEN.keys())
def test_a_broken_table_is_explained_where_it_is_broken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, message: str
) -> None:
    write(tmp_path, text)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InvalidInputError) as caught:
        load_table("table.csv")
    assert str(caught.value) == message


def test_a_missing_table_is_named(tmp_path: Path) -> None:
    path = tmp_path / "none.csv"
    with pytest.raises(InputMissingError) as caught:
        load_table(path)
    assert str(caught.value) == f"{path}: no such file"


def test_a_folder_is_no_table(tmp_path: Path) -> None:
    with pytest.raises(InputMissingError) as caught:
        load_table(tmp_path)
    assert str(caught.value) == f"{tmp_path}: is a folder, not a table"


def test_a_name_that_no_file_can_have_is_refused() -> None:
    with pytest.raises(InputMissingError, match="cannot be read: embedded null"):
        load_table("a\0b")


def test_bytes_that_are_no_text_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_bytes(HEADER.encode("utf-16"))
    with pytest.raises(InvalidInputError, match="not a text file"):
        load_table(path)


def test_a_huge_file_is_refused_before_it_is_read(tmp_path: Path) -> None:
    path = write(tmp_path, HEADER + "1,x,mm,1,16\n" * 90_000)
    with pytest.raises(InvalidInputError, match="too large for a table; the limit is 1000000 bytes"):
        load_table(path)


def test_a_huge_line_is_not_repeated_to_the_user(tmp_path: Path) -> None:
    path = write(tmp_path, HEADER + "1,x,mm,1," + "9" * 100_000 + "\n")
    with pytest.raises(InvalidInputError, match="the line has 100009 characters") as caught:
        load_table(path)
    assert len(str(caught.value)) < 1_000


def test_a_flood_of_mistakes_is_cut_and_counted(tmp_path: Path) -> None:
    path = write(tmp_path, HEADER + "1,x,kg,1,1\n" * 50)
    with pytest.raises(InvalidInputError) as caught:
        load_table(path)
    assert str(caught.value).endswith("... and 30 more problems")


def test_a_table_cannot_steer_the_terminal(tmp_path: Path) -> None:
    path = write(tmp_path, HEADER + "1,x,\x1b[31mred,1,1\n")
    with pytest.raises(InvalidInputError) as caught:
        load_table(path)
    assert "\x1b" not in str(caught.value)

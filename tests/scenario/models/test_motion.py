"""Tables of motion as files have them."""

from pathlib import Path

import pytest

from blocksim.scenario.models.motion import MotionTableError, read_motion_table


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_lines_end_only_where_editors_end_them(tmp_path: Path, end: str) -> None:
    lines = ["# run 7\u2028shaking\x0ctable", "", "time_s, displacement_mm", "0,0", " # pause", "0.5,2"]
    path = tmp_path / "m.csv"
    path.write_bytes(end.join(lines).encode("utf-8-sig"))
    table = read_motion_table(path)
    assert (table.times, table.values) == ((0.0, 0.5), (0.0, 0.002))
    path.write_bytes(end.join([*lines, "0.4,1"]).encode())
    with pytest.raises(MotionTableError, match=r"^line 7: time 0\.4 s: times must increase"):
        read_motion_table(path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time_s;displacement_mm\n0;0\n", r"line 1: .*: columns are separated by semicolons; separate them by commas"),
        ("time_s,displacement_mm\n0,0\n0,1,2,5\n", r'line 3: "0,1,2,5": a time and a value.* decimals with a point'),
        ("time_s,displacement_mm\n0,0\n0.1;2\n", r'line 3: "0.1;2": a time and a value.* separate them by commas'),
        ("time_s,displacement_mm\n0,0\n0.1,2\n0.1,3\n", r"line 4: time 0\.1 s: the time of the line before is repeat"),
    ],
)
def test_tables_as_spreadsheets_write_them_are_explained(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "m.csv"
    path.write_text(text)
    with pytest.raises(MotionTableError, match=message):
        read_motion_table(path)

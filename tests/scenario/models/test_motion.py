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

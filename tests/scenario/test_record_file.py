"""Accelerograms and tables of motion as files have them; wrong ones are in broken/files."""

from itertools import pairwise
from pathlib import Path

import pytest

from blocksim.errors import ScenarioError
from blocksim.scenario import load_scenario, scenario_from_mapping, scenario_hash, scenario_to_toml
from blocksim.scenario.models.motion import MotionTableError, read_motion_table, read_record
from tests.scenario.conftest import VALID, data_of

G = 9.80665
AT2 = """\
PEER NGA STRONG MOTION DATABASE RECORD
Somewhere, 1/17/1994, Station, 090
ACCELERATION TIME SERIES IN UNITS OF {unit}
{size}
  .1000000E-01 -.2000000E-01  .3000000D-01
 -.4000000E-01
"""
NEW, OLD = "NPTS=   4, DT=   .0050 SEC,", "    4   0.0050    NPTS, DT"


def written(folder: Path, text: str, name: str = "r.txt") -> Path:
    path = folder / name
    path.write_bytes(text.encode())
    return path


@pytest.mark.parametrize("size", [NEW, OLD, "NPTS= 4,DT= 5.0E-3 SEC"])
@pytest.mark.parametrize(("unit", "factor"), [("G", G), ("CM/S/S", 0.01), ("M/SEC/SEC", 1.0), ("cm/sec2", 0.01)])
def test_at2_of_any_age_and_unit(tmp_path: Path, size: str, unit: str, factor: float) -> None:
    found = read_record(written(tmp_path, AT2.format(unit=unit, size=size)))
    assert found.times == pytest.approx((0.0, 0.005, 0.01, 0.015), abs=1e-15)
    assert found.values == pytest.approx([factor * one for one in (0.01, -0.02, 0.03, -0.04)], rel=1e-14)


@pytest.mark.parametrize(
    ("head", "unit"),
    [
        ("time_s,acceleration_g", "g"),
        ("Time (s), Acceleration (cm/s2)", "cm/s^2"),
        ("t [s];a [m/s^2]", "m/s^2"),
        ("time\tgal", "cm/s^2"),
        ("time_s,acceleration_m_s2", "m/s^2"),
        ("% no names", None),
        ("time,acceleration", None),
    ],
)
def test_two_columns_say_their_unit_in_the_first_line(tmp_path: Path, head: str, unit: str | None) -> None:
    found = read_record(written(tmp_path, f"# noted\n{head}\n0.0 1\n0.5, 2\n1;-3\n"))
    assert found.unit == unit
    assert found.times == (0.0, 0.5, 1.0)


def test_rounded_times_are_a_constant_step(tmp_path: Path) -> None:
    lines = [f"{place / 512:.4f} {place % 7}" for place in range(500)]
    found = read_record(written(tmp_path, "\n".join(lines)))
    steps = [after - before for before, after in pairwise(found.times)]
    assert max(steps) - min(steps) < 1e-12


BARE = "0 0\n0.1 1\n0.2 0\n"
TWO = "time_s,acceleration_g\n0,0\n0.1,1\n0.2,2\n"


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ('table = "r.txt"', r"motion\.table: r\.txt does not say its unit"),
        ('table = "r.csv"\nunit = "cm/s^2"', r'motion\.unit: "cm/s\^2": r\.csv says g'),
        ('table = "r.txt"\nunit = "G"', r'motion\.unit: "G" is unknown, did you mean "g"'),
        ('table = "r.csv"\nscale = 2\npga = "0.3 g"', r"motion\.pga: scale and pga are both given"),
        ('table = "zero.txt"\nunit = "g"\npga = "0.3 g"', r"motion\.pga: zero\.txt is zero throughout"),
    ],
)
def test_mistakes_about_records_are_located_in_the_scenario(tmp_path: Path, keys: str, message: str) -> None:
    for name, text in {"r.txt": BARE, "r.csv": TWO, "zero.txt": "0 0\n1 0\n"}.items():
        written(tmp_path, text, name)
    path = written(tmp_path, f'{VALID}\n[motion]\nkind = "record"\n{keys}\n', "s.toml")
    with pytest.raises(ScenarioError, match=rf"s\.toml:\d+: {message}") as caught:
        load_scenario(path)
    assert caught.value.exit_code == 65


def test_a_copied_record_means_the_same_whatever_its_name(tmp_path: Path) -> None:
    written(tmp_path, AT2.format(unit="G", size=NEW), "quake.AT2")
    motion = {"kind": "record", "table": "quake.AT2", "pga": "0.2 g"}
    first = scenario_from_mapping({**data_of(), "motion": motion}, tmp_path)
    written(tmp_path, AT2.format(unit="G", size=NEW), "motion.csv")
    again = load_scenario(written(tmp_path, scenario_to_toml(first, motion_table="motion.csv"), "s.toml"))
    assert again == first
    assert scenario_hash(again) == scenario_hash(first)
    written(tmp_path, AT2.format(unit="G", size=NEW.replace(".0050", ".0060")), "motion.csv")
    assert scenario_hash(load_scenario(tmp_path / "s.toml")) != scenario_hash(first)


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

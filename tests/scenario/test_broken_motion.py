"""Prescribed motion."""

from pathlib import Path

import pytest

from tests.scenario.conftest import Edit, Refused

CASES = {
    "no kind": '[motion]\namplitude = "10 mm"',
    "misspelt kind": '[motion]\nkind = "harmonik"\namplitude = "10 mm"\nfrequency = "2 Hz"',
    "unknown kind": '[motion]\nkind = "sine"\namplitude = "10 mm"\nfrequency = "2 Hz"',
    "list of motions": '[[motion]]\nkind = "harmonic"',
    "misspelt unit": '[motion]\nkind = "harmonic"\namplitude = "10 mm"\nfrequency = "2 HZ"',
    "spin for a frequency": '[motion]\nkind = "harmonic"\namplitude = "10 mm"\nfrequency = "2 rad/s"',
    "typo": '[motion]\nkind = "harmonic"\namplitude = "10 mm"\nfrequency = "2 Hz"\ndurration = 3',
    "no room for ramps": '[motion]\nkind = "harmonic"\namplitude = "10 mm"\nfrequency = "2 Hz"\nduration = 0.9',
    "no ramp": '[motion]\nkind = "harmonic"\namplitude = "10 mm"\nfrequency = "2 Hz"\nramp = 0',
    "too many cycles": '[motion]\nkind = "harmonic"\namplitude = "10 mm"\nfrequency = "1 MHz"',
    "endless cycles": '[motion]\nkind = "harmonic"\namplitude = "10 mm"\nfrequency = 1e18',
    "no such table": '[motion]\nkind = "table"\ntable = "m.csv"',
    "folder for a table": '[motion]\nkind = "table"\ntable = "."',
    "number for a table": '[motion]\nkind = "table"\ntable = 3',
    "no table": '[motion]\nkind = "table"',
    "key of another kind": '[motion]\nkind = "harmonic"\namplitude = 1\nfrequency = 1\nscale = 2',
    "sweep of no table": (
        '[motion]\nkind = "harmonic"\namplitude = "10 mm"\nfrequency = "2 Hz"\n\n[sweep]\n"motion.table" = ["m.csv"]'
    ),
}


@pytest.mark.parametrize("edit", CASES.values(), ids=CASES)
def test_motion(refused: Refused, edit: Edit) -> None:
    refused(edit)


COLUMNS = b"time_s,displacement_m\n"
TABLES = {
    "empty": b"",
    "unknown column": b"# n\ntime_s,displacement\n0,0\n",
    "no time": b"t,displacement_m\n0,0\n",
    "time twice": b"time_s,time_s\n0,0\n",
    "one sample": COLUMNS + b"0,0\n",
    "time stands still": COLUMNS + b"0,0\n# a note\n\n0,1\n",
    "negative time": COLUMNS + b"-1,0\n1,0\n",
    "word": COLUMNS + b"0,0\n1,a\n",
    "not a number": COLUMNS + b"0,0\n1,nan\n",
    "one cell": COLUMNS + b"0,0\n1\n2,0\n",
    "open quote": COLUMNS + b'0,"0\n1,0\n',
    "no text": b"\xff\xfe\x00",
}


@pytest.mark.parametrize("content", TABLES.values(), ids=TABLES)
def test_tables(tmp_path: Path, refused: Refused, content: bytes) -> None:
    (tmp_path / "m.csv").write_bytes(content)
    refused('[motion]\nkind = "table"\ntable = "m.csv"')

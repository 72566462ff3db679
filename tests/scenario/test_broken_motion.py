"""Prescribed motion. Every message in full."""

# ruff: noqa: E501 - messages and scenario lines stand as they are

from collections.abc import Callable
from pathlib import Path

import pytest

CASES = {
    "no kind": (
        '\n[motion]\namplitude = "10 mm"\n',
        """
bad.toml:20: motion.kind: this key is missing: "harmonic" or "table" is needed
   20 | [motion]
      |  ^^^^^^
""",
    ),
    "misspelt kind": (
        '\n[motion]\nkind = "harmonik"\namplitude = "10 mm"\nfrequency = "2 Hz"\n',
        """
bad.toml:21: motion.kind: unknown motion kind "harmonik"; did you mean 'harmonic'?
   21 | kind = "harmonik"
      |        ^^^^^^^^^^
""",
    ),
    "unknown kind": (
        '\n[motion]\nkind = "sine"\namplitude = "10 mm"\nfrequency = "2 Hz"\n',
        """
bad.toml:21: motion.kind: unknown motion kind "sine"; choose "harmonic" or "table"
   21 | kind = "sine"
      |        ^^^^^^
""",
    ),
    "list of motions": (
        '\n[[motion]]\nkind = "harmonic"\n',
        """
bad.toml:20: motion: a list is not a table; write [motion] with single brackets
   20 | [[motion]]
      |   ^^^^^^
""",
    ),
    "misspelt unit": (
        '\n[motion]\nkind = "harmonic"\namplitude = "10 mm"\nfrequency = "2 HZ"\n',
        """
bad.toml:23: motion.frequency: "2 HZ" is not a frequency: unknown unit 'HZ', did you mean 'Hz'?
   23 | frequency = "2 HZ"
      |             ^^^^^^
""",
    ),
    "spin for a frequency": (
        '\n[motion]\nkind = "harmonic"\namplitude = "10 mm"\nfrequency = "2 rad/s"\n',
        """
bad.toml:23: motion.frequency: "2 rad/s" is a spin; a frequency above 0 such as "2 Hz" is needed
   23 | frequency = "2 rad/s"
      |             ^^^^^^^^^
""",
    ),
    "typo": (
        '\n[motion]\nkind = "harmonic"\namplitude = "10 mm"\nfrequency = "2 Hz"\ndurration = 3\n',
        """
bad.toml:24: motion.durration: unknown key, did you mean 'duration'?
   24 | durration = 3
      | ^^^^^^^^^
""",
    ),
    "no room for ramps": (
        '\n[motion]\nkind = "harmonic"\namplitude = "10 mm"\nfrequency = "2 Hz"\nduration = 0.9\n',
        """
bad.toml:24: motion.duration: 0.9 s is too short for two ramps of 0.5 s
   24 | duration = 0.9
      |            ^^^
""",
    ),
    "no ramp": (
        '\n[motion]\nkind = "harmonic"\namplitude = "10 mm"\nfrequency = "2 Hz"\nramp = 0\n',
        """
bad.toml:24: motion.ramp: 0 is too small; a time above 0 such as "2 s" is needed
   24 | ramp = 0
      |        ^
""",
    ),
    "too many cycles": (
        '\n[motion]\nkind = "harmonic"\namplitude = "10 mm"\nfrequency = "1 MHz"\n',
        """
bad.toml:23: motion.frequency: 2e+06 cycles are too many; at most 5000 are allowed
   23 | frequency = "1 MHz"
      |             ^^^^^^^
""",
    ),
    "endless cycles": (
        '\n[motion]\nkind = "harmonic"\namplitude = "10 mm"\nfrequency = 1e18\n',
        """
bad.toml:23: motion.frequency: 2e+18 cycles are too many; at most 5000 are allowed
   23 | frequency = 1e18
      |             ^^^^
""",
    ),
    "no such table": (
        '\n[motion]\nkind = "table"\ntable = "m.csv"\n',
        """
bad.toml:22: motion.table: "m.csv": no such file (paths are relative to the scenario file)
   22 | table = "m.csv"
      |         ^^^^^^^
""",
    ),
    "folder for a table": (
        '\n[motion]\nkind = "table"\ntable = "."\n',
        """
bad.toml:22: motion.table: ".": is a folder, not a table (paths are relative to the scenario file)
   22 | table = "."
      |         ^^^
""",
    ),
    "number for a table": (
        '\n[motion]\nkind = "table"\ntable = 3\n',
        """
bad.toml:22: motion.table: 3 is not the path of a table, such as "shaking.csv"
   22 | table = 3
      |         ^
""",
    ),
    "no table": (
        '\n[motion]\nkind = "table"\n',
        """
bad.toml:20: motion.table: this key is missing: CSV table, relative to the scenario file: time_s and displacement_m, _mm or acceleration_g, _m_s2
   20 | [motion]
      |  ^^^^^^
""",
    ),
    "key of another kind": (
        '\n[motion]\nkind = "harmonic"\namplitude = 1\nfrequency = 1\nscale = 2\n',
        """
bad.toml:24: motion.scale: unknown key, allowed are: kind, amplitude, frequency, phase, direction, start, duration, ramp
   24 | scale = 2
      | ^^^^^
""",
    ),
    "sweep of no table": (
        '\n[motion]\nkind = "harmonic"\namplitude = "10 mm"\nfrequency = "2 Hz"\n\n[sweep]\n"motion.table" = ["m.csv"]\n',
        """
bad.toml:26: sweep."motion.table": unknown key, allowed are: kind, amplitude, frequency, phase, direction, start, duration, ramp
   26 | "motion.table" = ["m.csv"]
      | ^^^^^^^^^^^^^^
""",
    ),
}


@pytest.mark.parametrize(("new", "message"), CASES.values(), ids=CASES)
def test_motion(refusal_of_edit: Callable[[str | None, str], tuple[int, str]], new: str, message: str) -> None:
    assert refusal_of_edit(None, new) == (65, message.strip("\n"))


NEEDED = "time_s and one of displacement_m, displacement_mm, acceleration_m_s2, acceleration_g are needed"
TABLES = {
    "empty": (b"", f'line 1: the columns are ""; {NEEDED}'),
    "unknown column": (b"# n\ntime_s,displacement\n0,0\n", f'line 2: the columns are "time_s,displacement"; {NEEDED}'),
    "no time": (b"t,displacement_m\n0,0\n", f'line 1: the columns are "t,displacement_m"; {NEEDED}'),
    "time twice": (b"time_s,time_s\n0,0\n", f'line 1: the columns are "time_s,time_s"; {NEEDED}'),
    "one sample": (b"time_s,displacement_m\n0,0\n", "1 lines with samples; 2 to 500000 are allowed"),
    "time stands still": (
        b"time_s,displacement_m\n0,0\n# a note\n\n0,1\n",
        "line 5: time 0 s: times must increase, the one before is 0 s",
    ),
    "negative time": (b"time_s,displacement_m\n-1,0\n1,0\n", "line 2: time -1 s: times must not be negative"),
    "word": (b"time_s,displacement_m\n0,0\n1,a\n", 'line 3: "a" is not a finite number'),
    "not a number": (b"time_s,displacement_m\n0,0\n1,nan\n", 'line 3: "nan" is not a finite number'),
    "one cell": (b"time_s,displacement_m\n0,0\n1\n2,0\n", "line 3: a time and a value are needed"),
    "open quote": (b'time_s,displacement_m\n0,"0\n1,0\n', 'line 2: "\\"0" is not a finite number'),
    "no text": (b"\xff\xfe\x00", "not a text file in UTF-8"),
}


@pytest.mark.parametrize(("content", "message"), TABLES.values(), ids=TABLES)
def test_tables(
    tmp_path: Path, refusal_of_edit: Callable[[str | None, str], tuple[int, str]], content: bytes, message: str
) -> None:
    (tmp_path / "m.csv").write_bytes(content)
    expected = f'bad.toml:22: motion.table: m.csv: {message}\n   22 | table = "m.csv"\n      |         ^^^^^^^'
    assert refusal_of_edit(None, '\n[motion]\nkind = "table"\ntable = "m.csv"\n') == (65, expected)

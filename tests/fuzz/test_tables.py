"""Tables that are damaged or hostile: of experiments, of a support's motion, and of the cases of a sweep."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import pytest
from hypothesis import given, settings, strategies as st

from tests.fuzz.conftest import LONG, QUICK, ROOT, assert_harmless
from tests.fuzz.mutations import TABLE, damaged
from tests.sizes import in_all

if TYPE_CHECKING:
    from pathlib import Path

    from tests.fuzz.child import Child
    from tests.fuzz.runs import Run

EXPERIMENT = (ROOT / "scenarios" / "experiments" / "three_blocks.csv").read_bytes()
MOTION = b"# a pulse\ntime_s,acceleration_g\n0.00,0\n0.01,0.12\n0.02,-0.3\n0.03,0.05\n0.04,0\n"
CASES = b"""# readings
structures.0.overlap [mm],friction.block_block.kinetic,time.scheme
10.1,0.19,explicit
9.8,0.21,nonsmooth
10.0,0.2,explicit
"""
TABLES = st.sampled_from(("experiment", "motion", "cases"))
TEXTS = {"experiment": EXPERIMENT, "motion": MOTION, "cases": CASES}
PLACED = re.compile(r"bad\.csv(:| line )\d+: |bad\.csv: line \d+: |^scene\.toml:\d+: ", re.MULTILINE)
WHOLE = ("not a text file", "the table is empty", "too large for a table", "lines with samples", "measures block")


@pytest.fixture(scope="module")
def place(run: Run) -> Path:
    """Return a folder with scenarios that name a table beside them."""
    plain = (ROOT / "scenarios" / "three_blocks.toml").read_text(encoding="utf-8")
    plain = re.sub(r"(?ms)^\[(experiment|sweep|provenance)\].*?(?=^\[|\Z)", "", plain)
    for name, table in (("motion", '[motion]\nkind = "table"'), ("cases", '[sweep]\nmode = "table"')):
        text = f'{plain}\n{table}\ntable = "bad.csv"\n'
        (run.folder / name).mkdir()
        (run.folder / name / "scene.toml").write_text(text, encoding="utf-8")
    (run.folder / "experiment").mkdir()
    return run.folder


COMMANDS = {
    "experiment": ("compare", "../good", "--experiment", "bad.csv"),
    "motion": ("check", "scene.toml"),
    "cases": ("sweep", "scene.toml", "--dry-run"),
}


def _try(child: Child, place: Path, kind: str, content: bytes) -> None:
    (place / kind / "bad.csv").write_bytes(content)
    left = child.call(place / kind, *COMMANDS[kind])
    assert_harmless(left, {0, 1, 65} if kind == "experiment" else {0, 65})
    if left.code == 65:
        assert PLACED.search(left.err) or any(told in left.err for told in WHOLE), left.err


def test_sound_tables_are_taken(child: Child, place: Path) -> None:
    for kind, text in TEXTS.items():
        (place / kind / "bad.csv").write_bytes(text)
        left = child.call(place / kind, *COMMANDS[kind])
        assert left.code in {0, 1}, left.err


@settings(max_examples=QUICK)
@given(data=st.data(), kind=TABLES)
def test_damaged_tables_are_refused_with_their_line(child: Child, place: Path, data: st.DataObject, kind: str) -> None:
    _try(child, place, kind, data.draw(damaged(TEXTS[kind], TABLE)))


@pytest.mark.long
@settings(LONG, max_examples=in_all(1000))
@given(data=st.data(), kind=TABLES)
def test_a_thousand_damaged_tables(child: Child, place: Path, data: st.DataObject, kind: str) -> None:
    _try(child, place, kind, data.draw(damaged(TEXTS[kind], TABLE)))

"""Scenarios that are damaged or hostile: refused with the place, or accepted; never a traceback, a hang or a flood."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.fuzz.conftest import LONG, QUICK, assert_harmless
from tests.fuzz.mutations import SCENARIO, damaged
from tests.sizes import in_all

if TYPE_CHECKING:
    from tests.fuzz.child import Child

FOLDER = Path(__file__).parents[2] / "scenarios"
TEXTS = tuple(path.read_bytes() for path in sorted(FOLDER.glob("*.toml")))
PLACED = re.compile(r"^bad\.toml:\d+: ", re.MULTILINE)
WHOLE = ("not a text file", "the file is empty", "nested too deeply", "larger than", "not valid TOML: ")
SCENARIOS = st.sampled_from(TEXTS).flatmap(lambda text: damaged(text, SCENARIO))


def _check(child: Child, folder: Path, content: bytes) -> None:
    (folder / "bad.toml").write_bytes(content)
    left = child.call(folder, "check", "bad.toml")
    assert_harmless(left, {0, 65, 66})
    if left.code == 65 and "bad.toml" in left.err:
        assert PLACED.search(left.err) or any(told in left.err for told in WHOLE), left.err


@settings(max_examples=QUICK)
@given(content=SCENARIOS)
def test_damaged_scenarios_are_refused_with_their_place(child: Child, folder: Path, content: bytes) -> None:
    _check(child, folder, content)


@pytest.mark.long
@settings(LONG, max_examples=in_all(5000))
@given(content=SCENARIOS)
def test_five_thousand_damaged_scenarios(child: Child, folder: Path, content: bytes) -> None:
    _check(child, folder, content)

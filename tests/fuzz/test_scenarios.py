"""Scenarios that are damaged or hostile: refused with the place, or accepted; never a traceback, a hang or a flood."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from hypothesis import given, settings, strategies as st

from tests.fuzz.conftest import LONG, QUICK, ROOT, check_damaged
from tests.fuzz.mutations import SCENARIO, damaged, removals
from tests.sizes import in_all

if TYPE_CHECKING:
    from pathlib import Path

    from tests.fuzz.child import Child

TEXTS = tuple(path.read_bytes() for path in sorted((ROOT / "scenarios").glob("*.toml")))
USUAL = ROOT / "scenarios" / "three_blocks_nominal.toml"
SCENARIOS = st.sampled_from(TEXTS).flatmap(lambda text: damaged(text, SCENARIO))


@settings(max_examples=QUICK)
@given(content=SCENARIOS)
def test_damaged_scenarios_are_refused_with_their_place(child: Child, folder: Path, content: bytes) -> None:
    check_damaged(child, folder, content)


@pytest.mark.long
@settings(LONG, max_examples=in_all(5000))
@given(content=SCENARIOS)
def test_five_thousand_damaged_scenarios(child: Child, folder: Path, content: bytes) -> None:
    check_damaged(child, folder, content)


def test_scenario_without_a_table_or_a_key_is_read_or_refused_with_its_place(child: Child, folder: Path) -> None:
    for content in removals(USUAL.read_bytes()):
        check_damaged(child, folder, content)


@pytest.mark.long
def test_every_scenario_without_a_table_or_a_key_is_read_or_refused(child: Child, folder: Path) -> None:
    for text in TEXTS:
        for content in removals(text):
            check_damaged(child, folder, content)

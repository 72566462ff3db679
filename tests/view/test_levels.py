"""Pictures of convergence: which blocks are shown, within which limits."""

from pathlib import Path

import pytest

from blocksim.view.studies import MOST_BLOCKS, chosen_blocks, distance_limits, draw_levels
from tests.view.drawings import panel


def test_many_blocks_are_cut_to_the_farthest() -> None:
    assert chosen_blocks([panel(60)]) == list(range(60 - MOST_BLOCKS, 60))
    assert chosen_blocks([panel(3)]) == [1, 2]


def test_limits_hold_the_tolerance_and_what_is_worth_showing() -> None:
    low, high = distance_limits([panel(size_mm=1e-6), panel(size_mm=20.0)], [50.0])
    assert low == pytest.approx(1e-4)
    assert high == 100.0
    low, high = distance_limits([panel(size_mm=1e-5)], [])
    assert low < 1e-6
    assert high == pytest.approx(0.2)


def test_nothing_but_zeros_can_be_drawn(tmp_path: Path) -> None:
    still = panel(size_mm=0.0, recommended=None)
    assert chosen_blocks([still]) == []
    draw_levels([still], tmp_path / "still.png")
    assert (tmp_path / "still.png").stat().st_size > 0

"""Pictures of studies: convergence, tornadoes, limits over another key, fragility."""

from pathlib import Path

import numpy as np
import pytest

from blocksim.view.studies import (
    Bars,
    chosen_blocks,
    distance_limits,
    draw_levels,
    draw_tornado,
    span_of_bars,
)
from tests.view.drawings import KEYS, panel


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
    draw_tornado([Bars("x", KEYS, np.zeros(3), np.zeros(3))], ("total", ""), tmp_path / "tornado.png", "nothing")
    assert all((tmp_path / f"{name}.png").stat().st_size > 0 for name in ("still", "tornado"))


def test_intervals_that_are_hardly_known_do_not_hide_the_bars() -> None:
    low, high = span_of_bars(Bars("x", KEYS, np.array([0.2, 0.7, 0.1]), np.array([0.1, 1e5, 0.0])))
    assert -0.1 < low < 0.7 < high < 1.2
    low, high = span_of_bars(Bars("x", KEYS, np.array([0.2, 0.7, 0.1]), np.array([0.1, 0.2, 0.0])))
    assert (low, high) == pytest.approx((-0.014, 0.914))

"""Tornadoes: the most important input at the top, intervals that are hardly known cut."""

from pathlib import Path

import numpy as np
import pytest

from blocksim.view.studies import Bars, draw_tornado, order_of, span_of_bars
from tests.view.drawings import KEYS


def test_nothing_but_zeros_can_be_drawn(tmp_path: Path) -> None:
    draw_tornado([Bars("x", KEYS, np.zeros(3), np.zeros(3))], ("total", ""), tmp_path / "tornado.png", "nothing")
    assert (tmp_path / "tornado.png").stat().st_size > 0


def test_keys_come_in_the_order_of_their_size() -> None:
    assert order_of(np.array([0.2, -0.7, 0.1, np.nan])) == [1, 0, 2, 3]


def test_intervals_that_are_hardly_known_do_not_hide_the_bars() -> None:
    low, high = span_of_bars(Bars("x", KEYS, np.array([0.2, 0.7, 0.1]), np.array([0.1, 1e5, 0.0])))
    assert -0.1 < low < 0.7 < high < 1.2
    low, high = span_of_bars(Bars("x", KEYS, np.array([0.2, 0.7, 0.1]), np.array([0.1, 0.2, 0.0])))
    assert (low, high) == pytest.approx((-0.014, 0.914))

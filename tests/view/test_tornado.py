"""Tornadoes: the most important input at the top, intervals that are hardly known cut."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from blocksim.view.studies import Bars, draw_tornado, span_of_bars
from tests.view.drawings import KEYS


def test_nothing_but_zeros_can_be_drawn(tmp_path: Path) -> None:
    draw_tornado([Bars("x", KEYS, np.zeros(3), np.zeros(3))], ("total", ""), tmp_path / "tornado.png", "nothing")
    assert (tmp_path / "tornado.png").stat().st_size > 0


def test_keys_come_in_the_order_of_their_size(caught: list[Figure], tmp_path: Path) -> None:
    values = np.array([0.2, -0.7, 0.1])
    draw_tornado([Bars("x", KEYS, values, np.zeros(3))], ("total", ""), tmp_path / "tornado.png", "order")
    (axes,) = caught[0].axes
    from_above = sorted(zip(axes.get_yticks(), axes.get_yticklabels(), strict=True), key=lambda tick: -tick[0])
    expected = ["block_block.static", "restitution", "block_ground.static"]
    assert [label.get_text().removeprefix("contact.") for _, label in from_above] == expected


def test_intervals_that_are_hardly_known_do_not_hide_the_bars() -> None:
    low, high = span_of_bars(Bars("x", KEYS, np.array([0.2, 0.7, 0.1]), np.array([0.1, 1e5, 0.0])))
    assert -0.1 < low < 0.7 < high < 1.2
    low, high = span_of_bars(Bars("x", KEYS, np.array([0.2, 0.7, 0.1]), np.array([0.1, 0.2, 0.0])))
    assert (low, high) == pytest.approx((-0.014, 0.914))

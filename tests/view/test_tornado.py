"""Tornadoes: the most important input at the top, intervals that are hardly known cut."""

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from blocksim.errors import InvalidInputError
from blocksim.view.tornado import Bars, draw_tornado, limits_of, order_of

KEYS = ("contact.restitution", "friction.block_block.static", "friction.block_ground.static")
BARS = Bars("x of block 2", KEYS, np.array([0.2, 0.7, 0.1]), np.array([0.1, 0.2, np.nan]), np.array([0.1, -0.05, 0.0]))


def test_svg_names_what_it_shows(tmp_path: Path) -> None:
    path = tmp_path / "tornado.svg"
    still = Bars("x of block 1", KEYS, np.zeros(3), np.zeros(3))
    draw_tornado([still, BARS], ("total", "alone"), path, "Which inputs matter")
    assert ET.parse(path).getroot().tag.endswith("svg")  # noqa: S314 - our own file
    text = path.read_text(encoding="utf-8")
    for told in ("Which inputs matter", "x of block 2", "restitution", "block_ground.static", "total", "alone"):
        assert f"<!-- {told} -->" in text
    assert "x of block 1" not in text  # nothing matters for it


def test_nothing_but_zeros_can_be_drawn(tmp_path: Path) -> None:
    draw_tornado([Bars("x", KEYS, np.zeros(3), np.zeros(3))], ("total", ""), tmp_path / "tornado.png", "nothing")
    assert (tmp_path / "tornado.png").stat().st_size > 0


def test_keys_come_in_the_order_of_their_size() -> None:
    assert order_of(np.array([0.2, -0.7, 0.1, np.nan])) == [1, 0, 2, 3]


def test_intervals_that_are_hardly_known_do_not_hide_the_bars() -> None:
    low, high = limits_of(Bars("x", KEYS, np.array([0.2, 0.7, 0.1]), np.array([0.1, 1e5, 0.0])))
    assert -0.1 < low < 0.7 < high < 1.2
    low, high = limits_of(Bars("x", KEYS, np.array([0.2, 0.7, 0.1]), np.array([0.1, 0.2, 0.0])))
    assert (low, high) == pytest.approx((-0.014, 0.914))


def test_unknown_format_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match="unsupported picture format"):
        draw_tornado([BARS], ("total", ""), tmp_path / "tornado.bmp", "x")

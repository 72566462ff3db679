"""The picture of a fragility study: its axis, and that counts without a curve can be drawn."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from blocksim.errors import InvalidInputError
from blocksim.view.studies import Band, Fragility, axis_of, draw_fragility, places
from blocksim.view.style import Paper

X = np.array([0.2, 0.4, 0.6])


def made_up(x: np.ndarray = X, *, with_curve: bool = True) -> Fragility:
    at = places(x)
    rising = np.linspace(0.1, 0.9, len(at))
    band = Band(at, rising, rising - 0.1, rising + 0.1) if with_curve else None
    share = np.linspace(0.0, 1.0, len(x))
    return Fragility("motion.scale", "", x, share, share * 0.8, 1.0 - 0.8 * (1.0 - share), band, ("A note.",))


def test_the_axis_shows_all_points_and_is_logarithmic_over_a_decade() -> None:
    low, high, is_log = axis_of(X)
    assert not is_log
    assert 0.0 < low < 0.2
    assert high > 0.6
    assert axis_of(np.array([0.1, 10.0]))[2]
    assert axis_of(np.array([3.0]))[:2] == pytest.approx((2.82, 3.18))
    wide = np.log(places(np.array([0.1, 10.0])))
    assert np.diff(wide) == pytest.approx(np.diff(wide)[0])


@pytest.mark.parametrize("with_curve", [True, False])
def test_counts_are_drawn_with_a_curve_and_without(tmp_path: Path, *, with_curve: bool) -> None:
    draw_fragility(made_up(with_curve=with_curve), tmp_path / "one.svg", "A study")
    draw_fragility(made_up(with_curve=with_curve), tmp_path / "two.svg", "A study")
    text = (tmp_path / "one.svg").read_text()
    assert text == (tmp_path / "two.svg").read_text()
    assert ("lognormal curve" in text) == with_curve


def test_probability_goes_to_one_where_few_samples_fail(tmp_path: Path) -> None:
    found = made_up(with_curve=False)
    few = replace(found, share=0.1 * found.share, low=0.0 * found.low, high=0.1 + 0.1 * found.share)
    draw_fragility(few, tmp_path / "few.svg", "A study")
    assert "<!-- 1.0 -->" in (tmp_path / "few.svg").read_text()


def test_a_page_without_room_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match="too small for this picture"):
        draw_fragility(made_up(), tmp_path / "small.png", paper=Paper((2.0, 5.0)))

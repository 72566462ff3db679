"""Pictures of studies: convergence, tornadoes, limits over another key, fragility."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from blocksim.view.studies import (
    MOST_BLOCKS,
    Band,
    Bars,
    Fragility,
    LimitCurve,
    LimitRange,
    OtherLimits,
    axis_of,
    chosen_blocks,
    distance_limits,
    draw_fragility,
    draw_levels,
    draw_limit_curve,
    draw_tornado,
    places,
    span_of_bars,
)
from tests.view.drawings import KEYS, panel
from tests.view.made_up import overlapping


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
    draw_tornado([Bars("x", KEYS, np.zeros(3), np.zeros(3))], ("total", ""), tmp_path / "tornado.png", "nothing")
    assert all((tmp_path / f"{name}.png").stat().st_size > 0 for name in ("still", "tornado"))


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


def test_long_series_of_others_are_lines_and_short_ones_marks_with_their_names(
    caught: list[Figure], tmp_path: Path
) -> None:
    many = tuple((0.1 * number, 2.0 - 0.1 * number) for number in range(13))
    few = ((0.1, 1.9), (0.6, 1.4))
    curve = LimitCurve(
        "friction",
        "thickness (m)",
        [(0.3, [LimitRange(1.6, 1.8, "falls", "stands")])],
        ("Stands means: outcome == stands.",),
        (OtherLimits("curve of a book", many), OtherLimits("values of a paper", few)),
    )
    draw_limit_curve(curve, tmp_path / "limits.png", "An arch")
    (figure,) = caught
    assert overlapping(figure) == []
    (axes,) = figure.axes
    drawn = {str(line.get_label()): line for line in axes.lines}
    line, marks = drawn["curve of a book"], drawn["values of a paper"]
    assert (line.get_linestyle(), line.get_marker()) == ("-", "None")
    assert (marks.get_linestyle(), marks.get_xdata().tolist()) == ("None", [0.1, 0.6])  # type: ignore[union-attr]
    assert marks.get_marker() != "None"
    legend = axes.get_legend()
    assert legend is not None
    texts = [text.get_text() for text in legend.get_texts()]
    assert texts == ["curve of a book", "values of a paper", "falls below, stands above"]


X = np.array([0.2, 0.4, 0.6])


def counted(x: np.ndarray = X, *, with_curve: bool = True) -> Fragility:
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
    draw_fragility(counted(with_curve=with_curve), tmp_path / "one.svg", "A study")
    draw_fragility(counted(with_curve=with_curve), tmp_path / "two.svg", "A study")
    text = (tmp_path / "one.svg").read_text()
    assert text == (tmp_path / "two.svg").read_text()
    assert ("lognormal curve" in text) == with_curve


def test_probability_goes_to_one_where_few_samples_fail(tmp_path: Path) -> None:
    found = counted(with_curve=False)
    few = replace(found, share=0.1 * found.share, low=0.0 * found.low, high=0.1 + 0.1 * found.share)
    draw_fragility(few, tmp_path / "few.svg", "A study")
    assert "<!-- 1.0 -->" in (tmp_path / "few.svg").read_text()

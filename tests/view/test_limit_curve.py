"""Limits over another key, with what others found beside them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from blocksim.view.studies import LimitCurve, LimitRange, OtherLimits, draw_limit_curve
from tests.view.made_up import overlapping

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.figure import Figure


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

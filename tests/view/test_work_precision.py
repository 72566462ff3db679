"""Pictures of accuracy against computing time: what is shown, and the same bytes twice."""

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from blocksim.errors import InvalidInputError, OutputError
from blocksim.view.layout import Paper
from blocksim.view.work_precision import (
    SMALLEST_SHARE,
    Curve,
    Panel,
    draw_work_precision,
    floor_of,
    refuse_small_page,
)
from tests.view.made_up import overlapping


def curve(label: str, group: str, factor: float = 1.0) -> Curve:
    seconds = np.array([1e-3, 1e-2, 1e-1, 1.0])
    return Curve(label, group, seconds, factor * 1e-2 / seconds, 5e-3 / seconds, 2e-2 / seconds)


PANEL = Panel(
    "stairs", "error (mm)", (curve("fast", "one"), curve("faster", "one", 0.5), curve("slow", "two")), 0.2, "enough"
)


def test_svg_names_what_it_shows(tmp_path: Path) -> None:
    path = tmp_path / "work.svg"
    bare = Panel("wall", "change (mm)", (Curve("heap", "three", np.ones(1), np.ones(1)),))
    draw_work_precision([PANEL, bare], path, title="engines")
    assert ET.parse(path).getroot().tag.endswith("svg")  # noqa: S314 - our own file
    text = path.read_text(encoding="utf-8")
    for told in ("engines", "stairs", "wall", "error (mm)", "change (mm)", "fast", "faster", "slow", "heap", "enough"):
        assert f"<!-- {told} -->" in text


def test_same_curves_give_the_same_bytes(tmp_path: Path) -> None:
    paths = [tmp_path / f"{name}.png" for name in ("first", "second")]
    for path in paths:
        draw_work_precision([PANEL], path)
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_zero_errors_are_drawn_at_the_floor(tmp_path: Path) -> None:
    exact = Curve("exact", "one", np.array([1.0, 2.0]), np.array([4.0, 0.0]))
    tiny = Curve("tiny", "two", np.array([1.0]), np.array([1e-12]))
    assert floor_of(Panel("", "", (exact,))) == 4.0
    assert floor_of(Panel("", "", (exact, tiny))) == pytest.approx(4.0 * SMALLEST_SHARE)
    none = Panel("", "", (Curve("none", "one", np.ones(1), np.zeros(1)),), 0.2)
    assert floor_of(none) == 0.2
    draw_work_precision([none], tmp_path / "none.png")
    assert (tmp_path / "none.png").stat().st_size > 0


def test_wrong_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match="unsupported picture format"):
        draw_work_precision([PANEL], tmp_path / "work.bmp")
    with pytest.raises(OutputError, match="cannot be written"):
        draw_work_precision([PANEL], tmp_path / "nix" / "work.png")


def test_page_has_the_size_that_was_asked_for(caught: list[Figure]) -> None:
    draw_work_precision([PANEL, PANEL], "work.png", title="engines " * 30, paper=Paper((6.0, 2.6), 100.0))
    (figure,) = caught
    assert (tuple(figure.get_size_inches()), figure.dpi) == ((6.0, 2.6), 100.0)
    assert overlapping(figure) == []
    with pytest.raises(InvalidInputError, match="too small for this picture"):
        refuse_small_page(3, Paper((6.0, 2.5)))

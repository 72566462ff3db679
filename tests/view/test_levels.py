"""Pictures of convergence: what is shown, within which limits, and the same bytes twice."""

import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from blocksim.errors import InvalidInputError, OutputError
from blocksim.view.layout import Paper
from blocksim.view.levels import MOST_BLOCKS, Panel, chosen_blocks, draw_levels, limits_of, refuse_small_page
from tests.view.made_up import HOSTILE, overlapping


def panel(blocks: int = 3, levels: int = 4, size_mm: float = 1.0) -> Panel:
    """Return distances that fall by ten from level to level and grow with the block; the first block stays."""
    off = size_mm * 10.0 ** -np.arange(levels)[:, None] * np.arange(blocks) / max(blocks - 1, 1)
    off[-1] = 0.0
    return Panel(
        title="time step",
        key="time.safety",
        verdict="converged",
        values=np.array([0.1 * 0.5**level for level in range(levels)]),
        blocks=tuple(f"b{number}" for number in range(blocks)),
        off_mm=off,
        largest_off_mm=off.max(axis=1),
        tolerance_mm=0.1,
        own=0.05,
        recommended=0.025,
    )


@pytest.mark.parametrize("panels", [[panel()], [panel(), panel(3, 9)]])
def test_svg_names_what_it_shows(tmp_path: Path, panels: list[Panel]) -> None:
    path = tmp_path / "levels.svg"
    draw_levels(panels, path, title="slide", measured={"b1": 7.0, "b2": 8.0})
    assert ET.parse(path).getroot().tag.endswith("svg")  # noqa: S314 - our own file
    text = path.read_text(encoding="utf-8")
    for told in ("slide", "time step: converged", "own", "recommended", "x of block b2", "by 7 mm", "0.05"):
        assert f"<!-- {told} -->" in text
    assert "<!-- x of block b0 -->" not in text


def test_same_levels_give_the_same_bytes(tmp_path: Path) -> None:
    paths = [tmp_path / f"{name}.png" for name in ("first", "second")]
    for path in paths:
        draw_levels([panel()], path)
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_many_blocks_are_cut_to_the_farthest() -> None:
    assert chosen_blocks([panel(60)]) == list(range(60 - MOST_BLOCKS, 60))
    assert chosen_blocks([panel(3)]) == [1, 2]


def test_limits_hold_the_tolerance_and_what_is_worth_showing() -> None:
    low, high = limits_of([panel(size_mm=1e-6), panel(size_mm=20.0)], [50.0])
    assert low == pytest.approx(1e-4)
    assert high == 100.0
    low, high = limits_of([panel(size_mm=1e-5)], [])
    assert low < 1e-6
    assert high == pytest.approx(0.2)


def test_nothing_but_zeros_can_be_drawn(tmp_path: Path) -> None:
    still = panel(size_mm=0.0)
    assert chosen_blocks([still]) == []
    draw_levels([replace(still, recommended=None)], tmp_path / "still.png")
    assert (tmp_path / "still.png").stat().st_size > 0


def test_wrong_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match="unsupported picture format"):
        draw_levels([panel()], tmp_path / "levels.bmp")
    with pytest.raises(OutputError, match="cannot be written"):
        draw_levels([panel()], tmp_path / "nix" / "levels.png")


@pytest.mark.parametrize("name", ["W" * 200, *HOSTILE])
@pytest.mark.parametrize("count", [1, 3])
def test_long_and_hostile_names_cover_nothing(caught: list[Figure], name: str, count: int) -> None:
    named = replace(panel(), blocks=("b0", name, "b2"))
    draw_levels([named] * count, "levels.png", title=name, measured={name: 7.0})
    assert overlapping(caught[0]) == []


@pytest.mark.parametrize(("count", "inches"), [(1, (3.5, 2.5)), (3, (8.0, 3.0)), (2, (12.0, 9.0))])
def test_page_has_the_size_that_was_asked_for(caught: list[Figure], count: int, inches: tuple[float, float]) -> None:
    long = replace(panel(3, 9), title="velocity tolerance", key="time.velocity_tolerance", verdict="not yet converged")
    draw_levels([long] * count, "levels.png", title="slide", measured={"b1": 7.0}, paper=Paper(inches, 100.0))
    (figure,) = caught
    assert (tuple(figure.get_size_inches()), figure.dpi) == (inches, 100.0)
    assert overlapping(figure) == []
    assert all(axes.get_position().width * inches[0] > 1.6 for axes in figure.axes)


def test_page_without_room_is_refused_before_anything_is_drawn(caught: list[Figure]) -> None:
    with pytest.raises(InvalidInputError, match=r"too small for this picture: at least \d+ mm wide"):
        draw_levels([panel()] * 3, "levels.png", paper=Paper((4.0, 4.0)))
    with pytest.raises(InvalidInputError, match=r"at least \d+ mm high"):
        refuse_small_page(1, Paper((4.0, 1.0)))
    assert caught == []

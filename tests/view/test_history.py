"""Histories: what is drawn over time, of how many blocks, in which units."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from blocksim.analysis import load_table
from blocksim.view import history
from blocksim.view.history import draw_history, drawn_energies, energy_unit, farthest_blocks
from blocksim.view.support import Support
from tests.view.made_up import HOSTILE, boxes_of, overlapping, toppling

TABLE = load_table(Path(history.__file__).parents[2] / "scenarios" / "experiments" / "three_blocks.csv")


@pytest.mark.parametrize("suffix", ["png", "svg", "pdf"])
def test_the_same_run_gives_the_same_bytes(tmp_path: Path, suffix: str) -> None:
    paths = [tmp_path / f"{name}.{suffix}" for name in ("first", "second")]
    for path in paths:
        draw_history(toppling(8), path, title="twice", measured=TABLE)
    assert paths[0].read_bytes() == paths[1].read_bytes()


@pytest.mark.parametrize("blocks", [1, 3, 1000])
def test_no_text_covers_another_or_is_cut(caught: list[Figure], blocks: int) -> None:
    draw_history(toppling(blocks), "history.png", title="a title", measured=TABLE)
    assert overlapping(caught[0]) == []


def test_lines_are_what_was_recorded_in_millimetres_and_degrees(caught: list[Figure]) -> None:
    frames = toppling(3)
    draw_history(frames, "history.png")
    values = (1000.0 * frames.x, 1000.0 * frames.y, np.degrees(frames.rotation))
    for axes, expected in zip(caught[0].axes, values, strict=False):
        for block in range(3):
            np.testing.assert_allclose(np.asarray(axes.lines[block].get_ydata()), expected[:, block])
    labels = [axes.get_ylabel() for axes in caught[0].axes]
    assert labels == ["x (mm)", "y (mm)", "rotation (°)", "energy (mJ)", "contacts"]


def test_of_many_blocks_those_that_come_farthest_are_coloured(caught: list[Figure]) -> None:
    frames = toppling(20)
    frames.x[-1, 7] += 1.0
    draw_history(frames, "history.png")
    assert len(caught[0].axes[0].lines) == 6
    assert len(caught[0].axes[0].collections[0].get_paths()) == 14
    legend = caught[0].axes[0].get_legend()
    assert legend is not None
    assert "8" in [text.get_text() for text in legend.get_texts()]
    assert "Coloured: 6 of 20 blocks" in "".join(text for text, _ in boxes_of(caught[0]))


def test_fixed_blocks_are_never_coloured() -> None:
    frames = toppling(3)
    shown = farthest_blocks(frames, np.arange(len(frames)), Support(fixed=(True, False, False)))
    assert shown == [1, 2]


def test_a_scene_of_fixed_blocks_only_can_be_drawn(caught: list[Figure]) -> None:
    draw_history(toppling(2), "history.png", support=Support(fixed=(True, True)))
    assert caught[0].axes[0].get_legend() is None


def test_energies_are_grouped_and_small_ones_left_out() -> None:
    frames = toppling(1)
    drawn = drawn_energies(frames.energy, np.arange(len(frames)))
    assert list(drawn) == ["kinetic", "potential", "lost in impacts", "elf"]  # friction is zero, elf is unknown
    assert float(drawn["potential"].min()) == 0.0


@pytest.mark.parametrize(("most", "unit"), [(2e3, "kJ"), (1.0, "J"), (0.1, "mJ"), (1e-5, "µJ"), (0.0, "µJ")])
def test_energies_are_told_in_a_unit_that_fits(most: float, unit: str) -> None:
    assert energy_unit(most)[1] == unit


def test_measured_ranges_stand_at_the_end(caught: list[Figure]) -> None:
    draw_history(toppling(3), "history.png", measured=TABLE)
    ends = [line.get_ydata() for line in caught[0].axes[0].lines[3:]]
    assert any(np.allclose(np.asarray(end, dtype=float), [71.69, 78.53]) for end in ends if np.size(end) == 2)
    assert "measured mean and range" in "".join(text for text, _ in boxes_of(caught[0]))


def test_long_runs_are_thinned_and_many_grey_lines_stored_as_an_image(tmp_path: Path) -> None:
    draw_history(toppling(200, steps=3000), tmp_path / "history.svg")
    assert (tmp_path / "history.svg").stat().st_size < 2_000_000


def test_hostile_names_are_text(caught: list[Figure]) -> None:
    draw_history(replace(toppling(6), names=HOSTILE[:6]), "history.png", title=HOSTILE[0] * 20)
    texts = [text for text, _ in boxes_of(caught[0])]
    assert "$x^2$ \\frac" in texts
    assert "_hidden" in texts
    assert overlapping(caught[0]) == []


def test_frames_that_are_not_finite_are_left_out(caught: list[Figure]) -> None:
    frames = toppling(2)
    frames.x[-1] = np.nan
    draw_history(frames, "history.png")
    assert len(np.asarray(caught[0].axes[0].lines[0].get_ydata())) == len(frames) - 1

"""Histories: what is drawn over time, of how many blocks, in which units."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from blocksim.analysis import load_table
from blocksim.errors import InvalidInputError
from blocksim.scenario.motion import MotionPieces
from blocksim.view import history, style
from blocksim.view.history import draw_history, line_looks
from blocksim.view.history_panels import ENERGY_LOOKS, LEAST_SPAN, Choice, drawn_energies, farthest_blocks, unit_for
from blocksim.view.layout import Paper
from blocksim.view.paint import by_speed
from blocksim.view.run_data import Support
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
    shown = farthest_blocks(frames, np.arange(len(frames)), Support(fixed=(True, False, False)), 6)
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
def test_energies_are_reported_in_a_unit_that_fits(most: float, unit: str) -> None:
    assert unit_for(most, "J")[1] == unit


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


MOVING = Support(motion=MotionPieces(np.array([0.0, 1.0]), np.array([[0.0, 0.02, 0.0, 0.0]]), 0.02), weight=12.0)


def lines_of(figure: Figure, panel: int) -> list[np.ndarray]:
    return [np.asarray(line.get_ydata(), dtype=float) for line in figure.axes[panel].lines]


def test_displacements_and_velocities_are_those_seen_from_the_moving_ground(caught: list[Figure]) -> None:
    frames = toppling(3)
    for relative in (False, True):
        choice = Choice(("displacement", "velocity"), ("3",), relative=relative)
        draw_history(frames, "history.png", support=MOVING, choice=choice)
    moved = 20.0 * frames.time
    there = 1000.0 * (frames.x[:, 2] - frames.x[0, 2])
    for figure, carried, speed in zip(caught, (0.0 * moved, moved), (0.0, 20.0), strict=True):
        np.testing.assert_allclose(lines_of(figure, 0), [there - carried], atol=1e-9)
        np.testing.assert_allclose(lines_of(figure, 2), [1000.0 * frames.vx[:, 2] - speed], atol=1e-9)
    assert [axes.get_ylabel() for axes in caught[0].axes] == ["Δx (mm)", "Δy (mm)", "vx (mm/s)", "vy (mm/s)"]
    assert caught[1].axes[0].get_ylabel() == "Δx − ground (mm)"


def test_the_motion_of_the_ground_stands_below_a_shaken_run(caught: list[Figure]) -> None:
    frames = toppling(2)
    draw_history(frames, "history.png", support=MOVING)
    assert caught[0].axes[-1].get_ylabel() == "ground (mm)"
    np.testing.assert_allclose(lines_of(caught[0], -1), [20.0 * frames.time], atol=1e-9)
    assert overlapping(caught[0]) == []


def test_a_block_has_one_colour_in_all_pictures_and_dashes_tell_equal_ones_apart(caught: list[Figure]) -> None:
    draw_history(toppling(20), "history.png", choice=Choice(("x",), ("2", "8", "14", "3")))
    assert [line.get_color() for line in caught[0].axes[0].lines] == ["#E69F00"] * 3 + ["#009E73"]
    looks = line_looks([style.block_colour(block) for block in range(20)], [1, 7, 13, 2]).values()
    assert len({str(look) for look in looks}) == 4


def test_an_energy_has_one_colour_whatever_else_is_drawn(caught: list[Figure]) -> None:
    for energy in ({"kinetic": 1.0, "friction": 1.0}, {"kinetic": 1.0, "stored_normal": 1.0, "friction": 1.0}):
        frames = toppling(1)
        frames = replace(frames, energy={name: value + frames.time for name, value in energy.items()})
        draw_history(frames, "history.png", choice=Choice(("energy",)))
    drawn = [{line.get_label(): line.get_color() for line in figure.axes[0].lines} for figure in caught]
    assert {figure["lost to friction"] for figure in drawn} == {ENERGY_LOOKS["lost to friction"][0]}


def test_round_off_looks_flat(caught: list[Figure]) -> None:
    frames = toppling(1)
    frames.x[:] = 0.1 + 1e-15 * np.arange(len(frames))[:, None]
    draw_history(frames, "history.png", choice=Choice(("x", "dx")))
    for axes, line in zip(caught[0].axes, (lines_of(caught[0], 0), lines_of(caught[0], 1)), strict=True):
        low, high = axes.get_ylim()
        assert high - low > 0.999 * LEAST_SPAN
        assert np.ptp(line[0]) < 1e-9 * (high - low)


@pytest.mark.parametrize(
    ("choice", "told"),
    [
        (Choice(("speeed",)), "unknown panel, did you mean 'speed'?"),
        (Choice(blocks=("9",)), "--block 9: no such block in this run, its 3 blocks are 1, 2, 3"),
        (Choice(("force",)), "stored no contacts"),
    ],
)
def test_what_a_run_does_not_have_is_refused(choice: Choice, told: str) -> None:
    with pytest.raises(InvalidInputError, match=told):
        draw_history(toppling(3), "history.png", choice=choice)


def test_lines_cannot_change_their_colour_with_speed() -> None:
    with pytest.raises(InvalidInputError, match="coloured by block or material"):
        draw_history(toppling(3), "history.png", paint=by_speed(toppling(3)))


def test_many_names_do_not_run_into_the_legend_of_energies(caught: list[Figure]) -> None:
    names = tuple(str(number) for number in range(1, 13))
    draw_history(toppling(20), "history.png", choice=Choice(("x", "energy"), names))
    assert overlapping(caught[0]) == []


def test_a_page_has_the_size_that_was_asked_for_or_is_refused(caught: list[Figure]) -> None:
    draw_history(toppling(3), "history.png", paper=Paper((6.0, 8.0)))
    assert caught[0].get_size_inches().tolist() == [6.0, 8.0]
    assert overlapping(caught[0]) == []
    with pytest.raises(
        InvalidInputError, match=r"--size 152.4x50.8 mm is too small for this picture: at least 1\d\d mm"
    ):
        draw_history(toppling(3), "history.png", paper=Paper((6.0, 2.0)))

"""Histories: what is drawn over time, of how many blocks, in which units and colours."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from blocksim.errors import InvalidInputError
from blocksim.simulation.trajectory import force_on_supports
from blocksim.view.history import draw_history
from blocksim.view.paints import by_speed
from blocksim.view.run_data import Support
from blocksim.view.scene import PictureOptions
from blocksim.view.time_panels import LEAST_SPAN
from tests.golden import Golden
from tests.view.drawings import MOVING
from tests.view.made_up import overlapping, pressed, toppling


def lines_of(figure: Figure, panel: int) -> list[np.ndarray]:
    return [np.asarray(line.get_ydata(), dtype=float) for line in figure.axes[panel].lines]


def test_lines_are_what_was_recorded_in_millimetres_and_degrees(caught: list[Figure]) -> None:
    frames = pressed(toppling(3))
    draw_history(frames, "history.png", PictureOptions(support=Support(weight=12.0)))
    values = (1000.0 * frames.x, 1000.0 * frames.y, np.degrees(frames.rotation))
    for panel, expected in enumerate(values):
        np.testing.assert_allclose(lines_of(caught[0], panel)[:3], expected.T)
    labels = [axes.get_ylabel() for axes in caught[0].axes]
    assert labels == ["x (mm)", "y (mm)", "rotation (°)", "energy (mJ)", "contacts", "support force (N)"]
    assert frames.contacts is not None
    held, weight = lines_of(caught[0], 5)
    np.testing.assert_allclose(held, force_on_supports(frames.contacts))
    np.testing.assert_allclose(weight, 12.0)


def test_long_runs_are_thinned_and_many_grey_lines_stored_as_an_image(tmp_path: Path) -> None:
    draw_history(toppling(200, steps=3000), tmp_path / "history.svg")
    assert (tmp_path / "history.svg").stat().st_size < 2_000_000


def test_displacements_and_velocities_are_those_seen_from_the_moving_ground(caught: list[Figure]) -> None:
    frames, along = toppling(3), np.array(MOVING.direction)
    for relative in (False, True):
        asked = PictureOptions(support=MOVING, panels=("displacement", "velocity"), blocks=("3",), relative=relative)
        draw_history(frames, "history.png", asked)
    moved = 1000.0 * MOVING.offset(frames.time).T
    speed = np.where(frames.time < 0.3, 200.0 * frames.time, 0.0)  # of 0.1 m/s2 and then none
    there = 1000.0 * np.array([frames.x[:, 2] - frames.x[0, 2], frames.y[:, 2] - frames.y[0, 2]])
    for figure, share in zip(caught, (0.0, 1.0), strict=True):
        for k, velocity in enumerate((frames.vx[:, 2], frames.vy[:, 2])):
            np.testing.assert_allclose(lines_of(figure, k), [there[k] - share * moved[k]], atol=1e-9)
            expected = 1000.0 * velocity - share * along[k] * speed
            np.testing.assert_allclose(lines_of(figure, 2 + k), [expected], atol=1e-9)


def test_round_off_looks_flat(caught: list[Figure]) -> None:
    frames = toppling(1)
    frames.x[:] = 0.1 + 1e-15 * np.arange(len(frames))[:, None]
    draw_history(frames, "history.png", PictureOptions(panels=("x", "dx")))
    for panel, axes in enumerate(caught[0].axes):
        low, high = axes.get_ylim()
        assert high - low > 0.999 * LEAST_SPAN
        assert np.ptp(lines_of(caught[0], panel)[0]) < 1e-9 * (high - low)


@pytest.mark.parametrize("speed", [123.456789, -0.123456789, 12.3456789, 0.0])
def test_numbers_along_a_constant_differ_and_leave_room_for_its_name(caught: list[Figure], speed: float) -> None:
    frames = toppling(1)
    frames.vx[:] = speed + 1e-9 * np.sin(frames.time)[:, None]
    draw_history(frames, "history.png", PictureOptions(panels=("vx", "x")))
    (figure,) = caught
    figure.draw_without_rendering()
    axes = figure.axes[0]
    low, high = axes.get_ylim()
    shown = [tick.label1.get_text() for tick in axes.yaxis.get_major_ticks() if low <= tick.get_loc() <= high]
    assert len(set(shown)) == len(shown) >= 3
    assert all(len(text) <= 7 for text in shown)
    assert overlapping(figure) == []


@pytest.mark.parametrize(
    "options",
    [
        PictureOptions(panels=("speeed",)),
        PictureOptions(blocks=("9",)),
        PictureOptions(panels=("force",)),
        PictureOptions(paint=by_speed(toppling(3))),
    ],
    ids=["panel", "block", "contacts", "speed"],
)
def test_what_a_run_does_not_have_or_lines_cannot_show_is_refused(golden: Golden, options: PictureOptions) -> None:
    with pytest.raises(InvalidInputError) as caught:
        draw_history(toppling(3), "history.png", options)
    golden(str(caught.value))

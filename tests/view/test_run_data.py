"""A run as its pictures need it: frames even in the way, times found, supports as the scenario has them."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from blocksim.errors import InvalidInputError
from blocksim.scenario import Model, load_scenario, scenario_from_mapping, scenario_to_toml
from blocksim.simulation.results import EventRecord
from blocksim.simulation.trajectory import Frames, final_columns
from blocksim.view import strip
from blocksim.view.final import draw_final
from blocksim.view.history import draw_history
from blocksim.view.paints import by_block, by_speed, by_turn
from blocksim.view.run_data import (
    Extent,
    Support,
    drawable_frames,
    extent_of,
    moments_at,
    moments_by_motion,
    path_lengths,
    support_of,
)
from blocksim.view.scene import Canvas, PictureOptions, Scene, draw_scene, readable_scale
from blocksim.view.strip import arrangement
from blocksim.view.style import open_figure
from tests.golden import Golden
from tests.view.made_up import blocks_at, boxes_of, stacked, toppling

SCENE: dict[str, object] = {
    "schema": 1,
    "name": "a",
    "materials": {"oak": {"density": 1000, "young_modulus": 1e9, "poisson_ratio": 0.3}},
    "blocks": {"brick": {"width": 0.1, "height": 0.1, "length": 0.1, "material": "oak"}},
    "structures": [{"kind": "stack", "block": "brick", "count": 2}],
    "bodies": [{"block": "brick", "x": -1, "y": 2, "fixed": True}],
    "ground": {"tilt": "-10 deg", "profile": [[1, 0], [1, -1], [3, 0]]},
    "walls": [{"from": [2, 2], "to": [2, 3]}],
    "motion": {"kind": "harmonic", "amplitude": 0.01, "frequency": 1, "direction": "90 deg", "ramp": 0.1},
}


def moving(places: list[float], angles: list[float] | None = None) -> Frames:
    """Return frames of a unit square, 0.1 s apart."""
    return blocks_at(places, 0.0, angles or 0.0, time=0.1 * np.arange(len(places)), size=(1.0, 1.0))


def test_panels_are_even_in_the_way_and_not_in_time() -> None:
    frames = moving([0.0] * 50 + [1.0, 2.0, 3.0, 4.0] + [4.0] * 100)
    chosen = moments_by_motion(frames, drawable_frames(frames), 5)
    assert list(frames.x[chosen, 0]) == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert (chosen[0], chosen[-1]) == (0, 153)


def test_turning_on_the_spot_counts_as_motion_and_going_back_does_not_cancel() -> None:
    turning, returning = moving([0.0] * 5, [0.0, 0.0, 0.5, 1.0, 1.0]), moving([0.0, 1.0, 0.0])
    path = path_lengths(turning, drawable_frames(turning))
    assert list(path) == pytest.approx([0.0, 0.0, np.sqrt(0.125), np.sqrt(0.5), np.sqrt(0.5)])
    assert path_lengths(returning, drawable_frames(returning))[-1] == 2.0


def test_riding_on_a_moving_support_is_no_way() -> None:
    frames = moving([0.0, 1.0, 0.0, 0.5])
    carried = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 0.0], [0.0, 0.0]])
    assert list(path_lengths(frames, drawable_frames(frames), carried)) == [0.0, 0.0, 0.0, 0.5]
    assert list(moments_by_motion(frames, drawable_frames(frames), 3, carried)) == [0, 3]


@pytest.mark.parametrize(("places", "expected"), [([1.0], [0]), ([1.0] * 9, [0, 8]), ([0.0, 1.0, 2.0], [0, 1, 2])])
def test_short_or_still_runs_show_no_frame_twice(places: list[float], expected: list[int]) -> None:
    frames = moving(places)
    assert list(moments_by_motion(frames, drawable_frames(frames), 8)) == expected


def test_a_failed_run_is_drawn_as_far_as_it_has_numbers() -> None:
    frames = moving([0.0, 1.0, float("nan"), 3.0])
    frames.angle[3] = np.inf
    assert list(drawable_frames(frames)) == [0, 1]


def test_the_printed_time_of_the_last_frame_means_the_last_frame() -> None:
    frames = moving([0.0, 1.0, 2.0, 3.0])
    frames.time[:] = [0.0, 0.1, 0.299, 0.2994]  # a run that came to rest between two outputs
    assert list(moments_at(frames, drawable_frames(frames), [0.299, 0.2990001])) == [3, 2]
    frames.time[-1] = 0.3546
    assert list(moments_at(frames, drawable_frames(frames), [0.355])) == [3]


def test_what_cannot_be_drawn_and_times_that_were_not_recorded_are_refused(golden: Golden) -> None:
    frames, said = moving([0.0, 1.0, 2.0, 3.0]), []
    for wrong in (moving([float("nan")]), replace(moving([0.0]), names=())):
        with pytest.raises(InvalidInputError) as caught:
            drawable_frames(wrong)
        said.append(str(caught.value))
    for times in ([0.1, 0.5], [-0.1], [float("nan")], []):
        with pytest.raises(InvalidInputError) as caught:
            moments_at(frames, drawable_frames(frames), times)
        said.append(f"{times}: {caught.value}")
    golden("\n".join(said))


def test_the_resolved_scenario_of_a_run_tells_all(tmp_path: Path) -> None:
    (tmp_path / "scenario.toml").write_text(scenario_to_toml(scenario_from_mapping(SCENE)), encoding="utf-8")
    support = support_of(Model(load_scenario(tmp_path / "scenario.toml")))
    assert list(support.fixed) == [False, False, True]
    assert np.array(support.profile).tolist() == [[1, 0], [1, -1], [3, 0]]
    assert [(wall.x0, wall.y0, wall.x1, wall.y1) for wall in support.walls] == [(2, 2, 2, 3)]
    assert np.degrees(support.tilt) == pytest.approx(-10.0)
    assert support.offset(np.array([0.0, 1.25, 1.75])) == pytest.approx(np.array([[0, 0], [0, 0.01], [0, -0.01]]))


def test_walls_go_at_the_time_of_an_event_and_at_rest_when_a_run_came_to_it() -> None:
    walls = [{"from": [x, 2], "to": [x, 3]} for x in (2, 3)]
    events = [{"when": "rest", "remove": ["wall 1"]}, {"at": 0.9, "remove": ["wall 2"]}]
    scenario = scenario_from_mapping({**SCENE, "walls": walls, "events": events})
    happened = EventRecord(event=0, step=15, time_s=1.5, what="", energy_J=0.0)
    times = (0.8, 1.0, 1.4, 1.5)
    assert [len(support_of(Model(scenario)).at(time).walls) for time in times] == [2, 1, 1, 1]
    assert [len(support_of(Model(scenario), [happened]).at(time).walls) for time in times] == [2, 1, 1, 0]


def test_heights_and_corners_of_a_profile() -> None:
    support = Support(profile=((0.0, 0.2), (1.0, 0.2), (2.0, 0.2), (3.0, 0.0), (4.0, 0.0)))
    assert support.height(np.array([-9.0, 2.5, 9.0])) == pytest.approx([0.2, 0.1, 0.0])
    assert support.corners().tolist() == [[2.0, 0.2], [3.0, 0.0]]
    assert support.line(5.0)[[0, -1]].tolist() == [[-5.0, 0.2], [9.0, 0.0]]


def test_rotation_of_what_turned_while_settling_is_that_of_the_table(caught: list[Figure]) -> None:
    frames = stacked(1)
    frames.angle[:] = np.radians(1.24)  # from the first frame on, which is after settling
    (rotation,) = final_columns(frames)["rotation_deg"]
    draw_final(frames, "final.png")
    draw_history(frames, "history.png", PictureOptions(panels=("rotation",)))
    assert f"{rotation:.2f}°" == "1.24°" in [text for text, _ in boxes_of(caught[0])]
    (curve,) = (line for axes in caught[1].axes for line in axes.lines if np.size(line.get_xdata()) == len(frames))
    assert np.asarray(curve.get_ydata())[-1] == pytest.approx(rotation)
    scale = by_turn(frames).scale
    assert scale is not None
    assert scale.high == pytest.approx(rotation)


def test_long_runs_are_thinned_and_many_grey_lines_stored_as_an_image(tmp_path: Path) -> None:
    draw_history(toppling(200, steps=3000), tmp_path / "history.svg")
    assert (tmp_path / "history.svg").stat().st_size < 2_000_000


def test_what_a_run_does_not_have_or_lines_cannot_show_is_refused(golden: Golden) -> None:
    said = []
    for values in (
        {"panels": ("speeed",)},
        {"blocks": ("9",)},
        {"panels": ("force",)},
        {"paint": by_speed(toppling(3))},
    ):
        with pytest.raises(InvalidInputError) as caught:
            draw_history(toppling(3), "history.png", PictureOptions(**values))
        said.append(str(caught.value))
    golden("\n".join(said))


@pytest.mark.parametrize(
    ("extent", "readable", "expected"),
    [
        (Extent(0, 160, 0, 150), 0.0, (4, 8)),
        (Extent(0, 500, 0, 100), 0.0, (2, 8)),
        (Extent(0, 900, 0, 50), 0.0, (1, 6)),
        (Extent(0, 800, 0, 400), 0.3, (2, 8)),  # names need larger panels
        (Extent(0, 800, 0, 400), 0.1, (4, 8)),  # readable as it is
        (Extent(0, 800, 0, 400), 5.0, (4, 8)),  # not readable either way
        (Extent(0, 400, 0, 400), 0.5, (4, 8)),
    ],
)
def test_long_scenes_and_small_names_get_fewer_columns(
    extent: Extent, readable: float, expected: tuple[int, int]
) -> None:
    assert arrangement(extent, readable=readable) == expected


def test_importing_the_room_does_not_load_matplotlib() -> None:
    code = "import sys, blocksim.view; sys.exit('matplotlib' in sys.modules or 'pandas' in sys.modules)"
    root = Path(strip.__file__).parents[2]
    assert subprocess.run([sys.executable, "-c", code], cwd=root, check=False).returncode == 0


@pytest.mark.parametrize(("share", "name"), [(1.01, "1"), (0.99, "")])
def test_names_are_readable_from_the_scale_at_which_they_are_written(share: float, name: str) -> None:
    frames = blocks_at([0.1, 0.2], [0.025, 0.016], [0.0, -np.pi / 2])
    extent = extent_of(frames, np.arange(2), Support())
    with open_figure(1.0, 1.0) as figure:
        canvas = Canvas(figure.add_axes((0.0, 0.0, 1.0, 1.0)), extent, share * readable_scale(frames))
        draw_scene(canvas, Scene(frames, Support(), by_block(frames)), 1)
    assert "".join(text.get_text() for text in canvas.axes.texts) == name

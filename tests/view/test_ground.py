"""Where ground, walls and their places at the start are drawn: data of the artists, in millimetres of the scene."""

import numpy as np
import pytest
from matplotlib.collections import LineCollection
from matplotlib.patches import PathPatch
from numpy.typing import NDArray

from blocksim.scenario import PlacedSegment
from blocksim.view.run_data import Extent, Support, rotate_points
from blocksim.view.scene import (
    GROUND_THICKNESS,
    WALL_THICKNESS,
    Canvas,
    draw_start,
    draw_support,
    finish_panel,
    wall_outlines,
)
from blocksim.view.style import open_figure

Floats = NDArray[np.float64]

SCALE = 2.0  # points a mm
NOWHERE = np.array([0.0, 0.0])
NO_OUTLINES = np.zeros((0, 4, 2))
STEP = Support(profile=((20.0e-3, 0.0), (20.0e-3, -40.0e-3)))


def canvas(base: float = -40.0, tilt: float = 0.0) -> Canvas:
    """Return a canvas that shows 200 x 150 mm."""
    with open_figure(4.0, 3.0) as figure:
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_xlim(-100.0, 100.0)
    axes.set_ylim(-50.0, 100.0)
    return Canvas(axes, Extent(-100.0, 100.0, -50.0, 100.0, base, tilt), SCALE)


def wall(
    start: tuple[float, float], end: tuple[float, float], *, extends: tuple[bool, bool] = (False, False)
) -> PlacedSegment:
    """Return a wall between two points in mm."""
    ends = {"extends_start": extends[0], "extends_end": extends[1], "touches_start": False, "touches_end": False}
    x0, y0, x1, y1 = (1e-3 * place for place in (*start, *end))
    return PlacedSegment(x0, y0, x1, y1, material=None, **ends)


def is_solid(drawn: Canvas, x: float, y: float) -> bool:
    """Return True if a point (mm, scene) is filled."""
    patches = [artist for artist in drawn.axes.patches if isinstance(artist, PathPatch)]
    return any(patch.get_path().contains_point((x, y)) for patch in patches)


def lines_of(drawn: Canvas) -> list[Floats]:
    """Return the straight lines (mm, scene) of ground and walls."""
    return [
        np.asarray(path.vertices, dtype=float)
        for artist in drawn.axes.collections
        if isinstance(artist, LineCollection)
        for path in artist.get_paths()
    ]


@pytest.mark.parametrize("offset", [(0.0, 0.0), (30.0, 0.0), (-12.0, 7.0)])
def test_the_solid_is_below_the_displaced_profile(offset: tuple[float, float]) -> None:
    drawn = canvas()
    draw_support(drawn, STEP, np.array(offset))
    corner, top = 20.0 + offset[0], offset[1]
    for x, y, expected in (
        (corner - 1.0, top - 1.0, True),
        (corner - 1.0, top + 1.0, False),
        (corner + 1.0, top - 1.0, False),
        (corner + 1.0, top - 41.0, True),
        (-100.0, top - 1.0, True),
        (100.0, top - 41.0, True),
    ):
        assert is_solid(drawn, x, y) == expected, (x, y)


def test_a_profile_that_is_kilometres_long_and_deep_is_cut_to_the_picture() -> None:
    drawn = canvas()
    draw_support(drawn, Support(profile=((-1e4, 0.0), (0.0, 0.0), (0.0, -1e4), (0.01, -1e4), (0.01, 1e4))), NOWHERE)
    outlines = [np.asarray(patch.get_path().vertices, dtype=float) for patch in drawn.axes.patches]
    vertices = np.concatenate([*outlines, *lines_of(drawn)])
    assert np.abs(vertices).max() < 500.0
    assert is_solid(drawn, -1.0, -1.0)
    assert not is_solid(drawn, 5.0, -1.0)
    assert is_solid(drawn, 11.0, 99.0)


def test_a_wall_is_solid_on_the_right_hand_only_and_moves_with_the_ground() -> None:
    drawn = canvas()
    draw_support(drawn, Support(walls=(wall((50.0, 0.0), (50.0, 30.0)),)), np.array([10.0, 0.0]))
    depth = WALL_THICKNESS / SCALE
    solid = [is_solid(drawn, 60.0 + x, y) for x, y in ((0.5 * depth, 20.0), (-0.1, 20.0), (1.1 * depth, 20.0))]
    assert solid == [True, False, False]
    assert not is_solid(drawn, 60.0 + 0.5 * depth, 31.0)
    assert lines_of(drawn)[-1].tolist() == [pytest.approx([60.0, 0.0]), pytest.approx([60.0, 30.0])]


def test_walls_that_join_are_mitred_without_needles() -> None:
    valley = (wall((0.0, 10.0), (0.0, 0.0)), wall((0.0, 0.0), (10.0, 0.0)))
    down, level = wall_outlines(valley, 2.0)
    assert down[2].tolist() == level[3].tolist() == pytest.approx([-2.0, -2.0])
    edge = (wall((0.0, 0.0), (0.0, 10.0)), wall((0.0, 10.0), (10.0, 10.0)))
    up, roof = wall_outlines(edge, 2.0)
    assert up[2].tolist() == roof[3].tolist() == pytest.approx([2.0, 8.0])
    there_and_back = (wall((0.0, 0.0), (100.0, 0.0)), wall((100.0, 0.0), (0.0, 5.0)))
    assert np.concatenate(wall_outlines(there_and_back, 2.0))[:, 0].max() < 105.0


@pytest.mark.parametrize(("is_covered", "below"), [(False, 0.0), (True, -2.0)])
def test_free_ends_are_square_and_covered_ones_reach_into_what_covers_them(is_covered: bool, below: float) -> None:
    (outline,) = wall_outlines((wall((0.0, 0.0), (0.0, 10.0), extends=(is_covered, False)),), 2.0)
    assert outline.tolist() == [pytest.approx(point) for point in ([0, 0], [0, 10], [2, 10], [2, below])]


@pytest.mark.parametrize(("offset", "heights"), [((10.0, 0.0), [0.0]), ((0.0, 10.0), [-40.0, 0.0]), ((0.1, 0.1), [])])
def test_the_start_is_dashed_where_it_can_be_told_from_the_present(
    offset: tuple[float, float], heights: list[float]
) -> None:
    drawn = canvas()
    draw_start(drawn, STEP, np.array(offset), NO_OUTLINES)
    assert sorted({float(line[0, 1]) for line in lines_of(drawn)}) == pytest.approx(heights)
    if len(heights) == 1:
        assert [line.tolist() for line in lines_of(drawn)] == [[pytest.approx([20.0, 0]), pytest.approx([20.0, -40.0])]]


@pytest.mark.parametrize("tilt", [-0.5, 0.3])
def test_tilted_ground_is_turned_in_the_picture_and_numbered_along_itself(tilt: float) -> None:
    drawn = canvas(base=0.0, tilt=tilt)
    draw_support(drawn, Support(tilt=tilt), NOWHERE)
    turn = drawn.scene - drawn.axes.transData
    for point in ([0.0, 0.0], [70.0, -3.0]):
        assert turn.transform(point) == pytest.approx(rotate_points(np.array(point), tilt))
    assert drawn.axes.patches[0].get_transform().transform([70.0, 0.0]) == pytest.approx(
        drawn.axes.transData.transform(rotate_points(np.array([70.0, 0.0]), tilt))
    )
    finish_panel(drawn, labelled=False)
    numbers = [(text.get_text(), text.get_position()[0]) for text in drawn.axes.texts]
    assert len(numbers) > 5
    assert all(float(shown.removesuffix(" mm").replace("−", "-")) == x for shown, x in numbers)
    assert [shown.endswith(" mm") for shown, _ in numbers] == [False] * (len(numbers) - 1) + [True]
    turns = np.array([text.get_rotation() for text in drawn.axes.texts])
    assert turns == pytest.approx(np.degrees(tilt) % 360.0)
    assert all(text.get_position()[1] < -GROUND_THICKNESS / SCALE for text in drawn.axes.texts)

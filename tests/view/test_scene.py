"""Where blocks are drawn."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgba
from matplotlib.path import Path as MatplotlibPath
from numpy.typing import NDArray

from blocksim.scenario.geometry import holds, least_width, regular
from blocksim.scenario.motion import MotionPieces
from blocksim.simulation.trajectory import Frames
from blocksim.view.paints import by_block
from blocksim.view.run_data import Support, extent_of
from blocksim.view.scene import Canvas, Scene, corners, draw_scene, readable_scale, upper_sides
from blocksim.view.style import GROUND_COLOUR, block_colour, open_figure
from tests.view.made_up import blocks_at, polygons

FRAMES = blocks_at([0.1, 0.2], [0.025, 0.016], [0.0, -np.pi / 2])
PAIR = replace(blocks_at([[0.1, 0.2]], 0.025), names=("pier", "2"))


def test_a_block_turned_clockwise_lies_on_its_right_side() -> None:
    upright, lying = corners(FRAMES, 0)[0], corners(FRAMES, 1)[0]
    assert upright.tolist() == [pytest.approx(point) for point in ([84, 0], [116, 0], [116, 50], [84, 50])]
    assert lying.tolist() == [pytest.approx(point, abs=1e-9) for point in ([175, 32], [175, 0], [225, 0], [225, 32])]


WEDGE = ((-0.01, -0.01), (0.02, -0.01), (-0.01, 0.02))


def test_a_polygon_is_drawn_by_its_corners_and_all_of_it_is_in_the_picture() -> None:
    frames = polygons(blocks_at([[0.1, 0.2], [0.1, 0.2]], 0.05, np.pi / 2), WEDGE, regular(6, 0.03))
    first = corners(frames, 0)[0, :3]
    assert first == pytest.approx(np.array([[110, 40], [110, 70], [80, 40]]))
    canvas = drawn(frames, Support())
    wedge, hexagon = (points(path) for one in blocks_of(canvas) for path in one.get_paths())
    assert wedge[:3] == pytest.approx(first)
    assert len(hexagon) == 7  # and back to the first
    extent = extent_of(frames, np.arange(2))
    assert extent.left < 80.0
    assert extent.right > 226.0


@pytest.mark.parametrize(
    "shape", [WEDGE, regular(6, 0.03), regular(5, 0.03), ((-0.03, -0.01), (0.03, -0.01), (0, 0.02))]
)
def test_the_line_along_the_upper_side_is_within_the_polygon(shape: tuple[tuple[float, float], ...]) -> None:
    (ends,) = upper_sides(polygons(blocks_at([0.0]), shape))
    width = least_width(shape)
    assert all(holds(shape, (float(x), float(y)), -0.069 * width) for x, y in ends)
    assert np.hypot(*(ends[1] - ends[0])) > 0.2 * width


def test_names_are_readable_from_the_scale_at_which_they_are_written() -> None:
    scale = readable_scale(FRAMES)
    assert name_at(1.01 * scale) == "1"
    assert name_at(0.99 * scale) == ""


def name_at(points_per_mm: float) -> str:
    """Return what is written on the block of FRAMES at this scale."""
    return "".join(text.get_text() for text in drawn(FRAMES, Support(), points_per_mm).axes.texts)


def drawn(frames: Frames, support: Support, points_per_mm: float = 1.0) -> Canvas:
    """Draw the last frame."""
    frame = len(frames.time) - 1
    extent = extent_of(frames, np.arange(frame + 1), support)
    with open_figure(1.0, 1.0) as figure:
        canvas = Canvas(figure.add_axes((0.0, 0.0, 1.0, 1.0)), extent, points_per_mm)
        draw_scene(canvas, Scene(frames, support, by_block(frames)), frame)
    return canvas


def blocks_of(canvas: Canvas) -> list[PolyCollection]:
    """Return what is drawn for fixed and for free blocks."""
    return [artist for artist in canvas.axes.collections if isinstance(artist, PolyCollection)]


def points(path: MatplotlibPath) -> NDArray[np.float64]:
    """Return the points (mm) of a path."""
    return np.asarray(path.vertices, dtype=float)


def test_fixed_blocks_are_hatched_in_the_ground_s_colour_and_free_ones_keep_theirs() -> None:
    fixed, free = blocks_of(drawn(PAIR, Support(fixed=(True, False))))
    assert [points(path)[0].tolist() for path in fixed.get_paths()] == [pytest.approx([84, 0])]
    assert [points(path)[0].tolist() for path in free.get_paths()] == [pytest.approx([184, 0])]
    assert fixed.get_hatch()
    assert not free.get_hatch()
    assert np.asarray(fixed.get_facecolor()).tolist() == [list(to_rgba(GROUND_COLOUR))]
    assert np.asarray(free.get_facecolor()).tolist() == [list(to_rgba(block_colour(1)))]


def test_a_moving_fixed_block_is_dashed_where_it_was() -> None:
    frames = blocks_at([0.1, 0.11], 0.025)
    motion = MotionPieces(np.array([0.0, 1.0]), np.array([[0.0, 0.01, 0.0, 0.0]]), 0.01)
    dashed = drawn(frames, Support(fixed=(True,), motion=motion)).axes.collections[1]
    assert dashed.get_zorder() < 1.0  # under the blocks
    assert [points(path)[0].tolist() for path in dashed.get_paths()] == [pytest.approx([84.0, 0.0])]
    assert points(dashed.get_paths()[0]).max(axis=0).tolist() == pytest.approx([116.0, 50.0])

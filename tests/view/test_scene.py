"""Where blocks are drawn."""

import numpy as np
import pytest

from blocksim.scenario.geometry import holds, least_width, regular
from blocksim.simulation.trajectory import Frames
from blocksim.view.paints import by_block
from blocksim.view.run_data import Support, extent_of
from blocksim.view.scene import Canvas, Scene, draw_scene, readable_scale, upper_sides
from blocksim.view.style import open_figure
from tests.view.made_up import blocks_at, polygons

FRAMES = blocks_at([0.1, 0.2], [0.025, 0.016], [0.0, -np.pi / 2])


WEDGE = ((-0.01, -0.01), (0.02, -0.01), (-0.01, 0.02))


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

"""Where blocks are drawn."""

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from blocksim.view.scene import corners, extent_of

Floats = NDArray[np.float64]


@dataclass
class Frames:
    time: Floats
    x: Floats
    y: Floats
    angle: Floats
    size_x: Floats
    size_y: Floats
    names: tuple[str, ...]


FRAMES = Frames(
    time=np.array([0.0, 1.0]),
    x=np.array([[0.1], [0.2]]),
    y=np.array([[0.025], [0.016]]),
    angle=np.array([[0.0], [-np.pi / 2]]),
    size_x=np.array([0.032]),
    size_y=np.array([0.050]),
    names=("1",),
)


def test_a_block_turned_clockwise_lies_on_its_right_side() -> None:
    upright, lying = corners(FRAMES, 0)[0], corners(FRAMES, 1)[0]
    assert upright.tolist() == [pytest.approx(point) for point in ([84, 0], [116, 0], [116, 50], [84, 50])]
    assert lying.tolist() == [pytest.approx(point, abs=1e-9) for point in ([175, 32], [175, 0], [225, 0], [225, 32])]


def test_the_scene_is_as_large_as_the_corners_with_one_margin() -> None:
    extent = extent_of(FRAMES, np.array([0, 1]))
    points = np.concatenate([corners(FRAMES, 0)[0], corners(FRAMES, 1)[0]])
    margins = [
        points[:, 0].min() - extent.left,
        extent.right - points[:, 0].max(),
        extent.top - points[:, 1].max(),
    ]
    assert margins == [pytest.approx(margins[0])] * 3


def test_the_scene_holds_every_corner_of_every_frame_and_the_ground() -> None:
    extent = extent_of(FRAMES, np.array([0, 1]))
    assert extent.left < 84.0
    assert extent.right > 225.0
    assert extent.bottom < 0.0
    assert extent.top > 50.0
    assert extent.width < 1.2 * (225 - 84)

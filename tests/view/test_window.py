"""Which part of the plane a strip shows."""

import numpy as np
import pytest

from blocksim.scenario import PlacedSegment
from blocksim.scenario.motion import MotionPieces
from blocksim.simulation.trajectory import Frames
from blocksim.view.run_data import Extent, Support, extent_of, rotate_points
from blocksim.view.scene import corners
from tests.view.made_up import blocks_at


def frames(*places: tuple[float, float, float]) -> Frames:
    """Return frames of one block of 32 x 50 mm at these x, y (m) and angles (rad)."""
    return blocks_at(*np.array(places).T)


def window(shown: Frames, support: Support | None = None) -> Extent:
    return extent_of(shown, np.arange(len(shown.time)), support)


def wall(x0: float, y0: float, x1: float, y1: float) -> PlacedSegment:
    ends = {"extends_start": False, "extends_end": False, "touches_start": True, "touches_end": True}
    return PlacedSegment(x0, y0, x1, y1, material=None, **ends)


FALLING = frames((0.1, 0.025, 0.0), (0.2, 0.016, -np.pi / 2))


def test_the_scene_holds_every_corner_of_every_frame_with_one_margin_and_the_ground() -> None:
    extent = window(FALLING)
    points = np.concatenate([corners(FALLING, frame)[0] for frame in (0, 1)])
    (left, _), (right, top) = points.min(axis=0), points.max(axis=0)
    margin = left - extent.left
    assert [extent.right - right, extent.top - top] == [pytest.approx(margin)] * 2
    assert 0.0 < margin < 0.1 * (right - left)
    assert extent.bottom < extent.base == 0.0


def test_the_ground_below_a_block_is_shown_however_deep_but_no_other() -> None:
    cliff = Support(profile=((0.12, 0.0), (0.12, -10.0)))
    staying, falling = (
        window(frames((0.1, 0.025, 0.0)), cliff),
        window(frames((0.1, 0.025, 0.0), (0.2, 0.0, 0.0)), cliff),
    )
    assert -100.0 < staying.base < 0.0  # the cliff is seen, its foot is not
    assert staying.right > 120.0
    assert falling.base == pytest.approx(-10000.0)
    assert falling.bottom < falling.base


def test_corners_of_the_ground_and_walls_are_shown_where_they_are_near_and_not_elsewhere() -> None:
    block = frames((0.1, 0.025, 0.0))
    plain = window(block)
    assert window(block, Support(profile=((0.05, 0.01), (0.06, 0.0)))).left < 50.0 < plain.left
    for hidden in (
        Support(profile=((-5.0, 0.01), (-4.0, 0.0))),
        Support(profile=((-300.0, 0.0), (0.1, 0.0), (300.0, 0.0))),  # level
        Support(walls=(wall(3.0, 0.0, 3.0, 100.0),)),
    ):
        assert window(block, hidden) == plain
    near = window(block, Support(walls=(wall(0.15, 0.0, 0.15, 100.0),)))
    assert 150.0 < near.right < 200.0
    assert 50.0 < near.top < 250.0  # no more of a high wall than shows that it continues


def test_a_moving_support_is_shown_wherever_it_comes() -> None:
    block = frames((0.1, 0.025, 0.0), (0.1, 0.025, 0.0))
    motion = MotionPieces(np.array([0.0, 1.0]), np.array([[0.0, -0.03, 0.0, 0.0]]), -0.03)
    pier = (wall(0.15, 0.0, 0.15, 0.05),)
    still, sunk = (
        window(block, Support(walls=pier)),
        window(block, Support(walls=pier, direction=(0.0, 1.0), motion=motion)),
    )
    assert still.base == 0.0
    assert sunk.base == pytest.approx(-30.0)
    assert sunk.bottom < -30.0
    moved = window(block, Support(walls=(wall(0.08, 0.0, 0.08, 0.05),), motion=motion))
    assert moved.left < 50.0


def test_tilted_ground_is_turned_so_that_gravity_points_down() -> None:
    tilt = np.radians(30.0)
    sliding = frames((0.0, 0.025, 0.0), (1.0, 0.025, 0.0))
    extent = window(sliding, Support(tilt=tilt))
    inside = np.concatenate([corners(sliding, frame)[0] for frame in (0, 1)])
    pictured = rotate_points(inside, tilt)
    assert pictured[:, 0].min() > extent.left
    assert pictured[:, 0].max() < extent.right
    assert pictured[:, 1].max() < extent.top
    assert extent.tilt == tilt
    assert pictured[6, 1] - pictured[2, 1] == pytest.approx(1000.0 * np.sin(tilt))  # the same corner has risen
    gravity = np.array([-np.sin(tilt), -np.cos(tilt)])  # as the world has it, along and across the ground
    assert rotate_points(gravity, tilt) == pytest.approx([0.0, -1.0])

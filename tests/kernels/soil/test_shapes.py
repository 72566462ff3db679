"""Distances of a disc's centre from the exact shapes of bodies."""

import math
from typing import Any

import numpy as np
import pytest

from blocksim.kernels.soil.contact import from_body
from blocksim.simulation.schemes import build_scene
from tests.soils import LEFT, column, scene

RADIUS = 0.0025


def bodies(**changes: Any) -> Any:
    return build_scene(scene(column(0.04, 0.04, 0.005), **changes)).world.bodies


@pytest.mark.parametrize(
    ("u", "v", "distance", "normal"),
    [
        (0.03, 0.0, 0.01, (1.0, 0.0)),
        (0.0, -0.021, 0.001, (0.0, -1.0)),
        (0.023, 0.024, 0.005, (0.6, 0.8)),
        (-0.019, 0.0, -0.001, (-1.0, 0.0)),
    ],
)
def test_a_rectangle_has_faces_and_corners_however_it_is_turned(
    u: float, v: float, distance: float, normal: tuple[float, float]
) -> None:
    block = bodies()[0]
    for angle in (0.0, 0.4, 2.0):
        block.cos, block.sin = math.cos(angle), math.sin(angle)
        turn = np.array([[block.cos, -block.sin], [block.sin, block.cos]])
        x, y = (block.x, block.y) + turn @ (u, v)
        found, nx, ny = from_body(block, False, x, y, RADIUS)
        assert found == pytest.approx(distance, abs=1e-12)
        assert (nx, ny) == pytest.approx(tuple(turn @ normal), abs=1e-9)


def test_a_wall_has_one_face_and_a_free_end() -> None:
    wall = bodies(walls=[LEFT])[1]
    assert from_body(wall, False, 0.002, 0.1, RADIUS) == pytest.approx((0.002, 1.0, 0.0), abs=1e-9)
    assert from_body(wall, False, -0.0005, 0.1, RADIUS)[0] == pytest.approx(-0.0005)  # pressed in
    assert from_body(wall, False, -0.002, 0.1, RADIUS)[0] == math.inf  # behind
    assert from_body(wall, False, 0.0, 0.301, RADIUS)[0] == pytest.approx(0.001)  # on its end
    assert from_body(wall, False, 0.002, -0.02, RADIUS)[0] == math.inf  # that end stands on the ground


def test_an_edge_of_a_profile_is_touched_once() -> None:
    profile = [[-0.2, 0.0], [0.2, 0.0], [0.2, -0.1], [0.5, -0.1]]
    pieces = bodies(ground={"profile": profile})[1:-1]
    found = [from_body(piece, False, 0.201, 0.001, RADIUS)[0] for piece in pieces]
    assert sorted(one for one in found if one < RADIUS) == pytest.approx([math.hypot(0.001, 0.001)])


def test_the_ground_is_a_half_plane() -> None:
    ground = bodies()[-1]
    assert from_body(ground, True, 5.0, 0.001, RADIUS) == pytest.approx((0.001, 0.0, 1.0))

"""A particle of soil beside bodies: distances from their exact shapes, and what presses at the start."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from blocksim.kernels.common.jit import config
from blocksim.kernels.soil import contact
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


pytestmark = pytest.mark.skipif(not config.DISABLE_JIT, reason="calls kernels without records")
record: Any = SimpleNamespace


@pytest.mark.parametrize(("apart", "touches"), [(3e-4, True), (3e-3, False)])
def test_particle_that_nearly_touches_a_body_at_the_start_is_pressed_against_it(
    monkeypatch: pytest.MonkeyPatch, apart: float, touches: bool
) -> None:
    monkeypatch.setattr(contact, "from_body", lambda *_: (1.0 + apart, 0.0, 1.0))
    touch = record(particle=0, body=0, normal_force=0.0)
    ground: Any = record(contact_class=0)
    table: Any = {(0, 0): record(normal_stiffness=1e9)}
    soils = record(
        controls=[record(radius=1.0, touch_count=1)],
        touches=[touch],
        points=[record(x=0.0, y=1.0)],
        states=[record(kind=0, sxx=-1.0, sxy=0.0, syy=-1.0)],
        kinds=[record(density=1.0, volume=1.0)],
        interactions=table,
    )
    bodies = type("Rows", (list,), {"size": 1})([ground])
    contact.preload(soils, record(controls=[record(gravity_x=0.0, gravity_y=-1.0)], bodies=bodies))
    assert (touch.normal_force > 0.0) == touches

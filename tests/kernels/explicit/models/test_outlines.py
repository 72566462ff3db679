"""Polygons in the `surface` model: contact points of rectangles given as outlines, restitution, energy, momentum."""

from __future__ import annotations

from math import cos, pi, sin
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.kernels.explicit.models.surface import near_slots
from blocksim.kernels.explicit.sides import MOST_CORNERS
from blocksim.verification.scene import CaseScene

if TYPE_CHECKING:
    from blocksim.kernels.common.arrays import World

Outline = list[list[float]]
RADIUS = 0.02  # m
ABOVE = 1e-6  # m, from where blocks fall


def regular(corners: int) -> Outline:
    return [[RADIUS * cos(2.0 * pi * k / corners), RADIUS * sin(2.0 * pi * k / corners)] for k in range(corners)]


def rectangle(width: float, height: float) -> Outline:
    x, y = 0.5 * width, 0.5 * height
    return [[-x, -y], [x, -y], [x, y], [-x, y]]


# sides of two (m), place beside and tilt of the upper one, stiffness scale: the overlap is as deep as it is long
AT_ENDS = [
    ((0.0224, 0.0151), (0.0367, 0.0138), -0.0294, -0.0015, 0.003),
    ((0.0382, 0.0245), (0.0145, 0.0117), 0.02623, 0.0, 0.01),
]


@pytest.mark.parametrize(("below", "above", "x", "angle", "scale"), AT_ENDS)
def test_rectangles_given_as_outlines_keep_their_energy_near_the_ends_of_faces(
    below: tuple[float, float], above: tuple[float, float], x: float, angle: float, scale: float
) -> None:
    low = min(sin(angle) * u + cos(angle) * v for u, v in rectangle(*above))
    bodies: list[dict[str, object]] = [
        {"y": 1.0, "outline": rectangle(*below)},
        {
            "x": x,
            "y": 1.0 + 0.5 * below[1] - low + ABOVE,
            "angle": angle,
            "velocity": [0.0, -1.0],
            "outline": rectangle(*above),
        },
    ]
    run = CaseScene(bodies, gravity=0.0, restitution=1.0, friction=0.0, contact={"stiffness_scale": scale}).start()
    before = run.kinetic
    run.to_step(490)
    assert run.contacts == 0
    assert run.bodies[1].spin != 0.0
    assert run.mechanical == pytest.approx(before, rel=1e-3)


def test_only_corners_near_the_other_body_are_candidates() -> None:
    bodies = [
        {"y": 0.1, "outline": regular(3), "angle": 0.5 * pi},
        {"y": 0.1 - 0.011 - RADIUS, "outline": regular(6), "angle": 0.5 * pi},
    ]
    world: Any = CaseScene(bodies, gravity=0.0).start().scene
    found = np.zeros(2 * MOST_CORNERS, dtype=np.int64)
    count = near_slots(world, 0, 1, 1.1e-3, found)
    assert found[:count].tolist() == [MOST_CORNERS]


def test_no_end_of_a_face_is_lost_between_two_sharp_corners() -> None:
    """As at the back of an arch: where sharp ends lie on one another, neither corner need be inside the other body."""
    depth = 1e-6
    below = [[-0.02, -0.02], [0.02, -0.02], [0.03, 0.02], [-0.03, 0.02]]
    above = [[-0.03, -0.02], [0.03, -0.02], [0.02, 0.02], [-0.02, 0.02]]
    apart = 0.08 * 7.0 / 15.0  # m, of the centroids
    for beside in (0.0, 0.1 * depth, -0.2 * depth):  # within a quarter of the depth: that is how far sides recede there
        bodies = [{"y": 0.1, "outline": below}, {"x": beside, "y": 0.1 + apart, "outline": above}]

        def press(world: World) -> None:
            world.bodies[1].y -= depth

        run = CaseScene(bodies, gravity=0.0, restitution=1.0).start(press)
        contacts = run.contact_records
        assert contacts.depth == pytest.approx([depth, depth], rel=1e-6)
        assert run.bodies[1].ay * run.bodies[1].mass == pytest.approx(contacts.normal_force.sum(), rel=1e-9)
        assert abs(run.bodies[1].spin_rate) * 0.03 < 1e-3 * run.bodies[1].ay
        run.to_step(3)
        assert run.contacts == 2

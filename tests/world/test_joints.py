"""Joints of blocks as they are placed: their ends, normals and partners."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import pytest

from blocksim.scenario import place_bodies, place_segments
from blocksim.verification.scene import scenario_of
from blocksim.world.rigid_step import ContactJoint, joints_of

if TYPE_CHECKING:
    from collections.abc import Mapping

NEAR = 1e-5  # m


BRICK = {"width": 0.2, "height": 0.1, "length": 1.0}
TRIANGLE = {"outline": [[-0.1, -0.05], [0.1, -0.05], [0.0, 0.1]], "length": 1.0}


def joints(*bodies: Mapping[str, Any], **tables: Any) -> list[ContactJoint]:
    """Return the joints of bricks, or of other bodies, the fixed ones supports."""
    rigid = {"time": {"scheme": "nonsmooth", "end": 1.0}, "friction": {"block_block": 0.6, "block_ground": 0.6}}
    scenario = scenario_of([BRICK | {**body} for body in bodies], **rigid, **tables)
    placed = place_bodies(scenario)
    free = {i for i, body in enumerate(placed) if not body.fixed}
    level = scenario.ground.profile is None
    return joints_of(placed, place_segments(scenario), free, NEAR, level=level)


def ends(joint: ContactJoint) -> list[tuple[float, float]]:
    return sorted((round(x, 9), round(y, 9)) for x, y in joint.points)


def test_ends_of_a_joint_are_corners_of_either_block_and_corners_alone_are_no_joint() -> None:
    """Two bricks below, one across both, and one whose corner only meets that of another."""
    found = joints({"x": 0.1, "y": 0.05}, {"x": 0.3, "y": 0.05}, {"x": 0.25, "y": 0.15}, {"x": 0.05, "y": 0.15})
    by_pair = {(joint.one, joint.other): joint for joint in found}
    assert set(by_pair) == {(0, 1), (0, 2), (1, 2), (0, 3), (2, 3), (0, 4), (1, 4)}
    assert ends(by_pair[0, 2]) == [(0.15, 0.1), (0.2, 0.1)]
    assert by_pair[0, 2].normal == pytest.approx((0.0, 1.0))
    assert by_pair[0, 4].normal == pytest.approx((0.0, -1.0))  # towards the ground, which comes last
    assert by_pair[0, 1].normal == pytest.approx((1.0, 0.0))
    assert math.dist(*by_pair[1, 2].points) == pytest.approx(0.15)


def test_a_corner_on_a_face_is_a_joint_of_one_point_and_fixed_blocks_have_none_among_themselves() -> None:
    tip = {**TRIANGLE, "angle": math.pi, "x": 0.1, "y": 0.2}
    (joint,) = [one for one in joints({"x": 0.1, "y": 0.05, "fixed": True}, tip) if len(one.points) == 1]
    assert (joint.one, joint.other) == (0, 1)
    assert joint.normal == pytest.approx((0.0, 1.0))
    (point,) = joint.points
    assert point == pytest.approx((0.1, 0.1))
    both = ({"x": 0.1, "y": 0.05, "fixed": True}, {"x": 0.1, "y": 0.15, "fixed": True})
    assert len(joints(*both, {"x": 0.1, "y": 0.25})) == 1


def test_blocks_stand_on_pieces_of_ground_and_lean_on_walls() -> None:
    ground = {"profile": [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [2.0, 0.0]]}
    walls = [{"from": [0.3, 1.0], "to": [0.3, 2.0], "material": "aluminium"}]
    found = joints({"x": 0.2, "y": 1.05}, {"x": 1.0, "y": 1.15}, ground=ground, walls=walls)
    normals = sorted((round(one.normal[0], 9), round(one.normal[1], 9)) for one in found)
    assert normals == [(0.0, -1.0), (1.0, 0.0)]

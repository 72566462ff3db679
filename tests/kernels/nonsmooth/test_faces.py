"""Faces, edges and points of the manifold, piece by piece, and the ground below a block."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, strategies as st

from blocksim.kernels.nonsmooth.arrays import AWAY, FAR
from blocksim.kernels.nonsmooth.faces import (
    Block,
    Edge,
    Face,
    block_ahead,
    clip,
    face_on,
    in_frame,
    side_numbered,
    side_opposite,
)
from tests.kernels.nonsmooth.references import corners, meet, places_of

if TYPE_CHECKING:
    from blocksim.kernels.common.arrays import Record
    from tests.kernels.conftest import MakeBody

angles = st.floats(-4.0, 4.0)
places = st.floats(-0.05, 0.05)


@given(angle=angles, way=angles)
def test_face_opposite_a_direction_looks_most_against_it(make_body: MakeBody, angle: float, way: float) -> None:
    body = make_body(0.1, -0.3, angle, width=0.03, height=0.02)
    block = Block(body.x, body.y, body.cos, body.sin, body.half_x, body.half_y)
    side, _ = side_opposite(math.cos(way), math.sin(way), block, None, 0)
    face = face_on(block, side)
    (number,) = [k for k in range(4) if side_numbered(block, None, k) == side]
    assert face.nx * math.cos(way) + face.ny * math.sin(way) <= -math.sqrt(0.5) + 1e-12
    turned = angle + number * math.pi / 2
    assert (face.nx, face.ny) == pytest.approx((math.cos(turned), math.sin(turned)), abs=1e-12)
    assert (face.distance, face.right) == ((0.015, 0.01) if number in {0, 2} else (0.01, 0.015))
    assert face.left == -face.right


@given(angle=angles, right=places, above=places)
def test_frame_of_a_face_counts_to_the_right_and_from_the_face_on(angle: float, right: float, above: float) -> None:
    """Seen from inside the body, looking out, the right is at hand where the normal has turned clockwise."""
    n = np.array([math.cos(angle), math.sin(angle)])
    face = Face(float(n[0]), float(n[1]), 0.2, 0.1, 0.015, -0.01, 0.01)
    x, y = (0.2, 0.1) + (0.015 + above) * n + right * np.array([n[1], -n[0]])
    assert in_frame(face, float(x), float(y)) == pytest.approx((right, above), abs=1e-15)


@given(left=places, width=st.floats(1e-4, 0.1), gap=places, rise=places, half=st.floats(0.005, 0.05), middle=places)
def test_clipped_edge_stays_on_its_line_and_over_the_face(
    left: float, width: float, gap: float, rise: float, half: float, middle: float
) -> None:
    face = Face(0.0, 1.0, 0.0, 0.0, 0.0, middle - half, middle + half)
    whole = Edge(left, gap, left + width, gap + rise, False, False)
    cut = clip(whole, face)
    if left >= face.right or left + width <= face.left:
        assert cut.left >= cut.right or math.isclose(cut.left, cut.right)
        return
    assert (cut.left, cut.right) == (max(left, face.left), min(left + width, face.right))
    for place, height in ((cut.left, cut.left_gap), (cut.right, cut.right_gap)):
        assert height == pytest.approx(gap + rise * (place - left) / width, abs=1e-12)
    # ends of the face can touch
    assert (bool(cut.is_left), bool(cut.is_right)) == (left < face.left, left + width > face.right)


def test_block_ahead_turns_to_third_order_in_the_angle() -> None:
    block = Block(0.1, 0.2, math.cos(0.4), math.sin(0.4), 0.016, 0.0125)
    errors = []
    for ahead in (2e-3, 1e-3):
        moved = block_ahead(block, 0.5, -0.7, 30.0, ahead)
        assert (moved.x, moved.y) == pytest.approx((0.1 + 0.5 * ahead, 0.2 - 0.7 * ahead), abs=1e-15)
        angle = 0.4 + 30.0 * ahead
        errors.append(math.hypot(moved.cos - math.cos(angle), moved.sin - math.sin(angle)))
    assert 0.0 < errors[1] < 0.13 * errors[0] < 0.13 * 0.06**3


def on_ground(body: Record, ground: Record, margin: float) -> Record:
    return meet(body, ground, margin, is_ground=True)


@given(angle=angles, height=st.floats(-2e-3, 2e-3), level=places)
def test_ground_is_met_by_all_corners_within_the_margin(
    make_body: MakeBody, angle: float, height: float, level: float
) -> None:
    margin = 1.5e-3
    body, ground = make_body(0.3, 0.0, angle), make_body(7.0, level, mass=1.0)
    body.y = level + height - corners(body)[:, 1].min()
    near = [corner for corner in corners(body).tolist() if corner[1] - level <= margin]
    near.sort(reverse=True)  # along the tangent of an upward normal, which points to the left
    constraint = on_ground(body, ground, margin)
    assert bool(constraint.reach == AWAY) is (not near)
    if not near:
        return
    assert (constraint.nx, constraint.ny) == (0.0, 1.0)
    gaps = np.array([constraint.gap_one, constraint.gap_two])
    assert gaps[gaps < FAR] == pytest.approx([y - level for _, y in near], abs=1e-12)
    found = places_of(constraint, body, of_a=True)[gaps < FAR]
    assert found == pytest.approx(np.array([(x, level) for x, _ in near]), abs=1e-12)

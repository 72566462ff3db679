"""Rotations and distances of rectangles against independent geometry."""

from __future__ import annotations

from math import cos, sin
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, strategies as st

from blocksim.kernels.common.arrays import BODY, zeros
from blocksim.kernels.common.shapes import corner_offset, ground_gap, place_corners, separation, slab_depth, turn
from blocksim.kernels.common.tolerances import END_RATIO, SMALL_TURN
from tests.kernels.references import apart as largest_gap, corners, distances, turning
from tests.kernels.scenes import make_body

if TYPE_CHECKING:
    from blocksim.kernels.common.arrays import Record

places = st.floats(-0.06, 0.06)
sides = st.floats(1e-3, 0.05)
angles = st.floats(-7.0, 7.0)


def points_of(body: Record, count: int = 15) -> np.ndarray:
    """Return a grid of points that fills a body."""
    u, v = np.meshgrid(np.linspace(-1.0, 1.0, count), np.linspace(-1.0, 1.0, count))
    local = np.stack([u.ravel() * body.half_x, v.ravel() * body.half_y], axis=1)
    return np.asarray(local @ turning(body.angle) + (body.x, body.y))


@pytest.mark.parametrize("by", [0.0, 1e-9, 1e-3, SMALL_TURN * (1 - 1e-9), SMALL_TURN, SMALL_TURN * (1 + 1e-9), -0.049])
def test_turn_agrees_with_the_library_on_both_sides_of_the_series(by: float) -> None:
    assert turn(1.0, 0.0, by) == pytest.approx((cos(by), sin(by)), abs=1e-14)


@given(x=places, y=places, one=angles, two=angles, w=sides, h=sides)
def test_separation_is_the_largest_gap_and_never_exceeds_the_distance(
    *, x: float, y: float, one: float, two: float, w: float, h: float
) -> None:
    a = make_body(x, y, one)
    b = make_body(0.0, 0.01, two, width=w, height=h)
    gap = separation(a, b)
    assert gap == pytest.approx(largest_gap(a, b), abs=1e-15)
    assert gap == pytest.approx(separation(b, a), abs=1e-15)
    nearest = min(distances(points_of(a), b).min(), distances(points_of(b), a).min())
    assert gap <= nearest + 1e-15
    assert (gap <= 0.0) or (nearest > 0.0)


@given(y=places, angle=angles, w=sides, h=sides)
def test_ground_gap_is_the_height_of_the_lowest_corner(y: float, angle: float, w: float, h: float) -> None:
    body = make_body(0.3, y, angle, width=w, height=h)
    assert ground_gap(body) == pytest.approx(corners(body)[:, 1].min(), abs=1e-15)


@given(angle=angles, w=sides, h=sides)
def test_ways_to_the_corners_lead_to_the_corners(angle: float, w: float, h: float) -> None:
    body = make_body(0.1, -0.2, 0.0, width=w, height=h)
    body.angle, body.cos, body.sin = angle, cos(angle), sin(angle)
    place_corners(body)
    ways = np.array([corner_offset(body, corner) for corner in range(4)])
    assert ways == pytest.approx(corners(body) - (body.x, body.y), abs=1e-15)


@given(x=st.floats(-0.6, 0.6), depth=st.floats(-1e-3, 0.02))
def test_depth_below_a_slab_is_the_distance_from_its_line_except_far_below_its_ends(x: float, depth: float) -> None:
    slab = zeros(1, BODY)[0]
    slab.half_x, slab.half_y = 0.5, 0.01
    found = slab_depth(x, slab.half_y - depth, slab)
    inside = 0.5 - abs(x)
    if depth <= 0.0 or inside < 0.0 or depth > 1.001 * END_RATIO * inside:
        assert found == 0.0
    elif 1e-12 < depth < 0.999 * END_RATIO * inside:
        assert found == pytest.approx(depth, abs=1e-16)

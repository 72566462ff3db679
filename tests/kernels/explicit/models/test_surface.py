"""Which corners touch which faces, and how deep."""

from __future__ import annotations

from math import radians
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import assume, given, strategies as st

from blocksim.kernels.common.arrays import CONTACT, CONTACTS, PAIR, POINT, SLOTS, zeros
from blocksim.kernels.common.shapes import ground_gap, separation
from blocksim.kernels.common.tolerances import CONE_TOLERANCE
from blocksim.kernels.explicit.contact import pair_forces
from blocksim.kernels.explicit.models.surface import (
    block_points,
    corner_seen,
    corners_near,
    face_met,
    find_points,
    ground_points,
    near_slots,
)
from blocksim.kernels.explicit.sides import MOST_CORNERS, UPPER, corner_of, side_normal
from tests.kernels.rectangles import corners, in_frame

if TYPE_CHECKING:
    from blocksim.kernels.common.arrays import Record
    from tests.kernels.conftest import MakeBody, Pose

OF_B = MOST_CORNERS  # slots from there on
ALL = np.array([*range(4), *range(OF_B, OF_B + 4)])
RIGHT = 1  # a face
W, H = 0.032, 0.025


def place_of(body: Record, corner: int) -> np.ndarray:
    return np.asarray(corners(body)[corner])


def points_and_duplicates(a: Record, b: Record, touching: tuple[int, ...] = ()) -> tuple[list[Any], list[int]]:
    """Return the points between two blocks, some of whose corners are in contact, and the slots of duplicates."""
    points, contacts, pair = zeros(SLOTS, POINT), zeros(CONTACTS, CONTACT), zeros(1, PAIR)[0]
    contacts.slot[: len(touching)] = touching
    pair.near, pair.active = SLOTS, len(touching)
    pair.duplicates = 0xFFFFFFFF  # of the step before
    count = block_points(a, b, pair, ALL, contacts, points, None)
    return list(points[:count]), [k for k in range(32) if (int(pair.duplicates) >> k) & 1]


def points_between(a: Record, b: Record) -> list[Any]:
    return points_and_duplicates(a, b)[0]


def test_corners_and_faces_count_counter_clockwise_from_the_lower_left_and_from_below(make_body: MakeBody) -> None:
    body = make_body(angle=0.3)
    for k in range(4):
        side = corner_of(body, None, k)
        assert (np.sign(side.x), np.sign(side.y)) == ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))[k]
        assert (side.distance, side.half) == ((H / 2, W / 2), (W / 2, H / 2))[k % 2]
        turned = 0.3 + (k - 1) * np.pi / 2
        assert side_normal(body, None, k) == pytest.approx((np.cos(turned), np.sin(turned)), abs=1e-15)


@given(x=st.floats(-0.035, 0.035), y=st.floats(-0.03, 0.03), one=st.floats(-4.0, 4.0), two=st.floats(-4.0, 4.0))
def test_every_contact_point_is_a_corner_inside_the_other_block(
    make_body: MakeBody, x: float, y: float, one: float, two: float
) -> None:
    a, b = make_body(x, y, one), make_body(0.0, 0.0, two, width=0.02)
    found = points_between(a, b)
    for point in found:
        owner, touched = (a, b) if point.slot < OF_B else (b, a)
        corner = place_of(owner, point.slot % OF_B)
        assert [point.x, point.y] == pytest.approx(corner, abs=1e-15)
        local = in_frame(corner, touched)
        outward = np.array([(0, -1), (1, 0), (0, 1), (-1, 0)][point.face])
        half = abs(outward @ (touched.half_x, touched.half_y))
        assert point.depth == pytest.approx(half - outward @ local, abs=1e-15)
        assert point.depth > 0.0
        sign = 1.0 if point.slot < OF_B else -1.0  # from b to a
        assert [point.nx, point.ny] == pytest.approx(sign * np.array(side_normal(touched, None, point.face)))
    assert len({point.slot for point in found}) == len(found)
    assert not found or separation(a, b) < 0.0


@given(x=st.floats(-0.03, 0.03), one=st.floats(-0.7, 0.7), depth=st.floats(1e-9, 1e-4))
def test_shallow_overlap_of_two_blocks_is_always_found(make_body: MakeBody, x: float, one: float, depth: float) -> None:
    a, b = make_body(x, 0.0, one), make_body(0.0, 0.0)
    a.y = 0.03
    a.y -= separation(a, b) + depth  # from above: its gap along y is the largest one
    assume(separation(a, b) < 0.0)
    assert points_between(a, b)


@pytest.mark.parametrize("shift", [0.0, 1e-9, -1e-9, 0.01])
@pytest.mark.parametrize("depth", [1e-9, 1e-6])
def test_stacked_blocks_touch_at_the_top_and_not_at_the_sides(make_body: MakeBody, shift: float, depth: float) -> None:
    found = points_between(make_body(shift, H - depth), make_body())
    assert len(found) == 2
    for point in found:
        assert [point.nx, point.ny] == pytest.approx([0.0, 1.0], abs=1e-15)
        assert point.depth == pytest.approx(depth, rel=1e-6)
    assert abs(found[0].x - found[1].x) == pytest.approx(W - abs(shift))


def face_of(make_body: MakeBody, x: float, y: float, corner: int) -> tuple[int, float]:
    """Return the face of a block, and the overlap, that a corner of one which is not turned touches at a place."""
    owner, touched = make_body(), make_body()
    own = place_of(owner, corner)
    owner.x, owner.y = x - own[0], y - own[1]
    face, depth, _ = face_met(corner_seen(owner, corner, touched, None), touched, None, CONE_TOLERANCE)
    return face, depth


def test_corner_touches_only_faces_within_its_normal_cone(make_body: MakeBody) -> None:
    tiny = 1e-9
    # a lower right corner near the upper right one, nearer to the side than to the top
    face, depth = face_of(make_body, W / 2 - tiny, H / 2 - 2 * tiny, 1)
    assert face == UPPER
    assert depth == pytest.approx(2 * tiny, rel=1e-6)
    # its mirror image at the upper left
    face, depth = face_of(make_body, -W / 2 + tiny, H / 2 - 2 * tiny, 0)
    assert face == UPPER
    assert depth == pytest.approx(2 * tiny, rel=1e-6)
    # a lower left corner at the upper right one may touch either: the nearest counts
    assert face_of(make_body, W / 2 - tiny, H / 2 - 2 * tiny, 0)[0] == RIGHT
    assert face_of(make_body, W / 2 - 2 * tiny, H / 2 - tiny, 0)[0] == UPPER


def test_upper_corner_never_touches_the_top_of_another_block(make_body: MakeBody) -> None:
    assert CONE_TOLERANCE < 1.0
    assert face_of(make_body, 0.0, H / 2 - 1e-6, 3)[0] != UPPER


def test_aligned_blocks_keep_the_corner_that_was_in_contact(make_body: MakeBody) -> None:
    a, b = make_body(0.0, H - 1e-6), make_body()
    for touching, duplicates in (((), [18, 19]), ((0, 1), [18, 19]), ((18, 19), [0, 1]), ((1, 19), [0, 18])):
        points, found = points_and_duplicates(a, b, touching)
        assert sorted(point.slot for point in points) == list(touching or (0, 1))
        assert found == duplicates


def test_corners_that_meet_no_other_have_no_duplicates(make_body: MakeBody) -> None:
    points, duplicates = points_and_duplicates(make_body(0.003, H - 1e-6), make_body())
    assert [point.slot for point in points] == [0, 18]
    assert duplicates == []


def test_aligned_blocks_keep_the_deeper_corner_without_history(make_body: MakeBody) -> None:
    a, b = make_body(0.0, H - 1e-6, 1e-6), make_body()
    found = points_between(a, b)
    assert len(found) == 2
    every = {point.slot: point.depth for point in found}
    assert max(every.values()) == pytest.approx(1e-6 + 0.016e-6, rel=1e-3)


@given(y=st.floats(-0.01, 0.03), angle=st.floats(-7.0, 7.0))
def test_corners_below_the_ground_touch_it(make_body: MakeBody, y: float, angle: float) -> None:
    body, points = make_body(0.4, y, angle), zeros(SLOTS, POINT)
    count = ground_points(body, 4, ALL, 0.0, points, None)
    heights = [place_of(body, k)[1] for k in range(4)]
    assert [point.slot for point in points[:count]] == [k for k in range(4) if heights[k] < 0.0]
    for point in points[:count]:
        assert point.depth == pytest.approx(-heights[point.slot])
        assert (point.nx, point.ny) == (0.0, 1.0)
    assert (count > 0) == (ground_gap(body) < 0.0) or abs(ground_gap(body)) < 1e-15


@pytest.mark.parametrize(
    ("angle", "slots"), [(0.0, [0, 1]), (0.3, [0, 1]), (-1.2, [1, 2]), (3.0, [2, 3]), (2.0, [0, 3])]
)
def test_block_deep_under_ground_has_its_two_deepest_points_and_no_room_is_overrun(
    pose: Pose, angle: float, slots: list[int]
) -> None:
    world = pose((0.0, -0.05, angle), (0.1, 0.0124, 0.0))
    assert [(pair.a, pair.b, pair.near) for pair in world.pairs[:2]] == [(0, 2, 4), (1, 2, 2)]
    world.contacts[1] = beside = np.full(CONTACTS, 7.0).astype(world.contacts.dtype).view(np.recarray)
    assert find_points(world, 0) == CONTACTS
    assert world.points.slot[:CONTACTS].tolist() == slots
    pair_forces(world, 0, 1e-6)
    assert world.pairs[0].active == CONTACTS
    assert world.contacts[0].slot.tolist() == slots
    heights = [place_of(world.bodies[0], k)[1] for k in slots]
    assert world.contacts[0].depth == pytest.approx(-np.array(heights))
    assert world.contacts[1].tobytes() == beside.tobytes()
    assert not world.contacts["normal_force"][2:].any()


@given(x=st.floats(-0.02, 0.02), y=st.floats(-0.02, 0.02), one=st.floats(-4.0, 4.0), two=st.floats(-4.0, 4.0))
def test_two_blocks_in_one_place_have_two_points_at_most(
    pose: Pose, x: float, y: float, one: float, two: float
) -> None:
    world = pose((x, 1.0 + y, one), (0.0, 1.0, two))
    count = find_points(world, 0)
    assert count <= CONTACTS
    pair_forces(world, 0, 1e-6)
    assert world.pairs[0].active == count
    assert not world.contacts["normal_force"][1:].any()


@given(x=st.floats(-0.06, 0.06), y=st.floats(-0.06, 0.06), one=st.floats(-4.0, 4.0), two=st.floats(-4.0, 4.0))
def test_corner_is_near_when_it_lies_in_the_grown_rectangle(
    make_body: MakeBody, x: float, y: float, one: float, two: float
) -> None:
    a, b = make_body(x, y, one), make_body(0.0, 0.0, two)
    expected = []
    for corner in range(4):
        local = np.abs(in_frame(place_of(a, corner), b))
        beyond = float(max(local[0] - b.half_x, local[1] - b.half_y))
        assume(abs(beyond - 0.01) > 1e-12)
        if beyond <= 0.01:
            expected.append(corner)
    slots = np.full(SLOTS, 99)
    slots[0] = 7  # there already
    for first in (0, OF_B):
        count = corners_near(a, b, 0.01, first, slots, 1, None)
        assert slots[:count].tolist() == [7] + [first + corner for corner in expected]
        assert (slots[count:] == 99).all()  # there is no room for more


@given(y=st.floats(-0.02, 0.06), angle=st.floats(-4.0, 4.0))
def test_corner_is_near_the_ground_when_it_is_below_the_height(pose: Pose, y: float, angle: float) -> None:
    world, slots = pose((0.3, y, angle)), np.full(SLOTS, 99)
    heights = [place_of(world.bodies[0], k)[1] for k in range(4)]
    assume(min(abs(height - 0.02) for height in heights) > 1e-12)
    count = near_slots(world, 0, 1, 0.02, slots)
    assert slots[:count].tolist() == [k for k in range(4) if heights[k] <= 0.02]


def test_candidates_of_a_pair_are_corners_of_the_first_and_then_of_the_second(pose: Pose) -> None:
    world, slots = pose((0.0, 1.0 + H, 0.0), (0.0, 1.0, 0.0)), np.full(SLOTS, 99)
    count = near_slots(world, 0, 1, 1e-3, slots)
    assert slots[:count].tolist() == [0, 1, OF_B + 2, OF_B + 3]


def test_corner_a_quarter_turn_apart_touches_the_side_it_came_through(make_body: MakeBody) -> None:
    a = make_body(W / 2 + H / 2 - 1e-6, 0.0, radians(90.0))
    found = points_between(a, make_body())
    assert {(round(point.nx), round(point.ny)) for point in found} == {(1, 0)}
    assert [point.depth for point in found] == pytest.approx([1e-6, 1e-6], rel=1e-6)


def test_corner_passing_a_corner_is_one_contact_of_continuous_depth(make_body: MakeBody) -> None:
    b = make_body()
    depths = []
    for shift in np.linspace(-3e-6, 1.2e-6, 85):  # a stands on its lower corner, which leaves b over its edge
        a = make_body(0.0, 0.0, radians(45.0))
        lowest = min((place_of(a, k) for k in range(4)), key=lambda corner: float(corner[1]))
        a.x, a.y = W / 2 + shift - lowest[0], H / 2 - 1e-6 - lowest[1]
        found = points_between(a, b)
        assert len(found) <= 1
        depths.append(float(found[0].depth) if found else 0.0)
    assert depths[0] == pytest.approx(1e-6, rel=1e-6)
    assert depths[-1] == 0.0
    assert np.abs(np.diff(depths)).max() < 0.06e-6

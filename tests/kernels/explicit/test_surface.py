"""Which corners touch which faces, and how deep."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import assume, given, strategies as st

from blocksim.kernels.common.arrays import CONTACT, CONTACTS, PAIR, POINT, SLOTS, zeros
from blocksim.kernels.common.shapes import ground_gap, separation
from blocksim.kernels.common.tolerances import CONE_TOLERANCE
from blocksim.kernels.explicit.contact import pair_forces
from blocksim.kernels.explicit.models.surface import block_points, corner_seen, face_met, find_points, ground_points
from blocksim.kernels.explicit.sides import MOST_CORNERS, UPPER, side_normal
from tests.kernels.references import corners, in_frame
from tests.kernels.scenes import make_body, pose

if TYPE_CHECKING:
    from blocksim.kernels.common.arrays import Record

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


@given(x=st.floats(-0.035, 0.035), y=st.floats(-0.03, 0.03), one=st.floats(-4.0, 4.0), two=st.floats(-4.0, 4.0))
def test_every_contact_point_is_a_corner_inside_the_other_block(x: float, y: float, one: float, two: float) -> None:
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
def test_shallow_overlap_of_two_blocks_is_always_found(x: float, one: float, depth: float) -> None:
    a, b = make_body(x, 0.0, one), make_body(0.0, 0.0)
    a.y = 0.03
    a.y -= separation(a, b) + depth  # from above: its gap along y is the largest one
    assume(separation(a, b) < 0.0)
    assert points_between(a, b)


@pytest.mark.parametrize("shift", [0.0, 1e-9, -1e-9, 0.01])
@pytest.mark.parametrize("depth", [1e-9, 1e-6])
def test_stacked_blocks_touch_at_the_top_and_not_at_the_sides(shift: float, depth: float) -> None:
    found = points_between(make_body(shift, H - depth), make_body())
    assert len(found) == 2
    for point in found:
        assert [point.nx, point.ny] == pytest.approx([0.0, 1.0], abs=1e-15)
        assert point.depth == pytest.approx(depth, rel=1e-6)
    assert abs(found[0].x - found[1].x) == pytest.approx(W - abs(shift))


def face_of(x: float, y: float, corner: int) -> tuple[int, float]:
    """Return the face of a block, and the overlap, that a corner of one which is not turned touches at a place."""
    owner, touched = make_body(), make_body()
    own = place_of(owner, corner)
    owner.x, owner.y = x - own[0], y - own[1]
    face, depth, _ = face_met(corner_seen(owner, corner, touched, None), touched, None, CONE_TOLERANCE)
    return face, depth


def test_corner_touches_only_faces_within_its_normal_cone() -> None:
    tiny = 1e-9
    # a lower right corner near the upper right one, nearer to the side than to the top
    face, depth = face_of(W / 2 - tiny, H / 2 - 2 * tiny, 1)
    assert face == UPPER
    assert depth == pytest.approx(2 * tiny, rel=1e-6)
    # its mirror image at the upper left
    face, depth = face_of(-W / 2 + tiny, H / 2 - 2 * tiny, 0)
    assert face == UPPER
    assert depth == pytest.approx(2 * tiny, rel=1e-6)
    # a lower left corner at the upper right one may touch either: the nearest counts
    assert face_of(W / 2 - tiny, H / 2 - 2 * tiny, 0)[0] == RIGHT
    assert face_of(W / 2 - 2 * tiny, H / 2 - tiny, 0)[0] == UPPER


def test_aligned_blocks_keep_the_corner_that_was_in_contact() -> None:
    a, b = make_body(0.0, H - 1e-6), make_body()
    for touching, duplicates in (((), [18, 19]), ((0, 1), [18, 19]), ((18, 19), [0, 1]), ((1, 19), [0, 18])):
        points, found = points_and_duplicates(a, b, touching)
        assert sorted(point.slot for point in points) == list(touching or (0, 1))
        assert found == duplicates


@given(y=st.floats(-0.01, 0.03), angle=st.floats(-7.0, 7.0))
def test_corners_below_the_ground_touch_it(y: float, angle: float) -> None:
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
    angle: float, slots: list[int]
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

"""Contacts that continue, against the general way to find places, motions and inverse masses of points."""

from __future__ import annotations

from math import cos, pi, sin
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import assume, given, strategies as st

from blocksim.kernels.common.tolerances import CONE_TOLERANCE
from blocksim.kernels.explicit.kinematics import Point, relative_motion, resolve_point
from blocksim.kernels.explicit.models import contact_points
from blocksim.kernels.explicit.models.surface import corner_signs, face_normal, opens
from blocksim.kernels.explicit.persistent_forces import admits, face_frame, follow
from blocksim.verification.scene import HEIGHT

if TYPE_CHECKING:
    from blocksim.kernels.common.arrays import World
    from tests.kernels.conftest import MakeBody, Pose

STEP = 1e-6
SEEDS = st.integers(0, 10_000)
angles = st.floats(-4.0, 4.0)


def moving(pose: Pose, seed: int, angle: float, shift: float) -> World:
    """Return a block that stands on another one or, tilted, on one of its corners, both in random motion."""
    lowest = 0.5 * (0.032 * abs(sin(angle)) + HEIGHT * cos(angle))
    world, random = (
        pose((0.1 + shift, 1.0 + 0.5 * HEIGHT + lowest - 1e-6, angle), (0.1, 1.0, 0.0)),
        np.random.default_rng(seed),
    )
    for body in world.bodies[:2]:
        for name in ("vx", "vy", "spin", "ax", "ay", "spin_rate"):
            body[name] = 0.01 * random.normal()
        body.pairs_before = random.integers(1, 6)
        body.seats = random.integers(1, 4)  # borne by others too, over a middle of their own
        body.k_xx, body.k_yy = 1e10 * random.uniform(0.2, 1.0, 2)
        body.k_x, body.k_y = 1e7 * random.normal(size=2)
    return world


def contacts_of(world: World) -> tuple[list[bool], list[Point]]:
    """Return whether the contacts of the points found continue, and the contacts."""
    a, b = world.bodies[:2]
    count = contact_points(world, 0)
    world.contacts[0].slot[:count], world.contacts[0].face[:count] = (
        world.points.slot[:count],
        world.points.face[:count],
    )
    dx, dy = a.x - b.x, a.y - b.y
    motion = relative_motion(a, b, dx, dy, 0.5 * STEP)
    found = [follow(contact, a, b, dx, dy, motion, STEP, True) for contact in world.contacts[0, :count]]
    return [goes_on for goes_on, _ in found], [one for _, one in found]


@given(angle=st.sampled_from([0.0, 1e-6, 0.3, -0.3]), seed=SEEDS, shift=st.floats(-4e-3, 4e-3))
def test_spots_are_the_points_of_the_general_way(pose: Pose, angle: float, seed: int, shift: float) -> None:
    world = moving(pose, seed, angle, shift)
    a, b = world.bodies[:2]
    go_on, contacts = contacts_of(world)
    assert all(go_on)
    assert len(contacts) == (2 if abs(angle) < 0.1 else 1)
    for one, point in zip(contacts, world.points, strict=False):
        resolve_point(point, a, b, STEP)
        assert [one.x + b.x, one.y + b.y, one.depth] == pytest.approx([point.x, point.y, point.depth], abs=1e-15)
        assert [one.nx, one.ny] == pytest.approx([point.nx, point.ny], abs=1e-15)
        assert [one.closing, one.slip] == pytest.approx([point.closing, point.slipping], abs=1e-20)
        assert [one.closing_rate, one.slip_rate] == pytest.approx([point.closing_rate, point.slip_rate], abs=1e-14)


@given(angle=angles, face=st.integers(0, 3), along=st.floats(-0.01, 0.01), above=st.floats(-0.01, 0.01))
def test_frame_of_a_face_measures_from_the_centre(
    make_body: MakeBody, angle: float, face: int, along: float, above: float
) -> None:
    body = make_body(angle=angle)
    nx, ny, half, half_length = face_frame(body, face)
    assert (nx, ny) == pytest.approx(face_normal(face, body))
    assert {half, half_length} == {body.half_x, body.half_y}
    assert half == (body.half_y if face % 2 else body.half_x)
    x, y = (half + above) * nx - along * ny, (half + above) * ny + along * nx
    local = np.array([body.cos * x + body.sin * y, body.cos * y - body.sin * x])
    outward = np.array([(1, 0), (0, 1), (-1, 0), (0, -1)][face])
    assert outward @ local == pytest.approx(half + above, abs=1e-15)


@given(corner=st.integers(0, 3), face=st.integers(0, 3), one=angles, two=angles)
def test_corner_can_touch_a_face_as_the_narrow_phase_says(
    make_body: MakeBody, corner: int, face: int, one: float, two: float
) -> None:
    owner, touched = make_body(angle=one), make_body(angle=two)
    (sx, sy), (nx, ny) = corner_signs(corner), face_normal(face, touched)
    along = [sign * (nx * cos(turn) + ny * sin(turn)) for sign, turn in ((sx, one), (sy, one + pi / 2))]
    assume(min(abs(part - CONE_TOLERANCE) for part in along) > 1e-12)
    assert admits(owner, corner, nx, ny) == opens(face, sx, sy, cos(one - two), sin(one - two))

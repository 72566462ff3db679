"""Contacts that continue, against the general way to find places, motions and inverse masses of points."""

from __future__ import annotations

from math import cos, sin
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, strategies as st

from blocksim.kernels.explicit.kinematics import Point, relative_motion, resolve_point
from blocksim.kernels.explicit.models import contact_points
from blocksim.kernels.explicit.persistent_forces import follow
from blocksim.verification.scene import HEIGHT

if TYPE_CHECKING:
    from blocksim.kernels.common.arrays import World
    from tests.kernels.conftest import Pose

STEP = 1e-6
SEEDS = st.integers(0, 10_000)


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
    found = [follow(contact, a, b, dx, dy, motion, STEP, True, 0, None) for contact in world.contacts[0, :count]]
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

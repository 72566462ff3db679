"""Contacts push and never pull, however fast they open: in both ways in which a pair is evaluated."""

from __future__ import annotations

from math import cos, sin
from typing import TYPE_CHECKING

import pytest

from blocksim.kernels.common.arrays import POINT, zeros
from blocksim.kernels.explicit.contact import clip_tension, pair_forces
from blocksim.kernels.explicit.persistent_forces import TOUCHING, persistent_forces
from blocksim.verification.scene import HEIGHT, WIDTH

if TYPE_CHECKING:
    from tests.kernels.conftest import Pose

TILT, STEP = 0.3, 1e-7


def test_dashpot_that_pulls_more_than_the_spring_pushes_leaves_no_force() -> None:
    point = zeros(1, POINT)[0]
    point.force, point.spring_force, point.closing = -3.0, 5.0, -1e-6
    assert clip_tension(point, 2.0) == pytest.approx(0.5 * (2.0 - 5.0) * -1e-6, rel=1e-12)
    assert point.normal_force == 0.0


def test_push_is_not_clipped() -> None:
    point = zeros(1, POINT)[0]
    point.force, point.spring_force, point.closing = 7.0, 5.0, 1e-6
    assert clip_tension(point, 0.0) == pytest.approx(0.5 * 2.0 * 1e-6, rel=1e-12)
    assert point.normal_force == 7.0


@pytest.mark.parametrize("speed", [0.1, 1.0])
def test_corner_that_leaves_the_ground_fast_is_not_held(pose: Pose, speed: float) -> None:
    world = pose((0.0, 0.5 * (sin(TILT) * WIDTH + cos(TILT) * HEIGHT) - 1e-8, TILT))
    pair_forces(world, 0, 0.0)
    assert (world.pairs[0].active, world.action[0].fy > 0.0) == (1, True)
    world.bodies[0].vy = speed
    kind, effect = persistent_forces(world, 0, STEP, world.particles, world.corners)
    assert (kind, effect.fy) == (TOUCHING, 0.0)
    assert world.contacts[0, 0].normal_force == 0.0

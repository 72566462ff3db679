"""Contacts push and never pull, however fast they open: in both ways in which a pair is evaluated."""

from __future__ import annotations

from math import cos, sin
from typing import TYPE_CHECKING

import pytest

from blocksim.kernels.common.arrays import CONTACT, INTERACTION, zeros
from blocksim.kernels.explicit.contact import pair_forces
from blocksim.kernels.explicit.forces import grip_of, keep
from blocksim.kernels.explicit.kinematics import Point
from blocksim.kernels.explicit.laws import LINEAR, spring_at
from blocksim.kernels.explicit.persistent_forces import TOUCHING, persistent_forces
from blocksim.verification.scene import HEIGHT, WIDTH

if TYPE_CHECKING:
    from tests.kernels.conftest import Pose

TILT, STEP = 0.3, 1e-7


def pushed(force: float, closing: float) -> tuple[float, float]:
    """Return the force that is left of spring (5 N) and dashpot, and what has been lost (J); none was before."""
    point = Point(0.0, 0.0, 0.0, 1.0, 1e-6, closing, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0)
    contact, values = zeros(1, CONTACT)[0], zeros(1, INTERACTION)[0]
    spring, before = spring_at(LINEAR, 5e6, 1e-6), spring_at(LINEAR, 5e6, 0.0)
    grip = grip_of(contact, point, values, force, spring, before, True)
    lost = 0.5 * keep(contact, point, grip, 0.0, spring, before)
    assert contact.normal_force == grip.normal
    return grip.normal, lost


def test_dashpot_that_pulls_more_than_the_spring_pushes_leaves_no_force() -> None:
    assert pushed(-3.0, -1e-6) == pytest.approx((0.0, 0.5 * -5.0 * -1e-6), rel=1e-12, abs=0.0)


def test_push_is_not_clipped() -> None:
    assert pushed(7.0, 1e-6) == pytest.approx((7.0, 0.5 * 2.0 * 1e-6), rel=1e-12)


@pytest.mark.parametrize("speed", [0.1, 1.0])
def test_corner_that_leaves_the_ground_fast_is_not_held(pose: Pose, speed: float) -> None:
    world = pose((0.0, 0.5 * (sin(TILT) * WIDTH + cos(TILT) * HEIGHT) - 1e-8, TILT))
    pair_forces(world, 0, 0.0)
    assert (world.pairs[0].active, world.action[0].fy > 0.0) == (1, True)
    world.bodies[0].vy = speed
    kind, effect = persistent_forces(world, 0, STEP, world.particles)
    assert (kind, effect.fy) == (TOUCHING, 0.0)
    assert world.contacts[0, 0].normal_force == 0.0

"""Sliding beyond the cases V7 to V9: the cone of Coulomb at every step."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.conftest import Simulation


@pytest.mark.parametrize("restitution", [0.0, 0.3])
def test_shear_force_never_leaves_the_static_cone(start_shipped: Callable[..., Simulation], restitution: float) -> None:
    scene = start_shipped(
        "three_blocks", contact__restitution=restitution, contact__stiffness_scale=1e-3, time__stop_at_rest=False
    )
    last, shears = 0.35, 0
    while scene.time < last:
        scene.to_step(scene.steps + 20)
        pairs: Any = scene.world.pairs[: scene.world.clock[0].pair_count]
        ground = pairs.b == len(scene.bodies)
        static = np.where(ground, 0.38, 0.31).repeat(pairs.active)
        contacts = scene.contact_records
        assert np.all(np.abs(contacts.shear_force) <= static * contacts.normal_force * (1.0 + 1e-12))
        assert np.all(contacts.normal_force >= 0.0)
        shears += int(np.count_nonzero(contacts.shear_force))
    assert shears > 1000

"""The collision of V16 is one, and takes energy away."""

from __future__ import annotations

import pytest

from blocksim.verification.case import Setting
from blocksim.verification.impacts import COLLISION_STEPS, collision


@pytest.mark.parametrize("law", ["linear", "hertz-mindlin"])
@pytest.mark.parametrize("e", [0.0, 0.2, 1.0])
def test_the_two_blocks_meet_and_lose_energy(law: str, e: float) -> None:
    scene = collision(Setting(law=law), e)
    before = scene.kinetic
    scene.to_step(COLLISION_STEPS)
    assert scene.bodies[0].vx < 0.6
    assert scene.kinetic < before

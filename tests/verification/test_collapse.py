"""The three-block collapse beyond the cases V19, V22 and V24: other restitution, friction, stiffness and order."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from blocksim.kernels.common.arrays import AT_REST
from blocksim.verification.case import Setting
from blocksim.verification.collapse import BEFORE_FIRST_IMPACT, FINAL, collapse, staircase

if TYPE_CHECKING:
    from tests.conftest import Start


@pytest.mark.parametrize(("restitution", "ground_friction"), [(0.2, 0.38), (0.2, 0.31), (0.0, 0.31)])
def test_stiff_blocks_topple_as_others_let_them_with_any_restitution_and_ground(
    start: Start, restitution: float, ground_friction: float
) -> None:
    scene = start(staircase(), restitution=restitution, ground_friction=ground_friction)
    for time, blocks in BEFORE_FIRST_IMPACT.items():
        bodies = scene.to_time(time).bodies
        for body, (x, y, angle) in zip(bodies[1:], blocks, strict=True):
            assert [1e3 * body.x, 1e3 * body.y] == pytest.approx([x, y], abs=0.1), f"at {time} s"
            assert np.degrees(body.angle) == pytest.approx(angle, abs=0.15), f"at {time} s"
        assert 1e3 * bodies[0].x == pytest.approx(16.0, abs=0.1)


def test_soft_blocks_come_to_rest_where_stiff_ones_do() -> None:
    scene = collapse(Setting(), 0.0, scale=0.001).to_time(2.0)
    assert scene.status == AT_REST
    for block, x, tolerance, angle in FINAL:
        assert 1e3 * scene.bodies[block - 1].x == pytest.approx(x, abs=tolerance)
        assert np.degrees(scene.bodies[block - 1].angle) == pytest.approx(angle, abs=0.5)

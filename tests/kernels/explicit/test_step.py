"""What ends a run, that a run starts only once, and that it does not matter in how many calls it is made."""

from __future__ import annotations

from math import inf, nan
from typing import TYPE_CHECKING

import pytest

from blocksim.kernels.common.arrays import NOT_FINITE

if TYPE_CHECKING:
    from collections.abc import Callable

    from blocksim.kernels.common.arrays import World
    from tests.conftest import Start


def with_value(name: str, value: float) -> Callable[[World], None]:
    def change(world: World) -> None:
        world.bodies[0][name] = value

    return change


@pytest.mark.usefixtures("compiler")  # the cosine of infinity is an exception in Python, not a number in IEEE
@pytest.mark.parametrize("name", ["x", "y", "angle", "vx", "vy", "spin"])
@pytest.mark.parametrize("value", [nan, inf])
def test_state_that_is_not_finite_stops_the_run(start: Start, name: str, value: float) -> None:
    scene = start([{"y": 1.0}], change=with_value(name, value)).to_time(1e-2)
    assert scene.status == NOT_FINITE
    assert scene.time == pytest.approx(1e-4, rel=0.01)

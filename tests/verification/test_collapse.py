"""The three-block collapse: before its first impact (V24), at its end (V22), and seen in a mirror (V19)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from blocksim.kernels.arrays import AT_REST

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from tests.conftest import Simulation, Start

BEFORE_FIRST_IMPACT = {  # time (s): x, y (mm), angle (degrees) of blocks 2 and 3
    0.05: ((40.330, 74.323, -5.409), (63.160, 122.385, -5.409)),
    0.10: ((46.623, 71.146, -21.171), (74.432, 113.995, -21.171)),
    0.15: ((55.200, 61.301, -49.670), (94.447, 92.863, -48.415)),
    0.20: ((64.446, 32.025, -85.583), (116.650, 48.972, -79.664)),
}
SIZES = {"width": 0.032, "height": 0.05, "length": 0.025}  # upright = "length"
NOT_MIRRORED = np.array([-1.0, 1.0, -1.0, -1.0, 1.0, -1.0])  # x, y, angle, vx, vy, spin


@pytest.mark.parametrize("restitution", [0.0, 0.2])
@pytest.mark.parametrize("ground_friction", [0.31, 0.38])
def test_blocks_topple_as_other_engines_let_them(
    start_shipped: Callable[..., Simulation], restitution: float, ground_friction: float
) -> None:
    collapse = start_shipped(
        "three_blocks_nominal",
        contact__restitution=restitution,
        friction__block_block=0.31,
        friction__block_ground=ground_friction,
    )
    for time, blocks in BEFORE_FIRST_IMPACT.items():
        collapse.to_time(time)
        bodies = collapse.bodies
        for body, (x, y, angle) in zip(bodies[1:], blocks, strict=True):
            assert [1e3 * body.x, 1e3 * body.y] == pytest.approx([x, y], abs=0.1), f"at {time} s"
            assert np.degrees(body.angle) == pytest.approx(angle, abs=0.15), f"at {time} s"
        assert 1e3 * bodies[0].x == pytest.approx(16.0, abs=0.1)


@pytest.mark.parametrize("scale", [1.0, 0.001])
def test_without_restitution_blocks_come_to_rest_where_other_engines_put_them(
    start_shipped: Callable[..., Simulation], scale: float
) -> None:
    collapse = start_shipped("three_blocks_nominal", contact__restitution=0.0, contact__stiffness_scale=scale)
    collapse.to_time(2.0)
    assert collapse.status == AT_REST
    for body, x, tolerance, turned in zip(
        collapse.bodies, (16.0, 67.3, 128.8), (0.1, 0.6, 1.0), (0.0, -90.0, -90.0), strict=True
    ):
        assert 1e3 * body.x == pytest.approx(x, abs=tolerance)
        assert np.degrees(body.angle) == pytest.approx(turned, abs=0.5)


def staircase(order: Sequence[int] = (0, 1, 2), side: float = 1.0, shift: float = 0.0) -> list[dict[str, object]]:
    """Return the bodies, block `order[i]` at place i of the list; to the other side for `side` = -1."""
    return [{"x": shift + side * (0.016 + 0.022 * level), "y": 0.025 + 0.05 * level, **SIZES} for level in order]


def states(collapse: Simulation) -> tuple[np.ndarray, np.ndarray]:
    """Return the state just before the first impact and that at the end."""
    before = collapse.to_time(0.2).state()
    return before, collapse.to_time(0.45).state()


@pytest.fixture(scope="module")
def usual(start: Start) -> tuple[np.ndarray, np.ndarray]:
    """Return the collapse as everybody sees it."""
    return states(start(staircase()))


def assert_same(one: tuple[np.ndarray, np.ndarray], two: tuple[np.ndarray, np.ndarray]) -> None:
    assert np.abs(one[0] - two[0])[:, :2].max() < 1e-9
    assert np.abs(one[0] - two[0])[:, 2].max() * 0.03 < 1e-9  # of a corner
    assert np.abs(one[1] - two[1])[:, :2].max() < 5e-5
    assert np.abs(one[1] - two[1])[:, 2].max() * 0.03 < 5e-5


def test_collapse_in_a_mirror_is_the_mirrored_collapse(start: Start, usual: tuple[np.ndarray, np.ndarray]) -> None:
    before, after = states(start(staircase(side=-1.0)))
    assert_same(usual, (before * NOT_MIRRORED, after * NOT_MIRRORED))


@pytest.mark.parametrize("order", [(2, 1, 0), (1, 2, 0)])
def test_order_of_blocks_in_the_file_does_not_matter(
    start: Start, usual: tuple[np.ndarray, np.ndarray], order: tuple[int, int, int]
) -> None:
    before, after = states(start(staircase(order)))
    back = np.argsort(order)
    assert_same(usual, (before[back], after[back]))


def test_place_of_the_origin_does_not_matter(start: Start, usual: tuple[np.ndarray, np.ndarray]) -> None:
    before, after = states(start(staircase(shift=1.0)))
    back = np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert_same(usual, (before - back, after - back))

"""Substeps of blocks in the plane: it does not matter where the scene lies, how it is turned, or who is body a."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.kernels.nonsmooth.arrays import TALLY_PACKS
from blocksim.kernels.nonsmooth.passes import VELOCITY, range_of_thread, velocity_pass
from blocksim.kernels.nonsmooth.step import bodies_of_thread, kick_share
from tests.kernels.nonsmooth.scenes import Block, after_substep, pile, posed, velocities

if TYPE_CHECKING:
    from numpy.typing import NDArray

EXACT: dict[str, Any] = {"gravity": 0.0, "velocity_tolerance": 1e-11, "velocity_sweeps": 10_000, "substeps": 1}
BLOCKS = [
    Block(0.0, 1.0, 0.02, 0.3, 0.1, 2.0),
    Block(0.003, 1.0249, 0.0, 0.0, -0.8, -3.0),
    Block(0.0325, 1.001, -0.4, -0.5, 0.0, 1.0, width=0.02),
]


def pushed(blocks: list[Block], **values: Any) -> NDArray[np.float64]:
    """Return the velocities of blocks after a substep of impacts."""
    return velocities(after_substep(blocks, **{**EXACT, "restitution": 0.4, **values}).contacts.states)[:-1]


def test_blocks_do_the_same_anywhere_and_turned_any_way() -> None:
    expected = pushed(BLOCKS)
    assert np.abs(expected - [[b.vx, b.vy, b.spin] for b in BLOCKS]).max() > 0.1
    moved = [replace(b, x=b.x - 3.0, y=b.y + 2.0) for b in BLOCKS]
    assert pushed(moved) == pytest.approx(expected, abs=1e-9)
    for angle in (0.7, math.pi / 2, 3.0):
        c, s = math.cos(angle), math.sin(angle)
        turned = [
            replace(
                b,
                x=c * b.x - s * b.y,
                y=s * b.x + c * b.y + 5.0,
                angle=b.angle + angle,
                vx=c * b.vx - s * b.vy,
                vy=s * b.vx + c * b.vy,
            )
            for b in BLOCKS
        ]
        found = pushed(turned)
        back = np.array([c * found[:, 0] + s * found[:, 1], c * found[:, 1] - s * found[:, 0], found[:, 2]]).T
        assert back == pytest.approx(expected, abs=1e-9)


def test_mirror_image_is_pushed_the_other_way() -> None:
    image = [replace(b, x=-b.x, angle=-b.angle, vx=-b.vx, spin=-b.spin) for b in BLOCKS]
    assert pushed(image) * (-1.0, 1.0, -1.0) == pytest.approx(pushed(BLOCKS), abs=1e-9)


@pytest.mark.parametrize("order", [(1, 0, 2), (2, 1, 0), (1, 2, 0)])
def test_numbers_of_blocks_do_not_matter(order: tuple[int, ...]) -> None:
    found = pushed([BLOCKS[i] for i in order], friction=0.0)
    assert found == pytest.approx(pushed(BLOCKS, friction=0.0)[list(order)], abs=1e-9)


def test_uniform_motion_is_added_to_all_that_happens() -> None:
    """Galileo's relativity, of blocks that no support touches."""
    fast = [replace(b, vx=b.vx + 2.0, vy=b.vy - 1.0) for b in BLOCKS]
    assert pushed(fast) - (2.0, -1.0, 0.0) == pytest.approx(pushed(BLOCKS), abs=1e-9)


@pytest.mark.parametrize("size", [1, 2, 3, 5])
@pytest.mark.parametrize("count", [0, 1, 3, 4, 7, 23, 64])
def test_threads_divide_packs_in_whole_tallies_and_leave_none_out(size: int, count: int) -> None:
    begin, end = 8, 8 + count
    ranges = [range_of_thread(begin, end, k, size) for k in range(size)]
    assert [m for first, last in ranges for m in range(first, last)] == list(range(begin, end))
    assert all((first - begin) % TALLY_PACKS == 0 for first, last in ranges if first < last)
    scene = posed([Block(0.1 * i, 1.0) for i in range(7)])
    assert [i for k in range(size) for i in range(*bodies_of_thread(scene.contacts, k, size))] == list(range(7))


def test_only_the_first_substep_of_a_run_has_half_a_kick() -> None:
    shares = [kick_share(number, is_first) for is_first in (True, False) for number in range(3)]
    assert shares == [0.5, 1.0, 1.0, 1.0, 1.0, 1.0]


def test_velocity_pass_ends_at_its_tolerance_or_after_its_sweeps() -> None:
    blocks = pile(np.random.default_rng(0), 2, 2)
    sweeps = {}
    for tolerance in (0.1, 1e-3, 1e-6):
        scene = after_substep(blocks, velocity_tolerance=tolerance)
        sweeps[tolerance] = int(scene.contacts.stepping[0].sweeps)
        before = velocities(scene.contacts.states)
        velocity_pass(scene.contacts, scene.world.team, 0, VELOCITY, 1e3)  # one more sweep
        assert (
            np.abs(velocities(scene.contacts.states) - before)[:, :2].max() <= 4.0 * tolerance
        )  # constraints of a body
        assert scene.contacts.stepping[0].sweeps == sweeps[tolerance] + 1
    assert sweeps[0.1] < sweeps[1e-3] < sweeps[1e-6]
    assert after_substep(blocks, velocity_tolerance=1e-6, velocity_sweeps=3).contacts.stepping[0].sweeps == 3


def test_block_at_rest_is_held_by_the_impulse_of_its_weight() -> None:
    scene = after_substep([Block(0.0, 0.0125)], restitution=0.0, substeps=1)
    (pack,) = scene.contacts.packs[: scene.contacts.stepping[0].pack_count]
    weight = float(scene.world.bodies.mass[0]) * 9.81e-3
    assert float(pack.normal_one[0] + pack.normal_two[0]) == pytest.approx(weight, rel=1e-9)

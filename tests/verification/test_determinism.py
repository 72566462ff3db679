"""Same bits every time, in one call or in many; the pair list has no influence on contact history."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import pytest

if TYPE_CHECKING:
    from collections.abc import Callable

    from blocksim.kernels.arrays import World
    from tests.conftest import PaperBlock, Simulation, Start

NOT_STATE = {"points", "matrices", "spare_pairs", "spare_slots", "spare_candidates"}  # work space
END = 0.24  # s, after the first impacts


def bits(scene: Simulation) -> dict[str, bytes]:
    """Return every bit of the state."""
    arrays = scene.world._asdict().items()
    return {name: array.tobytes() for name, array in arrays if name not in NOT_STATE and array is not None}


def collapse(start_shipped: Callable[..., Simulation]) -> Simulation:
    return start_shipped("three_blocks", contact__stiffness_scale=0.01)


@pytest.fixture(scope="module")
def reference(start_shipped: Callable[..., Simulation]) -> dict[str, bytes]:
    """Return the state at the end of a collapse in one call."""
    return bits(collapse(start_shipped).to_time(END))


def test_same_scenario_gives_the_same_bits_again(
    start_shipped: Callable[..., Simulation], reference: dict[str, bytes]
) -> None:
    assert bits(collapse(start_shipped).to_time(END)) == reference


@pytest.mark.parametrize("pieces", [2, 7, 997])
def test_where_outputs_interrupt_a_run_changes_no_bit(
    start_shipped: Callable[..., Simulation], reference: dict[str, bytes], pieces: int
) -> None:
    scene = collapse(start_shipped)
    last = round(END / scene.step)
    for stop in sorted({*np.random.default_rng(pieces).integers(0, last, pieces).tolist(), last}):
        scene.to_step(stop)
    assert bits(scene) == reference


def test_calls_for_steps_already_done_change_nothing(start: Start, paper_block: PaperBlock) -> None:
    scene = start([{"y": paper_block.height / 2}]).to_step(100)
    before = bits(scene)
    scene.to_step(100).to_step(0)
    assert bits(scene) == before


def with_skin(skin: float) -> Callable[[World], None]:
    def change(world: World) -> None:
        world.controls[0].skin = skin

    return change


def staircase_with_skin(start: Start, skin: float) -> Simulation:
    sizes = {"width": 0.032, "height": 0.05, "length": 0.025}
    bodies = [{"x": 0.022 * i, "y": 0.025 + 0.05 * i, **sizes} for i in range(3)]
    return start(bodies, contact={"stiffness_scale": 0.1}, change=with_skin(skin))


def test_reach_of_the_pair_list_does_not_change_a_collapse(start: Start) -> None:
    seldom, often = (staircase_with_skin(start, skin).to_time(0.15) for skin in (1e-2, 1e-7))
    assert seldom.world.clock[0].rebuilds < 100
    assert often.world.clock[0].rebuilds > 50_000
    assert np.abs(seldom.state() - often.state())[:, :3].max() < 1e-12
    assert seldom.residual() == pytest.approx(often.residual(), abs=1e-9)


@pytest.mark.parametrize(("slope", "slides"), [(0.3, False), (0.5, True)])
def test_friction_history_survives_a_new_pair_list(
    start: Start, paper_block: PaperBlock, slope: float, slides: bool
) -> None:
    scenes = [
        start([{"y": paper_block.height / 2}], tilt=-slope, change=with_skin(skin)).to_time(0.02)
        for skin in (1e-2, 1e-8)
    ]
    seldom, often = scenes
    assert seldom.world.clock[0].rebuilds == 1
    assert not slides or often.world.clock[0].rebuilds > 10_000
    assert np.abs(seldom.state() - often.state()).max() < 1e-11
    assert often.slots[0, :2].shear_force == pytest.approx(seldom.slots[0, :2].shear_force, rel=1e-9)
    assert abs(often.slots[0, :2].shear_force).min() > 0.05


@pytest.mark.parametrize("slope", [0.3, 0.5])
def test_friction_force_does_not_jump_at_a_new_pair_list(start: Start, paper_block: PaperBlock, slope: float) -> None:
    scene = start([{"y": paper_block.height / 2}], tilt=-slope).to_time(0.02)
    forces = []
    for k in range(200):
        if k % 10 == 5:
            scene.world.clock[0].pairs_due = 1
        scene.to_step(scene.steps + 1)
        forces.append(scene.slots[0, :2].shear_force.copy())
    assert scene.world.clock[0].rebuilds == 21
    assert max(np.abs(b - a).max() for a, b in pairwise(forces)) < 1e-6

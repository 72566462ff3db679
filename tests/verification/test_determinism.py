"""Same bits every time, in one call or in many; the pair list has no influence on contact history."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from blocksim.bench.harness import pushed_wall
from blocksim.kernels.common.arrays import REACHED
from blocksim.verification.scene import Simulation
from blocksim.world.build import build_world

if TYPE_CHECKING:
    from collections.abc import Callable

    from tests.conftest import PaperBlock, Start

# work space
WORK_SPACE = {"points", "matrices", "before", "action", "starts", "order", "shares", "between", "team"}
NOT_STATE = {*WORK_SPACE, "near_pairs"}
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


def motion_bits(scene: Simulation) -> dict[str, bytes]:
    """Return the bits of all that moves, and of what the contacts remember."""
    names = ("x", "y", "angle", "cos", "sin", "vx", "vy", "spin", "ax", "ay", "spin_rate")
    return {name: scene.bodies[name].tobytes() for name in names} | {"contacts": scene.contact_records.tobytes()}


@pytest.mark.parametrize(
    "contact",
    [
        {"stiffness_scale": 1e-3},
        pytest.param({"stiffness_scale": 1e-3, "law": "hertz-mindlin"}, marks=pytest.mark.long),
        pytest.param(
            {"stiffness_scale": 1e-4, "model": "kernel", "particle_spacing": 4e-3, "max_overlap": 5e-3},
            marks=pytest.mark.long,
        ),
    ],
)
def test_a_crowd_moves_the_same_to_the_last_bit_with_any_skin_of_the_scenario(contact: dict[str, object]) -> None:
    usual = float(build_world(pushed_wall(5, 8, contact=contact)).controls[0].skin)
    ends, rebuilds = [], []
    for share in (0.5, 1.0, 3.0):
        skin = {} if share == 1.0 else {"skin": share * usual}
        scene = Simulation(build_world(pushed_wall(5, 8, contact={**contact, **skin}))).to_time(0.15)
        assert scene.status == REACHED
        ends.append(motion_bits(scene))
        rebuilds.append(int(scene.world.clock[0].rebuilds))
    assert ends[0] == ends[1] == ends[2]
    assert rebuilds[0] > rebuilds[1] > rebuilds[2] > 10


@pytest.mark.parametrize(("slope", "slides"), [(0.3, False), (0.5, True)])
def test_friction_history_survives_a_new_pair_list(
    start: Start, paper_block: PaperBlock, slope: float, slides: bool
) -> None:
    seldom, often = (
        start([{"y": paper_block.height / 2}], tilt=-slope, contact={"skin": skin}).to_time(0.02)
        for skin in (1e-2, 4e-6)
    )
    assert seldom.status == often.status == REACHED
    assert seldom.world.clock[0].rebuilds == 1
    assert not slides or often.world.clock[0].rebuilds > 20
    assert motion_bits(seldom) == motion_bits(often)
    assert abs(often.contact_records.shear_force).min() > 0.05

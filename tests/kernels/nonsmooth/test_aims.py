"""What the velocity pass aims at: Newton's restitution where blocks meet, no approach where they touch."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.kernels.nonsmooth.arrays import FAR
from tests.kernels.nonsmooth.references import dense
from tests.kernels.nonsmooth.scenes import Block, after_substep, velocities

if TYPE_CHECKING:
    from collections.abc import Callable

    from blocksim.verification.scene import Simulation

G = 9.81
H = 1e-3  # s, a substep
HALF = 0.0125  # m, of a height
SMOOTH: dict[str, Any] = {"friction": 0.0, "ground_friction": 0.0, "substeps": 1, "velocity_tolerance": 1e-11}
RESTITUTIONS = [0.0, 0.2, 0.5, 0.8, 1.0]


def lowest(angle: float) -> float:
    """Return how far (m) the lowest corner is below the centre."""
    return math.sin(abs(angle)) * 0.016 + math.cos(angle) * HALF


@pytest.mark.parametrize("restitution", RESTITUTIONS)
@pytest.mark.parametrize("angle", [0.0, 0.3, -1.0])
@pytest.mark.parametrize("others", [0, 2])  # impacts of one or two blocks go in rounds, weak ones of three do not
def test_impact_reverses_the_approach_of_the_point_by_its_restitution(
    restitution: float, angle: float, others: int
) -> None:
    """Without gravity exactly: flat, or on a corner, in the plane of the ground or that of a fixed block."""
    far = [Block(3.0 + k, 3.0) for k in range(others)]
    for floor in ([], [Block(0.0, -HALF + 0.5, width=0.2, fixed=True)]):
        level = 0.5 if floor else 0.0
        block = Block(0.004, level + lowest(angle) + 1e-5, angle, 0.3, -0.9, 4.0 * (angle != 0.0))
        scene = after_substep([block, *floor, *far], restitution=restitution, gravity=0.0, **SMOOTH)
        all_of = dense(scene)
        after = all_of.normals @ velocities(scene.contacts.states).ravel()
        before = all_of.normals @ velocities(scene.contacts.before).ravel()
        if restitution > (0.5 if far else 0.0):  # in rounds: their velocities before are no longer kept
            rest = [[0.0] * 3] * (1 + len(floor) + len(far))
            before = all_of.normals @ np.array([[0.3, -0.9, block.spin], *rest]).ravel()
        is_met = all_of.gaps < FAR / 2
        assert after[is_met] == pytest.approx(-restitution * before[is_met], abs=1e-9)
        assert before[is_met].max() < -0.5


@pytest.mark.parametrize("restitution", RESTITUTIONS)
def test_two_free_blocks_part_with_their_restitution(restitution: float) -> None:
    blocks = [Block(0.0, 1.0, vy=0.4, vx=0.1), Block(0.0, 1.0 + 2 * HALF + 1e-5, vy=-0.6, width=0.02, vx=-0.3)]
    scene = after_substep(blocks, restitution=restitution, gravity=0.0, **SMOOTH)
    one, two = velocities(scene.contacts.states)[:2]
    assert two[1] - one[1] == pytest.approx(restitution, abs=1e-9)
    assert [one[0], two[0]] == pytest.approx([0.1, -0.3], abs=1e-12)


@pytest.mark.parametrize(("rate", "rebounds"), [(0.019, False), (0.021, True)])
def test_slower_impacts_than_the_threshold_do_not_rebound(rate: float, rebounds: bool) -> None:
    block = Block(0.0, HALF - 1e-7, vy=-rate)
    scene = after_substep([block], restitution=0.5, gravity=0.0, restitution_threshold=0.02, **SMOOTH)
    assert velocities(scene.contacts.states)[0, 1] == pytest.approx(0.5 * rate if rebounds else 0.0, abs=1e-9)


@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
def test_gap_that_does_not_close_in_the_substep_takes_nothing_from_an_approach(restitution: float) -> None:
    block = Block(0.0, HALF + 1.1e-3, vy=-1.0)
    scene = after_substep([block], restitution=restitution, gravity=0.0, **SMOOTH)
    assert velocities(scene.contacts.states)[0].tolist() == [0.0, -1.0, 0.0]


@pytest.mark.parametrize("others", [0, 2])  # in rounds, and not
def test_point_that_parts_beside_one_that_meets_is_not_made_to_rebound(others: int) -> None:
    """A heel comes down while the toe is lifted, out of an overlap: the blow takes from that, and nothing gives."""
    block = Block(0.0, HALF - 1e-3, vx=0.2, vy=-0.25, spin=-45.0)
    far = [Block(3.0 + k, 3.0) for k in range(others)]
    scene = after_substep([block, *far], restitution=0.4, gravity=0.0, **SMOOTH)
    all_of = dense(scene)
    before = all_of.normals @ np.array([block.vx, block.vy, block.spin, *[0.0] * 3 * (1 + others)])
    after = all_of.normals @ velocities(scene.contacts.states).ravel()
    heel, toe = np.argmin(before), np.argmax(before)
    assert before[toe] > 0.3
    assert after[heel] == pytest.approx(-0.4 * before[heel], abs=1e-9)
    assert all_of.impulses[toe] == 0.0
    assert velocities(scene.contacts.states)[0, 0] == pytest.approx(0.2, abs=1e-12)


def test_point_that_is_still_open_beside_one_in_touch_is_not_slowed_down() -> None:
    """A block turns about one corner; the other will meet the ground in the next substep, and not in this one."""
    angle, x = 0.02, 0.016 * math.cos(0.02) - HALF * math.sin(0.02)
    spin = -angle / (1.5 * H)
    block = Block(0.0, lowest(angle) - 1e-9, angle, lowest(angle) * -spin, x * spin, spin)
    scene = after_substep([block], restitution=0.0, gravity=0.0, **SMOOTH)
    assert dense(scene).gaps.max() < FAR / 2  # both are looked at
    assert velocities(scene.contacts.states)[0].tolist() == pytest.approx([block.vx, block.vy, spin], abs=1e-6)


@pytest.mark.parametrize("restitution", [0.4, 0.8])
@pytest.mark.parametrize("share", [0.1, 0.6])
def test_rebound_from_a_fall_has_the_share_of_energy_that_restitution_leaves(
    single: Callable[..., Simulation], restitution: float, share: float
) -> None:
    """Wherever within a substep the block meets the ground: apexes are h e^2, of a fall from h."""
    height = 0.05 + share * H * math.sqrt(2 * G * 0.05)
    run = single([{"y": HALF + height}], restitution=restitution, step=H, substeps=1)
    time = math.sqrt(2 * height / G) * (1.0 + restitution)
    steps = round(time / run.step)
    run.to_step(steps)
    body = run.bodies[0]
    apex = body.y - HALF + 0.5 * body.vy * body.vy / G
    assert apex == pytest.approx(restitution**2 * height, abs=3e-3 * height)


@pytest.mark.parametrize("restitution", [0.4, 0.9])
def test_blocks_that_meet_side_by_side_in_flight_fall_on(single: Callable[..., Simulation], restitution: float) -> None:
    blocks = [{"x": -0.02, "y": 1.0, "velocity": [1.0, 0.0]}, {"x": 0.02, "y": 1.0, "velocity": [-1.0, 0.0]}]
    run = single(blocks, restitution=restitution, friction=0.0).to_step(20)
    assert run.bodies.y == pytest.approx([1.0 - 0.5 * G * 0.02**2] * 2, abs=1e-9)
    assert run.bodies.vx == pytest.approx([-restitution, restitution], abs=1e-6)


@pytest.mark.parametrize("tilt", [0.0, 0.2])
def test_block_in_touch_neither_sinks_nor_slides_nor_is_lifted_by_the_velocity_pass(tilt: float) -> None:
    """Its weight is taken up whole, overlap or not; what the position pass adds is gone again."""
    for overlap in (0.0, 1e-5, 1e-4):
        values: dict[str, Any] = {"restitution": 0.0, "tilt": tilt, "substeps": 1, "velocity_tolerance": 1e-11}
        scene = after_substep([Block(0.0, HALF - overlap)], **values)
        assert np.abs(velocities(scene.contacts.states)[0, :2]).max() < 1e-9


@pytest.mark.parametrize("restitution", [0.4, 0.9])
def test_row_that_parts_already_is_left_alone(restitution: float) -> None:
    scene = after_substep([Block(0.0, HALF - 1e-6, vy=0.5)], restitution=restitution, gravity=0.0, **SMOOTH)
    assert velocities(scene.contacts.states)[0].tolist() == pytest.approx([0.0, 0.5, 0.0], abs=1e-12)

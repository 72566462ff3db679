"""Springs with history, clipping and what is booked, seen on one block."""

from __future__ import annotations

from math import cos, sin
from typing import TYPE_CHECKING

import numpy as np
import pytest

from blocksim.kernels.contact import shared_step

if TYPE_CHECKING:
    from tests.conftest import PaperBlock, Start
    from tests.kernels.conftest import MakeBody

SLOPE = 0.2


@pytest.mark.parametrize(("of_a", "of_b", "times"), [(0, 0, 1.0), (2, 1, 1.0), (3, 2, 1.5), (1, 6, 3.0)])
def test_own_force_counts_more_where_more_than_two_pairs_act_on_a_body(
    make_body: MakeBody, of_a: int, of_b: int, times: float
) -> None:
    a, b = make_body(), make_body()
    a.pairs_before, b.pairs_before = of_a, of_b
    assert shared_step(a, b, 1e-6) == pytest.approx(times * 1e-6)


def test_pairs_of_a_fixed_body_do_not_count(make_body: MakeBody) -> None:
    a, ground = make_body(), make_body()
    ground.inverse_mass, ground.pairs_before, a.pairs_before = 0.0, 100, 1
    assert shared_step(a, ground, 1e-6) == shared_step(ground, a, 1e-6) == 1e-6


def test_pairs_in_contact_are_counted_for_every_body(start: Start, paper_block: PaperBlock) -> None:
    height = paper_block.height
    brick = {"x": 0.5 * 0.033, "y": 1.5 * height}
    wall = start([{"y": 0.5 * height}, {"x": 0.033, "y": 0.5 * height}, brick]).to_time(1e-2)
    assert wall.bodies.pairs_before.tolist() == [2, 2, 2]
    assert wall.world.bodies[-1].pairs_before == 2


def test_sticking_block_pulls_its_shear_springs_against_the_slope(start: Start, paper_block: PaperBlock) -> None:
    rest = start([{"y": paper_block.height / 2}], tilt=-SLOPE).to_time(0.05)
    slots = rest.slots[0, :2]
    weight = paper_block.mass * 9.81
    assert slots.normal_force.sum() == pytest.approx(weight * cos(SLOPE), rel=1e-3)
    assert abs(slots.shear_force.sum()) == pytest.approx(weight * sin(SLOPE), rel=1e-3)
    assert slots.normal_force[1] > slots.normal_force[0]  # it leans downhill, towards +x
    lever = weight * sin(SLOPE) * paper_block.height / 2
    assert np.diff(slots.normal_force)[0] * paper_block.width / 2 == pytest.approx(lever, rel=1e-3)


def test_sliding_block_has_its_springs_at_the_cone(start: Start, paper_block: PaperBlock) -> None:
    slide = start([{"y": paper_block.height / 2, "velocity": [-0.5, 0.0]}]).to_time(0.02)
    world = slide.world
    slots, stiffness = (
        slide.slots[0, :2],
        float(world.interactions[1, 0].normal_stiffness * world.interactions[1, 0].shear_ratio),
    )
    assert abs(slots.shear_force) == pytest.approx(0.38 * slots.normal_force, rel=1e-12)
    assert stiffness * slots.spring == pytest.approx(slots.shear_force, rel=1e-12)
    assert world.ledger[0].friction == pytest.approx(
        0.38 * paper_block.mass * 9.81 * abs(float(slide.bodies[0].x)), rel=1e-2
    )


def test_kinetic_friction_slows_a_sliding_block_and_static_friction_holds_it(
    start: Start, paper_block: PaperBlock
) -> None:
    def give_kinetic_friction(world: object) -> None:
        world.interactions.kinetic_friction[...] = 0.19  # type: ignore[attr-defined]

    slide = start([{"y": paper_block.height / 2, "velocity": [0.5, 0.0]}], change=give_kinetic_friction).to_time(0.1)
    assert slide.bodies[0].vx == pytest.approx(0.5 - 0.19 * 9.81 * slide.time, rel=1e-3)
    rest = start([{"y": paper_block.height / 2}], tilt=-0.35, change=give_kinetic_friction).to_time(0.1)
    assert abs(rest.bodies[0].vx) < 1e-6  # tan 0.35 = 0.365: between kinetic and static


def test_contact_never_pulls_while_it_ends(start: Start, paper_block: PaperBlock) -> None:
    impact = start([{"y": paper_block.height / 2 + 1e-7, "velocity": [0.0, -1.0]}], restitution=0.1, gravity=0.0)
    forces = [impact.to_step(step).slots[0].normal_force.copy() for step in range(1, 300)]
    assert np.min(forces) == 0.0
    assert np.max(forces) > 1e3
    assert impact.contacts == 0
    speed_change = np.sum(forces) * impact.step / paper_block.mass
    assert speed_change == pytest.approx(float(impact.bodies[0].vy) + 1.0, rel=1e-9)

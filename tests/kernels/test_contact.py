"""Springs with history, clipping and what is booked, seen on one block."""

from __future__ import annotations

from math import cos, sin
from typing import TYPE_CHECKING

import numpy as np
import pytest

from blocksim.kernels.arrays import NO_FACE, SLOT, SLOTS, zeros
from blocksim.kernels.contact import release_slot

if TYPE_CHECKING:
    from tests.conftest import PaperBlock, Start

SLOPE = 0.2


def test_released_contact_books_its_shear_spring_and_forgets_everything() -> None:
    slot, ledger = zeros(1, SLOT)[0], zeros(1, np.dtype([("broken", "f8"), ("dashpot", "f8")]))[0]
    slot.face, slot.spring, slot.depth, slot.normal_loss = 1, 2e-6, 3e-6, -4.0
    release_slot(slot, ledger, 1e8)
    assert ledger.broken == pytest.approx(0.5 * 1e8 * 4e-12)
    assert ledger.dashpot == pytest.approx(0.5 * 4.0 * 3e-6)
    assert slot.face == NO_FACE
    assert not any(slot[name] for name in ("spring", "depth", "normal_force", "shear_force", "normal_loss"))


def test_sticking_block_pulls_its_shear_springs_against_the_slope(start: Start, paper_block: PaperBlock) -> None:
    rest = start([{"y": paper_block.height / 2}], tilt=-SLOPE).to_time(0.05)
    slots = rest.world.slots[0, :2]
    weight = paper_block.mass * 9.81
    assert slots.normal_force.sum() == pytest.approx(weight * cos(SLOPE), rel=1e-3)
    assert abs(slots.shear_force.sum()) == pytest.approx(weight * sin(SLOPE), rel=1e-3)
    assert slots.normal_force[1] > slots.normal_force[0]  # it leans downhill, towards +x
    lever = weight * sin(SLOPE) * paper_block.height / 2
    assert np.diff(slots.normal_force)[0] * paper_block.width / 2 == pytest.approx(lever, rel=1e-3)


def test_sliding_block_has_its_springs_at_the_cone(start: Start, paper_block: PaperBlock) -> None:
    slide = start([{"y": paper_block.height / 2, "velocity": [-0.5, 0.0]}]).to_time(0.02)
    world = slide.world
    slots, stiffness = world.slots[0, :2], float(world.interactions[1, 0].shear_stiffness)
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
    impact = start(
        [{"y": paper_block.height / 2 + 1e-7, "velocity": [0.0, -1.0]}], restitution=0.1, gravity=0.0
    )
    forces = []
    for step in range(1, 300):
        forces.append(impact.to_step(step).world.slots[0, :SLOTS].normal_force.copy())
    assert np.min(forces) == 0.0
    assert np.max(forces) > 1e3
    assert impact.contacts == 0
    speed_change = np.sum(forces) * impact.step / paper_block.mass
    assert speed_change == pytest.approx(float(impact.bodies[0].vy) + 1.0, rel=1e-9)

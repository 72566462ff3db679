"""What contacts remember, and what becomes of it when they end or pass to another corner."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from blocksim.kernels.arrays import NO_FACE, POINT, SLOT, SLOTS, zeros
from blocksim.kernels.history import goes_on, take_over
from blocksim.kernels.models.surface import slot_normal

if TYPE_CHECKING:
    from tests.conftest import PaperBlock, Start
    from tests.kernels.conftest import MakeBody

REMEMBERED = ("spring", "depth", "normal_force", "shear_force", "normal_loss", "shear_loss")


def test_normal_of_a_slot_points_from_b_to_a_whoever_owns_the_corner(make_body: MakeBody) -> None:
    a, b = make_body(angle=0.2), make_body(angle=-0.1)
    for face in range(4):
        angle = face * np.pi / 2
        assert slot_normal(1, face, a, b, False) == pytest.approx((np.cos(angle - 0.1), np.sin(angle - 0.1)))
        assert slot_normal(5, face, a, b, False) == pytest.approx((-np.cos(angle + 0.2), -np.sin(angle + 0.2)))
    assert slot_normal(2, 1, a, b, True) == (0.0, 1.0)


def test_contact_goes_on_only_with_the_same_corner_on_the_same_face() -> None:
    points = zeros(SLOTS, POINT)
    points.slot[:2], points.face[:2] = (0, 5), (1, 3)
    assert goes_on(0, 1, points, 2)
    assert goes_on(5, 3, points, 2)
    assert not goes_on(0, 2, points, 2)
    assert not goes_on(1, 1, points, 2)
    assert not goes_on(5, 3, points, 1)


def test_history_that_is_taken_over_leaves_nothing_behind() -> None:
    slots, point = zeros(2, SLOT), zeros(1, POINT)[0]
    for value, name in enumerate(REMEMBERED, start=1):
        slots[0][name] = float(value)
    slots[0].face, slots[1].face, point.face = 1, NO_FACE, 3
    point.slot = 1
    take_over(point, slots, 0)
    assert [slots[1][name] for name in REMEMBERED] == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    assert not any(slots[0][name] for name in REMEMBERED)
    assert (slots[0].face, slots[1].face) == (NO_FACE, 3)
    assert point.before == slots[1].normal_force


def test_broken_contact_books_its_shear_springs_and_forgets_everything(start: Start, paper_block: PaperBlock) -> None:
    soft = {"stiffness_scale": 1e-4}
    scene = start([{"y": paper_block.height / 2}], tilt=-0.2, contact=soft).to_time(0.05)
    springs = scene.slots[0, :2].spring.copy()
    stiffness = float(scene.world.interactions[1, 0].normal_stiffness * scene.world.interactions[1, 0].shear_ratio)
    assert np.abs(springs).min() > 0.0
    scene.world.bodies[0].y += 1e-4
    scene.to_step(scene.steps + 1)
    assert scene.contacts == 0
    assert scene.world.ledger[0].broken == pytest.approx(0.5 * stiffness * float((springs**2).sum()), rel=1e-2)
    assert (scene.slots.face == NO_FACE).all()
    assert not any(scene.slots[name].any() for name in REMEMBERED)


def test_friction_goes_on_where_corners_pass_one_another(start: Start, paper_block: PaperBlock) -> None:
    # a block slides over another of the same width: where they are aligned, the corner of the one takes the place
    # of the corner of the other at both ends
    below = {"y": 0.5 * paper_block.height, "fixed": True}
    above = {"x": -2e-4, "y": 1.5 * paper_block.height, "velocity": [0.2, 0.0]}
    slide = start([below, above], friction=0.31).to_time(5e-4)
    weight = paper_block.mass * 9.81
    while slide.bodies[1].x < 1e-4:
        slide.to_step(slide.steps + 1)
        assert slide.contacts == 2
        assert abs(slide.slots.shear_force.sum()) == pytest.approx(0.31 * weight, rel=0.05)
    assert slide.bodies[1].vx == pytest.approx(0.2 - 0.31 * 9.81 * slide.time, rel=1e-3)
    assert slide.residual() < 1e-6
    assert slide.world.ledger[0].broken < 1e-6 * slide.world.ledger[0].friction

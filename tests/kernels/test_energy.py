"""What the ledger finds in a scene."""

from __future__ import annotations

from math import cos, sin
from typing import TYPE_CHECKING

import numpy as np
import pytest

from blocksim.kernels.energy import LEDGER_ROW, contact_summary, measure, potential_energy

if TYPE_CHECKING:
    from tests.conftest import PaperBlock, Start

SOFT = {"stiffness_scale": 1e-4}  # a hundredth of the steps


def test_potential_energy_counts_against_gravity_also_on_a_slope(start: Start, paper_block: PaperBlock) -> None:
    scene = start([{"x": 0.5, "y": 1.0}, {"x": -0.2, "y": 2.0}], tilt=0.2)
    expected = sum(paper_block.mass * 9.81 * (sin(0.2) * x + cos(0.2) * y) for x, y in ((0.5, 1.0), (-0.2, 2.0)))
    assert potential_energy(scene.world) == pytest.approx(expected, rel=1e-12)


def test_resting_block_holds_its_weight_in_two_springs(start: Start, paper_block: PaperBlock) -> None:
    rest = start([{"y": paper_block.height / 2}], contact=SOFT).to_time(0.05)
    normal, shear, count, overlap = contact_summary(rest.world)
    weight = paper_block.mass * 9.81
    assert count == 2
    stiffness = SOFT["stiffness_scale"] * paper_block.point_stiffness
    assert normal == pytest.approx(2 * (weight / 2) ** 2 / (2 * stiffness), rel=1e-6)
    assert shear < 1e-6 * normal
    assert overlap == pytest.approx(weight / (2 * stiffness), rel=1e-6)


def test_sticking_block_on_a_slope_holds_its_pull_in_shear_springs(start: Start, paper_block: PaperBlock) -> None:
    rest = start([{"y": paper_block.height / 2}], tilt=-0.2, contact=SOFT).to_time(0.05)
    world = rest.world
    springs = rest.slots[0, :2].spring
    stiffness = float(world.interactions[1, 0].normal_stiffness * world.interactions[1, 0].shear_ratio)
    assert stiffness * abs(springs.sum()) == pytest.approx(paper_block.mass * 9.81 * sin(0.2), rel=1e-3)
    assert contact_summary(world)[1] == pytest.approx(0.5 * stiffness * (springs**2).sum(), rel=1e-12)


def test_row_of_the_ledger_has_the_documented_order(start: Start) -> None:
    scene = start([{"y": 0.03, "angle": 0.6, "velocity": [0.3, -1.0]}], contact=SOFT).to_time(0.02)
    row = np.zeros(len(LEDGER_ROW) + 2)
    measure(scene.world, row)
    named = dict(zip(LEDGER_ROW, row, strict=False))
    ledger = scene.world.ledger[0]
    normal, shear, count, overlap = contact_summary(scene.world)
    assert named["potential"] == potential_energy(scene.world)
    assert (named["stored_normal"], named["stored_shear"]) == (normal, shear)
    assert (named["dashpot"], named["friction"], named["broken"]) == (ledger.dashpot, ledger.friction, ledger.broken)
    assert (row[-2], row[-1]) == (count, overlap)
    assert ledger.dashpot > 0.0

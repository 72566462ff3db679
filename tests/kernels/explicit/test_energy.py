"""What the ledger finds in a scene."""

from __future__ import annotations

from math import cos, sin
from typing import TYPE_CHECKING

import numpy as np
import pytest

from blocksim.kernels.common.arrays import LEDGER, zeros
from blocksim.kernels.common.energy import potential_energy, weights_power
from blocksim.kernels.explicit.energy import LEDGER_ROW, contact_summary, measure, tallied

if TYPE_CHECKING:
    from tests.conftest import PaperBlock, Start

SOFT = {"stiffness_scale": 1e-4}  # a hundredth of the steps


def test_potential_energy_counts_against_gravity_also_on_a_slope(start: Start, paper_block: PaperBlock) -> None:
    scene = start([{"x": 0.5, "y": 1.0}, {"x": -0.2, "y": 2.0}], tilt=0.2)
    expected = sum(paper_block.mass * 9.81 * (sin(0.2) * x + cos(0.2) * y) for x, y in ((0.5, 1.0), (-0.2, 2.0)))
    assert potential_energy(scene.world) == pytest.approx(expected, rel=1e-12)


def test_row_of_the_ledger_has_the_documented_order(start: Start) -> None:
    scene = start([{"y": 0.03, "angle": 0.6, "velocity": [0.3, -1.0]}], contact=SOFT).to_time(0.02)
    row = np.zeros(len(LEDGER_ROW) + 2)
    measure(scene.world, row)
    named = dict(zip(LEDGER_ROW, row, strict=False))
    normal, shear, count, overlap = contact_summary(scene.world)
    assert named["potential"] == potential_energy(scene.world)
    assert (named["stored_normal"], named["stored_shear"]) == (normal, shear)
    assert (named["dashpot"], named["friction"], named["broken"]) == tallied(scene.world.ledger)
    assert named["to_support"] == scene.world.ledger[0].to_support
    assert (row[-2], row[-1]) == (count, overlap)
    assert named["dashpot"] > 0.0
    assert named["friction"] > 0.0


def test_losses_are_those_of_all_tallies() -> None:
    tallies = zeros(5, LEDGER)
    amounts = np.random.default_rng(0).uniform(0.0, 1.0, (3, 5))
    tallies.dashpot, tallies.friction, tallies.broken = amounts
    assert tallied(tallies) == pytest.approx(tuple(amounts.sum(axis=1)), rel=1e-14)


def test_power_of_the_weights_counts_ways_up_and_down(start: Start, paper_block: PaperBlock) -> None:
    up, down = {"y": 1.0, "velocity": [0.3, 0.5]}, {"x": 0.5, "y": 1.0, "velocity": [0.2, -1.0]}
    level, fixed = {"x": -0.5, "y": 1.0, "velocity": [2.0, 0.0]}, {"x": -1.0, "y": 1.0, "fixed": True}
    weight = paper_block.mass * 9.81
    assert weights_power(start([up, down, level, fixed]).world) == pytest.approx(1.5 * weight, rel=1e-12)
    along = abs(0.3 * sin(0.2) + 0.5 * cos(0.2))
    assert weights_power(start([up], tilt=0.2).world) == pytest.approx(along * weight, rel=1e-12)

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
    springs = rest.contact_records.spring
    assert springs.size == 2
    stiffness = float(world.interactions[1, 0].normal_stiffness * world.interactions[1, 0].shear_ratio)
    assert stiffness * abs(springs.sum()) == pytest.approx(paper_block.mass * 9.81 * sin(0.2), rel=1e-3)
    assert contact_summary(world)[1] == pytest.approx(0.5 * stiffness * (springs**2).sum(), rel=1e-12)


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


def test_travel_of_the_weights_is_the_way_up_and_down_again(start: Start, paper_block: PaperBlock) -> None:
    scene = start([{"y": 1.0, "velocity": [0.0, 0.1]}], contact=SOFT).to_time(0.1)
    apex = 0.1 / 9.81
    way = 0.5 * 9.81 * (apex**2 + (scene.time - apex) ** 2)
    travelled = scene.world.ledger[0].travel_work / (paper_block.mass * 9.81)
    assert travelled == pytest.approx(way, rel=0.01)

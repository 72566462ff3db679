"""What `check` tells must be what a run will use."""

from pathlib import Path

import pytest

from blocksim.scenario import load_scenario
from blocksim.world import build_world
from blocksim.world.describe import describe

SCENARIOS = Path(__file__).parents[2] / "scenarios"


def test_the_step_that_is_told_is_the_one_that_is_taken() -> None:
    scenario = load_scenario(SCENARIOS / "three_blocks.toml")
    told = describe(scenario)
    assert told.step == build_world(scenario).controls[0].step
    assert told.steps * told.step == pytest.approx(scenario.time.end, abs=told.step)


def test_ground_and_block_pairs_are_told_with_their_own_friction_and_restitution() -> None:
    scenario = load_scenario(SCENARIOS / "three_blocks.toml", ["contact.restitution.block_ground=0.1"])
    ground, block = describe(scenario).pairs
    assert (ground.static_friction, ground.kinetic_friction, ground.restitution) == (0.38, 0.31, 0.1)
    assert (block.static_friction, block.kinetic_friction, block.restitution) == (0.31, 0.192, 0.3)


def test_every_boundary_particle_is_counted() -> None:
    # perimeter 2 (32 + 50) mm at 1 mm, three blocks; at 3 mm the sides divide into 11 and 17
    shipped = SCENARIOS / "three_blocks.toml"
    assert describe(load_scenario(shipped)).particles == 3 * 164
    assert describe(load_scenario(shipped, ["contact.particle_spacing=0.003"])).particles == 3 * 2 * (11 + 17)


def test_more_output_costs_more_bytes_but_not_more_steps() -> None:
    shipped = SCENARIOS / "tower.toml"
    coarse, fine = (describe(load_scenario(shipped, [f"output.every={every}"])) for every in (0.01, 0.001))
    assert fine.bytes > 9 * coarse.bytes
    assert fine.steps == coarse.steps

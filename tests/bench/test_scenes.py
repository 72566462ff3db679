"""The scenes that are measured are those that they are said to be."""

from pathlib import Path

import numpy as np
import pytest

from blocksim.bench.harness import LOW_COURSES, UNTIL_SOLVED, TimeSteps, pushed_wall, three_blocks
from blocksim.scenario import load_scenario, place_bodies
from blocksim.scenario.models.timeline import Nonsmooth

NOMINAL = Path(__file__).parents[2] / "scenarios" / "three_blocks_nominal.toml"


def test_three_blocks_are_those_of_the_scenario_that_ships() -> None:
    ours, shipped = three_blocks(), load_scenario(NOMINAL)
    assert place_bodies(ours) == place_bodies(shipped)
    for table in ("materials", "blocks", "ground", "friction", "contact", "time", "gravity"):
        assert getattr(ours, table) == getattr(shipped, table), table


def test_a_stepping_is_what_the_scenario_gets() -> None:
    time = three_blocks(time=TimeSteps(2e-3, substeps=3, velocity_sweeps=5).time(end=0.5)).time
    assert isinstance(time, Nonsmooth)
    assert (time.step, time.substeps, time.velocity_sweeps, time.end) == (2e-3, 3, 5, 0.5)
    default = three_blocks(time={"scheme": "nonsmooth"}).time
    assert isinstance(default, Nonsmooth)
    assert TimeSteps(1e-3).velocity_sweeps == UNTIL_SOLVED == default.velocity_sweeps


def test_a_wall_is_pushed_in_proportion_to_height() -> None:
    placed = place_bodies(pushed_wall(4, 3))
    y, vx = np.array([(body.y, body.vx) for body in placed]).T
    assert len(placed) == 12
    assert {(body.size_x, body.size_y, body.depth) for body in placed} == {(0.05, 0.032, 0.025)}
    assert vx == pytest.approx(1.0 * y / 0.096)
    assert not any(body.vy or body.spin for body in placed)


def test_low_courses_are_those_of_the_wall_that_non_smooth_engines_are_compared_on() -> None:
    scenario = pushed_wall(4, 3, upright=LOW_COURSES)
    placed = place_bodies(scenario)
    assert {(body.size_x, body.size_y) for body in placed} == {(0.032, 0.025)}
    assert max(body.y for body in placed) == pytest.approx(2.5 * 0.025)
    assert scenario.contact.restitution.block_block == 0.1
    assert (scenario.friction.block_block.kinetic, scenario.friction.block_ground.kinetic) == (0.31, 0.38)

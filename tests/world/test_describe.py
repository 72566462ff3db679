"""What `check` tells must be what a run will use; what it prints is in cli/golden/sessions.txt."""

from pathlib import Path

import pytest

from blocksim.scenario import load_scenario
from blocksim.verification.scene import scenario_of
from blocksim.world.build import build_world
from blocksim.world.describe import describe

SCENARIOS = Path(__file__).parents[2] / "scenarios"


def test_the_step_that_is_reported_is_the_one_that_is_taken() -> None:
    scenario = load_scenario(SCENARIOS / "three_blocks.toml")
    told = describe(scenario)
    assert told.step == build_world(scenario).controls[0].step
    assert told.steps * told.step == pytest.approx(scenario.time.end, abs=told.step)


def test_walls_of_their_own_material_are_pairs_too() -> None:
    walls = [{"from": [1, 0], "to": [1, 1], "material": "oak"}, {"from": [2, 0], "to": [2, 1]}]
    oak = {"density": 700, "young_modulus": 11e9, "poisson_ratio": 0.3}
    values = {"materials.oak": oak, "walls": walls, "pairs.aluminium.oak.friction": 0.6}
    scenario = load_scenario(SCENARIOS / "slide.toml", values)
    pairs = {pair.pair: pair for pair in describe(scenario).pairs}
    assert list(pairs) == ["aluminium - ground", "aluminium - aluminium", "aluminium - wall of oak"]
    assert [pair.static_friction for pair in pairs.values()] == [0.38, 0.31, 0.6]
    assert pairs["aluminium - wall of oak"].rules["friction"] == "pairs.aluminium.oak.friction"


def test_frames_closer_than_a_step_are_reported() -> None:
    slide = SCENARIOS / "slide.toml"
    step = describe(load_scenario(slide)).step
    told = [describe(load_scenario(slide, {"output.every": share * step})) for share in (0.9, 1.0, 1.1)]
    assert [one.frames_at_every_step for one in told] == [True, False, False]


def test_frames_that_go_into_a_folder_take_no_memory() -> None:
    shipped = SCENARIOS / "tower.toml"
    coarse, fine = (describe(load_scenario(shipped, [f"output.every={every}"])) for every in (0.01, 1e-5))
    assert fine.memory == coarse.memory
    assert 200e6 < coarse.memory < 220e6  # measured: 207 MB


def test_outlines_on_springs_cost_what_was_measured() -> None:
    square = {"outline": [[0.0, 0.0], [0.032, 0.0], [0.032, 0.025], [0.0, 0.025]]}
    brick, outline = (describe(scenario_of([{"y": 0.0125, **shape}])) for shape in ({}, square))
    assert 1.0 < (outline.seconds / outline.steps) / (brick.seconds / brick.steps) < 2.0


def test_kernels_of_a_crowd_cost_more_than_of_a_few() -> None:
    # every block of a wall touches others on all sides: measured 6 times the time a block and step
    few, many = (
        describe(load_scenario(SCENARIOS / "wall.toml", {"contact.model": "kernel", **size}))
        for size in (
            {"structures.0.columns": 3, "structures.0.rows": 3},
            {"structures.0.columns": 20, "structures.0.rows": 10},
        )
    )
    a, b = (one.seconds / one.steps / len(one.bodies) for one in (few, many))
    assert 4.0 < b / a < 8.0

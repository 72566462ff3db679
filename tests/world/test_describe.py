"""What `check` tells must be what a run will use."""

from pathlib import Path

import pytest

from blocksim.scenario import load_scenario, scenario_from_mapping
from blocksim.world.build import build_world
from blocksim.world.describe import describe

SCENARIOS = Path(__file__).parents[2] / "scenarios"


def test_the_step_that_is_reported_is_the_one_that_is_taken() -> None:
    scenario = load_scenario(SCENARIOS / "three_blocks.toml")
    told = describe(scenario)
    assert told.step == build_world(scenario).controls[0].step
    assert told.steps * told.step == pytest.approx(scenario.time.end, abs=told.step)


def test_frames_closer_than_any_step_are_as_many_as_steps() -> None:
    told = describe(load_scenario(SCENARIOS / "slide.toml", {"output.every": 1e-17}))
    assert told.frames == told.steps + 1


def test_ground_and_block_pairs_are_reported_with_their_own_friction_and_restitution() -> None:
    scenario = load_scenario(SCENARIOS / "three_blocks.toml", ["contact.restitution.block_ground=0.1"])
    ground, block = describe(scenario).pairs
    assert (ground.static_friction, ground.kinetic_friction, ground.restitution) == (0.38, 0.3319, 0.1)
    assert (block.static_friction, block.kinetic_friction, block.restitution) == (0.31, 0.191, 0.322)


def test_stiffness_is_reported_in_the_unit_of_the_law() -> None:
    shipped = SCENARIOS / "three_blocks.toml"
    linear, hertz = (describe(load_scenario(shipped, [f"contact.law={law}"])) for law in ("linear", "hertz-mindlin"))
    assert {pair.stiffness_unit for pair in linear.pairs} == {"N/m"}
    assert {pair.stiffness_unit for pair in hertz.pairs} == {"N/m^1.5"}
    # E* L with 1/E* = 2 (1 - nu^2)/E, and 4/3 E* R*^(1/2) at R* = 1 mm
    modulus = 69e9 / (2 * (1 - 0.3**2))
    assert linear.pairs[0].normal_stiffness == pytest.approx(modulus * 0.025)
    assert hertz.pairs[0].normal_stiffness == pytest.approx(4 / 3 * modulus * 0.001**0.5)
    # Mindlin: 2 (1 - nu)/(2 - nu), for both laws
    assert [pair.shear_stiffness_ratio for pair in (linear.pairs[0], hertz.pairs[0])] == pytest.approx([1.4 / 1.7] * 2)


def test_every_pair_names_the_keys_that_decided() -> None:
    ground, block = describe(load_scenario(SCENARIOS / "three_blocks_nominal.toml")).pairs
    assert (ground.pair, ground.materials) == ("aluminium - ground", ("aluminium", "ground"))
    assert (block.pair, block.materials) == ("aluminium - aluminium", ("aluminium", "aluminium"))
    assert (ground.rules["friction"], block.rules["friction"]) == ("friction.block_ground", "friction.block_block")
    assert (ground.rules["normal_stiffness"], ground.rules["shear_damping_ratio"]) == ("materials", "default")


def test_walls_of_their_own_material_are_pairs_too(tmp_path: Path) -> None:
    walls = """
[materials.oak]
density = 700
young_modulus = "11 GPa"
poisson_ratio = 0.3

[[walls]]
from = [1, 0]
to = [1, 1]
material = "oak"

[[walls]]
from = [2, 0]
to = [2, 1]

[pairs.aluminium.oak]
friction = 0.6
"""
    (tmp_path / "walls.toml").write_text((SCENARIOS / "slide.toml").read_text() + walls)
    pairs = {pair.pair: pair for pair in describe(load_scenario(tmp_path / "walls.toml")).pairs}
    assert list(pairs) == ["aluminium - ground", "aluminium - aluminium", "aluminium - wall of oak"]
    assert [pair.static_friction for pair in pairs.values()] == [0.38, 0.31, 0.6]
    assert pairs["aluminium - wall of oak"].rules["friction"] == "pairs.aluminium.oak.friction"


def test_every_boundary_particle_is_counted() -> None:
    # perimeter 2 (32 + 50) mm at 1 mm, three blocks; at 3 mm the sides divide into 11 and 17
    shipped = SCENARIOS / "three_blocks.toml"
    assert describe(load_scenario(shipped)).particles == 3 * 164
    assert describe(load_scenario(shipped, ["contact.particle_spacing=0.003"])).particles == 3 * 2 * (11 + 17)


def test_more_output_costs_more_bytes_but_not_more_steps() -> None:
    shipped = SCENARIOS / "tower.toml"
    coarse, fine = (describe(load_scenario(shipped, [f"output.every={every}"])) for every in (0.001, 0.0001))
    assert fine.bytes > 9 * coarse.bytes
    assert fine.steps == coarse.steps


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
    brick = {"width": 0.1, "height": 0.1, "length": 0.1, "material": "oak"}
    square = {"outline": [[0.0, 0.0], [0.1, 0.0], [0.1, 0.1], [0.0, 0.1]], "depth": 0.1, "material": "oak"}
    seconds = []
    for block in (brick, square):
        scene = {
            "schema": 1,
            "name": "a",
            "materials": {"oak": {"density": 1000, "young_modulus": 1e9, "poisson_ratio": 0.3}},
            "blocks": {"one": block},
            "bodies": [{"block": "one", "x": 0.0, "y": 0.05}],
        }
        found = describe(scenario_from_mapping(scene))
        seconds.append(found.seconds / found.steps)
    assert 1.0 < seconds[1] / seconds[0] < 2.0


def test_kernels_of_a_crowd_cost_more_than_of_a_few() -> None:
    # every block of a wall touches others on all sides: measured 6 times the time a block and step
    few, many = (
        describe(
            load_scenario(
                SCENARIOS / "wall.toml",
                {
                    "contact.model": "kernel",
                    "structures.0.columns": columns,
                    "structures.0.rows": rows,
                },
            )
        )
        for columns, rows in ((3, 3), (20, 10))
    )
    a, b = (one.seconds / one.steps / len(one.bodies) for one in (few, many))
    assert 4.0 < b / a < 8.0

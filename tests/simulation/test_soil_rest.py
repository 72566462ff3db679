"""Soil and blocks that come to rest together before time zero: equilibrium, thrust, books, bits, refusals."""

import math
from typing import Any

import numpy as np
import pytest

from blocksim.errors import ScenarioError
from blocksim.scenario import Model, scenario_from_mapping
from blocksim.simulation import schemes, simulate
from blocksim.simulation.loop import Simulation
from blocksim.world.describe import describe
from blocksim.world.systems.soils import body_contacts, in_lifts
from tests.soils import DEPTH, MATERIALS, SMOOTH_WALLS, UNIT_WEIGHT, column, data_of, right

HEIGHT, COUNT, LENGTH = 0.32, 4, 0.35  # m, blocks, m of soil behind
SPACING = 0.01
REST = 0.3 / 0.7 * 0.5 * UNIT_WEIGHT * HEIGHT**2 * DEPTH  # N: pressure of elastic soil at rest, smooth faces
RANKINE = math.tan(math.radians(45 - 0.5 * 35)) ** 2 * 0.5 * UNIT_WEIGHT * HEIGHT**2 * DEPTH


def wall(width: float, *, sign: int = 1, end: float = 1.0, **changes: Any) -> dict[str, Any]:
    """Return a stack with soil of 35 degrees to its right, or left, to a smooth wall; as heavy as the soil."""
    table = column(LENGTH, HEIGHT, SPACING, material="sand")
    ends = (0.0, LENGTH)
    back = right(LENGTH)
    if sign < 0:
        table["x"], ends = [-LENGTH, 0.0], (-LENGTH, 0.0)
        back = {"from": [-LENGTH, 0.3], "to": [-LENGTH, 0.0], "material": "smooth"}
        back["from"] = [-LENGTH, 0.4]
    else:
        back["to"] = [LENGTH, 0.4]
    assert ends[0] == table["x"][0]
    materials = {**MATERIALS, "sand": {**MATERIALS["rods"], "friction_angle": "35 deg"}}
    materials["stone"] = {"unit_weight": 1.25 * UNIT_WEIGHT, "young_modulus": 3e7, "poisson_ratio": 0.2}
    size = {"width": width, "height": HEIGHT / COUNT, "length": DEPTH, "material": "stone"}
    bodies = [{"block": "one", "x": -0.5 * sign * width, "y": HEIGHT / COUNT * (k + 0.5)} for k in range(COUNT)]
    pairs = {"sand": {"smooth": {"friction": 0.0}, "stone": {"friction": 0.0}}}
    friction = {"block_block": 0.6, "block_ground": 0.6}
    data = data_of(table, blocks={"one": size}, bodies=bodies, walls=[back], materials=materials, pairs=pairs, end=end)
    del data["start"]
    return {**data, "friction": friction, **changes}


def thrust_on(simulation: Simulation) -> float:
    """Return the force (N) of soil on the blocks along x."""
    scene: Any = simulation.scene
    touching = body_contacts(scene.systems[0], scene.world)
    on_blocks = touching.body < len(simulation.names)
    return float(np.sum((touching.normal_force * touching.normal[:, 0])[on_blocks]))


def test_wall_beside_soil_begins_at_rest_between_the_active_thrust_and_that_at_rest_and_stays() -> None:
    simulation = Simulation(scenario_from_mapping(wall(0.16)))
    settled = simulation.settled
    assert settled is not None
    assert settled.at_rest
    assert RANKINE < -thrust_on(simulation) < REST
    before = simulation.bodies.copy()
    simulation.advance(to=0.3)
    moved = np.hypot(simulation.bodies.x - before.x, simulation.bodies.y - before.y)
    assert moved.max() < 1e-4 * 0.08
    assert simulation.energy().relative_residual < 1e-5
    assert settled.damping_J is not None
    assert settled.energy_error is not None
    assert settled.damping_J > 0.0
    assert settled.energy_error < 5e-3


def test_wall_that_cannot_hold_its_soil_falls_from_where_it_began_to_move_and_says_so() -> None:
    result = simulate(scenario_from_mapping(wall(0.085, end=0.1)))
    settled = result.summary.settled
    assert settled is not None
    assert not settled.at_rest
    assert settled.largest_displacement_mm <= 0.02 * 80.0
    assert any(text.startswith("no equilibrium before time zero: block 4 moves on") for text in result.summary.warnings)
    assert result.summary.movement is not None
    far = result.summary.movement.values["largest_displacement_mm"]
    assert isinstance(far, float)
    assert far > 0.05 * 80.0


def test_settled_wall_and_its_mirror_image_are_mirrored() -> None:
    places = []
    for sign in (1, -1):
        simulation = Simulation(scenario_from_mapping(wall(0.16, sign=sign))).advance(to=0.01)
        places.append(np.array([sign * simulation.bodies.x, simulation.bodies.y, sign * simulation.bodies.angle]))
    np.testing.assert_allclose(places[0], places[1], rtol=0.0, atol=1e-9)


def test_threads_change_no_bit_of_a_settled_wall() -> None:
    ends = [simulate(scenario_from_mapping(wall(0.16, end=0.01)), threads=threads) for threads in (1, 2)]
    assert len({one.summary.final_state_sha256 for one in ends}) == 1


def test_soil_alone_and_soil_beside_fixed_blocks_begin_as_they_are_placed() -> None:
    data = wall(0.16)
    assert Model(scenario_from_mapping(data)).settles
    fixed = [{**body, "fixed": True} for body in data["bodies"]]
    ramp = {**data["soils"][0], "start": "ramp"}
    for changes in ({"bodies": fixed}, {"start": {"settle": False}}, {"soils": [ramp]}):
        assert not Model(scenario_from_mapping({**data, **changes})).settles


@pytest.mark.parametrize(
    ("table", "values", "why"),
    [
        ("soils", {"start": "ramp"}, 'soil column has start = "ramp"'),
        ("bodies", {"velocity": [0.1, 0.0]}, "body 1 moves"),
        ("start", {"hold": ["2"]}, "body 2 is held"),
    ],
)
def test_settling_of_what_moves_before_is_refused_with_what_moves(table: str, values: dict[str, Any], why: str) -> None:
    data = wall(0.16, start={"settle": True})
    if table == "start":
        data["start"] |= values
    else:
        data[table][0] |= values
    with pytest.raises(ScenarioError, match=rf"start\.settle.*{why}"):
        scenario_from_mapping(data)


def test_pressure_at_rest_on_fixed_smooth_walls_is_that_of_elasticity_and_the_surface_stays_level() -> None:
    """Width and height are no multiples of the spacing."""
    width, height = 0.503, 0.297
    left = {"from": [0.0, 0.4], "to": [0.0, 0.0], "material": "smooth"}
    table = column(width, height, SPACING)
    stiff = {**MATERIALS, "rods": {**MATERIALS["rods"], "friction_angle": "35 deg"}}
    walls = [left, {"from": [width, 0.0], "to": [width, 0.4], "material": "smooth"}]
    pairs = {"rods": {**SMOOTH_WALLS["rods"], "ground": {"friction": 0.0}}}
    far = {"far": {"width": 0.1, "height": 0.1, "length": DEPTH, "material": "soft"}}
    bodies = [{"block": "far", "x": -1.0, "y": 0.05}]
    start = {"settle": True}
    data = data_of(table, materials=stiff, walls=walls, pairs=pairs, blocks=far, bodies=bodies, start=start)
    simulation = Simulation(scenario_from_mapping(data)).advance(to=0.01)
    scene: Any = simulation.scene
    touching = body_contacts(scene.systems[0], scene.world)
    for body in (1, 2):
        force = float(np.sum(touching.normal_force[touching.body == body]))
        assert force == pytest.approx(0.3 / 0.7 * 0.5 * UNIT_WEIGHT * height**2 * DEPTH, rel=0.02)
    own = scene.systems[0].points["y"]
    assert own.max() + 0.5 * SPACING == pytest.approx(height, abs=1e-3 * height)
    mass = schemes.system_totals(scene)[1]
    assert mass == pytest.approx(UNIT_WEIGHT / 9.81 * width * height * DEPTH, rel=1e-12)


def test_lifts_begin_with_their_own_weight_and_end_with_all_soil() -> None:
    data = wall(0.16)
    data["soils"][0]["lifts"] = 4
    model = Model(scenario_from_mapping(data))
    elements, chosen = in_lifts(model, 2)
    y, stress = elements.start[1, chosen], elements.start[5, chosen]
    np.testing.assert_allclose(stress, -UNIT_WEIGHT * (0.5 * HEIGHT - y))
    simulation = Simulation(model)
    settled, scene = simulation.settled, simulation.scene
    assert settled is not None
    assert settled.at_rest
    assert settled.energy_error is not None
    assert settled.energy_error < 5e-3
    mass = schemes.system_totals(scene)[1]
    assert mass == pytest.approx(UNIT_WEIGHT / 9.81 * LENGTH * HEIGHT * DEPTH)
    assert RANKINE < -thrust_on(simulation) < REST


def test_springs_into_which_the_wall_sinks_are_warned_of_with_a_stiff_enough_scale() -> None:
    soft = {**wall(0.16), "contact": {"stiffness_scale": 0.1}}
    (text,) = [one for one in describe(Model(scenario_from_mapping(soft))).warnings if "sinks" in one]
    assert text.startswith("block 1 sinks")
    soft["contact"] = {"stiffness_scale": float(text.split("stiffness_scale = ")[1].split()[0])}
    assert not [one for one in describe(Model(scenario_from_mapping(soft))).warnings if "sinks" in one]

"""Where bodies are at the start."""

import gc
import math
import weakref
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from blocksim.scenario import Scenario, load_scenario, place_bodies, scenario_from_mapping
from blocksim.scenario.overrides import freeze
from blocksim.scenario.placement import LENGTH_WITHOUT_BLOCKS, PlacedBody, reference_length, smallest_width
from tests.scenario.conftest import MATERIAL, data_of

BRICK = {"width": "32 mm", "height": "25 mm", "length": "50 mm", "material": "aluminium"}


def scenario_data(**tables: object) -> dict[str, object]:
    return data_of(materials={"aluminium": MATERIAL}, blocks={"brick": BRICK}, **tables)


def test_the_three_blocks_stand_as_in_the_experiment() -> None:
    path = Path(__file__).parents[2] / "scenarios" / "three_blocks_nominal.toml"
    bodies = place_bodies(load_scenario(path))
    assert [body.name for body in bodies] == ["1", "2", "3"]
    assert [body.x for body in bodies] == pytest.approx([0.016, 0.038, 0.060], abs=1e-15)
    assert [body.y for body in bodies] == pytest.approx([0.025, 0.075, 0.125], abs=1e-15)
    assert {(body.size_x, body.size_y, body.depth, body.angle) for body in bodies} == {(0.032, 0.05, 0.025, 0.0)}
    assert bodies[0].density == pytest.approx(2721.7, abs=0.05)
    assert bodies[0].mass == pytest.approx(0.10887, abs=5e-6)
    assert bodies[0].inertia == pytest.approx(0.10887 * (0.032**2 + 0.05**2) / 12, rel=1e-4)


def test_structures_come_before_bodies_and_numbers_run_on() -> None:
    stack = {"kind": "stack", "block": "brick", "count": 2}
    spec = {
        "block": "brick",
        "x": "1 m",
        "y": "1 m",
        "angle": "30 deg",
        "velocity": ["1 m/s", 0],
        "spin": "180 deg/s",
    }
    bodies = place_bodies(
        scenario_from_mapping(
            scenario_data(
                bodies=[spec, {"block": "brick", "x": 2, "y": 2, "name": "wall", "fixed": True}],
                structures=[stack, {**stack, "left": "0.1 m"}],
            )
        )
    )
    assert [body.name for body in bodies] == ["1", "2", "3", "4", "5", "wall"]
    moving, wall = bodies[4:]
    assert (moving.x, moving.y, moving.angle) == (1.0, 1.0, math.radians(30))
    assert (moving.vx, moving.vy, moving.spin, moving.fixed) == (1.0, 0.0, math.pi, False)
    assert (wall.x, wall.fixed, wall.spin) == (2.0, True, 0.0)


def test_a_scenario_is_placed_once_and_its_bodies_go_with_it() -> None:
    # placing a million blocks takes seconds; check, build and describe all ask for them
    path = Path(__file__).parents[2] / "scenarios" / "wall.toml"
    scenario = load_scenario(path)
    bodies = place_bodies(scenario)
    assert place_bodies(scenario) is bodies
    other = scenario.model_copy(update={"structures": ()})
    assert place_bodies(other) != bodies
    assert place_bodies(scenario) == bodies
    weak = weakref.ref(scenario)
    del scenario
    gc.collect()
    assert weak() is None


def placed_outline(outline: list[list[float]], **tables: object) -> PlacedBody:
    blocks = {"wedge": {"outline": outline, "depth": 0.5, "material": "aluminium"}, "brick": BRICK}
    data = data_of(materials={"aluminium": MATERIAL}, blocks=blocks, **tables)
    return place_bodies(Scenario.model_validate(freeze(data)))[0]


def test_a_block_with_an_outline_is_placed_by_its_centroid() -> None:
    body = placed_outline([[1, 2], [1, 5], [7, 2]], bodies=[{"block": "wedge", "x": 3, "y": 4, "angle": "30 deg"}])
    assert (body.x, body.y) == (3.0, 4.0)
    assert body.outline == body.corners == ((-2.0, -1.0), (4.0, -1.0), (-2.0, 2.0))
    assert (body.size_x, body.size_y, body.depth) == (6.0, 3.0, 0.5)
    assert body.mass == pytest.approx(1000 * 9 * 0.5)
    assert body.inertia == pytest.approx(body.mass * (3**2 + 6**2) / 18)  # right-angled triangle
    assert body.radius == pytest.approx(math.hypot(4, 1))


def test_structures_line_up_the_bounding_boxes_of_outlines() -> None:
    stack = {"kind": "stack", "block": "wedge", "count": 1, "left": 10, "bottom": 20}
    body = placed_outline([[0, 0], [6, 0], [0, 3]], structures=[stack], bodies=[])
    assert [(body.x + x, body.y + y) for x, y in body.corners] == [(10, 20), (16, 20), (10, 23)]
    push = {"kind": "dominoes", "block": "wedge", "count": 1, "spacing": 1, "push": 1}
    body = placed_outline([[0, 0], [6, 0], [0, 3]], structures=[push], bodies=[])
    # pivots about the lower right corner at (6, 0)
    assert (body.vx, body.vy) == pytest.approx((-body.spin * body.y, body.spin * (body.x - 6)))


def test_lengths_where_there_are_no_blocks_are_finite_and_those_of_blocks_as_they_are() -> None:
    assert reference_length(smallest_width([])) == reference_length(-math.inf) == LENGTH_WITHOUT_BLOCKS
    assert reference_length(0.025) == 0.025


@given(st.floats(1e-3, 1.0), st.floats(1e-3, 1.0), st.floats(1e-3, 1.0), st.floats(500.0, 8000.0))
def test_a_rectangle_given_as_an_outline_has_its_mass_to_the_last_bit(
    x: float, y: float, z: float, dense: float
) -> None:
    plain = PlacedBody("1", "brick", "stone", x, y, z, dense, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, False)
    other = plain._replace(outline=plain.corners)
    assert (other.mass, other.inertia, other.least_width) == (plain.mass, plain.inertia, plain.least_width)
    assert other.radius == plain.radius

"""Where bodies are at the start, what they may touch there, and where loads and joints find their faces."""

import gc
import math
import weakref
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

from blocksim.errors import ScenarioError
from blocksim.scenario import Document, Model, Scenario, load_scenario, scenario_from_mapping
from blocksim.scenario.models.loads import Face
from blocksim.scenario.open_faces import face_of, strip_before
from blocksim.scenario.overrides import freeze
from blocksim.scenario.placement import LENGTH_WITHOUT_BLOCKS, PlacedBody, reference_length, smallest_width
from blocksim.world.bodies import layout_of
from tests.golden import parsed
from tests.scenario.conftest import MATERIAL, SCENARIOS, data_of, edited, read

BRICK = {"width": "32 mm", "height": "25 mm", "length": "50 mm", "material": "aluminium"}


def test_the_three_blocks_stand_as_in_the_experiment() -> None:
    bodies = Model(load_scenario(SCENARIOS / "three_blocks_nominal.toml")).bodies
    assert [body.name for body in bodies] == ["1", "2", "3"]
    assert [body.x for body in bodies] == pytest.approx([0.016, 0.038, 0.060], abs=1e-15)
    assert [body.y for body in bodies] == pytest.approx([0.025, 0.075, 0.125], abs=1e-15)
    assert {(body.size_x, body.size_y, body.depth, body.angle) for body in bodies} == {(0.032, 0.05, 0.025, 0.0)}
    assert bodies[0].density == pytest.approx(2721.7, abs=0.05)
    assert bodies[0].mass == pytest.approx(0.10887, abs=5e-6)
    assert bodies[0].inertia == pytest.approx(0.10887 * (0.032**2 + 0.05**2) / 12, rel=1e-4)


def test_a_scenario_is_placed_once_and_its_bodies_go_with_it() -> None:
    # placing a million blocks takes seconds; check, build and describe all ask for them
    model = Model(SCENARIOS / "wall.toml")
    bodies = model.bodies
    assert Model(model).bodies is model.bodies is bodies
    assert layout_of(model).placed is bodies
    other = model.scenario.model_copy(update={"structures": ()})
    assert Model(other).bodies != bodies
    weak = weakref.ref(model.scenario)
    del model
    gc.collect()
    assert weak() is None


def placed_outline(outline: list[list[float]], **tables: object) -> PlacedBody:
    blocks = {"wedge": {"outline": outline, "depth": 0.5, "material": "aluminium"}, "brick": BRICK}
    data = data_of(materials={"aluminium": MATERIAL}, blocks=blocks, **tables)
    return Model(Scenario.model_validate(freeze(data))).bodies[0]


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


@given(st.floats(1e-3, 1.0), st.floats(1e-3, 1.0), st.floats(1e-3, 1.0), st.floats(500.0, 8000.0))
def test_a_rectangle_given_as_an_outline_has_its_mass_to_the_last_bit(
    x: float, y: float, z: float, dense: float
) -> None:
    plain = PlacedBody("1", "brick", "stone", x, y, z, dense, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, False)
    other = plain._replace(outline=plain.corners)
    assert (other.mass, other.inertia, other.least_width) == (plain.mass, plain.inertia, plain.least_width)
    assert other.radius == plain.radius
    assert reference_length(plain.least_width) == plain.least_width


def test_lengths_where_there_are_no_blocks_are_finite() -> None:
    assert reference_length(smallest_width([])) == reference_length(-math.inf) == LENGTH_WITHOUT_BLOCKS


PLACES = parsed((Path(__file__).parent / "valid" / "places.txt").read_text())


@pytest.mark.parametrize("place", [name for name in PLACES if name != "scenario"])
def test_a_body_may_be_there_free_or_fixed(place: str) -> None:
    document = Document.parse(edited(read(PLACES[place]), PLACES["scenario"]))
    document.build()
    document.with_values({"bodies.0.fixed": True}).build()


def test_too_many_pieces_of_boundary_and_probes_are_refused() -> None:
    points = [[float(i), 0.0] for i in range(1001)]
    walls = [{"from": [x, 9], "to": [x + 0.5, 9]} for x, _ in points]
    probes = [{"kind": "energy", "name": f"e{number}"} for number in range(201)]
    for name, tables, most in (
        ("points", {"ground": {"profile": points}}, 1000),
        ("walls", {"walls": walls}, 1000),
        ("probes", {"probes": probes}, 200),
    ):
        with pytest.raises(ScenarioError, match=f"{most + 1} {name} are too many; at most {most} are allowed"):
            scenario_from_mapping(data_of(bodies=[{"block": "brick", "x": 0, "y": 1}], **tables))


@pytest.mark.parametrize(
    ("face", "ends"),
    [("bottom", (0, 1)), (1, (0, 1)), ("left", (2, 0)), ("top", (1, 2)), ("30 deg", (1, 2))],
)
def test_the_face_of_an_outline_is_the_nearest_that_way_or_of_its_number(face: Face, ends: tuple[int, int]) -> None:
    wedge = [{"block": "wedge", "x": 0.1, "y": 0.1, "angle": "30 deg"}]
    body = placed_outline([[0, 0], [0.3, 0], [0, 0.3]], bodies=wedge)
    one, other = (body.corners[end] for end in ends)
    found = face_of(body.corners, face)
    assert found is not None
    assert {found[0], found[1]} == {one, other}
    strip = strip_before(body, face)
    assert strip.size_y == pytest.approx(1e-3 * 0.3 / math.sqrt(2.0))
    assert strip.size_x == pytest.approx(math.dist(one, other) - 2.0 * strip.size_y)
    normal = np.array([-math.sin(strip.angle), math.cos(strip.angle)])
    out = np.array(body.own_point(strip.x, strip.y)) - np.mean((one, other), axis=0)
    assert np.abs(np.hypot(*out)) == pytest.approx(0.5 * strip.size_y)
    turned = np.array(body.ground_point(*out)) - (body.x, body.y)
    assert abs(turned @ normal) == pytest.approx(0.5 * strip.size_y)

"""Where bodies are at the start, what they may touch there, and where loads and joints find their faces."""

import gc
import math
import weakref
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from blocksim.errors import ScenarioError
from blocksim.scenario import Scenario, load_scenario, place_bodies, scenario_from_mapping
from blocksim.scenario.models.loads import Face
from blocksim.scenario.open_faces import face_of, strip_before
from blocksim.scenario.overrides import freeze
from blocksim.scenario.placement import LENGTH_WITHOUT_BLOCKS, PlacedBody, reference_length, smallest_width
from blocksim.scenario.start import impossible_starts
from tests.scenario.conftest import BRICK as OAK_BRICK, MATERIAL, SCENARIOS, data_of

BRICK = {"width": "32 mm", "height": "25 mm", "length": "50 mm", "material": "aluminium"}


def scenario_data(**tables: object) -> dict[str, object]:
    return data_of(materials={"aluminium": MATERIAL}, blocks={"brick": BRICK}, **tables)


def test_the_three_blocks_stand_as_in_the_experiment() -> None:
    bodies = place_bodies(load_scenario(SCENARIOS / "three_blocks_nominal.toml"))
    assert [body.name for body in bodies] == ["1", "2", "3"]
    assert [body.x for body in bodies] == pytest.approx([0.016, 0.038, 0.060], abs=1e-15)
    assert [body.y for body in bodies] == pytest.approx([0.025, 0.075, 0.125], abs=1e-15)
    assert {(body.size_x, body.size_y, body.depth, body.angle) for body in bodies} == {(0.032, 0.05, 0.025, 0.0)}
    assert bodies[0].density == pytest.approx(2721.7, abs=0.05)
    assert bodies[0].mass == pytest.approx(0.10887, abs=5e-6)
    assert bodies[0].inertia == pytest.approx(0.10887 * (0.032**2 + 0.05**2) / 12, rel=1e-4)


def test_structures_come_before_bodies_and_numbers_run_on() -> None:
    stack = {"kind": "stack", "block": "brick", "count": 2}
    moved = {"x": "1 m", "y": "1 m", "angle": "30 deg", "velocity": ["1 m/s", 0], "spin": "180 deg/s"}
    loose = [{"block": "brick", **moved}, {"block": "brick", "x": 2, "y": 2, "name": "wall", "fixed": True}]
    data = scenario_data(bodies=loose, structures=[stack, {**stack, "left": "0.1 m"}])
    bodies = place_bodies(scenario_from_mapping(data))
    assert [body.name for body in bodies] == ["1", "2", "3", "4", "5", "wall"]
    moving, wall = bodies[4:]
    assert (moving.x, moving.y, moving.angle) == (1.0, 1.0, math.radians(30))
    assert (moving.vx, moving.vy, moving.spin, moving.fixed) == (1.0, 0.0, math.pi, False)
    assert (wall.x, wall.fixed, wall.spin) == (2.0, True, 0.0)


def test_a_scenario_is_placed_once_and_its_bodies_go_with_it() -> None:
    # placing a million blocks takes seconds; check, build and describe all ask for them
    scenario = load_scenario(SCENARIOS / "wall.toml")
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


SLOPE = math.atan(0.5)


def bricks_at(bodies: Sequence[Mapping[str, object]], **tables: object) -> dict[str, Any]:
    return data_of(bodies=[{"block": "brick", **body} for body in bodies], **tables)


def mistakes(data: dict[str, Any]) -> list[str]:
    try:
        scenario_from_mapping(data)
    except ScenarioError as error:
        return [problem.message for problem in error.problems]
    return []


def on_slope(gap: float, **keys: object) -> dict[str, Any]:
    """Place a brick on the slope y = x/2, its face `gap` m above it."""
    height = 0.05 + gap
    x, y = -height * math.sin(SLOPE), height * math.cos(SLOPE)
    return {"x": 1 + x, "y": 0.5 + y, "angle": f"{SLOPE!r} rad", **keys}


@pytest.mark.parametrize("fixed", [False, True])
@pytest.mark.parametrize(
    ("body", "tables"),
    [
        ({"x": 0, "y": 0.05}, {}),
        ({"x": -0.1, "y": 0.05}, {"ground": {"profile": [[0, 0], [0, 1]]}}),  # beside a riser
        ({"x": 0.1, "y": 1.05}, {"ground": {"profile": [[0, 0], [0, 1]]}}),  # on its upper level
        ({"x": 0, "y": 1.05}, {"ground": {"profile": [[-1, 0], [0, 1], [1, 0]]}}),  # on a tip
        (on_slope(0.0), {"ground": {"profile": [[0, 0], [2, 1]]}}),
        ({"x": 0.1, "y": 0.05}, {"walls": [{"from": [0, 0], "to": [0, 1]}]}),
        ({"x": 0, "y": 1.05}, {"walls": [{"from": [-1, 1], "to": [1, 1]}]}),  # on a shelf
        ({"x": 0, "y": 1.05}, {"walls": [{"from": [0, 0], "to": [0, 1]}]}),  # on the tip of a wall
        ({"x": 0, "y": 0.95}, {"walls": [{"from": [-1, 1], "to": [1, 1]}]}),  # below a shelf
        ({"x": 0, "y": 0.05}, {"beside": [{"x": 0.2, "y": 0.05, "fixed": True}]}),
    ],
)
def test_a_body_may_touch(body: dict[str, Any], tables: dict[str, Any], fixed: bool) -> None:
    others = {key: table for key, table in tables.items() if key != "beside"}
    assert mistakes(bricks_at([{**body, "fixed": fixed}, *tables.get("beside", [])], **others)) == []


@pytest.mark.parametrize(("gap", "message"), [(-0.9e-9, []), (-1e-6, ["body 1 reaches 0.001 mm into"])])
def test_a_nanometre_on_a_slope_is_forgiven(gap: float, message: list[str]) -> None:
    data = bricks_at([on_slope(gap)], ground={"profile": [[0, 0], [2, 1]]})
    assert [found[: len("body 1 reaches 0.001 mm into")] for found in mistakes(data)] == message


def test_the_level_ground_beyond_the_ends_of_a_profile_counts() -> None:
    profile = {"profile": [[0, 1], [1, 2]]}
    assert mistakes(bricks_at([{"x": -5, "y": 1.05}, {"x": 50, "y": 2.05}], ground=profile)) == []


def test_spacings_and_skins_count_for_the_blocks_in_use_and_the_models_that_use_them() -> None:
    tiny = {"width": 0.01, "height": 0.001, "length": 0.01, "material": "oak"}
    blocks = {"brick": OAK_BRICK, "tiny": tiny}
    coarse = {"particle_spacing": 0.03, "smoothing_length": 0.049, "model": "kernel"}
    wide = {"skin": 0.0011, "model": "particles", "particle_spacing": 5e-4}
    for contact in (coarse, wide):
        assert mistakes(bricks_at([{"x": 0, "y": 1}], blocks=blocks, contact=contact)) == []
    used: list[dict[str, object]] = [{"x": 0, "y": 1}, {"x": 1, "y": 1, "block": "tiny"}]
    assert mistakes(bricks_at(used, blocks=blocks, contact={**coarse, "model": "surface"})) == []


def test_a_skin_may_be_as_small_and_as_large_as_its_limits_and_round_off_far_away_refuses_none() -> None:
    for share in (1e-4, 1.0):
        assert mistakes(bricks_at([{"x": 0, "y": 1}], contact={"skin": share * OAK_BRICK["height"]})) == []
    assert mistakes(bricks_at([{"x": 0, "y": 1e13}])) == []


def test_too_many_pieces_of_boundary() -> None:
    points = [[float(i), 0.0] for i in range(1001)]
    walls = [{"from": [x, 9], "to": [x + 0.5, 9]} for x, _ in points]
    pieces: dict[str, dict[str, Any]] = {"points": {"ground": {"profile": points}}, "walls": {"walls": walls}}
    for name, tables in pieces.items():
        told = f"1001 {name} are too many; at most 1000 are allowed"
        assert mistakes(bricks_at([{"x": 0, "y": 1}], **tables)) == [told]


STONE = {"depth": 0.1, "material": "oak"}
BLOCKS = {
    "wedge": {"outline": [[0, 0], [0.3, 0], [0, 0.3]], **STONE},
    "hexagon": {"sides": 6, "radius": 0.1, **STONE},
    "keystone": {"outline": [[-0.1, 0], [0.1, 0], [0.2, 0.2], [-0.2, 0.2]], **STONE},
}
HIGH = 0.1 * math.sqrt(3.0) / 2.0


def outlined(bodies: list[dict[str, Any]], **tables: object) -> Scenario:
    return Scenario.model_validate(freeze(data_of(blocks=BLOCKS, bodies=bodies, **tables)))


def told(bodies: list[dict[str, Any]], **tables: object) -> list[tuple[object, str]]:
    return [(finding.path, finding.message) for finding in impossible_starts(outlined(bodies, **tables))]


def placed(block: str, x: float, y: float, angle: float = 0.0) -> PlacedBody:
    degrees = f"{math.degrees(angle)!r} deg" if angle else 0
    return place_bodies(outlined([{"block": block, "x": x, "y": y, "angle": degrees}]))[0]


WEDGE = {"block": "wedge", "x": 0.1, "y": 0.1}
TURNED = {"block": "wedge", "x": 0.2, "y": 0.2, "angle": "180 deg"}
ALLOWED: dict[str, tuple[list[dict[str, Any]], dict[str, Any]]] = {
    "a hexagon on its lowest side": ([{"block": "hexagon", "x": 0, "y": HIGH}], {}),
    "wedges in the box of one another": ([WEDGE, TURNED], {}),
    "a wedge on a slope of its own angle": ([TURNED], {"ground": {"profile": [[0, 0.3], [0.3, 0]]}}),
    "a wall past the slanted side": ([WEDGE], {"walls": [{"from": [0.31, 0], "to": [0, 0.31]}]}),
}


@pytest.mark.parametrize(("bodies", "tables"), ALLOWED.values(), ids=ALLOWED)
def test_outlines_may_touch(bodies: list[dict[str, Any]], tables: dict[str, Any]) -> None:
    assert told(bodies, **tables) == []


def test_loads_on_an_outline_are_accepted() -> None:
    force = {"kind": "force", "body": "1", "magnitude": 1, "point": [0.05, 0.05]}
    assert told([WEDGE], loads=[force, {"kind": "pressure", "body": "1", "magnitude": 1, "face": "left"}]) == []


@pytest.mark.parametrize(
    ("face", "ends"),
    [
        ("bottom", ((-0.1, -0.1), (0.2, -0.1))),
        (1, ((-0.1, -0.1), (0.2, -0.1))),
        ("left", ((-0.1, -0.1), (-0.1, 0.2))),
        ("top", ((-0.1, 0.2), (0.2, -0.1))),
        ("30 deg", ((-0.1, 0.2), (0.2, -0.1))),
    ],
)
def test_the_face_of_an_outline_is_the_nearest_that_way_or_that_of_its_number(
    face: Face, ends: tuple[tuple[float, float], ...]
) -> None:
    body = placed("wedge", 0.1, 0.1, math.radians(30))
    found = face_of(body.corners, face)
    assert found is not None
    assert np.array(found[:2]) == pytest.approx(np.array(ends), abs=1e-15)
    strip = strip_before(body, face)
    assert strip.size_y == pytest.approx(1e-3 * 0.3 / math.sqrt(2.0))
    assert strip.size_x == pytest.approx(math.dist(*ends) - 2.0 * strip.size_y)
    normal = np.array([-math.sin(strip.angle), math.cos(strip.angle)])
    out = np.array(body.own_point(strip.x, strip.y)) - np.mean(ends, axis=0)
    assert np.abs(np.hypot(*out)) == pytest.approx(0.5 * strip.size_y)
    turned = np.array(body.ground_point(*out)) - (body.x, body.y)
    assert abs(turned @ normal) == pytest.approx(0.5 * strip.size_y)

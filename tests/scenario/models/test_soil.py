"""Tables of soils and materials that are soils: what is refused, and where it is told."""

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from blocksim.errors import ScenarioError
from blocksim.scenario import load_scenario, scenario_from_mapping, scenario_hash, scenario_to_toml
from blocksim.scenario.models.soil import SoilTable
from tests.soils import BLOCKS, MATERIALS, column, data_of, scene

OUTLINE = {"name": "heap", "material": "rods", "spacing": 0.005}
CORNERS = [[0.2, 0.0], [0.3, 0.0], [0.2, 0.05]]


def problems(data: dict[str, Any]) -> list[str]:
    """Return what is told about a scenario, each with its key."""
    with pytest.raises(ScenarioError) as error:
        scenario_from_mapping(data)
    return [str(problem) for problem in error.value.problems]


@pytest.mark.parametrize(
    ("soil", "told"),
    [
        ({"material": "soft"}, ("soils", "material", '"soft" is no soil; give this material a friction_angle')),
        ({"material": "rod"}, ("soils", "material", "unknown material")),
        ({"spacing": 0.006}, ("soils", "spacing", "above an eighth of the smallest side of the blocks: at most 5 mm")),
        ({"x": [0.0, 0.019]}, ("soils", "spacing", "only 3 particles across")),
        ({"x": [-0.99, 0.1]}, ("soils", "soil column meets block 1")),
        ({"y": [-0.01, 0.1]}, ("soils", "soil column meets the ground")),
        ({"x": [0.1, 0.0]}, ("soils", "x", "the end must be beyond the begin")),
        ({"outline": CORNERS}, ("soils", "outline", "does not belong to kind")),
        ({"start": "geostatc"}, ("soils", "start", "did you mean")),
        ({"dilation": 0.0}, ("soils", "dilation", "unknown key")),
    ],
)
def test_a_soil_that_does_not_fit_is_told_with_its_key(soil: dict[str, Any], told: tuple[str, ...]) -> None:
    (problem,) = problems(data_of({**column(0.05, 0.05, 0.005), **soil}))
    assert all(part in problem for part in told), problem


@pytest.mark.parametrize(
    ("corners", "told"),
    [
        (CORNERS[:2], "at least three corners"),
        ([[0.2, 0.0], [0.3, 0.1], [0.3, 0.0], [0.2, 0.1]], "edges 1 and 3 of the outline meet"),
        ([*CORNERS, [0.2, 0.0]], "two corners are the same"),
        ([[0.0, 0.0], [0.1, 0.0], [0.1, 0.1], [0.0, 0.1]], "soil heap meets soil column"),
        ([[0.2, 0.0], [0.3, 0.0], [0.3, 0.1], [0.2, 0.1]], "soil heap meets wall 1"),
    ],
)
def test_an_outline_that_does_not_fit_is_told(corners: list[list[float]], told: str) -> None:
    wall = {"from": [0.25, 0.05], "to": [0.25, 0.2]}
    data = data_of(column(0.05, 0.05, 0.005), {**OUTLINE, "outline": corners}, walls=[wall])
    (problem,) = problems(data)
    assert told in problem


def test_ground_that_rises_between_the_corners_of_a_soil_is_told_as_ground_and_not_as_a_wall() -> None:
    step = {"profile": [[-1.5, 0.0], [0.034, 0.0], [0.035, 0.02]]}
    heap = {**OUTLINE, "outline": [[0.0, 0.0], [0.06, 0.03], [0.06, 0.1], [0.0, 0.1]]}
    told = problems(data_of(heap, ground=step, walls=[{"from": [0.9, 0.1], "to": [0.9, 0.02]}]))
    assert told, "the edge from the left runs through the step"
    assert all("meets the ground near x = " in one for one in told), told


SLOPE = {**column(0.3, 0.1, 0.005), "kind": "slope", "angle": "45 deg"}


@pytest.mark.parametrize(
    ("angle", "corners"),
    [
        ("45 deg", [(0.0, 0.0), (0.3, 0.0), (0.3, 0.1), (0.1, 0.1)]),
        ("135 deg", [(0.0, 0.0), (0.3, 0.0), (0.2, 0.1), (0.0, 0.1)]),
        ("90 deg", [(0.0, 0.0), (0.3, 0.0), (0.3, 0.1), (0.0, 0.1)]),
    ],
)
def test_a_slope_rises_from_its_foot_to_its_crest(angle: str, corners: list[tuple[float, float]]) -> None:
    (table,) = scene({**SLOPE, "angle": angle}).systems["soils"]
    assert isinstance(table, SoilTable)
    np.testing.assert_allclose(table.corners, corners, atol=1e-15)
    again = scenario_from_mapping(tomllib.loads(scenario_to_toml(scene({**SLOPE, "angle": angle}))))
    assert again.systems == scene({**SLOPE, "angle": angle}).systems


@pytest.mark.parametrize(
    ("soil", "told"),
    [
        ({"angle": "18 deg"}, ("soils", "angle", "the face reaches the other end below the crest")),
        ({"angle": "0 deg"}, ("soils", "angle", "above 0")),
        ({"angle": None}, ('kind "slope" needs the key angle',)),
        ({"angle": 45}, ("soils", "angle", "deg")),
        ({"kind": "rectangle"}, ("soils", "angle", "does not belong to kind")),
        ({"outline": CORNERS}, ("soils", "outline", "does not belong to kind")),
    ],
)
def test_a_slope_that_cannot_be_is_told_with_its_key(soil: dict[str, Any], told: tuple[str, ...]) -> None:
    (problem,) = problems(data_of({key: value for key, value in {**SLOPE, **soil}.items() if value is not None}))
    assert all(part in problem for part in told), problem


def test_soils_may_touch_what_they_stand_beside() -> None:
    wall = {"from": [0.05, 0.0], "to": [0.05, 0.2]}
    beside = {**column(0.05, 0.05, 0.005), "name": "upper", "y": [0.05, 0.1]}
    scene(column(0.05, 0.05, 0.005), beside, walls=[wall])


@pytest.mark.parametrize(
    ("material", "told"),
    [
        ({"cohesion": 100.0}, ("materials.soft.cohesion", "give friction_angle too")),
        ({"friction_angle": "20 deg", "dilation": "5 deg"}, ("materials.soft.dilation", "dilates is not available")),
        ({"friction_angle": "20 deg"}, ("blocks.far.material", '"soft" is soil')),
        ({"friction_angle": 20}, ("materials.soft.friction_angle", 'write "20 deg"')),
    ],
)
def test_a_material_is_soil_or_not(material: dict[str, Any], told: tuple[str, ...]) -> None:
    materials = {**MATERIALS, "soft": {**MATERIALS["soft"], **material}}
    (problem,) = problems(data_of(column(0.05, 0.05, 0.005), materials=materials))
    assert all(part in problem for part in told), problem


def test_a_thin_polygon_beside_soil_wants_particles_of_an_eighth_of_its_width() -> None:
    wedge = {"outline": [[0.0, 0.0], [0.08, 0.0], [0.0, 0.03]], "depth": 0.1, "material": "soft"}
    bodies = [{"block": "wedge", "x": -1.0, "y": 0.5}]
    (problem,) = problems(data_of(column(0.05, 0.05, 0.005), blocks={"wedge": wedge}, bodies=bodies))
    assert "above an eighth of the smallest side of the blocks: at most 3.511 mm" in problem


def test_soil_needs_springs_and_exact_shapes() -> None:
    data = data_of(column(0.05, 0.05, 0.005), contact={"model": "kernel", "particle_spacing": 0.005})
    assert any("does not go with soil" in one for one in problems(data))
    rigid = data_of(column(0.05, 0.05, 0.005), time={"scheme": "nonsmooth", "end": 1.0})
    assert any("soils need another scheme" in one for one in problems(rigid))


@pytest.mark.parametrize(
    ("material", "place"),
    [
        ({"friction_angle": "22 deg"}, {}),
        ({"cohesion": 1.0}, {}),
        ({"yield_surface": "plane-strain-associated"}, {}),
        ({}, {"y": [0.0, 0.06]}),
        ({}, {"spacing": 0.0025}),
        ({}, {"start": "ramp"}),
        ({}, {"gradient": "raw"}),
    ],
)
def test_the_hash_changes_with_what_and_where_a_soil_is(material: dict[str, Any], place: dict[str, Any]) -> None:
    materials = {**MATERIALS, "rods": {**MATERIALS["rods"], **material}}
    table = column(0.05, 0.05, 0.005)
    assert scenario_hash(scene({**table, **place}, materials=materials)) != scenario_hash(scene(table))


def test_a_scenario_with_soil_is_written_and_read_back(tmp_path: Path) -> None:
    before = scene({**OUTLINE, "outline": CORNERS})
    (tmp_path / "soil.toml").write_text(scenario_to_toml(before))
    after = load_scenario(tmp_path / "soil.toml")
    (table,) = after.systems["soils"]
    assert isinstance(table, SoilTable)
    assert after == before
    assert BLOCKS["far"]["width"] == after.blocks["far"].width

"""Tables of soils and materials that are soils; wrong ones are in broken/soils.txt."""

import tomllib
from typing import Any

import numpy as np
import pytest

from blocksim.errors import ScenarioError
from blocksim.scenario import Model, geometry, placement, scenario_from_mapping, scenario_to_toml, start
from blocksim.scenario.models.soil import SoilTable
from blocksim.world.systems import others_of
from tests.soils import DEPTH, GRAVITY, MATERIALS, UNIT_WEIGHT, column, data_of, scene

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
    before = scene({**SLOPE, "angle": angle})
    (table,) = before.systems["soils"]
    assert isinstance(table, SoilTable)
    np.testing.assert_allclose(table.corners, corners, atol=1e-15)
    assert scenario_from_mapping(tomllib.loads(scenario_to_toml(before))).systems == before.systems


def test_soils_may_touch_what_they_stand_beside() -> None:
    wall = {"from": [0.05, 0.0], "to": [0.05, 0.2]}
    beside = {**column(0.05, 0.05, 0.005), "name": "upper", "y": [0.05, 0.1]}
    scene(column(0.05, 0.05, 0.005), beside, walls=[wall])


def test_the_hash_changes_with_what_and_where_a_soil_is() -> None:
    table = column(0.05, 0.05, 0.005)
    hashes = {Model(scene(table)).hash}
    for material in ({"friction_angle": "22 deg"}, {"cohesion": 1.0}, {"yield_surface": "plane-strain-associated"}):
        materials = {**MATERIALS, "rods": {**MATERIALS["rods"], **material}}
        hashes.add(Model(scene(table, materials=materials)).hash)
    for place in ({"y": [0.0, 0.06]}, {"spacing": 0.0025}, {"start": "ramp"}, {"gradient": "raw"}):
        hashes.add(Model(scene({**table, **place})).hash)
    assert len(hashes) == 1 + 3 + 4


def arch_under(level: float) -> dict[str, Any]:
    """Return the data of an arch with abutments under fill to a level (m)."""
    fill = {"name": "fill", "material": "rods", "kind": "fill", "x": [-0.1, 1.5], "y": [0.0, level], "spacing": 0.01}
    arch = {"kind": "arch", "block": "cell", "span": 1.0, "thickness": 0.12, "count": 9, "abutments": True}
    blocks = {"cell": {"depth": 0.1, "material": "soft"}}
    return data_of(fill, blocks=blocks, structures=[arch], bodies=[])


def test_fill_lies_around_and_above_blocks_but_not_in_and_below_them() -> None:
    scenario = scenario_from_mapping(arch_under(0.8))
    (soil,) = placement.soil_tables(scenario)
    bodies = Model(scenario).bodies
    places, area = start.particle_places(soil, bodies)
    outlines = [np.array([body.ground_point(*at) for at in body.corners]) for body in bodies]
    apart = np.min([geometry.edge_distance(places, corners) for corners in outlines], axis=0)
    assert apart.min() >= 0.4999 * soil.spacing
    for corners in outlines:
        assert not geometry.is_inside(places, corners).any()
        assert not geometry.height_above(corners, places).any()
    grid = np.stack(np.meshgrid(np.arange(-0.0975, 1.5, 5e-3), np.arange(2.5e-3, 0.8, 5e-3)), axis=-1).reshape(-1, 2)
    covered = np.max([geometry.height_above(corners, grid) for corners in outlines], axis=0) > 0.0
    covered |= np.any([geometry.is_inside(grid, corners) for corners in outlines], axis=0)
    assert area == pytest.approx(25e-6 * np.count_nonzero(~covered), rel=0.02)
    assert [*start.gaps(soil, scenario, bodies)] == []


def test_fill_without_room_for_a_particle_says_so() -> None:
    data = arch_under(0.04)
    data["soils"][0]["x"] = [0.0, 0.1]
    with pytest.raises(ScenarioError, match="soil fill meets blocks everywhere: no particle has room"):
        scenario_from_mapping(data)


def test_rows_fill_an_outline_that_the_spacing_does_not_divide() -> None:
    scenario = scene(column(0.103, 0.048, 0.005))
    (elements,) = [one.elements for one in others_of(Model(scenario))]
    x, y = elements.start[:2]
    assert [x.min(), x.max(), y.min(), y.max()] == pytest.approx([0.0025, 0.1005, 0.0025, 0.0455])
    assert elements.constants[0].sum() == pytest.approx(UNIT_WEIGHT / GRAVITY * 0.103 * 0.048 * DEPTH)


def test_gap_to_a_block_is_named_with_its_width() -> None:
    block = {"wall": {"width": 0.04, "height": 0.06, "length": DEPTH, "material": "soft"}}
    for gap, named in ((0.0, []), (0.001, []), (0.0025, [("block 1", 0.0025)])):
        scenario = scene(
            column(0.1, 0.05, 0.005), blocks=block, bodies=[{"block": "wall", "x": -0.02 - gap, "y": 0.03}]
        )
        (soil,) = placement.soil_tables(scenario)
        found = [*start.gaps(soil, scenario, Model(scenario).bodies)]
        assert [(name, round(width, 9)) for name, width in found] == named
        warned = [text for text in Model(scenario).implausible_values if "gap" in text]
        assert len(warned) == len(named)

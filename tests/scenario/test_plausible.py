"""Warnings about values that are allowed and hardly meant."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from blocksim.scenario import Document
from blocksim.scenario.check import implausible_values
from tests.soils import column, scene

THREE_BLOCKS = Path(__file__).parents[2] / "scenarios" / "three_blocks.toml"
APART = THREE_BLOCKS.with_name("bounce.toml")  # one block, of any size


@pytest.mark.parametrize(
    ("settings", "suspects"),
    [
        ({"friction.block_block": 33}, ["friction.block_block = 33"]),
        ({"friction.block_ground.static": 20}, ["friction.block_ground = 20"]),
        ({"pairs.aluminium.ground.friction": 30}, ["pairs.aluminium.ground.friction = 30"]),
        ({"sweep": {"friction.block_block": [0.3, 25, 20]}}, ["friction.block_block = 25"]),
        ({"sweep": {"mode": "lhs", "friction.block_block": {"from": 20.0, "to": 30.0}}}, ["friction.block_block = 30"]),
        ({"friction.block_block": "33 deg", "friction.block_ground": 1.2}, []),
        ({"sweep": {"friction.block_block": ["20 deg", "30 deg"]}}, []),
        ({"sweep": {"gravity": [9.81, 20.0]}}, []),
    ],
)
def test_friction_angle_without_its_unit_is_warned_of(settings: dict[str, Any], suspects: list[str]) -> None:
    found = implausible_values(Document.read(THREE_BLOCKS).with_values(settings).build())
    assert [text.partition(" is a friction coefficient; for an angle write ")[0] for text in found] == suspects


@pytest.mark.parametrize(
    ("settings", "expected"),
    [
        ({"materials.aluminium": {"density": 2.4}}, ["materials.aluminium.density makes 2.4 kg/m^3"]),
        ({"materials.aluminium.unit_weight": 26.7}, ["materials.aluminium.unit_weight makes 2.722 kg/m^3"]),
        ({"materials.aluminium.young_modulus": 69}, ["materials.aluminium.young_modulus = 69 Pa"]),
        ({"blocks.brick.width": 600}, ["blocks.brick.width makes 600 m"]),
        ({"materials.aluminium.young_modulus": "0.1 MPa", "blocks.brick.width": "2 m"}, []),
        ({"blocks.brick": {"outline": [[0, 0], [90, 0], [0, 120]], "depth": 1}}, ["blocks.brick.outline makes 150 m"]),
        ({"blocks.brick": {"outline": [[0, 0], [1, 0], [0, 1]], "depth": 100}}, ["blocks.brick.depth makes 100 m"]),
        ({"blocks.brick": {"sides": 6, "radius": 40, "depth": 1}}, ["blocks.brick.radius makes 80 m"]),
        ({"blocks.brick": {"sides": 6, "radius": "0.1 m", "depth": "100 mm"}}, []),
    ],
)
def test_numbers_that_look_like_another_unit_are_warned_of(settings: dict[str, Any], expected: list[str]) -> None:
    rest: dict[str, dict[str, Any]] = {
        "materials": {"poisson_ratio": 0.3, "young_modulus": 69e9},
        "blocks": {"material": "aluminium"},
    }
    given = {
        key: {**rest[key.split(".")[0]], **value} if isinstance(value, dict) else value
        for key, value in settings.items()
    }
    given["bodies.0.y"] = 500
    found = implausible_values(Document.read(APART).with_values(given).build())
    assert [text.removesuffix("; is the unit right?") for text in found] == expected


@pytest.mark.parametrize(("unit", "warned"), [({}, True), ({"unit": "1 mm"}, False)])
def test_a_drawing_in_mm_that_is_read_in_m_is_warned_of(tmp_path: Path, unit: dict[str, str], *, warned: bool) -> None:
    squares = [[[0, 25 * i], [50, 25 * i], [50, 25 + 25 * i], [0, 25 + 25 * i]] for i in range(3)]
    drawing = {"type": "MultiPolygon", "coordinates": [[[*one, one[0]]] for one in squares]}
    (tmp_path / "wall.geojson").write_text(json.dumps(drawing))
    structure = {"kind": "polygons", "table": "wall.geojson", "block": "stone", **unit}
    given = Document.read(APART).with_values(
        {"blocks.stone": {"depth": 0.1, "material": "aluminium"}, "structures": [structure], "bodies": []}
    )
    found = implausible_values(replace(given, folder=tmp_path).build())
    assert found == ['structures.0: blocks of 55.9 m; for a drawing in mm add unit = "1 mm"'] * warned


@pytest.mark.parametrize(
    ("settings", "expected"),
    [
        ({}, []),
        ({"spacing": 0.004}, ["soils.column.spacing = 4 mm fills 48 of 50 mm of the height; 3.846 mm fills all"]),
        ({"x": [0.0, 0.1004]}, []),  # less than a hundredth
        ({"x": [0.0, 0.104]}, ["soils.column.spacing = 5 mm fills 100 of 104 mm of the width; 4.952 mm fills all"]),
    ],
)
def test_soil_that_leaves_a_part_of_its_shape_empty_is_warned_of(settings: dict[str, Any], expected: list[str]) -> None:
    found = implausible_values(scene({**column(0.1, 0.05, 0.005), **settings}))
    assert found == expected

"""Warnings about values that are allowed and hardly meant."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

from blocksim.scenario import Document
from blocksim.scenario.check import implausible_values
from tests.golden import Golden
from tests.scenario.conftest import SCENARIOS
from tests.soils import column, scene

THREE_BLOCKS = SCENARIOS / "three_blocks.toml"
APART = THREE_BLOCKS.with_name("bounce.toml")  # one block, of any size


FRICTIONS: list[dict[str, Any]] = [
    {"friction.block_block": 33},
    {"friction.block_ground.static": 20},
    {"pairs.aluminium.ground.friction": 30},
    {"sweep": {"friction.block_block": [0.3, 25, 20]}},
    {"sweep": {"mode": "lhs", "friction.block_block": {"from": 20.0, "to": 30.0}}},
    {"friction.block_block": "33 deg", "friction.block_ground": 1.2},
    {"sweep": {"friction.block_block": ["20 deg", "30 deg"]}},
    {"sweep": {"gravity": [9.81, 20.0]}},
]
SIZES: list[dict[str, Any]] = [
    {"materials.aluminium": {"density": 2.4, "poisson_ratio": 0.3, "young_modulus": 69e9}},
    {"materials.aluminium.unit_weight": 26.7},
    {"materials.aluminium.young_modulus": 69},
    {"blocks.brick.width": 600},
    {"materials.aluminium.young_modulus": "0.1 MPa", "blocks.brick.width": "2 m"},
    {"blocks.brick": {"outline": [[0, 0], [90, 0], [0, 120]], "depth": 1, "material": "aluminium"}},
    {"blocks.brick": {"outline": [[0, 0], [1, 0], [0, 1]], "depth": 100, "material": "aluminium"}},
    {"blocks.brick": {"sides": 6, "radius": 40, "depth": 1, "material": "aluminium"}},
    {"blocks.brick": {"sides": 6, "radius": "0.1 m", "depth": "100 mm", "material": "aluminium"}},
]
SOILS: list[dict[str, Any]] = [{}, {"spacing": 0.004}, {"x": [0.0, 0.1004]}, {"x": [0.0, 0.104]}]


def test_values_that_are_hardly_meant_are_warned_of(golden: Golden) -> None:
    scenarios = [
        *((values, Document.read(THREE_BLOCKS).with_values(values).build()) for values in FRICTIONS),
        *((values, Document.read(APART).with_values({**values, "bodies.0.y": 500}).build()) for values in SIZES),
        *((values, scene({**column(0.1, 0.05, 0.005), **values})) for values in SOILS),
    ]
    golden("\n\n".join("\n".join([json.dumps(values), *implausible_values(one)]) for values, one in scenarios))


def test_a_drawing_in_mm_that_is_read_in_m_is_warned_of(tmp_path: Path) -> None:
    squares = [[[0, 25 * i], [50, 25 * i], [50, 25 + 25 * i], [0, 25 + 25 * i]] for i in range(3)]
    drawing = {"type": "MultiPolygon", "coordinates": [[[*one, one[0]]] for one in squares]}
    (tmp_path / "wall.geojson").write_text(json.dumps(drawing))
    for unit, count in ({}, 1), ({"unit": "1 mm"}, 0):
        structure = {"kind": "polygons", "table": "wall.geojson", "block": "stone", **unit}
        stone = {"blocks.stone": {"depth": 0.1, "material": "aluminium"}, "structures": [structure], "bodies": []}
        found = implausible_values(replace(Document.read(APART).with_values(stone), folder=tmp_path).build())
        assert found == ['structures.0: blocks of 55.9 m; for a drawing in mm add unit = "1 mm"'] * count

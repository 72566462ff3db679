"""Warnings about values that are allowed and hardly meant."""

import json
import tomllib
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


VALUES: dict[str, list[dict[str, Any]]] = tomllib.loads(Path(__file__).with_name("plausible.toml").read_text())


def test_values_that_are_hardly_meant_are_warned_of(golden: Golden) -> None:
    scenarios = [
        *((values, Document.read(THREE_BLOCKS).with_values(values).build()) for values in VALUES["three_blocks"]),
        *(
            (values, Document.read(APART).with_values({**values, "bodies.0.y": 500}).build())
            for values in VALUES["bounce"]
        ),
        *((values, scene({**column(0.1, 0.05, 0.005), **values})) for values in VALUES["soil"]),
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

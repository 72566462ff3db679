"""Drawings of where blocks ended: the corners of the last frame, and read back by a scenario."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from blocksim.errors import InvalidInputError
from blocksim.scenario import load_scenario, place_bodies
from blocksim.scenario.structures.polygons import read_drawing
from blocksim.simulation.files import refuse_foreign
from blocksim.simulation.stores.exports import write_dxf, write_geojson
from blocksim.view.scene import corners
from tests.view.made_up import polygons, toppling

SCENARIO = load_scenario(Path(__file__).parents[3] / "scenarios" / "three_blocks.toml")
WEDGE = ((-0.01, -0.01), (0.02, -0.01), (-0.01, 0.02))
FRAMES = polygons(toppling(3, steps=5), WEDGE, ((-0.01, -0.01), (0.01, -0.01), (0.01, 0.01), (-0.01, 0.01)))


def test_geojson_has_the_last_outlines_with_their_blocks(tmp_path: Path) -> None:
    path = tmp_path / "end.geojson"
    assert write_geojson(path, FRAMES, SCENARIO) == 3
    refuse_foreign(path)  # it is one of blocksim
    data = json.loads(path.read_text())
    assert [one["properties"]["name"] for one in data["features"]] == ["1", "2", "3"]
    assert data["features"][2]["properties"]["rotation_deg"] == pytest.approx(-90.0)
    read = read_drawing(path)
    placed = place_bodies(SCENARIO)
    for number, (one, count) in enumerate(zip(read, (3, 4, 3), strict=True)):
        assert np.array(one.outline) == pytest.approx(1e-3 * corners(FRAMES, 4)[number, :count])
        assert one.properties["block"] == placed[number].block


def test_removed_blocks_and_frames_that_are_not_finite_are_left_out(tmp_path: Path) -> None:
    x, vx = FRAMES.x.copy(), FRAMES.vx.copy()
    x[4, 0], vx[3, 1] = np.nan, np.nan
    assert write_geojson(tmp_path / "end.geojson", replace(FRAMES, x=x, vx=vx), SCENARIO) == 2
    first = read_drawing(tmp_path / "end.geojson")[0]
    assert np.array(first.outline) == pytest.approx(1e-3 * corners(FRAMES, 3)[0, :3])
    with pytest.raises(InvalidInputError, match="no frame to export"):
        write_geojson(tmp_path / "end.geojson", replace(FRAMES, x=np.full_like(x, np.nan)), SCENARIO)


def test_dxf_has_them_in_the_layers_of_their_blocks(tmp_path: Path) -> None:
    pytest.importorskip("ezdxf", reason="DXF needs the extra dxf")
    path = tmp_path / "end.dxf"
    assert write_dxf(path, FRAMES, SCENARIO) == 3
    refuse_foreign(path)  # it is one of blocksim
    read = read_drawing(path)
    assert {one.properties["block"] for one in read} == {place_bodies(SCENARIO)[0].block}
    assert np.array(read[0].outline) == pytest.approx(1e-3 * corners(FRAMES, 4)[0, :3])


def test_dxf_keeps_names_and_what_is_fixed(tmp_path: Path) -> None:
    pytest.importorskip("ezdxf", reason="DXF needs the extra dxf")
    support = {"block": "brick", "x": "0.5 m", "y": "25 mm", "fixed": True, "name": "key-stone"}
    scenario = load_scenario(Path(__file__).parents[3] / "scenarios" / "three_blocks.toml", {"bodies": [support]})
    write_dxf(tmp_path / "end.dxf", toppling(4, steps=2), scenario)
    told = [(one.properties["name"], one.properties["fixed"]) for one in read_drawing(tmp_path / "end.dxf")]
    assert told == [(body.name, body.fixed) for body in place_bodies(scenario)]
    assert ("key-stone", True) in told

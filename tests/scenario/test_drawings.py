"""Drawings: what polygons of GeoJSON and polylines of DXF become; wrong ones are in broken/files."""

import json
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from blocksim.errors import InvalidInputError, ScenarioError, UnavailableError
from blocksim.scenario import Scenario, load_scenario, place_bodies, scenario_hash, scenario_to_toml
from blocksim.scenario.document import Document
from blocksim.scenario.structures.polygons import DrawingError, read_drawing, simplify

SQUARE = [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]
WEDGE = [[1, 0], [1.5, 0.0], [2, 0], [1, 1], [1, 0]]
TEXT = """
schema = 1
name = "drawn"
materials.stone = { density = 2000, young_modulus = 1e9, poisson_ratio = 0.2 }
blocks.stone = { depth = 1, material = "stone" }
blocks.pier = { depth = 2, material = "stone" }
structures = [{ kind = "polygons", block = "stone", table = "wall.geojson", unit = "1 cm" }]
time.scheme = "nonsmooth"
"""


def feature(*rings: Any, **properties: Any) -> dict[str, Any]:
    return {"type": "Feature", "properties": properties, "geometry": {"type": "Polygon", "coordinates": [*rings]}}


def collection(*features: Any) -> dict[str, Any]:
    return {"type": "FeatureCollection", "features": [*features]}


def written(folder: Path, data: object, name: str = "wall.geojson") -> Path:
    (folder / name).write_text(data if isinstance(data, str) else json.dumps(data))
    (folder / "scene.toml").write_text(TEXT)
    return folder / name


def loaded(folder: Path) -> Scenario:
    return load_scenario(folder / "scene.toml")


def test_every_polygon_is_a_block_and_its_properties_are_taken(tmp_path: Path) -> None:
    written(tmp_path, collection(feature(SQUARE, block="pier", fixed=True, name="A1", other=3), feature(WEDGE)))
    pier, wedge = place_bodies(loaded(tmp_path))
    assert (pier.name, pier.block, pier.depth, pier.fixed) == ("A1", "pier", 2.0, True)
    assert (wedge.name, wedge.block, wedge.fixed) == ("2", "stone", False)
    assert len(wedge.outline) == 3  # the point within the straight edge is left out
    assert (pier.x, pier.y) == pytest.approx((0.005, 0.005))
    assert wedge.mass == pytest.approx(2000 * 0.5e-4)


def test_results_keep_the_blocks_and_need_the_drawing_no_more(tmp_path: Path) -> None:
    drawing = written(tmp_path, collection(feature(SQUARE), feature(WEDGE)))
    first = loaded(tmp_path)
    text = scenario_to_toml(first)
    drawing.unlink()
    again = Document.parse(text).build()
    assert place_bodies(again) == place_bodies(first)
    assert scenario_hash(again) == scenario_hash(first)


def test_geometries_without_features_are_read(tmp_path: Path) -> None:
    polygon = {"type": "Polygon", "coordinates": [SQUARE]}
    several = {"type": "MultiPolygon", "coordinates": [[SQUARE], [WEDGE]]}
    collected = {"type": "GeometryCollection", "geometries": [polygon, polygon]}
    assert [len(read_drawing(written(tmp_path, data))) for data in (polygon, several, collected)] == [1, 2, 2]


def test_more_outlines_than_a_scenario_may_have_and_drawings_outside_are_refused(tmp_path: Path) -> None:
    written(tmp_path, collection(*[feature(SQUARE)] * 2001))
    with pytest.raises(ScenarioError, match="2001 outlines are too many"):
        loaded(tmp_path)
    (tmp_path / "inner").mkdir()
    (tmp_path / "inner" / "scene.toml").write_text(TEXT.replace("wall.geojson", "../wall.geojson"))
    with pytest.raises(ScenarioError, match="outside"):
        loaded(tmp_path / "inner")


def test_dxf_without_its_package_names_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "ezdxf", None)
    with pytest.raises(UnavailableError, match=r"pip install 'blocksim\[dxf\]'"):
        read_drawing(written(tmp_path, "", "wall.dxf"))


def test_settings_in_the_current_folder_do_not_reach_the_reader_of_dxf(tmp_path: Path) -> None:
    (tmp_path / "ezdxf.ini").write_text("[core]\nlog_unprocessed_tags = true\n")
    code = (
        "from blocksim.extras import load_module; print(load_module('ezdxf', 'reading').options.log_unprocessed_tags)"
    )
    command = [sys.executable, "-c", code]
    assert subprocess.run(command, cwd=tmp_path, check=True, capture_output=True).stdout == b"False\n"


def test_closed_polylines_of_a_dxf_file_are_blocks_by_their_layers(tmp_path: Path) -> None:
    ezdxf = pytest.importorskip("ezdxf", reason="reading DXF needs the extra dxf")
    document = ezdxf.new()
    space = document.modelspace()
    space.add_lwpolyline([(0, 0), (1, 0), (1, 1), (0, 1)], close=True, dxfattribs={"layer": "pier"})
    space.add_polyline2d([(1, 0), (2, 0), (1, 1)], close=True)
    space.add_lwpolyline([(0, 0), (5, 5)])
    space.add_line((0, 0), (1, 1))
    document.saveas(tmp_path / "wall.dxf")
    first, second = read_drawing(tmp_path / "wall.dxf")
    assert (first.outline, first.properties) == ([(0, 0), (1, 0), (1, 1), (0, 1)], {"block": "pier"})
    assert (second.outline, second.properties) == ([(1, 0), (2, 0), (1, 1)], {})
    space.add_lwpolyline([(0, 0, 0.5), (1, 0, 0), (1, 1, 0)], format="xyb", close=True)
    document.saveas(tmp_path / "arcs.dxf")
    with pytest.raises(DrawingError, match="has arcs"):
        read_drawing(tmp_path / "arcs.dxf")
    for damaged in (b"", b"no drawing", b"\0" * 100, b"0\nSECTION\n2\nENTITIES\n0\nLWPOLYLINE\n90\nx\n"):
        (tmp_path / "wall.dxf").write_bytes(damaged)
        with pytest.raises((DrawingError, InvalidInputError)):
            read_drawing(tmp_path / "wall.dxf")


def test_only_points_within_straight_edges_are_left_out() -> None:
    square = [(0.0, 0.0), (0.5, 0.0), (1.0, 0.0), (1.0, 1.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0)]
    assert simplify(square) == [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
    polygon = [(math.cos(0.4 * k), math.sin(0.4 * k)) for k in range(15)]
    assert simplify(polygon) == polygon


def test_blocks_of_rounded_coordinates_fit_once_they_are_shrunk(tmp_path: Path) -> None:
    # two halves of a square along an inclined joint, of which one is drawn 0.4 units over it
    left, right = [[0, 0], [40.2, 0], [60.2, 100], [0, 100], [0, 0]], [[39.8, 0], [100, 0], [100, 100], [59.8, 100]]
    written(tmp_path, collection(feature(left), feature([*right, right[0]][::-1])))
    with pytest.raises(ScenarioError, match=r"bodies 1 and 2 overlap by 3\.92232 mm"):
        loaded(tmp_path)
    changes = {"structures.0.shrink": "2 mm", "structures.0.in_place": True}
    one, other = place_bodies(load_scenario(tmp_path / "scene.toml", changes))
    corners = np.array([(one.x + x, one.y + y) for x, y in one.outline])
    assert corners.min(axis=0) == pytest.approx([0.002, 0.002])
    across = np.array([1.0, -0.2]) / np.hypot(1.0, 0.2)
    assert (corners @ across).max() == pytest.approx(0.402 * across[0] - 0.002)
    reach = min((other.x + x) * across[0] + (other.y + y) * across[1] for x, y in other.outline)
    assert reach - (corners @ across).max() == pytest.approx(0.004 - 0.00392232, abs=1e-8)
    for much, message in (("9 mm", "9 mm is too much; at most 0.01 of the least width of a block"), ("-1 mm", "small")):
        with pytest.raises(ScenarioError, match=message):
            load_scenario(tmp_path / "scene.toml", {"structures.0.shrink": much})

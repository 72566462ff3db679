"""Drawings: what polygons of GeoJSON and polylines of DXF become; wrong ones are in broken/files."""

import json
import math
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from blocksim.errors import InvalidInputError, ScenarioError, UnavailableError
from blocksim.scenario import Model, Scenario, load_scenario, scenario_to_toml
from blocksim.scenario.document import Document
from blocksim.scenario.structures.drawings import DrawingError, read_drawing, simplify
from tests.golden import Golden

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
    pier, wedge = Model(loaded(tmp_path)).bodies
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
    assert Model(again).bodies == Model(first).bodies
    assert Model(again).hash == Model(first).hash


def test_geometries_without_features_are_read(tmp_path: Path) -> None:
    polygon = {"type": "Polygon", "coordinates": [SQUARE]}
    several = {"type": "MultiPolygon", "coordinates": [[SQUARE], [WEDGE]]}
    collected = {"type": "GeometryCollection", "geometries": [polygon, polygon]}
    assert [len(read_drawing(written(tmp_path, data)).outlines) for data in (polygon, several, collected)] == [1, 2, 2]


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


HEADER_UTF8 = b"0\nSECTION\n2\nHEADER\n9\n$ACADVER\n1\nAC1027\n0\nENDSEC\n"


def test_bytes_of_a_dxf_file_that_are_no_characters_are_told_as_numbers(tmp_path: Path) -> None:
    pytest.importorskip("ezdxf")
    path = tmp_path / "wall.dxf"
    path.write_bytes(HEADER_UTF8 + b"0\nSECTION\n2\nENTITIES\n \xa8x\nLWPOLYLINE\n0\nENDSEC\n0\nEOF\n")
    with pytest.raises(DrawingError, match=r"udca8x"):
        read_drawing(path)


def test_settings_in_the_current_folder_do_not_reach_the_reader_of_dxf(tmp_path: Path) -> None:
    (tmp_path / "ezdxf.ini").write_text("[core]\nlog_unprocessed_tags = true\n")
    code = (
        "from blocksim.extras import load_module; print(load_module('ezdxf', 'reading').options.log_unprocessed_tags)"
    )
    command = [sys.executable, "-c", code]
    assert subprocess.run(command, cwd=tmp_path, check=True, capture_output=True).stdout == b"False\n"


@pytest.fixture
def dxf() -> Any:
    ezdxf = pytest.importorskip("ezdxf", reason="reading DXF needs the extra dxf")
    return ezdxf.new(units=6)  # metres


def saved(folder: Path, document: Any) -> Path:
    """Write a drawing, and a scenario of it in its own unit."""
    document.saveas(folder / "wall.dxf")
    text = TEXT.replace("wall.geojson", "wall.dxf").replace('unit = "1 cm"', "in_place = true")
    (folder / "scene.toml").write_text(text)
    return folder / "wall.dxf"


UNIT = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]


def test_closed_polylines_of_a_dxf_file_are_blocks_by_their_layers(tmp_path: Path, dxf: Any) -> None:
    space = dxf.modelspace()
    space.add_lwpolyline(UNIT, close=True, dxfattribs={"layer": "pier"})
    space.add_polyline2d([(1, 0), (2, 0), (1, 1)], close=True)
    first, second = read_drawing(saved(tmp_path, dxf)).outlines
    assert (first.outline, first.properties) == (UNIT, {"block": "pier"})
    assert (second.outline, second.properties) == ([(1, 0), (2, 0), (1, 1)], {})
    for damaged in (b"", b"no drawing", b"\0" * 100, b"0\nSECTION\n2\nENTITIES\n0\nLWPOLYLINE\n90\nx\n"):
        (tmp_path / "wall.dxf").write_bytes(damaged)
        with pytest.raises((DrawingError, InvalidInputError)):
            read_drawing(tmp_path / "wall.dxf")


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e4])
@pytest.mark.parametrize("off", [0.0, 1e-16, 9e-7])
def test_a_polyline_whose_ends_meet_but_for_round_off_is_closed(
    tmp_path: Path, dxf: Any, size: float, off: float
) -> None:
    points = [(size * (x + 1.0), size * y) for x, y in UNIT]
    end = (points[0][0], points[0][1] + off * size)
    dxf.modelspace().add_lwpolyline([*points, end])
    dxf.modelspace().add_polyline3d([*points, (*end, 0.0)])
    for one in read_drawing(saved(tmp_path, dxf)).outlines:
        assert np.array(one.outline) == pytest.approx(np.array([*points[1:], end]), rel=1e-12) or one.outline == points


def test_inserted_blocks_are_read_where_they_are_at_all_levels(tmp_path: Path, dxf: Any) -> None:
    inner, outer = dxf.blocks.new("inner"), dxf.blocks.new("outer")
    inner.add_lwpolyline(UNIT, close=True)
    outer.add_blockref("inner", (10.0, 0.0), dxfattribs={"xscale": -2.0, "yscale": 3.0})
    grid = {"row_count": 2, "row_spacing": 5.0, "column_count": 2, "column_spacing": 4.0, "layer": "pier"}
    dxf.modelspace().add_blockref("outer", (100.0, 0.0), dxfattribs=grid)
    found = read_drawing(saved(tmp_path, dxf)).outlines
    boxes = [(*np.min(one.outline, axis=0), *np.max(one.outline, axis=0)) for one in found]
    expected = [(108.0 + x, y, 110.0 + x, 3.0 + y) for y in (0.0, 5.0) for x in (0.0, 4.0)]
    assert np.array(boxes) == pytest.approx(np.array(expected))
    assert [one.properties["block"] for one in found] == ["pier"] * 4


def test_polylines_drawn_from_behind_are_where_they_are_seen(tmp_path: Path, dxf: Any) -> None:
    behind = {"extrusion": (0.0, 0.0, -1.0), "elevation": 2.0}
    dxf.modelspace().add_lwpolyline(UNIT, close=True, dxfattribs=behind)
    dxf.modelspace().add_polyline2d(UNIT, close=True, dxfattribs={"extrusion": (0.0, 0.0, -1.0)})
    for one in read_drawing(saved(tmp_path, dxf)).outlines:
        assert one.outline == [(-x, y) for x, y in UNIT]


def hidden(document: Any, how: str, **attributes: object) -> None:
    getattr(document.layers.add("aids"), how)()
    document.modelspace().add_lwpolyline(UNIT, close=True, dxfattribs={"layer": "aids", **attributes})


NO_BLOCKS = {
    "open polylines": lambda document: [
        document.modelspace().add_lwpolyline(UNIT[:size], dxfattribs={"handle": f"A{size}"}) for size in (2, 3, 4, 3, 2)
    ],
    "line": lambda document: document.modelspace().add_line((0, 0), (1, 1), dxfattribs={"handle": "A1"}),
    "hatch": lambda document: document.modelspace().add_hatch(dxfattribs={"handle": "A1"}),
    "mesh": lambda document: document.modelspace().add_polyface(dxfattribs={"handle": "A1"}),
    "arcs": lambda document: document.modelspace().add_lwpolyline(
        [(0, 0, 0.5), (1, 0, 0), (1, 1, 0)], format="xyb", close=True, dxfattribs={"handle": "A1"}
    ),
    "upright": lambda document: document.modelspace().add_lwpolyline(
        UNIT, close=True, dxfattribs={"handle": "A1", "extrusion": (1.0, 0.0, 0.0)}
    ),
    "layer off": lambda document: hidden(document, "off", handle="A1"),
    "layer frozen": lambda document: hidden(document, "freeze", handle="A1"),
    "invisible": lambda document: hidden(document, "on", handle="A1", invisible=1),
    "missing block": lambda document: document.modelspace().add_blockref("gone", (0, 0), dxfattribs={"handle": "A1"}),
    "line in a block": lambda document: [
        document.blocks.new("frame").add_line((0, 0), (1, 1)),
        document.modelspace().add_blockref("frame", (0, 0), dxfattribs={"handle": "A1", "layer": "pier"}),
    ],
    "text alone": lambda document: document.modelspace().add_text("wall"),
}


@pytest.mark.parametrize("draw", NO_BLOCKS.values(), ids=NO_BLOCKS)
def test_what_may_be_a_block_and_cannot_be_read_is_refused(
    tmp_path: Path, dxf: Any, golden: Golden, draw: Callable[[Any], object]
) -> None:
    draw(dxf)
    with pytest.raises(DrawingError) as caught:
        read_drawing(saved(tmp_path, dxf))
    golden(str(caught.value))


def test_annotations_are_counted_and_said(tmp_path: Path, dxf: Any, golden: Golden) -> None:
    space = dxf.modelspace()
    space.add_lwpolyline(UNIT, close=True)
    for text in ("north", "south"):
        space.add_text(text)
    space.add_linear_dim(base=(0, 2), p1=(0, 0), p2=(1, 0))
    saved(tmp_path, dxf)
    golden("\n".join(Model(loaded(tmp_path)).implausible_values))


@pytest.mark.parametrize(("code", "unit", "width"), [(6, None, 1.0), (2, None, 0.3048), (0, None, 1.0), (2, 0.5, 0.5)])
def test_the_unit_of_a_dxf_file_is_taken_or_compared_with_that_given(
    tmp_path: Path, dxf: Any, golden: Golden, code: int, unit: float | None, width: float
) -> None:
    dxf.header["$INSUNITS"] = code
    dxf.modelspace().add_lwpolyline(UNIT, close=True)
    saved(tmp_path, dxf)
    scenario = load_scenario(tmp_path / "scene.toml", {} if unit is None else {"structures.0.unit": unit})
    assert Model(scenario).bodies[0].size_x == pytest.approx(width)
    golden("\n".join(Model(scenario).implausible_values))


def test_parts_of_a_feature_have_names_of_their_own_and_numbers_are_names(tmp_path: Path) -> None:
    both = {"type": "MultiPolygon", "coordinates": [[SQUARE], [WEDGE]]}
    pair = {"type": "Feature", "properties": {"name": "pair", "fixed": True}, "geometry": both}
    alone = {"type": "MultiPolygon", "coordinates": [[[[x + 5, y] for x, y in SQUARE]]]}
    written(tmp_path, collection(pair, {"type": "Feature", "properties": {"name": 7}, "geometry": alone}))
    assert [(one.name, one.fixed) for one in Model(loaded(tmp_path)).bodies] == [
        ("pair-1", True), ("pair-2", True), ("7", False)
    ]  # fmt: skip


def test_degrees_are_metres_only_where_that_is_said(tmp_path: Path) -> None:
    far = [[11.5 + 1e-5 * x, 48.1 + 1e-5 * y] for x, y in SQUARE]
    written(tmp_path, collection(feature(far)))
    (tmp_path / "scene.toml").write_text(TEXT.replace("1 cm", "1 m"))
    assert Model(loaded(tmp_path)).bodies[0].size_x == pytest.approx(1e-5)
    (tmp_path / "scene.toml").write_text(TEXT.replace(', unit = "1 cm"', ""))
    with pytest.raises(ScenarioError, match=r"\(11\.5, 48\.1\) to \(11\.50001, 48\.10001\) look like degrees"):
        loaded(tmp_path)
    for near in ([[0.01 * x, 0.01 * y] for x, y in SQUARE], [[x + 100.0, y] for x, y in SQUARE]):
        written(tmp_path, collection(feature(near)))
        (tmp_path / "scene.toml").write_text(TEXT.replace(', unit = "1 cm"', ""))
        loaded(tmp_path)


def test_heights_that_are_left_out_are_said(tmp_path: Path) -> None:
    written(tmp_path, collection(feature([[*point, 3.0] for point in SQUARE])))
    (warning,) = Model(loaded(tmp_path)).implausible_values
    assert warning.startswith("wall.geojson: third coordinates of 5 points are not read")


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
    one, other = Model(load_scenario(tmp_path / "scene.toml", changes)).bodies
    corners = np.array([(one.x + x, one.y + y) for x, y in one.outline])
    assert corners.min(axis=0) == pytest.approx([0.002, 0.002])
    across = np.array([1.0, -0.2]) / np.hypot(1.0, 0.2)
    assert (corners @ across).max() == pytest.approx(0.402 * across[0] - 0.002)
    reach = min((other.x + x) * across[0] + (other.y + y) * across[1] for x, y in other.outline)
    assert reach - (corners @ across).max() == pytest.approx(0.004 - 0.00392232, abs=1e-8)
    for much, message in (("9 mm", "9 mm is too much; at most 0.01 of the least width of a block"), ("-1 mm", "small")):
        with pytest.raises(ScenarioError, match=message):
            load_scenario(tmp_path / "scene.toml", {"structures.0.shrink": much})

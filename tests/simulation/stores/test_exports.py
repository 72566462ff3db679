"""Exports: tables with a row each, in units, to the last bit; drawings that a scenario reads back; formats by name."""

import csv
import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from blocksim.errors import InvalidInputError, OutputError
from blocksim.scenario import load_scenario, place_bodies
from blocksim.scenario.structures.polygons import read_drawing
from blocksim.simulation.files import refuse_foreign
from blocksim.simulation.stores.exports import (
    CONTACT_COLUMNS,
    FORMATS,
    FRAME_COLUMNS,
    find_format,
    write_contacts_csv,
    write_dxf,
    write_frames_csv,
    write_geojson,
)
from blocksim.simulation.trajectory import CONTACT_ROW, SUPPORT, Contacts, Frames
from blocksim.view.scene import corners
from tests.simulation.conftest import SCENARIOS
from tests.view.made_up import HOSTILE, polygons, toppling

SCENARIO = load_scenario(SCENARIOS / "three_blocks.toml")
WEDGE = ((-0.01, -0.01), (0.02, -0.01), (-0.01, 0.02))
FRAMES = polygons(toppling(3, steps=5), WEDGE, ((-0.01, -0.01), (0.01, -0.01), (0.01, 0.01), (-0.01, 0.01)))


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def frame_rows(path: Path, frames: Frames) -> list[dict[str, str]]:
    assert write_frames_csv(path, frames) == len(frames)
    return rows_of(path)


def test_every_frame_has_a_row_for_every_block_in_the_units_of_its_heads(tmp_path: Path) -> None:
    frames = toppling(3, steps=5)
    rows = frame_rows(tmp_path / "frames.csv", frames)
    assert tuple(rows[0]) == FRAME_COLUMNS
    assert len(rows) == 15
    assert [row["block"] for row in rows[:4]] == ["1", "2", "3", "1"]
    for key, values in {
        "x_mm": 1000.0 * frames.x,
        "y_mm": 1000.0 * frames.y,
        "rotation_deg": np.degrees(frames.rotation),
        "vx_mm_s": 1000.0 * frames.vx,
        "vy_mm_s": 1000.0 * frames.vy,
        "spin_deg_s": np.degrees(frames.spin),
        "time_s": np.repeat(frames.time, 3),
    }.items():
        assert [float(row[key]) for row in rows] == values.ravel().tolist()


def test_rotation_counts_from_the_placed_angle_and_what_is_not_finite_is_an_empty_cell(tmp_path: Path) -> None:
    frames = replace(toppling(1, steps=2), start_angle=np.array([0.5]))
    frames.x[1] = np.nan
    first, last = frame_rows(tmp_path / "frames.csv", frames)
    assert float(first["rotation_deg"]) == -math.degrees(0.5)
    assert [row["x_mm"] for row in (first, last)] == ["0.0", ""]


def test_trouble_is_reported_and_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="cannot be written: No such file"):
        write_frames_csv(tmp_path / "none" / "frames.csv", toppling(1))
    (tmp_path / "folder.csv").mkdir()
    with pytest.raises(OutputError, match=r"folder\.csv: cannot be written"):
        write_frames_csv(tmp_path / "folder.csv", toppling(1))
    assert [path.name for path in tmp_path.iterdir()] == ["folder.csv"]


def test_every_contact_has_a_row_with_the_names_of_its_bodies(tmp_path: Path) -> None:
    frames = replace(toppling(2, steps=3), names=(HOSTILE[0], "two"))
    rows = np.zeros(3, CONTACT_ROW)
    rows["body_a"], rows["body_b"] = [0, 0, 1], [1, SUPPORT, SUPPORT]
    rows["x"], rows["overlap"] = [0.1, 0.2, 0.3], 1e-6
    rows["normal_y"], rows["normal_force"], rows["shear_force"] = 1.0, [1.5, 2.5, np.nan], -0.5
    assert write_contacts_csv(tmp_path / "contacts.csv", frames, Contacts(np.array([2, 2, 3]), rows)) == 3
    found = rows_of(tmp_path / "contacts.csv")
    assert tuple(found[0]) == CONTACT_COLUMNS
    assert [row["time_s"] for row in found] == [str(float(frames.time[frame])) for frame in (0, 0, 2)]
    assert [(row["body_a"], row["body_b"]) for row in found] == [(HOSTILE[0], "two"), (HOSTILE[0], ""), ("two", "")]
    assert [float(row["x_mm"]) for row in found] == pytest.approx([100.0, 200.0, 300.0])
    assert [row["normal_force_N"] for row in found] == ["1.5", "2.5", ""]
    assert float(found[0]["overlap_mm"]) == pytest.approx(1e-3)


def test_geojson_has_the_last_outlines_with_their_blocks(tmp_path: Path) -> None:
    path = tmp_path / "end.geojson"
    assert write_geojson(path, FRAMES, SCENARIO) == 3
    refuse_foreign(path)  # it is one of blocksim
    data = json.loads(path.read_text())
    assert [one["properties"]["name"] for one in data["features"]] == ["1", "2", "3"]
    assert data["features"][2]["properties"]["rotation_deg"] == pytest.approx(-90.0)
    for number, (one, count) in enumerate(zip(read_drawing(path), (3, 4, 3), strict=True)):
        assert np.array(one.outline) == pytest.approx(1e-3 * corners(FRAMES, 4)[number, :count])
        assert one.properties["block"] == place_bodies(SCENARIO)[number].block


def test_removed_blocks_and_frames_that_are_not_finite_are_not_drawn(tmp_path: Path) -> None:
    x, vx = FRAMES.x.copy(), FRAMES.vx.copy()
    x[4, 0], vx[3, 1] = np.nan, np.nan
    assert write_geojson(tmp_path / "end.geojson", replace(FRAMES, x=x, vx=vx), SCENARIO) == 2
    first = read_drawing(tmp_path / "end.geojson")[0]
    assert np.array(first.outline) == pytest.approx(1e-3 * corners(FRAMES, 3)[0, :3])
    with pytest.raises(InvalidInputError, match="no frame to export"):
        write_geojson(tmp_path / "end.geojson", replace(FRAMES, x=np.full_like(x, np.nan)), SCENARIO)


def test_dxf_has_them_with_blocks_names_and_what_is_fixed(tmp_path: Path) -> None:
    pytest.importorskip("ezdxf", reason="DXF needs the extra dxf")
    path = tmp_path / "end.dxf"
    support = {"block": "brick", "x": "0.5 m", "y": "25 mm", "fixed": True, "name": "key-stone"}
    scenario = load_scenario(SCENARIOS / "three_blocks.toml", {"bodies": [support]})
    frames = polygons(toppling(4, steps=5), WEDGE)
    assert write_dxf(path, frames, scenario) == 4
    refuse_foreign(path)  # it is one of blocksim
    read, placed = read_drawing(path), place_bodies(scenario)
    assert np.array(read[0].outline) == pytest.approx(1e-3 * corners(frames, 4)[0, :3])
    told = [tuple(one.properties[name] for name in ("block", "name", "fixed")) for one in read]
    assert told == [(body.block, body.name, body.fixed) for body in placed]
    assert told[-1][1:] == ("key-stone", True)


def test_formats_are_found_and_misspelt_ones_told() -> None:
    assert [find_format(name) for name in FORMATS] == list(FORMATS.values())
    told = "--format vtkhfd: unsupported format; use csv or vtkhdf or geojson or dxf"
    with pytest.raises(InvalidInputError, match=told):
        find_format("vtkhfd")

"""Exports: tables in units to the last bit, drawings that are read back, VTKHDF by its rules and VTK's own reader."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from numpy.typing import NDArray

from blocksim.errors import InvalidInputError
from blocksim.scenario import Model, load_scenario
from blocksim.scenario.geometry import regular
from blocksim.scenario.structures.drawings import read_drawing
from blocksim.simulation.files import refuse_foreign
from blocksim.simulation.stores import exports
from blocksim.simulation.stores.exports import (
    write_contacts_csv,
    write_contacts_vtkhdf,
    write_dxf,
    write_frames_csv,
    write_geojson,
    write_vtkhdf,
)
from blocksim.simulation.trajectory import CONTACT_ROW, SUPPORT, UNITS, Contacts, Frames, forces_on_a, join_contacts
from blocksim.view.scene import corners
from blocksim.world.systems.blocks import support_quads
from tests.golden import Golden
from tests.simulation.conftest import SCENARIOS
from tests.view.made_up import HOSTILE, polygons, toppling

SCENARIO = load_scenario(SCENARIOS / "three_blocks.toml")
WEDGE = ((-0.01, -0.01), (0.02, -0.01), (-0.01, 0.02))
FRAMES = polygons(toppling(3, steps=5), WEDGE, ((-0.01, -0.01), (0.01, -0.01), (0.01, 0.01), (-0.01, 0.01)))


def test_frames_and_contacts_are_the_tables_that_were_read(tmp_path: Path, golden: Golden) -> None:
    """A row a frame and block, a row a contact, in the units of their heads; cells of what is not finite are empty."""
    frames = replace(toppling(2, steps=3), names=(HOSTILE[0], "two"), start_angle=np.array([0.0, 0.5]))
    frames.x[1, 1] = np.nan
    rows = np.zeros(3, CONTACT_ROW)
    rows["body_a"], rows["body_b"] = [0, 0, 1], [1, SUPPORT, SUPPORT]
    rows["x"], rows["overlap"] = [0.1, 0.2, 0.3], 1e-6
    rows["normal_y"], rows["normal_force"], rows["shear_force"] = 1.0, [1.5, 2.5, np.nan], -0.5
    assert write_frames_csv(tmp_path / "frames.csv", frames) == 3
    assert write_contacts_csv(tmp_path / "contacts.csv", frames, Contacts(np.array([2, 2, 3]), rows)) == 3
    for name in ("frames", "contacts"):
        golden((tmp_path / f"{name}.csv").read_text(encoding="utf-8"), name, rules=["digits"])


def test_geojson_has_the_last_outlines_with_their_blocks(tmp_path: Path) -> None:
    path = tmp_path / "end.geojson"
    assert write_geojson(path, FRAMES, Model(SCENARIO)) == 3
    refuse_foreign(path)  # it is one of blocksim
    data = json.loads(path.read_text())
    assert [one["properties"]["name"] for one in data["features"]] == ["1", "2", "3"]
    assert data["features"][2]["properties"]["rotation_deg"] == pytest.approx(-90.0)
    for number, (one, count) in enumerate(zip(read_drawing(path).outlines, (3, 4, 3), strict=True)):
        assert np.array(one.outline) == pytest.approx(1e-3 * corners(FRAMES, 4)[number, :count])
        assert one.properties["block"] == Model(SCENARIO).bodies[number].block


def test_removed_blocks_and_frames_that_are_not_finite_are_not_drawn(tmp_path: Path) -> None:
    x, vx = FRAMES.x.copy(), FRAMES.vx.copy()
    x[4, 0], vx[3, 1] = np.nan, np.nan
    assert write_geojson(tmp_path / "end.geojson", replace(FRAMES, x=x, vx=vx), Model(SCENARIO)) == 2
    first = read_drawing(tmp_path / "end.geojson").outlines[0]
    assert np.array(first.outline) == pytest.approx(1e-3 * corners(FRAMES, 3)[0, :3])
    for write in (write_geojson, write_vtkhdf):
        with pytest.raises(InvalidInputError, match="no frame to export"):
            write(tmp_path / "none", replace(FRAMES, x=np.full_like(x, np.nan)), Model(SCENARIO))


def test_dxf_has_them_with_blocks_names_and_what_is_fixed(tmp_path: Path) -> None:
    pytest.importorskip("ezdxf", reason="DXF needs the extra dxf")
    path = tmp_path / "end.dxf"
    support = {"block": "brick", "x": "0.5 m", "y": "25 mm", "fixed": True, "name": "key-stone"}
    scenario = load_scenario(SCENARIOS / "three_blocks.toml", {"bodies": [support]})
    frames = polygons(toppling(4, steps=5), WEDGE)
    assert write_dxf(path, frames, Model(scenario)) == 4
    refuse_foreign(path)  # it is one of blocksim
    read, placed = read_drawing(path).outlines, Model(scenario).bodies
    assert np.array(read[0].outline) == pytest.approx(1e-3 * corners(frames, 4)[0, :3])
    told = [tuple(one.properties[name] for name in ("block", "name", "fixed")) for one in read]
    assert told == [(body.block, body.name, body.fixed) for body in placed]
    assert told[-1][1:] == ("key-stone", True)


CELLS = 4  # three blocks and the ground


@pytest.fixture(params=[7, 1 << 16], ids=lambda size: f"batch {size}")
def written(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Frames, Path]:
    """Give frames of three blocks and their file, written some blocks at once."""
    monkeypatch.setattr(exports, "BATCH", request.param)
    frames = toppling(3, steps=11)
    assert write_vtkhdf(tmp_path / "run.vtkhdf", frames, Model(SCENARIO)) == 11
    return frames, tmp_path / "run.vtkhdf"


def test_parts_of_every_time_are_found_where_the_steps_say(written: tuple[Frames, Path]) -> None:
    frames, path = written
    with h5py.File(path) as file:
        group = file["VTKHDF"]
        assert bytes(group.attrs["Type"]) == b"UnstructuredGrid"
        assert group.attrs["Version"].tolist() == [2, 0]
        steps, cells = group["Steps"], group["CellData"]
        assert int(steps.attrs["NSteps"]) == 11
        assert steps["Values"][:].tolist() == frames.time.tolist()
        for frame in range(11):
            assert steps["NumberOfParts"][frame] == 1
            start = int(steps["PointOffsets"][frame])
            points = group["Points"][start : start + int(group["NumberOfPoints"][0]), :2].reshape(-1, 4, 2)
            np.testing.assert_allclose(points[:3], 1e-3 * corners(frames, frame), atol=1e-15)
            np.testing.assert_allclose(points[3:], support_quads(SCENARIO, frames.tracks[0]))
            first = int(steps["CellDataOffsets/rotation_deg"][frame])
            still, shown = [0.0, 0.0, 0.0], {name: values[first : first + CELLS] for name, values in cells.items()}
            way = np.stack([frames.x[frame] - frames.x[0], frames.y[frame] - frames.y[0], np.zeros(3)], axis=-1)
            assert shown["displacement_m"].tolist() == [*way.tolist(), still]
            assert shown["velocity_m_s"].tolist() == [[0.25, -0.5, 0.0]] * 3 + [still]
            for name, angles in (("rotation_deg", frames.rotation), ("spin_deg_s", frames.spin)):
                assert shown[name].tolist() == [*np.degrees(angles[frame]).tolist(), 0.0]
        assert group["Types"][:].tolist() == [9] * CELLS
        assert group["Offsets"][:].tolist() == [0, 4, 8, 12, 16]
        assert group["Connectivity"][:].tolist() == list(range(16))
        counts = [int(group[f"NumberOf{name}"][0]) for name in ("Cells", "Points", "ConnectivityIds")]
        assert counts == [4, 16, 16]


def test_cells_of_polygons_have_their_own_corners(tmp_path: Path) -> None:
    hexagon = regular(6, 0.02)
    frames = polygons(toppling(3, steps=4), WEDGE, hexagon)
    write_vtkhdf(tmp_path / "run.vtkhdf", frames, Model(SCENARIO))
    with h5py.File(tmp_path / "run.vtkhdf") as file:
        group = file["VTKHDF"]
        assert group["Types"][:].tolist() == [7, 7, 7, 9]
        assert group["Offsets"][:].tolist() == [0, 3, 9, 12, 16]
        start = int(group["Steps/PointOffsets"][3])
        points = group["Points"][start : start + 12, :2]
    expected = [corners(frames, 3)[block, :count] for block, count in ((0, 3), (1, 6), (2, 3))]
    np.testing.assert_allclose(points, 1e-3 * np.concatenate(expected), atol=1e-15)


class Reader:
    def __init__(self, path: Path) -> None:
        hdf = pytest.importorskip("vtkmodules.vtkIOHDF", reason="reading back needs the extra paraview-check (vtk)")
        self.reader = hdf.vtkHDFReader()
        self.reader.SetFileName(str(path))
        self.reader.UpdateInformation()

    def times(self) -> list[float]:
        """Return the times that ParaView's time slider gets."""
        steps = pytest.importorskip("vtkmodules.vtkCommonExecutionModel").vtkStreamingDemandDrivenPipeline.TIME_STEPS()
        information = self.reader.GetOutputInformation(0)
        return [information.Get(steps, index) for index in range(information.Length(steps))]

    def grid(self, step: int) -> Any:
        self.reader.SetStep(step)
        self.reader.Update()
        return self.reader.GetOutputDataObject(0)


def values(data: Any, name: str) -> NDArray[Any]:
    found: NDArray[Any] = pytest.importorskip("vtkmodules.util.numpy_support").vtk_to_numpy(data.GetArray(name))
    return found


def test_vtk_reads_back_names_and_the_contacts_of_every_finite_time(tmp_path: Path) -> None:
    names = ("Stein ä", "b", *HOSTILE)
    tables = [np.zeros(count, CONTACT_ROW) for count in (2, 0, 3, 1)]
    for number, rows in enumerate(tables):
        for name in UNITS:
            rows[name] = 10.0 * number + np.arange(len(rows)) + len(name)
        rows["body_a"], rows["body_b"] = np.arange(len(rows)), SUPPORT
    frames = replace(toppling(len(names), steps=4), names=names, contacts=join_contacts(tables))
    frames.vx[2, 1] = np.inf  # a frame that neither file has
    assert frames.contacts is not None
    assert write_vtkhdf(tmp_path / "run.vtkhdf", frames, Model(SCENARIO)) == 3
    assert write_contacts_vtkhdf(tmp_path / "contacts.vtkhdf", frames, frames.contacts) == 3
    with h5py.File(tmp_path / "run.vtkhdf") as stored:
        assert tuple(name.decode() for name in stored["blocksim/block_names"][:]) == names
    for file in ("run", "contacts"):
        reader = Reader(tmp_path / f"{file}.vtkhdf")
        assert reader.times() == frames.time[[0, 1, 3]].tolist()
        for step, rows in enumerate(tables[number] for number in (0, 1, 3)):
            grid = reader.grid(step)
            texts = grid.GetFieldData().GetAbstractArray("block_names")
            assert tuple(texts.GetValue(number) for number in range(len(names))) == names
            if file == "contacts":
                places = [grid.GetPoint(number)[:2] for number in range(grid.GetNumberOfPoints())]
                assert places == [*zip(rows["x"].tolist(), rows["y"].tolist(), strict=True)]
                assert [grid.GetCell(number).GetPointId(0) for number in range(len(rows))] == [*range(len(rows))]
                data = grid.GetPointData()
                assert values(data, "body_a").tolist() == [*range(1, len(rows) + 1)]
                assert values(data, "body_b").tolist() == [0] * len(rows)
                assert values(data, "force_on_a_N")[:, :2].tolist() == forces_on_a(rows).tolist()
                assert values(data, "normal_force_N").tolist() == rows["normal_force"].tolist()
                assert values(data, "overlap_mm") == pytest.approx(1e3 * rows["overlap"])

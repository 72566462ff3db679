"""VTKHDF: every time and every block where they were, by the rules of the format and by VTK's own reader.

Ground and walls are cells where the scenario has them, solid inwards, and move as the support does.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from numpy.typing import NDArray

from blocksim.errors import InvalidInputError
from blocksim.scenario import load_scenario
from blocksim.scenario.geometry import regular
from blocksim.simulation.stores import exports
from blocksim.simulation.stores.exports import write_contacts_vtkhdf, write_vtkhdf
from blocksim.simulation.trajectory import CONTACT_ROW, SUPPORT, UNITS, Frames, forces_on_a, join_contacts
from blocksim.view.scene import corners
from blocksim.world.systems.blocks import support_quads
from tests.simulation.conftest import SCENARIOS
from tests.view.made_up import HOSTILE, polygons, toppling

SLOPE = load_scenario(SCENARIOS / "slope.toml")
LEVEL = load_scenario(SCENARIOS / "three_blocks.toml")
CELLS = 4  # three blocks and the ground


@pytest.fixture(params=[1, 7, 1 << 16], ids=lambda size: f"batch {size}")
def written(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Frames, Path]:
    """Give frames of three blocks and their file, written some blocks at once."""
    monkeypatch.setattr(exports, "BATCH", request.param)
    frames = toppling(3, steps=11)
    assert write_vtkhdf(tmp_path / "run.vtkhdf", frames, LEVEL) == 11
    return frames, tmp_path / "run.vtkhdf"


def test_parts_of_every_time_are_found_where_the_steps_say(written: tuple[Frames, Path]) -> None:
    frames, path = written
    with h5py.File(path) as file:
        group = file["VTKHDF"]
        assert bytes(group.attrs["Type"]) == b"UnstructuredGrid"
        assert group.attrs["Version"].tolist() == [2, 0]
        steps = group["Steps"]
        assert int(steps.attrs["NSteps"]) == 11
        assert steps["Values"][:].tolist() == frames.time.tolist()
        for frame in range(11):
            assert steps["NumberOfParts"][frame] == 1
            start = int(steps["PointOffsets"][frame])
            points = group["Points"][start : start + int(group["NumberOfPoints"][0])]
            np.testing.assert_allclose(points[:12, :2], 1e-3 * corners(frames, frame).reshape(-1, 2), atol=1e-15)
            first = int(steps["CellDataOffsets/rotation_deg"][frame])
            rotation = group["CellData/rotation_deg"][first : first + CELLS]
            assert rotation.tolist() == [*np.degrees(frames.rotation[frame]).tolist(), 0.0]
        assert group["Types"][:].tolist() == [9] * CELLS
        assert group["Offsets"][:].tolist() == [0, 4, 8, 12, 16]
        assert group["Connectivity"][:].tolist() == list(range(16))
        counts = [int(group[f"NumberOf{name}"][0]) for name in ("Cells", "Points", "ConnectivityIds")]
        assert counts == [4, 16, 16]


def test_cells_of_polygons_have_their_own_corners(tmp_path: Path) -> None:
    wedge, hexagon = [(-0.01, -0.01), (0.02, -0.01), (-0.01, 0.02)], regular(6, 0.02)
    frames = polygons(toppling(3, steps=4), wedge, hexagon)
    write_vtkhdf(tmp_path / "run.vtkhdf", frames, LEVEL)
    with h5py.File(tmp_path / "run.vtkhdf") as file:
        group = file["VTKHDF"]
        assert group["Types"][:].tolist() == [7, 7, 7, 9]
        assert group["Offsets"][:].tolist() == [0, 3, 9, 12, 16]
        start = int(group["Steps/PointOffsets"][3])
        points = group["Points"][start : start + 12, :2]
    expected = [corners(frames, 3)[block, :count] for block, count in ((0, 3), (1, 6), (2, 3))]
    np.testing.assert_allclose(points, 1e-3 * np.concatenate(expected), atol=1e-15)


class Reader:
    """VTK's own reader of a file."""

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


def points_of(grid: Any) -> NDArray[np.float64]:
    """Return the corners (m) of every cell, (b, 4, 2)."""
    cells = []
    for number in range(grid.GetNumberOfCells()):
        cell = grid.GetCell(number).GetPoints()  # the grid lends the same object for every cell
        cells.append([cell.GetPoint(corner)[:2] for corner in range(4)])
    return np.array(cells)


def values(data: Any, name: str) -> NDArray[Any]:
    found: NDArray[Any] = pytest.importorskip("vtkmodules.util.numpy_support").vtk_to_numpy(data.GetArray(name))
    return found


def test_vtk_reads_back_every_time(written: tuple[Frames, Path]) -> None:
    frames, path = written
    reader = Reader(path)
    assert reader.times() == frames.time.tolist()
    for frame in (0, 5, 10, 2):
        grid = reader.grid(frame)
        assert [grid.GetCellType(cell) for cell in range(grid.GetNumberOfCells())] == [9] * CELLS
        np.testing.assert_allclose(points_of(grid)[:3], 1e-3 * corners(frames, frame), atol=1e-15)
        data = grid.GetCellData()
        assert values(data, "block").tolist() == [1, 2, 3, 0]
        for name, angles in (("rotation_deg", frames.rotation), ("spin_deg_s", frames.spin)):
            assert values(data, name)[:3].tolist() == np.degrees(angles[frame]).tolist()
        way = np.stack([frames.x[frame] - frames.x[0], frames.y[frame] - frames.y[0], np.zeros(3)], axis=-1)
        assert values(data, "displacement_m").tolist() == [*way.tolist(), [0.0, 0.0, 0.0]]
        assert values(data, "velocity_m_s").tolist() == [[0.25, -0.5, 0.0]] * 3 + [[0.0, 0.0, 0.0]]


def test_vtk_shows_ground_and_walls_where_they_are(tmp_path: Path) -> None:
    write_vtkhdf(tmp_path / "run.vtkhdf", toppling(2, steps=3), SLOPE)
    found = points_of(Reader(tmp_path / "run.vtkhdf").grid(2))[2:]
    np.testing.assert_allclose(found, support_quads(SLOPE, toppling(2, steps=3).tracks[0]))


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
    assert write_vtkhdf(tmp_path / "run.vtkhdf", frames, LEVEL) == 3
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


def test_frames_of_which_none_is_finite_are_refused(tmp_path: Path) -> None:
    frames = toppling(2, steps=4)
    frames.x[:] = np.nan
    with pytest.raises(InvalidInputError, match="no frame to export"):
        write_vtkhdf(tmp_path / "other.vtkhdf", frames, LEVEL)

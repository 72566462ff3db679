"""What a run with soil leaves: probes of thrust, soils.csv, pictures, exports."""

from pathlib import Path

import h5py
import numpy as np
import pytest

import blocksim
from blocksim.errors import InvalidInputError
from blocksim.simulation import Result
from blocksim.simulation.stores.exports import write_vtkhdf
from blocksim.study.run import open_run
from blocksim.view.kinds import run_kind
from blocksim.view.paints import paint_of
from blocksim.view.report.player import pack_frames
from blocksim.view.scene import PictureOptions
from tests.soils import DEPTH, LEFT, column, scene
from tests.view.made_up import toppling

WEIGHT = 20e3 * 0.05 * 0.05 * DEPTH
PROBES = [
    {"kind": "force", "name": "wall", "on": "wall 1"},
    {"kind": "force", "name": "ground", "on": "ground", "by": "column"},
    {"kind": "force", "name": "soil", "on": "column"},
]
SCENE = scene(
    column(0.05, 0.05, 0.005),
    walls=[LEFT],
    probes=PROBES,
    end=0.15,
    output={"every": 0.03},
    blocks={"weir": {"width": 0.04, "height": 0.045, "length": DEPTH, "material": "soft"}},
    bodies=[{"block": "weir", "x": 0.08, "y": 0.0225}],
)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Result:
    """Run a column that collapses against a block."""
    folder = tmp_path_factory.mktemp("soil") / "run"
    return blocksim.run(SCENE, out=folder)


def test_probes_record_what_soil_does_to_walls_and_ground_and_gets_back(run: Result) -> None:
    wall, ground, soil = (run.probes[name] for name in ("wall", "ground", "soil"))
    assert wall["fx"][0] < 0.0  # it pushes the wall to the left
    assert wall["x"] == pytest.approx(0.0, abs=1e-9)
    assert 0.01 < wall["y"][0] < 0.025  # a third of the height
    assert -ground["fy"][0] == pytest.approx(WEIGHT, rel=0.02)
    block = run.probes["soil"]["fy"] + run.probes["wall"]["fy"] + run.probes["ground"]["fy"]
    assert block[0] == pytest.approx(0.0, abs=1e-6 * WEIGHT)  # until it reaches the block
    assert soil["fx"][0] == pytest.approx(-wall["fx"][0] - ground["fx"][0])
    assert ((wall["mobilised"] >= 0.0) & (wall["mobilised"] <= 1.0 + 1e-9)).all()


def test_the_end_of_soils_is_a_table_of_the_folder_and_of_the_result(run: Result) -> None:
    assert run.folder is not None
    head, row = (run.folder / "soils.csv").read_text().splitlines()
    assert head.startswith("soil,left_mm,right_mm")
    assert row.startswith("column,")
    again = open_run(run.folder)
    assert again.endings == run.endings
    assert again.endings["soils"]["right_mm"][0] > 55.0
    assert "soils.csv" in run.summary.sha256
    blocksim.run(SCENE, out=run.folder, overwrite=True)  # it is blocksim's own file, and may be replaced


@pytest.mark.parametrize("kind", ["strip", "final", "profile"])
def test_pictures_show_soil(run: Result, kind: str, tmp_path: Path) -> None:
    paint = paint_of("pressure", run.frames, SCENE)
    run_kind(kind)(run.frames, tmp_path / "one.svg", PictureOptions("title", paint=paint))
    text = (tmp_path / "one.svg").read_text()
    assert text.count("<path") > (100 if kind != "profile" else 8)


def test_soil_has_the_colour_asked_for_and_blocks_keep_theirs(run: Result) -> None:
    usual, speed = (paint_of(name, run.frames, SCENE) for name in ("block", "speed"))
    assert usual.scale is not None
    assert usual.scale.label == "displacement (mm)"
    assert (usual.fills(0), any(usual.elements)) == (speed.fills(0), True)
    first, last = (usual.elements[0](frame) for frame in (0, -1))  # type: ignore[misc]  # soil has fills
    assert len(set(first)) == 1
    assert len(set(last)) > 10
    with pytest.raises(InvalidInputError, match="unknown colour 'plastic' in this run"):
        paint_of("plastic", toppling(2), SCENE)


def test_a_run_without_soil_has_no_profile(tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match="no soil in this run"):
        run_kind("profile")(toppling(3), tmp_path / "one.svg", PictureOptions())


def test_the_player_gets_every_shade_with_its_scale(run: Result) -> None:
    (soil,) = pack_frames(run.frames).data["systems"]
    assert [shade["label"].split(" (")[0] for shade in soil["shades"]] == [
        "displacement",
        "speed",
        "plastic shear strain",
        "mean pressure",
    ]
    assert all(shade["high"] > 0.0 for shade in soil["shades"])
    assert len(set(soil["palette"])) == len(soil["palette"])


def test_paraview_gets_displacement_stress_and_pressure(run: Result, tmp_path: Path) -> None:
    write_vtkhdf(tmp_path / "run.vtkhdf", run.frames, SCENE)
    with h5py.File(tmp_path / "run.vtkhdf") as file:
        data = file["VTKHDF/CellData"]
        assert {"displacement_mm", "pressure_Pa", "syy_Pa", "plastic_strain"} <= set(data)
        assert np.max(data["displacement_mm"]) > 5.0


def test_a_name_that_is_no_soil_is_located() -> None:
    with pytest.raises(InvalidInputError, match='unknown body "colum", did you mean'):
        scene(column(0.05, 0.05, 0.005), probes=[{"kind": "force", "on": "ground", "by": "colum"}])

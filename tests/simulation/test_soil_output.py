"""What a run with soil leaves, beside blocks or alone: probes of thrust, soils.csv, pictures, exports, reports."""

import csv
import math
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

import blocksim
from blocksim.analysis.bits import differences
from blocksim.errors import ExitCode, InvalidInputError, ScenarioError
from blocksim.scenario import scenario_from_mapping
from blocksim.simulation import Result, schemes
from blocksim.simulation.loop import BY_CODE, diagnose
from blocksim.simulation.schemes import build
from blocksim.simulation.stores.exports import write_frames_csv, write_geojson, write_vtkhdf
from blocksim.simulation.trajectory import data_set, tidy_table
from blocksim.study.run import open_run
from blocksim.view.kinds import run_kind
from blocksim.view.paints import paint_of
from blocksim.view.report.player import pack_frames
from blocksim.view.scene import PictureOptions
from blocksim.world.describe import describe
from blocksim.world.free_memory import chunk_rows
from blocksim.world.systems import INTERACTIONS
from blocksim.world.systems.soils import SOILS
from tests.soils import DEPTH, LEFT, column, data_of, scene
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
ALONE = data_of(column(0.04, 0.04, 0.005), walls=[LEFT], end=0.06, output={"every": 0.02}, blocks={}, bodies=[])


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Result:
    """Run a column that collapses against a block."""
    return blocksim.run(SCENE, out=tmp_path_factory.mktemp("soil") / "run")


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> Result:
    """Run a column without any block."""
    return blocksim.run(scenario_from_mapping(ALONE), out=tmp_path_factory.mktemp("alone") / "run")


def test_probes_record_what_soil_does_to_walls_and_ground_and_gets_back(run: Result) -> None:
    wall, ground, soil = (run.probes[name] for name in ("wall", "ground", "soil"))
    assert wall["fx"][0] < 0.0  # it pushes the wall to the left
    assert wall["x"] == pytest.approx(0.0, abs=1e-9)
    assert 0.01 < wall["y"][0] < 0.025  # a third of the height
    assert -ground["fy"][0] == pytest.approx(WEIGHT, rel=0.02)
    block = soil["fy"] + wall["fy"] + ground["fy"]
    assert block[0] == pytest.approx(0.0, abs=1e-6 * WEIGHT)  # until it reaches the block
    assert soil["fx"][0] == pytest.approx(-wall["fx"][0] - ground["fx"][0])
    assert ((wall["mobilised"] >= 0.0) & (wall["mobilised"] <= 1.0 + 1e-9)).all()
    with pytest.raises(InvalidInputError, match='unknown body "colum", did you mean'):
        scene(column(0.05, 0.05, 0.005), probes=[{"kind": "force", "on": "ground", "by": "colum"}])


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


def test_the_ledger_of_frames_and_files_has_the_entries_of_soil(run: Result) -> None:
    entries = run.summary.energy_J
    assert entries.relative_residual < 2e-3
    assert abs(entries.residual - sum(values[-1] - values[0] for values in run.frames.energy.values())) < 1e-12
    assert run.folder is not None
    read = blocksim.open_run(run.folder)
    assert read.summary.energy_J.residual == entries.residual
    (held,), (soils,) = blocksim.run(SCENE).frames.others, read.frames.others
    np.testing.assert_array_equal(soils.values, held.values)
    with h5py.File(run.folder / "run.h5") as file:
        group = file["particles/soils"]
        assert (group["vy"].attrs["unit"], group["sxx"].attrs["unit"], len(group["mass"])) == ("m s-1", "Pa", 100)
        assert "soils_plastic" in file["observables"]


def test_a_changed_bit_of_soil_is_found(run: Result) -> None:
    (soils,) = run.frames.others
    values = soils.values.copy()
    values[3, 1, 2] = np.nextafter(values[3, 1, 2], 1.0)
    first = differences(run.frames, replace(run.frames, others=(replace(soils, values=values),))).first
    assert first is not None
    assert (first.frame, first.block, first.quantity) == (3, "column.3", "soils y (m)")


def test_tables_have_a_row_a_particle_and_frame(run: Result, tmp_path: Path) -> None:
    write_frames_csv(tmp_path / "run.csv", run.frames)
    with (tmp_path / "run_soils.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0])[:4] == ["time_s", "particle", "x_mm", "y_mm"]
    assert [float(row["y_mm"]) for row in rows] == (1e3 * run.frames.others[0]["y"]).ravel().tolist()
    assert len(tidy_table(run.frames, "soils")) == 100 * len(run.frames)
    assert data_set(run.frames, "soil")["soils_vy"].shape == (len(run.frames), 100)


def test_soil_that_has_no_finite_place_ends_the_run_and_is_named() -> None:
    one = build(SCENE)
    one.scene.systems[0].points.y[1] = np.nan
    after, code = schemes.ALONE.advance(one.scene, 100_000)
    told = diagnose(BY_CODE[code], code, after, one.placed)
    assert told.exit_code == ExitCode.NUMERICAL_FAILURE
    assert "(soils, step " in told.reason


def test_a_soil_that_is_not_modelled_or_gets_other_functions_once_compiled_is_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    build(SCENE)
    monkeypatch.setitem(INTERACTIONS, ("soils", "supports"), lambda: float)
    with pytest.raises(ValueError, match="compiled with other functions"):
        build(SCENE)
    monkeypatch.delitem(INTERACTIONS, ("soils", "blocks"))
    for use in (blocksim.run, describe):
        with pytest.raises(InvalidInputError, match=r"^soils and blocks cannot be in one scene: .* not modelled"):
            use(SCENE)


def test_threads_are_of_use_for_many_particles() -> None:
    one = build(SCENE).scene
    assert [schemes.team_for(one, 4, elements).threads for elements in (0, 3, 250, 1000)] == [1, 1, 2, 4]


def test_check_counts_the_particles() -> None:
    few, many = (describe(scene(column(0.1, 0.05 * k, 0.005, start="ramp"))) for k in (1, 2))
    assert (few.systems, many.systems) == ({"soils": 200}, {"soils": 400})
    cost, quantities = SOILS.cost, len(SOILS.quantities)
    frames = math.ceil(many.frames / chunk_rows(400)) * chunk_rows(400)  # run.h5 has room for whole chunks
    assert many.bytes - few.bytes == pytest.approx(200 * 8 * quantities * frames, rel=0.3)
    assert many.memory - few.memory == 200 * cost.memory


@pytest.mark.parametrize("kind", ["strip", "final", "profile"])
def test_pictures_show_soil(run: Result, alone: Result, kind: str, tmp_path: Path) -> None:
    paint = paint_of("pressure", run.frames, SCENE)
    run_kind(kind)(run.frames, tmp_path / "one.svg", PictureOptions("title", paint=paint))
    assert (tmp_path / "one.svg").read_text().count("<path") > (100 if kind != "profile" else 8)
    assert blocksim.plot(alone, tmp_path / "alone.png", kind=kind).stat().st_size > 5000
    if kind == "profile":
        with pytest.raises(InvalidInputError, match="no soil in this run"):
            run_kind(kind)(toppling(3), tmp_path / "one.svg", PictureOptions())


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


def test_the_player_gets_every_shade_with_its_scale(run: Result) -> None:
    (soil,) = pack_frames(run.frames).data["systems"]
    labels = [shade["label"].split(" (")[0] for shade in soil["shades"]]
    assert labels == ["displacement", "speed", "plastic shear strain", "mean pressure"]
    assert all(shade["high"] > 0.0 for shade in soil["shades"])
    assert len(set(soil["palette"])) == len(soil["palette"])


def test_paraview_gets_displacement_stress_and_pressure(run: Result, tmp_path: Path) -> None:
    write_vtkhdf(tmp_path / "run.vtkhdf", run.frames, SCENE)
    with h5py.File(tmp_path / "run.vtkhdf") as file:
        data = file["VTKHDF/CellData"]
        assert {"displacement_mm", "pressure_Pa", "syy_Pa", "plastic_strain"} <= set(data)
        assert np.max(data["displacement_mm"]) > 5.0


def test_soil_alone_falls_as_beside_a_block_far_away_and_needs_no_wall(alone: Result) -> None:
    beside = blocksim.run(scenario_from_mapping(data_of(*ALONE["soils"], walls=[LEFT], end=0.06)))
    assert alone.columns["block"] == []
    assert alone.summary.movement is None
    front, expected = (one.endings["soils"]["right_mm"] for one in (alone, beside))
    assert front == pytest.approx(expected, rel=1e-3)  # other steps
    assert alone.folder is not None
    (again,) = blocksim.open_run(alone.folder).frames.others
    assert np.ptp(again["y"][-1]) > 0.02
    free = blocksim.run(scenario_from_mapping({**ALONE, "walls": []}))
    left, right = (free.endings["soils"][name][0] for name in ("left_mm", "right_mm"))
    assert left + right == pytest.approx(40.0, abs=0.1)  # it spreads alike to both sides


def test_soil_alone_is_exported_and_reported_and_what_is_about_blocks_says_that_there_are_none(
    alone: Result, tmp_path: Path
) -> None:
    assert write_vtkhdf(tmp_path / "run.vtkhdf", alone.frames, alone.scenario) == len(alone.frames.time)
    assert blocksim.report(alone, out=tmp_path / "run.html").stat().st_size > 20_000
    assert blocksim.animate(alone, tmp_path / "run.gif").stat().st_size > 5000
    with pytest.raises(InvalidInputError, match="a history is that of blocks"):
        blocksim.plot(alone, tmp_path / "picture.png", kind="history")
    with pytest.raises(InvalidInputError, match="no block to export"):
        write_geojson(tmp_path / "run.geojson", alone.frames, alone.scenario)


def test_soil_on_the_solid_side_of_a_wall_is_refused_as_it_would_pass_through() -> None:
    turned = {**LEFT, "from": LEFT["to"], "to": LEFT["from"]}
    with pytest.raises(ScenarioError, match="meets the solid side of wall 1, right of the way"):
        scenario_from_mapping({**ALONE, "walls": [turned]})

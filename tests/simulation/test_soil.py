"""Soil among blocks and supports: what it conserves and presses with, its bits, and what a run with it leaves."""

import csv
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

import blocksim
from blocksim.analysis.bits import differences
from blocksim.errors import ExitCode, InvalidInputError, ScenarioError
from blocksim.scenario import Model, Scenario, scenario_from_mapping
from blocksim.simulation import Result, run_ensemble, schemes, simulate
from blocksim.simulation.checkpoint import CheckpointPolicy
from blocksim.simulation.loop import BY_CODE, diagnose
from blocksim.simulation.schemes import build
from blocksim.simulation.stores.exports import write_frames_csv, write_geojson, write_vtkhdf
from blocksim.simulation.trajectory import data_set, tidy_table
from blocksim.study.run import open_run
from blocksim.view.kinds import run_kind
from blocksim.view.paints import paint_of
from blocksim.view.report import player
from blocksim.view.report.player import pack_frames
from blocksim.view.scene import PictureOptions
from blocksim.world.describe import describe
from blocksim.world.free_memory import chunk_rows
from blocksim.world.systems import INTERACTIONS
from blocksim.world.systems.soils import SOILS
from tests.soils import DEPTH, FAR, LEFT, UNIT_WEIGHT, Soil, column, data_of, right, scene
from tests.view.made_up import toppling
from tests.view.report.folders import numbers

SPACING = 0.005
SINE = math.sin(math.radians(21.9))
SLIPPERY = {"rods": {"smooth": {"friction": 0.0}, "ground": {"friction": 0.0}}}
BLOCKS = {"any": {"width": 0.04, "height": 0.04, "length": DEPTH, "material": "smooth"}}


def place(soil: Soil, number: int, **values: float) -> None:
    for name, value in values.items():
        soil.soils.points[name][soil.soils.states["number"] == number] = value
    soil.soils.controls.is_listed[0] = 0


def test_a_column_between_smooth_walls_rests_with_its_weight_on_the_ground_and_presses_sideways() -> None:
    table = column(0.05, 0.05, SPACING, start="ramp", gradient="raw")
    soil = Soil(scene(table, walls=[LEFT, right(0.05)], pairs=SLIPPERY)).to_time(0.2)
    base, thrust = soil.mean_force_on(soil.world.bodies.size - 1, 0.23)[1], soil.mean_force_on(1, 0.26)[0]
    assert -base == pytest.approx(soil.weight, rel=0.005)
    assert np.hypot(soil.soils.points["vx"], soil.soils.points["vy"]).max() < 1e-3
    assert soil.soils.points["y"].max() == pytest.approx(0.05 - 0.5 * SPACING, abs=0.05 * SPACING)
    share, sine = -2.0 * thrust / (UNIT_WEIGHT * 0.05**2 * DEPTH), SINE / math.sqrt(3.0)
    assert share == pytest.approx((1.0 - sine) / (1.0 + 2.0 * sine), rel=0.02)


def test_thrust_on_a_wall_that_yields_on_a_rough_base_is_by_default_not_too_small() -> None:
    """With raw gradients it is by a tenth; soil that slips in bands, at tan(phi*) = sin(phi), presses by 5.6 % more."""
    blocks = {
        "far": {"width": 0.04, "height": 0.04, "length": DEPTH, "material": "soft"},
        "wall": {"width": 0.04, "height": 0.12, "length": DEPTH, "material": "smooth"},
    }
    pairs = {"rods": {"smooth": {"friction": 0.0}, "ground": {"friction": SINE / math.sqrt(1.0 - SINE**2)}}}
    bodies = [{"block": "wall", "x": -0.02, "y": 0.06, "fixed": True}, FAR]  # moves on as it is told
    soil = Soil(scene(column(0.15, 0.1, SPACING), blocks=blocks, bodies=bodies, walls=[right(0.15)], pairs=pairs))
    soil.world.bodies.vx[0] = -0.01
    soil.to_time(0.05)
    thrust, _ = soil.mean_force_on(0, 0.1)
    points = soil.soils.points
    columns = points["x"].min() + SPACING * (np.arange(5) - 0.5)
    tops = [points["y"][(points["x"] >= left) & (points["x"] < left + SPACING)].max() for left in columns[:-1]]
    height = float(np.mean(tops)) + 0.5 * SPACING
    rankine = (1.0 - SINE) / (1.0 + SINE)
    band = math.sin(math.atan(SINE))
    share = -2.0 * thrust / (UNIT_WEIGHT * height**2 * DEPTH)
    assert soil.world.bodies.x[0] == pytest.approx(-0.02 - 0.01 * soil.time)
    assert 0.98 * rankine < share < (1.0 - band) / (1.0 + band)


@pytest.mark.parametrize("degrees", [20.0, 80.0])
def test_a_particle_that_has_flown_off_leaves_a_corner_with_a_fifth_of_the_speed_of_approach(degrees: float) -> None:
    ram = [{"block": "any", "x": -1.0, "y": 0.5, "fixed": True}]  # moves on as it is told
    pairs = {"rods": {"smooth": {"friction": 0.0}}}
    soil = Soil(scene(column(0.04, 0.04, SPACING), blocks=BLOCKS, bodies=ram, pairs=pairs, gravity=0.0))
    normal = np.array([math.cos(math.radians(degrees)), math.sin(math.radians(degrees))])
    struck, away = 0.3 - 1.2 * normal, (0.5 * SPACING + 2e-4) * normal  # m/s, m: straight towards the corner
    place(soil, 0, x=-0.98 + away[0], y=0.52 + away[1], vx=struck[0], vy=struck[1])
    soil.world.bodies.vx[0], soil.world.bodies.vy[0] = 0.3, 0.3
    soil.to_time(0.004)
    number, points = soil.soils.states["number"], soil.soils.points
    found = np.array([float(points[name][number == 0][0]) for name in ("vx", "vy")])
    leaving, most = (found - 0.3) @ normal, 1.2 * math.exp(-0.5 * math.pi)
    assert 0.8 * most < leaving < most
    assert np.linalg.norm(found - 0.3) == pytest.approx(leaving, rel=1e-6)


def test_particles_too_near_to_one_another_end_the_run() -> None:
    soil = Soil(scene(column(0.1, 0.05, SPACING)))
    soil.soils.points["x"][:160] = np.linspace(0.02, 0.021, 160)
    soil.soils.points["y"][:160] = 0.02
    soil.soils.controls.is_listed[0] = 0
    soil.to_step(2000)
    assert soil.code != 0
    assert soil.steps < 1000


def collapse(end: float, every: float, *, material: str = "rods", contacts: bool = False, **keys: Any) -> Scenario:
    """Return a column that pushes one block aside and carries another one down."""
    carried = [{"block": "any", "x": 0.07, "y": 0.02}, {"block": "any", "x": 0.02, "y": 0.121}]
    output = {"every": every, "contacts": contacts}
    table = column(0.05, 0.1, SPACING, material=material)
    return scene(table, blocks=BLOCKS, bodies=carried, walls=[LEFT], end=end, output=output, **keys)


def test_bits_do_not_depend_on_the_number_of_threads_nor_on_interruptions(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("blocksim.simulation.schemes.useful_threads", lambda threads, *_: threads)
    scenario = collapse(0.03, 0.01)
    whole = blocksim.run(scenario)
    again = blocksim.run(scenario, threads=3)
    assert again.summary.energy_J == whole.summary.energy_J
    monkeypatch.setattr("blocksim.simulation.interruption.WallTime.check", lambda _: None)  # it comes later
    cut = CheckpointPolicy(wall_time=1e-9)
    assert blocksim.run(scenario, out=tmp_path / "run", precautions=cut).status == "interrupted"
    result = blocksim.run(scenario, out=tmp_path / "run", resume=True)
    for other in (again, result):
        assert other.summary.final_state_sha256 == whole.summary.final_state_sha256
    assert differences(result.frames, whole.frames).is_none
    (end,) = run_ensemble([scenario])
    assert (end.columns, end.ledger) == (whole.columns, whole.summary.energy_J)
    (soils,) = whole.frames.others
    assert soils.names[:2] == ("column.1", "column.2")
    for name in ("x", "y"):
        assert np.abs(soils[name][1] - soils[name][0]).max() < 0.5 * SPACING  # nobody has changed places
    assert soils["syy"][0][0] < 0.0
    assert set(soils.columns()) >= {"x_mm", "sxx_Pa", "plastic_strain"}


PROBE = {"kind": "force", "on": "1", "by": "column", "every": "step"}


@pytest.mark.parametrize(
    ("every", "contacts", "probes"),
    [(0.0005, False, []), (0.002, True, []), (0.01, False, [PROBE])],
    ids=["often", "contacts", "probed"],
)
def test_recording_stresses_contacts_and_forces_changes_no_bit(
    every: float, contacts: bool, probes: list[dict[str, object]]
) -> None:
    unrecorded = Soil(collapse(0.01, 0.01))
    last = simulate(collapse(0.01, every, contacts=contacts, probes=probes))
    unrecorded.to_step(last.summary.steps)
    (soils,) = last.frames.others
    assert np.abs(soils["sxx"]).max() > 100.0  # Pa
    order = np.argsort(unrecorded.soils.states["number"])
    for name, array in (("x", "points"), ("vy", "points"), ("sxx", "states"), ("sxy", "states"), ("plastic", "states")):
        now = getattr(unrecorded.soils, array)[name][order]
        assert np.array_equal(soils[name][-1], now.astype(soils[name].dtype)), name
    assert last.summary.final_state_sha256 == simulate(collapse(0.01, 0.01)).summary.final_state_sha256


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
    return blocksim.run(SCENE, out=tmp_path_factory.mktemp("soil") / "run")


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> Result:
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


def test_exports_have_a_row_a_particle_and_frame_with_what_soil_shows(run: Result, tmp_path: Path) -> None:
    write_frames_csv(tmp_path / "run.csv", run.frames)
    with (tmp_path / "run_soils.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0])[:4] == ["time_s", "particle", "x_mm", "y_mm"]
    assert [float(row["y_mm"]) for row in rows] == (1e3 * run.frames.others[0]["y"]).ravel().tolist()
    assert len(tidy_table(run.frames, "soils")) == 100 * len(run.frames)
    assert data_set(run.frames, "soil")["soils_vy"].shape == (len(run.frames), 100)
    write_vtkhdf(tmp_path / "run.vtkhdf", run.frames, Model(SCENE))
    with h5py.File(tmp_path / "run.vtkhdf") as file:
        data = file["VTKHDF/CellData"]
        assert {"displacement_mm", "pressure_Pa", "syy_Pa", "plastic_strain"} <= set(data)
        assert np.max(data["displacement_mm"]) > 5.0


def test_soil_that_has_no_finite_place_ends_the_run_and_is_named() -> None:
    one = build(Model(SCENE))
    one.systems[0].points.y[1] = np.nan  # type: ignore[union-attr]
    after, code = schemes.ALONE.advance(one, 100_000)
    told = diagnose(BY_CODE[code], code, after, Model(SCENE).bodies)
    assert told.exit_code == ExitCode.NUMERICAL_FAILURE
    assert "(soils, step " in told.reason


def test_a_soil_that_is_not_modelled_or_gets_other_functions_once_compiled_is_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    build(Model(SCENE))
    monkeypatch.setitem(INTERACTIONS, ("soils", "supports"), lambda: float)
    with pytest.raises(ValueError, match="compiled with other functions"):
        build(Model(SCENE))
    monkeypatch.delitem(INTERACTIONS, ("soils", "blocks"))
    for use in (blocksim.run, describe):
        with pytest.raises(InvalidInputError, match=r"^soils and blocks cannot be in one scene: .* not modelled"):
            use(Model(SCENE))


def test_threads_are_of_use_for_many_particles() -> None:
    one = build(Model(SCENE))
    assert [schemes.team_for(one, 4, elements).threads for elements in (0, 3, 250, 1000)] == [1, 1, 2, 4]


def test_check_counts_the_particles() -> None:
    few, many = (describe(Model(scene(column(0.1, 0.05 * k, 0.005, start="ramp")))) for k in (1, 2))
    assert (few.systems, many.systems) == ({"soils": 200}, {"soils": 400})
    cost, quantities = SOILS.cost, len(SOILS.quantities)
    frames = math.ceil(many.frames / chunk_rows(400)) * chunk_rows(400)  # run.h5 has room for whole chunks
    assert many.bytes - few.bytes == pytest.approx(200 * 8 * quantities * frames, rel=0.3)
    assert many.memory - few.memory == 200 * cost.memory


@pytest.mark.parametrize("kind", ["strip", "final", "profile"])
def test_pictures_show_soil(run: Result, alone: Result, kind: str, tmp_path: Path) -> None:
    paint = paint_of("pressure", run.frames, Model(SCENE))
    run_kind(kind)(run.frames, tmp_path / "one.svg", PictureOptions("title", paint=paint))
    assert (tmp_path / "one.svg").read_text().count("<path") > (100 if kind != "profile" else 8)
    assert blocksim.plot(alone, tmp_path / "alone.png", kind=kind).stat().st_size > 5000
    if kind == "profile":
        with pytest.raises(InvalidInputError, match="no soil in this run"):
            run_kind(kind)(toppling(3), tmp_path / "one.svg", PictureOptions())


def test_soil_has_the_colour_asked_for_all_in_the_player_and_blocks_keep_theirs(run: Result) -> None:
    usual, speed = (paint_of(name, run.frames, Model(SCENE)) for name in ("block", "speed"))
    assert usual.scale is not None
    assert usual.scale.label == "displacement (mm)"
    assert (usual.fills(0), any(usual.elements)) == (speed.fills(0), True)
    first, last = (usual.elements[0](frame) for frame in (0, -1))  # type: ignore[misc]  # soil has fills
    assert len(set(first)) == 1
    assert len(set(last)) > 10
    with pytest.raises(InvalidInputError, match="unknown colour 'plastic' in this run"):
        paint_of("plastic", toppling(2), Model(SCENE))
    (soil,) = pack_frames(run.frames).data["systems"]  # of the player
    labels = [shade["label"].split(" (")[0] for shade in soil["shades"]]
    assert labels == ["displacement", "speed", "plastic shear strain", "mean pressure"]
    assert all(shade["high"] > 0.0 for shade in soil["shades"])


def test_the_player_gets_all_corners_of_elements_that_grow(run: Result, monkeypatch: pytest.MonkeyPatch) -> None:
    (soil,) = pack_frames(run.frames).data["systems"]
    assert soil["shape"] is not None
    outlines, every = player._outlines, np.arange(len(run.frames))
    few = player.element_bytes(run.frames, every)
    monkeypatch.setattr(player, "_outlines", lambda track, frame: outlines(track, frame) * (1.0 + frame))
    (grown,) = pack_frames(run.frames).data["systems"]
    (track,) = run.frames.others
    wanted = np.stack([outlines(track, frame) * (1.0 + frame) for frame in range(len(run.frames))])
    assert grown["shape"] is None
    assert player.element_bytes(run.frames, every) - few == 4 * (wanted.shape[2] - 1) * wanted.shape[1]
    np.testing.assert_allclose(numbers(grown["x"]), wanted[..., 0].ravel(), rtol=1e-6)


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
    assert write_vtkhdf(tmp_path / "run.vtkhdf", alone.frames, Model(alone.scenario)) == len(alone.frames.time)
    assert blocksim.report(alone, out=tmp_path / "run.html").stat().st_size > 20_000
    assert blocksim.animate(alone, tmp_path / "run.gif").stat().st_size > 5000
    with pytest.raises(InvalidInputError, match="a history is that of blocks"):
        blocksim.plot(alone, tmp_path / "picture.png", kind="history")
    with pytest.raises(InvalidInputError, match="no block to export"):
        write_geojson(tmp_path / "run.geojson", alone.frames, Model(alone.scenario))


def test_soil_on_the_solid_side_of_a_wall_is_refused_as_it_would_pass_through() -> None:
    turned = {**LEFT, "from": LEFT["to"], "to": LEFT["from"]}
    with pytest.raises(ScenarioError, match="meets the solid side of wall 1, right of the way"):
        scenario_from_mapping({**ALONE, "walls": [turned]})

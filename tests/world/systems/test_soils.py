"""Systems at time zero: blocks, and soils with yield surface, pressure at rest, friction, step and what is shown."""

import csv
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from numpy.typing import NDArray

import blocksim
from blocksim.kernels.soil import arrays
from blocksim.scenario import GROUND, Model, load_scenario
from blocksim.scenario.models.contact import PairFriction
from blocksim.simulation import Result
from blocksim.simulation.schemes import build
from blocksim.simulation.stores.exports import write_frames_csv, write_vtkhdf
from blocksim.simulation.trajectory import data_set, tidy_table
from blocksim.view.history import MOTIONS, FramesInView
from blocksim.view.run_data import Support, drawable_frames
from blocksim.world.describe import describe
from blocksim.world.interactions import contact_classes
from blocksim.world.systems.blocks import placed_points, support_motion, support_quads
from blocksim.world.systems.soil_arrays import interactions_with
from blocksim.world.systems.soils import (
    SOILS,
    body_contacts,
    connected_span,
    earth_pressure_at_rest,
    final_table,
    friction_with,
    pressure,
    surface,
    yield_surface,
)
from blocksim.world.systems.system import SystemInScene, Track
from tests.golden import Golden
from tests.soils import DEPTH, LEFT, MATERIALS, SMOOTH_WALLS, UNIT_WEIGHT, Soil, column, right, scene
from tests.view.made_up import toppling

ANGLE = math.radians(21.9)
COLUMN = column(0.05, 0.1, 0.005)


def test_the_two_yield_surfaces_are_those_that_are_printed() -> None:
    weaker = {**MATERIALS["clay"], "yield_surface": "plane-strain-associated"}
    materials = scene(COLUMN, materials={**MATERIALS, "weaker": weaker}).materials
    angle = math.radians(20.0)
    root = math.sqrt(9.0 + 12.0 * math.tan(angle) ** 2)
    assert yield_surface(materials["clay"]) == pytest.approx((math.sin(angle) / 3.0, 1e3 * math.cos(angle)))
    assert yield_surface(materials["weaker"]) == pytest.approx((math.tan(angle) / root, 3e3 / root))


def test_the_start_is_within_the_yield_surface_and_carries_the_weight_above() -> None:
    upper = {**column(0.05, 0.05, 0.005), "name": "upper", "y": [0.1, 0.15]}
    elements = SOILS.elements(Model(scene(COLUMN, upper)))
    x, y, _, _, sxx, syy, szz, sxy, _ = elements.start
    np.testing.assert_allclose(syy, -UNIT_WEIGHT * (0.15 - y))
    at_rest = earth_pressure_at_rest(scene(COLUMN).materials["rods"])
    assert at_rest == pytest.approx(0.5484, abs=1e-4)
    np.testing.assert_allclose(sxx, at_rest * syy)
    deviator = np.sqrt(((sxx - syy) ** 2 + (syy - szz) ** 2 + (szz - sxx) ** 2) / 6.0 + sxy**2)
    assert (deviator <= -math.sin(ANGLE) / 3.0 * (sxx + syy + szz) + 1e-9).all()
    assert elements.constants[0].sum() == pytest.approx(UNIT_WEIGHT / 9.81 * 0.05 * 0.15 * DEPTH)
    assert (elements.names[0], len(x)) == ("column.1", 300)


def test_a_ramp_starts_without_stress() -> None:
    assert not SOILS.elements(Model(scene({**COLUMN, "start": "ramp"}))).start[4:].any()


def test_friction_is_of_the_pair_else_of_the_soil_itself() -> None:
    faces = [right(0.05), {"from": [0.5, 0.0], "to": [0.5, 0.1], "material": "soft"}]
    scenario = scene(COLUMN, walls=faces, pairs=SMOOTH_WALLS, friction={"block_ground": 0.1})
    classes = contact_classes(Model(scenario))
    assert friction_with(scenario, "rods", GROUND, ground=True) == PairFriction(static=math.tan(ANGLE))
    found = {
        one.material: friction_with(scenario, "rods", str(one.material), ground=True).static
        for one in classes
        if one.is_wall
    }
    assert found == pytest.approx({"smooth": 0.0, "soft": math.tan(ANGLE)})


def test_a_contact_is_as_stiff_as_its_soil_is_deep() -> None:
    scenario = scene(COLUMN)
    table = interactions_with(Model(scenario))
    np.testing.assert_allclose(table["normal_stiffness"], 5.84e6 * DEPTH)


def test_the_step_is_that_of_the_waves_in_the_soil() -> None:
    modulus = 5.84e6 * 0.7 / (1.3 * 0.4)
    expected = 0.4 * 1.5 * 0.005 / math.sqrt(modulus / (UNIT_WEIGHT / 9.81))
    assert SOILS.largest_step is not None
    assert SOILS.largest_step(Model(scene(COLUMN))) == pytest.approx(expected)
    alone = build(Model(scene(COLUMN, blocks={}, bodies=[])))
    assert alone.world.controls[0].step == pytest.approx(expected, rel=0.01)
    assert SOILS.largest_step(Model(scene(COLUMN, time={"end": 1.0, "safety": 0.025}))) == pytest.approx(0.5 * expected)
    assert SOILS.largest_step(Model(scene(COLUMN, time={"end": 1.0, "safety": 0.1}))) == pytest.approx(expected)


def test_check_tells_whose_step_is_taken_and_which_stiffness_makes_both_equal() -> None:
    limits = describe(Model(scene(COLUMN))).limits
    assert limits is not None
    equal = describe(Model(scene(COLUMN, contact={"stiffness_scale": limits.scale}))).limits
    assert equal is not None
    assert equal.blocks == pytest.approx(equal.systems, rel=1e-3)
    assert limits.blocks != pytest.approx(limits.systems, rel=0.1)


def test_the_ledger_names_energies_in_the_order_in_which_they_are_measured() -> None:
    assert SOILS.energies == arrays.ENERGIES


def test_arrays_of_soil_take_as_many_bytes_as_check_estimates() -> None:
    built: Any = build(Model(scene(column(0.25, 0.2, 0.005))))
    taken = sum(array.nbytes for array in built.systems[0])
    assert 0.95 * SOILS.cost.memory < taken / 2000 <= SOILS.cost.memory <= 400


WALL = {"block": "wall", "x": -0.02, "y": 0.06}
BESIDE = "rows of particles on a rough base the active thrust on blocks is some"


@pytest.mark.parametrize(
    ("keys", "body", "base", "expected"),
    [
        ({"gradient": "raw"}, {}, 0.4, [f"soils.column.gradient: with raw gradients and 20 {BESIDE} 11% "]),
        ({"gradient": "raw"}, {}, 0.0, []),
        ({"gradient": "raw"}, {"x": -0.026}, 0.4, []),  # more than a spacing away
        ({"gradient": "raw"}, {"fixed": True}, 0.4, []),  # feels the pressure at rest, which is right
        ({"gradient": "raw"}, {"x": 0.05, "y": 0.16}, 0.4, []),  # lies on top
        ({}, {}, 0.4, [f"soils.column.spacing: with corrected gradients and 20 {BESIDE} 4% "]),
        ({}, {}, 0.0, []),
        ({"y": [0.0, 0.05]}, {}, 0.4, [f"soils.column.spacing: with corrected gradients and 10 {BESIDE} 8% "]),
        ({"y": [0.0, 0.08]}, {}, 0.4, [f"soils.column.spacing: with corrected gradients and 16 {BESIDE} 5% "]),
    ],
)
def test_thrust_that_is_known_to_be_too_small_is_warned_of(
    keys: dict[str, Any], body: dict[str, Any], base: float, expected: list[str]
) -> None:
    blocks = {"wall": {"width": 0.04, "height": 0.12, "length": DEPTH, "material": "smooth"}}
    pairs = {"rods": {"ground": {"friction": base}}}
    table = column(0.1, 0.1, 0.005, **keys)
    held = scene(table, blocks=blocks, bodies=[{**WALL, **body}], pairs=pairs, end=1e-3)
    found = describe(Model(held)).warnings
    assert [text.partition("too small")[0] for text in found] == expected
    if expected:
        assert found == blocksim.run(held).summary.warnings


def test_thrust_of_walls_that_go_on_is_warned_of_by_what_was_measured() -> None:
    """K of smooth walls drawn back from 21.9 degrees by 3 mm of 100 mm, with 10, 14 and 20 rows; Rankine's is 0.457."""
    blocks = {"wall": {"width": 0.12, "height": 0.12, "length": DEPTH, "material": "smooth"}}
    for rows, measured in ((10, 0.3827), (14, 0.4001), (20, 0.4137)):
        table = column(0.1, 0.1, 0.1 / rows)
        (text,) = describe(Model(scene(table, blocks=blocks, bodies=[{**WALL, "x": -0.06}]))).warnings
        share = float(text.partition("of its height, ")[2].partition("%")[0])
        assert share == pytest.approx(100.0 * (1.0 - measured / 0.4567), abs=1.0)


TURNS = {"kind": "gravity", "to": "5 deg", "rate": "1 deg/s"}


@pytest.mark.parametrize("load", [{"kind": "horizontal", "magnitude": 0.1}, TURNS])
def test_loads_that_soil_does_not_feel_are_warned_of(load: dict[str, Any]) -> None:
    table = column(0.1, 0.1, 0.005)
    (text,) = describe(Model(scene(table, loads=[{**load, "name": "push"}]))).warnings
    assert text.startswith("loads.push: soil does not feel this load, blocks alone do")
    force = {"kind": "force", "body": "1", "magnitude": 1.0}
    assert not describe(Model(scene(table, loads=[force]))).warnings


SPACING = 0.005
SCENE = scene(column(0.05, 0.05, SPACING), walls=[LEFT])


def still(**changed: NDArray[np.float64]) -> Track:
    """Return the track of a column that rests for two frames, some quantities of which are changed in the last."""
    present = SystemInScene(SOILS, SOILS.elements(Model(SCENE)))
    values = np.stack([present.elements.start, present.elements.start])
    track = Track(present, values)
    for name, new in changed.items():
        track[name][1] = new
    return track


def test_contacts_with_bodies_add_up_to_the_forces_on_them() -> None:
    soil = Soil(SCENE)
    soil.to_time(0.02)
    found = body_contacts(soil.soils, soil.world)
    ground = soil.world.bodies.size - 1
    for body in (1, ground):
        own = found.body == body
        nx, ny = found.normal[own].T
        push, rub = found.normal_force[own], found.shear_force[own]
        force = [(push * nx - rub * ny).sum(), (push * ny + rub * nx).sum()]
        assert force == pytest.approx(soil.force_on(body), rel=1e-9)
        assert abs(soil.force_on(body)).max() > 0.3
    assert found.place[found.body == 1, 0] == pytest.approx(0.0, abs=1e-12)  # on the face of the wall
    assert found.place[found.body == ground, 1] == pytest.approx(0.0, abs=1e-12)
    assert set(found.part.tolist()) == {0}


def test_the_front_ends_at_the_first_gap_and_the_last_particle_is_told_beside_it() -> None:
    x = np.array([0.0, 0.01, 0.02, 0.03, 0.045, 0.2, -0.3])
    assert connected_span(x, 0.02) == (0.0, 0.045)
    track = still()
    places = track["x"][0].copy()
    places[places > 0.045] += 0.03  # the last column has left
    moved = final_table(Model(SCENE), still(x=places, vx=np.where(places > 0.045, 1.0, 0.0)))
    assert moved["soil"] == ["column"]
    assert [moved[name][0] for name in ("left_mm", "right_mm", "first_mm", "last_mm")] == pytest.approx([0, 45, 0, 80])
    assert (moved["back"], moved["at_rest"]) == (["left"], [0.9])
    assert moved["back_height_mm"] == pytest.approx([50.0])


def test_the_back_of_a_soil_is_the_same_however_little_its_ends_have_moved() -> None:
    apart = 1e-6 * np.sign(still()["x"][0] - 0.025)  # m
    places = still()["x"][0]
    end = right(0.05)
    for walls, back in (([LEFT], "left"), ([end], "right"), ([LEFT, end], "left"), ([], "left")):
        walled = scene(column(0.05, 0.05, SPACING), walls=walls)
        for one_end in (0.0 * apart, np.maximum(apart, 0.0), np.minimum(apart, 0.0)):
            assert final_table(Model(walled), still(x=places + one_end))["back"] == [back]


def test_the_surface_is_the_top_of_columns_and_gaps_interrupt_it() -> None:
    (whole,) = surface(still(), 0)
    assert whole[:, 1] == pytest.approx(0.05)
    track = still()
    track["x"][1][track["x"][0] > 0.03] += 0.1
    one, other = surface(track, 1)
    assert (one[-1, 0], other[0, 0]) == pytest.approx((0.025, 0.135))


def test_smoothed_pressure_of_a_constant_is_that_and_of_a_checkerboard_is_flat() -> None:
    flat = {name: np.full(100, -300.0) for name in ("sxx", "syy", "szz")}
    assert pressure(still(**flat))[1] == pytest.approx(300.0)
    track = still()
    column_of, row_of = ((track[name][0] / SPACING).astype(int) for name in ("x", "y"))
    signs = 1 - 2 * ((column_of + row_of) % 2)
    rough = pressure(still(**{name: values * (1.0 + signs) for name, values in flat.items()}))[1]
    assert np.abs(rough - 300.0).max() < 0.35 * 300.0
    assert np.abs(rough - 300.0).mean() < 0.1 * 300.0


SCENARIOS = Path(__file__).parents[3] / "scenarios"


@pytest.fixture(scope="module")
def fallen() -> Result:
    return blocksim.run(SCENARIOS / "three_blocks.toml")


def test_kinetic_energies_of_blocks_add_up_to_that_of_the_ledger(fallen: Result, tmp_path: Path) -> None:
    frames, blocks = fallen.frames, 3
    table = tidy_table(frames)["kinetic_energy_J"].to_numpy().reshape(-1, blocks)
    np.testing.assert_allclose(table.sum(axis=1), frames.energy["kinetic"], rtol=1e-12)
    assert table.max() > 1e-3
    write_frames_csv(tmp_path / "run.csv", frames)
    with (tmp_path / "run.csv").open() as file:
        exported = [float(row["kinetic_energy_J"]) for row in csv.DictReader(file)]
    np.testing.assert_array_equal(exported, table.ravel())
    write_vtkhdf(tmp_path / "run.vtkhdf", frames, Model(fallen.scenario))
    with h5py.File(tmp_path / "run.vtkhdf") as file:
        cells = file["VTKHDF/CellData/kinetic_energy_J"][:].reshape(len(frames), -1)
    np.testing.assert_array_equal(cells[:, :blocks], table)
    found = data_set(frames, "three")["kinetic_energy"]
    assert (found.attrs["units"], found.shape) == ("J", table.shape)
    panel = MOTIONS["kinetic_energy"](FramesInView(frames, drawable_frames(frames), Support()))
    assert panel.label == "kinetic energy (mJ)"
    np.testing.assert_allclose(panel.values, 1e3 * table)


def test_masses_that_frames_do_not_know_leave_the_cells_empty(fallen: Result) -> None:
    unknown = replace(fallen.frames, mass=None, inertia=None)
    assert tidy_table(unknown)["kinetic_energy_J"].isna().all()


def test_corners_turn_counter_clockwise_with_their_block() -> None:
    corners = np.array([[[1.0, 0.0], [0.0, 2.0]]])
    found = placed_points(corners, np.array([3.0]), np.array([4.0]), np.array([np.pi / 2.0]))
    np.testing.assert_allclose(found, [[[3.0, 5.0], [1.0, 4.0]]], atol=1e-15)


def test_ground_and_walls_are_cells_solid_inwards_beyond_all_blocks(golden: Golden) -> None:
    """Corners run counter-clockwise; a profile is filled below, a wall behind its face, from which no blocks come."""
    texts = []
    for name, count in (("slope", 2), ("three_blocks", 30)):
        quads = support_quads(load_scenario(SCENARIOS / f"{name}.toml"), toppling(count).tracks[0])
        texts += [f"{name}: {', '.join(f'({x:.9g}, {y:.9g})' for x, y in quad)}" for quad in quads.tolist()]
    golden("\n".join(texts))


def test_table_moves_as_the_scenario_says() -> None:
    scenario = load_scenario(SCENARIOS / "shaking_table.toml")
    times = np.linspace(0.0, 0.5, 2001)
    displacement, velocity = support_motion(Model(scenario), times)
    assert np.ptp(displacement[:, 0]) > 1e-3
    np.testing.assert_allclose(np.gradient(displacement[:, 0], times)[1:-1], velocity[1:-1, 0], atol=1e-3)
    assert support_motion(Model(load_scenario(SCENARIOS / "slope.toml")), times)[1].max() == pytest.approx(0.0)

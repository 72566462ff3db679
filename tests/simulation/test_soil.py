"""Soil among blocks and supports: what it conserves, how it rests, what it presses with, and the bits of it all."""

import math
from pathlib import Path

import numpy as np
import pytest

import blocksim
from blocksim.scenario import Scenario
from blocksim.simulation.checkpoint import CheckpointPolicy
from tests.soils import DEPTH, FAR, LEFT, MATERIALS, UNIT_WEIGHT, Soil, column, right, scene

SPACING = 0.005
ANGLE = math.radians(21.9)


@pytest.mark.parametrize("gradient", ["raw", "corrected"])
def test_the_energy_of_a_collapse_adds_up(gradient: str) -> None:
    soil = Soil(scene(column(0.05, 0.1, SPACING, gradient=gradient), walls=[LEFT]))
    before = soil.entries()
    soil.to_time(0.25)
    after = soil.entries()
    change = {name: after[name] - before[name] for name in after}
    assert change["soils_potential"] < -0.2 * before["soils_potential"]
    assert abs(sum(change.values())) < 0.002 * before["soils_potential"]
    for loss in ("plastic", "viscosity", "dashpot", "friction"):
        assert change[f"soils_{loss}"] > 0.0
    assert change["soils_viscosity"] < -0.06 * change["soils_potential"]  # else it stops thin fronts, not friction


@pytest.mark.parametrize("gradient", ["raw", "corrected"])
def test_the_energy_of_soil_that_strikes_the_ground_at_four_metres_a_second_adds_up(gradient: str) -> None:
    soil = Soil(scene(column(0.05, 0.05, SPACING, gradient=gradient), walls=[LEFT], gravity=0.0))
    soil.soils.points["vx"], soil.soils.points["vy"] = -2.0, -4.0
    soil.soils.controls.is_listed[0] = 0
    before = sum(soil.entries().values())
    soil.to_time(0.008)
    after = soil.entries()
    assert after["soils_kinetic"] < 0.6 * before  # it has struck, and rebounds
    assert sum(after.values()) == pytest.approx(before, rel=0.001)


def test_a_column_between_smooth_walls_comes_to_rest_with_its_weight_on_the_ground() -> None:
    table = column(0.05, 0.05, SPACING, start="ramp")
    pairs = {"rods": {"smooth": {"friction": 0.0}, "ground": {"friction": 0.0}}}
    soil = Soil(scene(table, walls=[LEFT, right(0.05)], pairs=pairs))
    soil.to_time(0.2)
    ground = soil.world.bodies.size - 1
    _, base = soil.mean_force_on(ground, 0.25)
    assert -base == pytest.approx(soil.weight, rel=0.005)
    assert np.hypot(soil.soils.points["vx"], soil.soils.points["vy"]).max() < 1e-3
    assert soil.soils.points["y"].max() == pytest.approx(0.05 - 0.5 * SPACING, abs=0.05 * SPACING)


def test_soil_that_starts_geostatic_presses_sideways_as_at_rest() -> None:
    pairs = {"rods": {"smooth": {"friction": 0.0}, "ground": {"friction": 0.0}}}
    soil = Soil(scene(column(0.06, 0.1, SPACING, gradient="raw"), walls=[LEFT, right(0.06)], pairs=pairs))
    soil.to_time(0.03)
    thrust, _ = soil.mean_force_on(1, 0.05)
    sine = math.sin(ANGLE) / math.sqrt(3.0)
    found = -2.0 * thrust / (UNIT_WEIGHT * 0.1**2 * DEPTH)
    assert found == pytest.approx((1.0 - sine) / (1.0 + 2.0 * sine), rel=0.01)


def test_a_particle_that_strikes_the_ground_keeps_a_fifth_of_its_speed_at_most() -> None:
    soil = Soil(scene(column(0.04, 0.04, SPACING), gravity=0.0))
    number = soil.soils.states["number"]
    for name, value in (("x", 0.2), ("y", 0.01), ("vy", -0.5)):
        soil.soils.points[name][number == 0] = value
    soil.soils.controls.is_listed[0] = 0
    soil.to_time(0.02)
    flies = soil.soils.states["number"] == 0
    assert 0.0 < float(soil.soils.points["vy"][flies][0]) < 1.01 * 0.5 * math.exp(-0.5 * math.pi)


@pytest.mark.parametrize("degrees", [20.0, 45.0, 80.0])
def test_a_particle_that_has_flown_off_leaves_a_corner_with_a_fifth_of_the_speed_of_approach(degrees: float) -> None:
    blocks = {"ram": {"width": 0.04, "height": 0.04, "length": DEPTH, "material": "smooth"}}
    ram = [{"block": "ram", "x": -1.0, "y": 0.5, "fixed": True}]  # moves on as it is told
    pairs = {"rods": {"smooth": {"friction": 0.0}}}
    soil = Soil(scene(column(0.04, 0.04, SPACING), blocks=blocks, bodies=ram, pairs=pairs, gravity=0.0))
    normal = np.array([math.cos(math.radians(degrees)), math.sin(math.radians(degrees))])
    struck, away = 0.3 - 1.2 * normal, (0.5 * SPACING + 2e-4) * normal  # m/s, m: straight towards the corner
    number, points = soil.soils.states["number"], soil.soils.points
    for name, value in zip(("x", "y", "vx", "vy"), (-0.98 + away[0], 0.52 + away[1], *struck), strict=True):
        points[name][number == 0] = value
    soil.world.bodies.vx[0], soil.world.bodies.vy[0] = 0.3, 0.3
    soil.soils.controls.is_listed[0] = 0
    soil.to_time(0.004)
    found = np.array([float(points[name][number == 0][0]) for name in ("vx", "vy")])
    leaving, most = (found - 0.3) @ normal, 1.2 * math.exp(-0.5 * math.pi)
    assert 0.8 * most < leaving < most
    assert np.linalg.norm(found - 0.3) == pytest.approx(leaving, rel=1e-6)


def test_particles_that_have_parted_do_not_bounce_off_one_another() -> None:
    soil = Soil(scene(column(0.04, 0.04, SPACING), gravity=0.0))
    points, number = soil.soils.points, soil.soils.states["number"]

    def pair() -> tuple[int, int]:
        return int(np.flatnonzero(number == 0)[0]), int(np.flatnonzero(number == 1)[0])

    for i, x, speed in zip(pair(), (0.2, 0.2 + SPACING), (-0.5, 0.5), strict=True):
        points["x"][i], points["y"][i], points["vx"][i] = x, 0.2, speed
    soil.soils.controls.is_listed[0] = 0
    soil.to_time(0.015)
    one, other = pair()
    assert points["x"][other] - points["x"][one] > 3.0 * SPACING  # nothing holds them
    points["vx"][[one, other]] = 0.5, -0.5
    soil.to_time(0.06)
    one, other = pair()
    assert abs(points["vx"][other] - points["vx"][one]) < 0.25


def test_soil_without_any_strength_presses_like_water() -> None:
    table = column(0.05, 0.05, SPACING, start="ramp", material="water", gradient="raw")
    soil = Soil(scene(table, walls=[LEFT, right(0.05)]))
    soil.to_time(0.15)
    left, _ = soil.mean_force_on(1, 0.25)
    assert -left == pytest.approx(0.5 * 10e3 * 0.05**2 * DEPTH, rel=0.03)


def drawn_back(width: float = 0.1, height: float = 0.06, base: float = 0.0) -> Scenario:
    """Return soil behind a wall that is a fixed block; a fixed block moves on as it is told."""
    blocks = {
        "far": {"width": 0.04, "height": 0.04, "length": DEPTH, "material": "soft"},
        "wall": {"width": 0.04, "height": 0.12, "length": DEPTH, "material": "smooth"},
    }
    return scene(
        column(width, height, SPACING),
        blocks=blocks,
        bodies=[{"block": "wall", "x": -0.02, "y": 0.06, "fixed": True}, FAR],
        walls=[right(width)],
        pairs={"rods": {"smooth": {"friction": 0.0}, "ground": {"friction": base}}},
    )


def active_share(soil: Soil, speed: float, begin: float, end: float) -> float:
    """Return the thrust on a smooth wall that leaves (m/s), over that of Rankine on the height at the wall."""
    soil.world.bodies.vx[0] = -speed
    soil.to_time(begin)
    thrust, _ = soil.mean_force_on(0, end)
    points = soil.soils.points
    columns = points["x"].min() + SPACING * (np.arange(5) - 0.5)
    tops = [points["y"][(points["x"] >= left) & (points["x"] < left + SPACING)].max() for left in columns[:-1]]
    height = float(np.mean(tops)) + 0.5 * SPACING
    sine = math.sin(ANGLE)
    return float(-2.0 * thrust / (UNIT_WEIGHT * height**2 * DEPTH) * (1.0 + sine) / (1.0 - sine))


def test_a_smooth_wall_that_is_drawn_back_feels_the_active_thrust() -> None:
    soil = Soil(drawn_back())
    soil.world.bodies.vx[0] = -0.01
    soil.to_time(0.06)
    thrust, _ = soil.mean_force_on(0, 0.08)
    points = soil.soils.points
    height = points["y"][points["x"] < 3.0 * SPACING].max() + 0.5 * SPACING
    sine = math.sin(ANGLE)
    assert soil.world.bodies.x[0] == pytest.approx(-0.02 - 0.01 * soil.time)
    active = -2.0 * thrust / (UNIT_WEIGHT * height**2 * DEPTH)
    assert active == pytest.approx((1.0 - sine) / (1.0 + sine), rel=0.05)  # 2 % at the full size


def test_thrust_on_a_wall_that_yields_on_a_rough_base_is_by_default_not_too_small() -> None:
    """With raw gradients it is by a tenth; soil that slips in bands, at tan(phi*) = sin(phi), presses by 5.6 % more."""
    share = active_share(Soil(drawn_back(0.15, 0.1, math.tan(ANGLE))), 0.01, 0.05, 0.1)
    band = math.sin(math.atan(math.sin(ANGLE)))
    sine = math.sin(ANGLE)
    assert 0.98 < share < (1.0 - band) / (1.0 + band) * (1.0 + sine) / (1.0 - sine)


def test_blocks_and_soil_act_on_one_another_with_opposite_forces() -> None:
    blocks = {"any": {"width": 0.04, "height": 0.04, "length": DEPTH, "material": "smooth"}}
    flying_block = {"block": "any", "x": -0.025, "y": 0.12, "velocity": [0.5, 0.0], "spin": 5.0}
    table = {**column(0.05, 0.05, SPACING), "y": [0.1, 0.15]}
    soil = Soil(scene(table, blocks=blocks, bodies=[flying_block], gravity=0.0))
    body, mass = soil.bodies[0], float(soil.soils.kinds["mass"][0])
    before = float(body.mass) * 0.5
    soil.to_time(0.05)
    points = soil.soils.points
    assert body.vx < 0.4
    for velocity, spread, start in ((body.vx, points["vx"], before), (body.vy, points["vy"], 0.0)):
        assert velocity * body.mass + mass * spread.sum() == pytest.approx(start, abs=1e-12 * before)
    entries = soil.entries()
    lost = 0.5 * float(body.mass) * 0.25 + 0.5 * float(body.inertia) * 25.0
    assert sum(entries.values()) == pytest.approx(lost, rel=0.002)


def test_bits_do_not_depend_on_the_number_of_threads_nor_on_interruptions(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("blocksim.simulation.schemes.useful_threads", lambda threads, *_: threads)
    blocks = {"any": {"width": 0.04, "height": 0.04, "length": DEPTH, "material": "smooth"}}
    carried = [{"block": "any", "x": 0.07, "y": 0.02}, {"block": "any", "x": 0.02, "y": 0.121}]
    scenario = scene(
        column(0.05, 0.1, SPACING), blocks=blocks, bodies=carried, walls=[LEFT], end=0.03, output={"every": 0.01}
    )
    whole = blocksim.run(scenario)
    again = blocksim.run(scenario, threads=3)
    assert again.summary.final_state_sha256 == whole.summary.final_state_sha256
    assert again.summary.energy_J == whole.summary.energy_J
    cut = CheckpointPolicy(wall_time=1e-9)
    result = blocksim.run(scenario, out=tmp_path / "run", precautions=cut)
    assert result.status == "interrupted"
    result = blocksim.run(scenario, out=tmp_path / "run", resume=True)
    assert result.summary.final_state_sha256 == whole.summary.final_state_sha256
    for one, other in zip(result.frames.tracks, whole.frames.tracks, strict=True):
        np.testing.assert_array_equal(one.values, other.values)


def test_frames_name_particles_as_they_were_placed() -> None:
    result = blocksim.run(scene(column(0.05, 0.05, SPACING), end=0.02, output={"every": 0.01}))
    (soils,) = result.frames.others
    first, last = soils["x"][0], soils["x"][-1]
    assert soils.names[:2] == ("column.1", "column.2")
    assert np.abs(last - first).max() < SPACING  # nobody has changed places
    assert soils["syy"][0][0] < 0.0 < MATERIALS["rods"]["poisson_ratio"]
    assert set(soils.columns()) >= {"x_mm", "sxx_Pa", "plastic_strain"}


def test_particles_too_near_to_one_another_end_the_run() -> None:
    soil = Soil(scene(column(0.1, 0.05, SPACING)))
    soil.soils.points["x"][:160] = np.linspace(0.02, 0.021, 160)
    soil.soils.points["y"][:160] = 0.02
    soil.soils.controls.is_listed[0] = 0
    soil.to_step(2000)
    assert soil.status != 0
    assert soil.steps < 1000

"""Soil among blocks and supports: what it conserves, how it rests, what it presses with, and the bits of it all.

Cases S1 to S11 measure more of that; S7 has the momentum of a block and soil.
"""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import blocksim
from blocksim.analysis.bits import differences
from blocksim.scenario import Scenario
from blocksim.simulation import run_ensemble, simulate, simulate_into
from blocksim.simulation.checkpoint import CheckpointPolicy
from tests.simulation.sliding import assert_same, interrupted_at
from tests.sizes import in_all
from tests.soils import DEPTH, FAR, LEFT, UNIT_WEIGHT, Soil, column, right, scene

SPACING = 0.005
SINE = math.sin(math.radians(21.9))
SLIPPERY = {"rods": {"smooth": {"friction": 0.0}, "ground": {"friction": 0.0}}}
BLOCKS = {"any": {"width": 0.04, "height": 0.04, "length": DEPTH, "material": "smooth"}}
gradients = pytest.mark.parametrize("gradient", ["raw", "corrected"])


def place(soil: Soil, number: int, **values: float) -> None:
    """Put a particle somewhere else, with another velocity."""
    for name, value in values.items():
        soil.soils.points[name][soil.soils.states["number"] == number] = value
    soil.soils.controls.is_listed[0] = 0


@gradients
def test_the_energy_of_soil_that_strikes_the_ground_at_four_metres_a_second_adds_up(gradient: str) -> None:
    soil = Soil(scene(column(0.05, 0.05, SPACING, gradient=gradient), walls=[LEFT], gravity=0.0))
    soil.soils.points["vx"], soil.soils.points["vy"] = -2.0, -4.0
    soil.soils.controls.is_listed[0] = 0
    before = sum(soil.entries().values())
    after = soil.to_time(0.008).entries()
    assert after["soils_kinetic"] < 0.6 * before  # it has struck, and rebounds
    assert sum(after.values()) == pytest.approx(before, rel=0.001)


@pytest.mark.parametrize("start", ["ramp", "geostatic"])
def test_a_column_between_smooth_walls_rests_with_its_weight_on_the_ground_and_presses_sideways(start: str) -> None:
    table = column(0.05, 0.05, SPACING, start=start, gradient="raw")
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


@pytest.mark.parametrize("degrees", [20.0, 45.0, 80.0])
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


def test_particles_that_have_parted_do_not_bounce_off_one_another() -> None:
    soil = Soil(scene(column(0.04, 0.04, SPACING), gravity=0.0))
    points, number = soil.soils.points, soil.soils.states["number"]

    def pair() -> list[int]:
        return [int(np.flatnonzero(number == one)[0]) for one in (0, 1)]

    place(soil, 0, x=0.2, y=0.2, vx=-0.5)
    place(soil, 1, x=0.2 + SPACING, y=0.2, vx=0.5)
    soil.to_time(0.015)
    assert np.diff(points["x"][pair()])[0] > 3.0 * SPACING  # nothing holds them
    points["vx"][pair()] = 0.5, -0.5
    soil.to_time(0.06)
    assert abs(np.diff(points["vx"][pair()])[0]) < 0.25


def test_particles_too_near_to_one_another_end_the_run() -> None:
    soil = Soil(scene(column(0.1, 0.05, SPACING)))
    soil.soils.points["x"][:160] = np.linspace(0.02, 0.021, 160)
    soil.soils.points["y"][:160] = 0.02
    soil.soils.controls.is_listed[0] = 0
    soil.to_step(2000)
    assert soil.status != 0
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


@pytest.mark.long
@pytest.mark.parametrize("material", ["rods", "clay"])
def test_twenty_interruptions_of_a_run_with_soil_change_no_bit(tmp_path: Path, material: str) -> None:
    scenario = collapse(0.05, 0.001, material=material)
    whole = simulate_into(scenario, tmp_path / "whole")
    steps = np.random.default_rng(20).choice(np.arange(1, whole.summary.steps), in_all(20), replace=False)
    stopped = interrupted_at(scenario, tmp_path / "parts", sorted(steps.tolist()))
    resumed = simulate_into(scenario, tmp_path / "parts", resume=True)
    assert resumed.summary.resumed_from == tuple(stopped) == tuple(sorted(steps.tolist()))
    assert_same(resumed, whole)


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

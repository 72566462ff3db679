"""Factors of safety by forces: closed forms and sums by hand in both schemes; what has none; where they are kept."""

import csv
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from blocksim import Model, Simulation, load, plot, report, run, static_limit
from blocksim.errors import InvalidInputError
from blocksim.scenario import geometry, scenario_from_mapping
from blocksim.simulation.safety import SafetyRow
from blocksim.world.earth_pressure import NotApplicableError, active_thrust, coulomb_share
from tests.simulation.sliding import interrupted_at

both = pytest.mark.parametrize("scheme", ["explicit", "nonsmooth"])
STONE = {"density": 2000.0, "young_modulus": 1e10, "poisson_ratio": 0.2}
WIDTH, HEIGHT = 0.2, 0.4
WEIGHT = 2000.0 * WIDTH * HEIGHT * 9.81  # N, of a block


def scene(scheme: str, **tables: Any) -> dict[str, Any]:
    """Return a block on the ground, in equilibrium at the start."""
    return {
        "schema": 1,
        "name": "pier",
        "gravity": 9.81,
        "materials": {"stone": STONE},
        "blocks": {"b": {"width": WIDTH, "height": HEIGHT, "length": 1.0, "material": "stone"}},
        "bodies": [{"block": "b", "x": 0.0, "y": 0.5 * HEIGHT}],
        "friction": {"block_block": 0.5, "block_ground": 0.6},
        "start": {"settle": True},
        "time": {"scheme": scheme, "end": 0.02},
        **tables,
    }


def push(size: float, body: str = "1", **keys: Any) -> dict[str, Any]:
    return {"kind": "force", "name": "push", "body": body, "magnitude": size, **keys}


@both
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_block_pushed_by_a_force_has_the_factors_of_the_textbook_and_of_statics(
    scheme: str, way: float, tmp_path: Path
) -> None:
    size, height = 20.0, 0.3
    data = scene(scheme, loads=[push(way * size, point=[0.0, height - 0.5 * HEIGHT])])
    joints = Simulation(data).joints()
    assert list(joints.columns) == [*SafetyRow.model_fields]
    (row,) = joints.to_dict("records")
    overturning = WEIGHT * 0.5 * WIDTH / (size * height)
    assert row["overturning"] == pytest.approx(overturning, rel=1e-6)
    assert row["sliding"] == pytest.approx(0.6 * WEIGHT / size, rel=1e-6)
    assert (row["compression_N"], row["shear_N"]) == pytest.approx((WEIGHT, way * size), rel=1e-6)
    assert row["eccentricity_mm"] == pytest.approx(way * 1e3 * size * height / WEIGHT, rel=1e-5)
    assert (row["length_mm"], row["kern_mm"]) == pytest.approx((200.0, 200.0 / 6.0), rel=1e-6)
    pressure = WEIGHT / WIDTH * (1.0 + 6.0 * size * height / WEIGHT / WIDTH)
    assert row["linear_pressure_Pa"] == pytest.approx(pressure, rel=1e-5)
    corner = WEIGHT * (0.5 + size * height / WEIGHT / WIDTH)  # N, of the two that carry it
    assert row["pressure_Pa"] == pytest.approx(corner / (0.5 * WIDTH), rel=1e-5)
    assert math.isnan(row["active_sliding"])
    ends = {"loads.push.magnitude": {"from": f"{way * 1.0} N", "to": f"{way * 2000.0} N"}}
    if way < 0.0:
        ends = {"loads.push.magnitude": {"from": "-2000 N", "to": "-1 N"}}
    found = static_limit({**data, "time": {"scheme": "nonsmooth", "end": 1.0}}, ends, out=tmp_path / "statics")
    assert abs(found.limits[0].bound) / size == pytest.approx(overturning, rel=1e-6)


@both
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_block_that_rocks_on_its_toe_has_a_factor_below_one(scheme: str, way: float) -> None:
    size = 1.25 * WEIGHT * 0.5 * WIDTH / HEIGHT
    pushed = push(way * size, point=[0.0, 0.5 * HEIGHT])
    simulation = Simulation(scene(scheme, loads=[pushed], start={})).advance(to=0.01)
    (row,) = simulation.joints().to_dict("records")
    assert (row["length_mm"], row["eccentricity_mm"]) == (0.0, pytest.approx(0.0, abs=1e-9))
    assert row["overturning"] == pytest.approx(0.8, rel=1e-2)
    assert math.isnan(row["pressure_Pa"])
    assert math.isnan(row["linear_pressure_Pa"])


@both
def test_weight_alone_overturns_nothing_that_rocks_on_its_toe(scheme: str) -> None:
    bodies = [{"block": "b", "x": 0.0, "y": 0.5 * HEIGHT, "spin": "-0.5 rad/s", "velocity": [0.1, 0.05]}]
    (row,) = Simulation(scene(scheme, bodies=bodies, start={})).advance(to=0.01).joints().to_dict("records")
    assert row["length_mm"] == 0.0
    assert math.isnan(row["overturning"])


@both
def test_every_joint_of_a_stack_has_the_factors_of_what_is_above_it(scheme: str) -> None:
    size, angle = 30.0, -0.4
    pushed = push(size, "3", direction=f"{angle} rad", point=[0.0, 0.5 * HEIGHT])
    stack = {"kind": "stack", "block": "b", "count": 3}
    joints = Simulation(scene(scheme, bodies=[], structures=[stack], loads=[pushed])).joints()
    across, down = size * math.cos(angle), -size * math.sin(angle)
    assert joints["structure"].tolist() == ["stack"] * 3
    for blocks, row in zip((3, 2, 1), joints.to_dict("records"), strict=True):
        pressed, friction = blocks * WEIGHT + down, 0.6 if blocks == 3 else 0.5
        assert row["compression_N"] == pytest.approx(pressed, rel=1e-5)
        assert row["sliding"] == pytest.approx(friction * pressed / across, rel=5e-4)  # at rest up to 1e-6 of weight
        turning = across * blocks * HEIGHT - down * 0.5 * WIDTH  # the load is one item
        assert row["overturning"] == pytest.approx(blocks * WEIGHT * 0.5 * WIDTH / turning, rel=1e-4)
        assert row["y_mm"] == pytest.approx(1e3 * HEIGHT * (3 - blocks), abs=0.01)


def test_dam_has_the_factors_of_sums_by_hand_at_every_level_of_the_water() -> None:
    simulation, weight = Simulation(load("scenarios/dam.toml")), 2400.0 * 40.0 * 9.81
    thrust, row = 0.0, dict[Any, Any]()
    for level in (4.0, 7.0, 10.0):
        (row,) = simulation.advance(to=0.4 * level).joints().to_dict("records")
        thrust = 0.5 * 9810.0 * level**2
        assert row["sliding"] == pytest.approx(0.75 * weight / thrust, rel=2e-3)
        assert row["overturning"] == pytest.approx(weight * 2.0 / (thrust * level / 3.0), rel=2e-3)
    off = thrust * 10.0 / 3.0 / weight
    assert off > 4.0 / 6.0  # beyond the kern
    assert row["linear_pressure_Pa"] == pytest.approx(2.0 * weight / (3.0 * (2.0 - off)), rel=5e-3)


@both
def test_joints_of_a_wall_in_running_bond_carry_weight_and_inertia_of_all_above(scheme: str) -> None:
    wall = {"kind": "wall", "block": "b", "rows": 3, "columns": 3}
    data = scene(scheme, bodies=[], structures=[wall], loads=[{"kind": "horizontal", "magnitude": 0.05}])
    joints, bodies = Simulation(data).joints(), Model(data).bodies
    heights = sorted({round(body.y, 6) for body in bodies})
    assert len(joints) == len(heights)
    for height, row in zip(heights, joints.to_dict("records"), strict=True):
        above = [body for body in bodies if body.y > height - 0.01]
        weight = 9.81 * sum(body.mass for body in above)
        bottom = height - 0.5 * HEIGHT
        rows = [[body for body in bodies if abs(body.y - y) < 0.01] for y in (height - HEIGHT, height)]
        toe = min(max(body.x + 0.5 * body.size_x for body in row) for row in rows if row)
        holds = 9.81 * sum(body.mass * (toe - body.x) for body in above)
        pushes = 0.05 * 9.81 * sum(body.mass * (body.y - bottom) for body in above)
        assert row["compression_N"] == pytest.approx(weight, rel=1e-4)
        assert row["sliding"] == pytest.approx((0.6 if bottom < 0.01 else 0.5) / 0.05, rel=5e-4)
        assert row["overturning"] == pytest.approx(holds / pushes, rel=1e-4)


SOIL = "scenarios/soil/retaining_wall_stands.toml"


def test_factors_beside_soil_are_those_of_the_forces_that_probes_print() -> None:
    pairs = (("1", "backfill", "low"), ("2", "backfill", "high"), ("1", "ground", "base"), ("2", "1", "joint"))
    probes = [{"kind": "force", "on": on, "by": by, "name": name, "every": "step"} for on, by, name in pairs]
    simulation = Simulation(load(SOIL, {"probes": probes, "time.stop_at_rest": False})).advance(to=0.02)
    last = {name: {key: float(one[key][-1]) for key in one.columns} for name, one in simulation.probes.items()}
    weight, joints = 26.7e3 * 0.032 * 0.025 * 0.05, simulation.joints()
    for number, (base, thrusts) in enumerate((("base", ("low", "high")), ("joint", ("high",)))):
        row, friction = joints.iloc[number], (1.0, 0.8)[number]
        assert row["sliding"] == pytest.approx(friction * last[base]["fy"] / abs(last[base]["fx"]), rel=0.01)
        bottom, toe = 0.025 * number, 0.0  # the resultant leans to the left
        holds = len(thrusts) * weight * (0.016 - toe)
        moment = sum(
            -last[one]["fx"] * (last[one]["y"] - bottom) + last[one]["fy"] * (last[one]["x"] - toe) for one in thrusts
        )
        assert row["overturning"] == pytest.approx(holds / moment, rel=0.01)
    angle, friction, height = math.radians(21.9), math.radians(10.9), 0.05
    thrust = 0.5 * 20e3 * coulomb_share(angle, friction=friction) * height**2 * 0.05
    across, down = thrust * math.cos(friction), thrust * math.sin(friction)
    holds, pushes = 2.0 * weight * 0.016, across * height / 3.0 - down * 0.032
    assert joints["active_sliding"][0] == pytest.approx((2.0 * weight + down) / across, rel=1e-3)
    assert joints["active_overturning"][0] == pytest.approx(holds / pushes, rel=1e-3)


def wedge(angle: float, batter: float, slope: float, friction: float) -> float:
    """Return the largest thrust of wedges on planes through the foot of a back of height one, over half the weight."""
    planes = np.linspace(max(slope, 0.0) + 1e-3, 0.5 * math.pi + batter - 1e-3, 200_001)
    head = -math.tan(batter)  # the soil is on the right of the foot, at x = 0, and its surface begins here
    far = (1.0 - head * math.tan(slope)) / (np.tan(planes) - math.tan(slope))
    area = 0.5 * np.abs(far * 1.0 - head * far * np.tan(planes))
    thrust = 2.0 * area * np.sin(planes - angle) / np.cos(planes - angle - batter - friction)
    is_wedge = (far > 0.0) & (planes > angle) & (np.cos(planes - angle - batter - friction) > 0.0)
    return float(thrust[is_wedge].max())


@pytest.mark.parametrize(
    ("angle", "batter", "slope", "friction", "share"),
    [
        (30, 0, 0, 20, 0.2973),  # Das, table 13.5
        (36, 0, 0, 24, 0.2349),
        (35, 0, 0, 0, 0.2710),  # Rankine
        (30, 10, 0, 0, None),
        (30, 0, 10, 15, None),
        (35, 10, 15, 20, None),
        (40, -8, 5, 25, None),
    ],
)
def test_active_share_is_that_of_tables_and_of_the_worst_wedge(
    angle: float, batter: float, slope: float, friction: float, share: float | None
) -> None:
    angles = [math.radians(one) for one in (angle, batter, slope, friction)]
    assert coulomb_share(*angles) == pytest.approx(wedge(*angles), rel=1e-5)
    assert share is None or coulomb_share(*angles) == pytest.approx(share, abs=1e-4)


BENT = {"outline": [["32 mm", "0 mm"], ["182 mm", "0 mm"], ["182 mm", "50 mm"], ["90 mm", "40 mm"], ["32 mm", "50 mm"]]}
NARROW = {"outline": [["32 mm", "0 mm"], ["50 mm", "0 mm"], ["50 mm", "50 mm"], ["32 mm", "50 mm"]]}
STEEP = {"outline": [["32 mm", "0 mm"], ["92 mm", "0 mm"], ["92 mm", "90 mm"], ["32 mm", "50 mm"]]}
HIGH = {"outline": [["32 mm", "0 mm"], ["182 mm", "0 mm"], ["182 mm", "70 mm"], ["32 mm", "70 mm"]]}


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"soils.0.outline": BENT["outline"]}, "the surface is not straight"),
        ({"soils.0.outline": NARROW["outline"]}, "ends within the wedge"),
        ({"soils.0.outline": STEEP["outline"]}, "steeper than the friction angle"),
        ({"soils.0.outline": HIGH["outline"]}, "higher than the back"),
        ({"structures.0.offset": "-1 mm"}, "the back is not straight"),
        ({"ground.tilt": "2 deg"}, "gravity is not vertical"),
        ({"bodies": [{"block": "brick", "x": 0.1, "y": 0.07, "fixed": True}]}, "in the soil or on it"),
    ],
)
def test_there_is_no_active_thrust_where_coulomb_has_none(changes: dict[str, object], reason: str) -> None:
    model = Model(load(SOIL, changes))
    with pytest.raises(NotApplicableError, match=reason):
        active_thrust(model, [0, 1], [0, 1], model.soils[0], 1.0)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_thrust_on_a_battered_back_below_an_inclined_surface_is_coulombs(side: float) -> None:
    lean, rise, size = 0.3, math.tan(math.radians(5.0)), 0.05  # m: the foot is 15 mm in the soil
    block = [[-0.04, 0.0], [0.03, 0.0], [0.015, size], [-0.04, size]]
    soil = [[0.03, 0.0], [0.23, 0.0], [0.23, size + 0.215 * rise], [0.015, size]]
    block, soil = ([[side * x, y] for x, y in corners] for corners in (block, soil))
    x, y = geometry.centroid([(x, y) for x, y in block])
    rods = {"unit_weight": 20e3, "young_modulus": 5.84e6, "poisson_ratio": 0.3, "friction_angle": "30 deg"}
    changes: dict[str, Any] = {
        "blocks": {"wall": {"outline": block, "depth": 0.05, "material": "aluminium"}},
        "structures": [],
    }
    changes |= {"bodies": [{"block": "wall", "x": x, "y": y}], "walls": [], "probes": [], "materials.rods": rods}
    model = Model(load(SOIL, {**changes, "soils.0.outline": soil, "pairs.rods.aluminium.friction": "20 deg"}))
    found = active_thrust(model, [0], [0], model.soils[0], side)
    fx, fy, moment = found.above(np.zeros(1))[0]
    batter, friction = math.atan(lean), math.radians(20.0)
    share = coulomb_share(math.radians(30.0), batter, math.radians(5.0), friction)
    thrust = 0.5 * 20e3 * share * size**2 * 0.05
    assert (fx, fy) == pytest.approx(
        (-side * thrust * math.cos(batter + friction), -thrust * math.sin(batter + friction)), rel=1e-6
    )
    x, y = side * (0.03 - lean * size / 3.0), size / 3.0
    assert moment == pytest.approx(x * fy - y * fx, rel=1e-6)


def test_cohesion_takes_thrust_away_and_leaves_no_tension() -> None:
    material = {"unit_weight": 20e3, "young_modulus": 5.84e6, "poisson_ratio": 0.3, "friction_angle": "30 deg"}
    changes = {"materials.rods": {**material, "cohesion": 100.0}, "pairs.rods.aluminium.friction": 0.0}
    model = Model(load(SOIL, changes))
    fx, fy, moment = active_thrust(model, [0, 1], [0, 1], model.soils[0], 1.0).above(np.zeros(1))[0]
    height = 0.05 - 2.0 * 100.0 / (20e3 * math.sqrt(1.0 / 3.0))
    thrust = 0.5 * 20e3 / 3.0 * height**2 * 0.05
    assert (fx, fy) == pytest.approx((-thrust, 0.0), abs=1e-12)
    assert moment == pytest.approx(thrust * height / 3.0)


@both
def test_nothing_is_a_factor_where_nothing_pushes(scheme: str, tmp_path: Path) -> None:
    kept = run(scene(scheme), out=tmp_path / "run")
    text = json.loads((tmp_path / "run" / "run.json").read_text())["joints"]
    assert [*text] == ["settled", "end"]
    (row,) = text["settled"]["joints"]
    assert (row["structure"], row["joint"], row["sliding"], row["overturning"]) == ("block 1", 0, None, None)
    with (tmp_path / "run" / "joints.csv").open() as file:
        table = list(csv.DictReader(file))
    assert [one["state"] for one in table] == ["settled", "end"]
    assert table[0]["sliding"] == table[0]["overturning"] == ""
    assert float(table[0]["compression_N"]) == pytest.approx(WEIGHT)
    assert kept.summary.sha256["joints.csv"]


def test_arches_cells_and_what_has_fallen_have_no_joints(tmp_path: Path) -> None:
    arch = run(load("scenarios/arch.toml", {"time.end": 1e-3}))
    assert {one: state.reasons for one, state in arch.summary.joints.items()}["end"] == {
        "arch": "no joints: its courses bear on faces steeper than 30 degrees"
    }
    tower = {"kind": "stack", "block": "b", "count": 2, "offset": 0.15}
    fallen = scene("nonsmooth", bodies=[], structures=[tower], start={}, time={"scheme": "nonsmooth", "end": 1.0})
    kept = run(fallen, out=tmp_path / "fallen")
    assert kept.summary.joints["end"].reasons == {"stack": "no joints: block 2 has fallen"}
    assert not (tmp_path / "fallen" / "joints.csv").exists()
    with pytest.raises(InvalidInputError, match=r"no joints across structures .stack: no joints: block 2 has fallen"):
        plot(kept, kind="joints", out=tmp_path / "none.png")


def test_single_blocks_that_touch_are_one_structure_and_others_their_own() -> None:
    places = [(0.0, 0.2), (0.0, 0.6), (1.0, 0.2)]
    bodies = [{"block": "b", "x": x, "y": y} for x, y in places]
    joints = Simulation(scene("nonsmooth", bodies=bodies)).joints()
    assert joints["structure"].tolist() == ["block 1 and 1 more"] * 2 + ["block 3"]
    assert joints["compression_N"].tolist() == pytest.approx([2.0 * WEIGHT, WEIGHT, WEIGHT], rel=1e-6)


def test_resumed_run_keeps_the_joints_as_they_settled(tmp_path: Path) -> None:
    data = scene("nonsmooth", loads=[push(20.0)], time={"scheme": "nonsmooth", "end": 0.02, "stop_at_rest": False})
    whole = run(data, out=tmp_path / "whole")
    interrupted_at(scenario_from_mapping(data), tmp_path / "parts", [3])
    resumed = run(data, out=tmp_path / "parts", resume=True)
    assert resumed.summary.resumed_from
    assert resumed.summary.joints == whole.summary.joints


def test_joints_are_a_picture_and_stand_in_the_report(tmp_path: Path) -> None:
    kept = run(load(SOIL, {"time.end": 2e-3}), out=tmp_path / "run")
    assert plot(kept, kind="joints", out=tmp_path / "joints.png").read_bytes().startswith(b"\x89PNG")
    page = report(kept, out=tmp_path / "page.html").read_text()
    assert "Joints: factors of safety" in page
    assert "stack 0, end" in page
    thrusts = kept.summary.joints["end"].thrusts
    assert [(one.on, one.side) for one in thrusts] == [("stack", "right"), ("wall 1", "left"), ("ground", "top")]
    on_stack, on_wall, on_ground = thrusts
    for one in (on_stack, on_wall):
        share = 2.0 * math.hypot(one.fx_N, one.fy_N) / (20e3 * 0.05**2 * 0.05)
        assert one.share == pytest.approx(share, rel=0.02)
        assert one.mobilised == pytest.approx(abs(math.tan(math.radians(one.inclination_deg))), rel=1e-6)
        assert math.copysign(1.0, one.inclination_deg) == -math.copysign(1.0, one.fy_N)
    assert on_ground.share is None
    assert on_ground.fy_N == pytest.approx(-20e3 * 0.15 * 0.05 * 0.05, rel=0.05)


@pytest.mark.parametrize(("angle", "friction", "kh"), [(30.0, 15.0, 0.2), (35.0, 0.0, 0.1), (35.0, 20.0, -0.1)])
def test_share_of_the_active_wedge_under_coefficients_of_gravity_is_that_of_the_worst_wedge(
    angle: float, friction: float, kh: float
) -> None:
    """Equilibrium of wedges of all angles behind an upright back; half a turn of the force on the plane of each."""
    phi, delta = math.radians(angle), math.radians(friction)
    planes = np.linspace(phi + 1e-3, 0.5 * math.pi - 1e-3, 100_001)
    turned = np.tan(planes - phi)
    worst = ((turned + kh) / np.tan(planes) / (math.cos(delta) + math.sin(delta) * turned)).max()
    assert coulomb_share(phi, friction=delta, pull=math.atan(kh)) == pytest.approx(worst, rel=1e-6)


def test_active_thrust_under_a_strength_factor_is_that_of_the_weaker_soil() -> None:
    weaker = math.degrees(math.atan(math.tan(math.radians(21.9)) / 1.3))
    found = []
    for changes in ({"strength.factor": 1.3}, {"materials.rods.friction_angle": f"{weaker!r} deg"}):
        model = Model(load(SOIL, {**changes, "pairs.rods.aluminium.friction": 0.0}))
        found.append(active_thrust(model, [0, 1], [0, 1], model.soils[0], 1.0).above(np.zeros(1)))
    np.testing.assert_allclose(found[0], found[1], rtol=1e-9)

"""Loads: what they do to bodies as closed forms say, in both schemes, their work, threads, and rest."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.kernels.common.loads import Pose, force_at, value_at
from blocksim.scenario import Scenario, scenario_from_mapping
from blocksim.simulation import Result, simulate
from blocksim.world.build import build_world

if TYPE_CHECKING:
    from blocksim.kernels.common.arrays import World

G = 9.81
WIDTH, HEIGHT, DEPTH, DENSITY = 1.0, 0.5, 2.0, 2000.0  # m, m, m, kg/m3
MASS = DENSITY * WIDTH * HEIGHT * DEPTH
INERTIA = MASS * (WIDTH**2 + HEIGHT**2) / 12.0
HIGH = 100.0  # m: nothing is met on the way down
SCHEMES = ("explicit", "nonsmooth")
EXACT = 1e-9
SECOND_ORDER = 1e-4


def scenario_with(*loads: dict[str, Any], scheme: str = "explicit", **changes: Any) -> Scenario:
    """Return a block in the air, or where `changes` have it, with loads."""
    data = {
        "schema": 1,
        "name": "loads",
        "materials": {"stone": {"density": DENSITY, "young_modulus": "1 GPa", "poisson_ratio": 0.2}},
        "blocks": {"b": {"width": WIDTH, "height": HEIGHT, "length": DEPTH, "material": "stone"}},
        "bodies": [{"block": "b", "x": 0.0, "y": HIGH}],
        "contact": {"stiffness_scale": 0.01, "restitution": 0.0},
        "time": {"end": 0.1, "scheme": scheme},
        "output": {"every": 0.01},
        "loads": list(loads),
        **changes,
    }
    data["time"] = {"scheme": scheme, **data["time"]}
    return scenario_from_mapping(data)


def end_of(result: Result) -> dict[str, float]:
    row = result.final.iloc[0]
    return {
        "t": result.summary.simulated_time_s,
        "x": 1e-3 * row["x_mm"],
        "y": 1e-3 * row["y_mm"] - HIGH,
        "vx": 1e-3 * row["vx_mm_s"],
        "vy": 1e-3 * row["vy_mm_s"],
        "angle": math.radians(row["rotation_deg"]),
        "spin": math.radians(row["spin_deg_s"]),
    }


def work_of_loads(result: Result) -> float:
    return -result.summary.energy_J.to_loads


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_constant_force_accelerates_a_free_block_exactly_and_its_work_is_the_energy_gained(scheme: str) -> None:
    force = {"kind": "force", "body": "1", "magnitude": "2 kN", "direction": "30 deg"}
    result = simulate(scenario_with(force, scheme=scheme))
    end, a = end_of(result), 2000.0 / MASS
    ax, ay = a * math.cos(math.pi / 6), a * 0.5 - G
    assert end["vx"] == pytest.approx(ax * end["t"], rel=EXACT)
    assert end["vy"] == pytest.approx(ay * end["t"], rel=EXACT)
    assert end["x"] == pytest.approx(0.5 * ax * end["t"] ** 2, rel=EXACT)
    assert end["y"] == pytest.approx(0.5 * ay * end["t"] ** 2, rel=1e-7)  # a small difference of places
    assert end["spin"] == 0.0
    along = end["x"] * math.cos(math.pi / 6) + end["y"] * 0.5
    assert work_of_loads(result) == pytest.approx(2000.0 * along, rel=1e-7)
    assert result.summary.energy_J.relative_residual < EXACT


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_moment_spins_a_block_about_its_centre(scheme: str) -> None:
    result = simulate(scenario_with({"kind": "moment", "body": "1", "magnitude": "-3 kN m"}, scheme=scheme))
    end, rate = end_of(result), -3000.0 / INERTIA
    assert end["spin"] == pytest.approx(rate * end["t"], rel=EXACT)
    assert end["angle"] == pytest.approx(0.5 * rate * end["t"] ** 2, rel=EXACT)
    assert end["vx"] == 0.0
    assert work_of_loads(result) == pytest.approx(-3000.0 * end["angle"], rel=EXACT)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_force_along_axes_of_the_body_turns_with_it_and_one_along_fixed_axes_does_not(scheme: str) -> None:
    bodies = [{"block": "b", "x": 0.0, "y": HIGH, "angle": "90 deg"}]
    force = {"kind": "force", "body": "1", "magnitude": "1 kN"}
    turned, fixed = (
        end_of(simulate(scenario_with({**force, "axes": axes}, scheme=scheme, bodies=bodies, gravity=0.0)))
        for axes in ("body", "world")
    )
    speed = 1000.0 / MASS * turned["t"]
    assert (turned["vx"], turned["vy"]) == pytest.approx((0.0, speed), abs=1e-12)
    assert (fixed["vx"], fixed["vy"]) == pytest.approx((speed, 0.0), abs=1e-12)


HISTORIES: dict[str, tuple[dict[str, Any], float]] = {  # and the integral of the factor over 0.1 s
    "ramp": ({"kind": "ramp", "start": 0.02, "end": 0.06, "from": 0.5, "to": 2.0}, 0.01 + 0.05 + 0.08),
    "steps": ({"kind": "steps", "times": [0.03, 0.05], "factors": [1.0, -2.0]}, 0.02 - 0.1),
    "table": ({"kind": "table", "times": [0.02, 0.04, 0.1], "factors": [1.0, 3.0, 0.0]}, 0.02 + 0.04 + 0.09),
}


@pytest.mark.usefixtures("compiler")
@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("kind", HISTORIES)
def test_a_force_that_goes_with_time_brings_the_integral_of_its_history(scheme: str, kind: str) -> None:
    history, integral = HISTORIES[kind]
    force = {"kind": "force", "body": "1", "magnitude": "2 kN", "history": history}
    result = simulate(scenario_with(force, scheme=scheme, gravity=0.0, time={"end": 0.1, "step": 2e-5}))
    end = end_of(result)
    assert end["t"] == pytest.approx(0.1, rel=1e-12)
    assert end["vx"] == pytest.approx(2000.0 / MASS * integral, rel=1e-3)
    assert work_of_loads(result) == pytest.approx(0.5 * MASS * end["vx"] ** 2, rel=SECOND_ORDER)


def water(level: float, **pose: float) -> tuple[float, float, float]:
    """Return force (N) and moment about the centre (N m) of water on the left face of a block (m, m, rad)."""
    body: dict[str, Any] = {"block": "b", "x": 0.0, "y": pose.get("y", 1.0)}
    load = {"kind": "pressure", "body": "1", "face": "left", "water_level": level, "unit_weight": "10 kN/m^3"}
    world: World = build_world(scenario_with(load, bodies=[body]))
    angle = pose.get("angle", 0.0)
    return force_at(world, world.loads[0], 0.0, Pose(0.0, body["y"], math.cos(angle), math.sin(angle)))


def test_water_below_a_face_does_nothing_and_above_it_presses_as_its_mean_depth_does() -> None:
    assert water(0.5) == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)
    area = HEIGHT * DEPTH
    fx, fy, torque = water(3.0)
    assert (fx, fy) == pytest.approx((10e3 * 2.0 * area, 0.0), abs=1e-9)
    assert torque == pytest.approx(10e3 * HEIGHT**3 * DEPTH / 12.0, rel=1e-12)  # unit weight times I of the face


def test_water_on_a_turned_face_is_the_exact_integral_along_it() -> None:
    angle, level = 0.3, 1.05
    fx, fy, torque = water(level, angle=angle)
    count = 100_000
    s = HEIGHT * ((np.arange(count) + 0.5) / count - 0.5)
    x = -0.5 * WIDTH * math.cos(angle) - s * math.sin(angle)
    y = -0.5 * WIDTH * math.sin(angle) + s * math.cos(angle)
    sizes = 10e3 * np.maximum(level - 1.0 - y, 0.0) * DEPTH * HEIGHT / count
    total, moment = sizes.sum(), (sizes * (x * math.sin(angle) - y * math.cos(angle))).sum()
    assert (fx, fy) == pytest.approx((total * math.cos(angle), total * math.sin(angle)), rel=1e-6)
    assert torque == pytest.approx(moment, rel=1e-6)


def test_the_piece_of_a_history_is_found_among_those_of_several_loads() -> None:
    steps = {"kind": "steps", "times": [0.1 * k for k in range(1, 8)], "factors": [float(k) for k in range(1, 8)]}
    force = {"kind": "force", "body": "1", "magnitude": 1.0}
    world: World = build_world(scenario_with(force, {**force, "history": steps}, force))
    found = [value_at(world, world.loads[1], 0.1 * k + 0.05) for k in range(9)]
    assert found == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 7.0]
    assert [value_at(world, world.loads[n], 0.55) for n in (0, 2)] == [1.0, 1.0]


@pytest.mark.usefixtures("compiler")
@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_run_whose_load_still_changes_does_not_end_at_rest(scheme: str) -> None:
    lying = [{"block": "b", "x": 0.0, "y": HEIGHT / 2}]
    push = {"kind": "force", "body": "1", "magnitude": "1 kN", "history": {"kind": "ramp", "start": 1.0, "end": 1.1}}
    result = simulate(scenario_with(push, scheme=scheme, bodies=lying, time={"end": 2.0, "rest_hold": 0.05}))
    assert result.summary.reason == "at rest"
    assert 1.1 < result.summary.simulated_time_s < 1.3
    without = simulate(scenario_with(scheme=scheme, bodies=lying, time={"end": 2.0, "rest_hold": 0.05}))
    assert without.summary.simulated_time_s < 0.9


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.usefixtures("compiler")
def test_loads_give_the_same_bits_on_two_threads(scheme: str) -> None:
    width, height = 16, 14
    wall = {"kind": "wall", "block": "b", "rows": height, "columns": width}
    names = [str(number) for number in (1, 30, 77, width * height)]
    loads: list[dict[str, Any]] = [
        {"kind": "horizontal", "magnitude": 0.3},
        {"kind": "gravity", "to": "5 deg", "rate": "90 deg/s"},
        *({"kind": "force", "body": name, "magnitude": "20 kN", "point": [0.1, 0.2]} for name in names),
    ]
    time = {"end": 0.02 if scheme == "nonsmooth" else 0.004}
    scenario = scenario_with(*loads, scheme=scheme, bodies=[], structures=[wall], time=time)
    one, two = (simulate(scenario, threads=threads) for threads in (1, 2))
    assert two.summary.threads == 2
    assert one.summary.final_state_sha256 == two.summary.final_state_sha256
    assert one.summary.energy_J.relative_residual < 1e-3
    assert one.summary.energy_J.to_loads < 0.0

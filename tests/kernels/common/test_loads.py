"""Loads: what they do to bodies as closed forms say, in both schemes, their work, histories, and threads."""

import math
from typing import Any

import numpy as np
import pytest

from blocksim.kernels.common.arrays import World
from blocksim.kernels.common.loads import Pose, force_at, value_at
from blocksim.scenario import Model, Scenario, scenario_from_mapping
from blocksim.simulation import simulate
from blocksim.world.build import build_world

G = 9.81
WIDTH, HEIGHT, DEPTH, DENSITY = 1.0, 0.5, 2.0, 2000.0  # m, m, m, kg/m3
MASS = DENSITY * WIDTH * HEIGHT * DEPTH
INERTIA = MASS * (WIDTH**2 + HEIGHT**2) / 12.0
HIGH = 100.0  # m: nothing is met on the way down
SCHEMES = ("explicit", "nonsmooth")
EXACT = 1e-9


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


class End:
    """Where a block is at the end of a run, how fast (m, rad, s), and the work (J) that loads have done."""

    def __init__(self, scheme: str, load: dict[str, Any], **changes: Any) -> None:
        """Run it."""
        result = simulate(scenario_with(load, scheme=scheme, **changes))
        row = result.final.iloc[0]
        self.t = result.summary.simulated_time_s
        self.place = 1e-3 * row["x_mm"], 1e-3 * row["y_mm"] - HIGH
        self.velocity = 1e-3 * row["vx_mm_s"], 1e-3 * row["vy_mm_s"]
        self.angle, self.spin = math.radians(row["rotation_deg"]), math.radians(row["spin_deg_s"])
        self.work = -result.summary.energy_J.to_loads
        self.residual = result.summary.energy_J.relative_residual


PUSH = {"kind": "force", "body": "1", "magnitude": "1 kN"}
QUARTER = {"bodies": [{"block": "b", "x": 0.0, "y": HIGH, "angle": "90 deg"}], "gravity": 0.0}
CONSTANT: dict[str, tuple[dict[str, Any], dict[str, Any], tuple[float, float, float]]] = {  # N, N, N m
    "force": ({**PUSH, "direction": "30 deg"}, {}, (500.0 * math.sqrt(3.0), 500.0, 0.0)),
    "moment": ({"kind": "moment", "body": "1", "magnitude": "-3 kN m"}, {}, (0.0, 0.0, -3000.0)),
    "axes of the body": ({**PUSH, "axes": "body"}, QUARTER, (0.0, 1000.0, 0.0)),
    "axes of the world": ({**PUSH, "axes": "world"}, QUARTER, (1000.0, 0.0, 0.0)),
}


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("name", CONSTANT)
def test_a_constant_force_and_a_moment_accelerate_a_free_block_exactly_and_work_as_much(name: str, scheme: str) -> None:
    load, changes, (fx, fy, torque) = CONSTANT[name]
    end = End(scheme, load, **changes)
    ax, ay, rate = fx / MASS, fy / MASS - changes.get("gravity", G), torque / INERTIA
    assert end.velocity == pytest.approx((ax * end.t, ay * end.t), rel=EXACT, abs=1e-12)
    assert end.place == pytest.approx((0.5 * ax * end.t**2, 0.5 * ay * end.t**2), rel=1e-7, abs=1e-12)
    assert (end.spin, end.angle) == pytest.approx((rate * end.t, 0.5 * rate * end.t**2), rel=EXACT)
    assert end.work == pytest.approx(fx * end.place[0] + fy * end.place[1] + torque * end.angle, rel=1e-7)
    assert end.residual < EXACT


@pytest.mark.parametrize(("level", "angle"), [(0.5, 0.0), (3.0, 0.0), (1.0, 0.0), (1.05, 0.3)])
def test_water_on_a_face_is_the_exact_integral_along_it(level: float, angle: float) -> None:
    """Below it, above it, halfway up, and on a face that has turned."""
    load = {"kind": "pressure", "body": "1", "face": "left", "water_level": level, "unit_weight": "10 kN/m^3"}
    world: World = build_world(Model(scenario_with(load, bodies=[{"block": "b", "x": 0.0, "y": 1.0}])))
    fx, fy, torque = force_at(
        world, world.loads[0], 0.0, Pose(0.0, 1.0, math.cos(angle), math.sin(angle), 0.0, 0.0, 0.0)
    )
    count = 100_000
    s = HEIGHT * ((np.arange(count) + 0.5) / count - 0.5)
    x = -0.5 * WIDTH * math.cos(angle) - s * math.sin(angle)
    y = -0.5 * WIDTH * math.sin(angle) + s * math.cos(angle)
    sizes = 10e3 * np.maximum(level - 1.0 - y, 0.0) * DEPTH * HEIGHT / count
    total, moment = sizes.sum(), (sizes * (x * math.sin(angle) - y * math.cos(angle))).sum()
    assert (fx, fy) == pytest.approx((total * math.cos(angle), total * math.sin(angle)), rel=1e-6, abs=1e-9)
    assert torque == pytest.approx(moment, rel=1e-6, abs=1e-9)


HISTORIES: list[tuple[dict[str, Any], list[float]]] = [  # and the factor after 0.05 s, 0.15 s and so on
    ({"kind": "steps", "times": [0.1, 0.2, 0.3, 0.6], "factors": [1, 2, 3, -4]}, [0, 1, 2, 3, 3, 3, -4, -4, -4]),
    ({"kind": "ramp", "start": 0.2, "end": 0.4, "from": 0.5, "to": 2.5}, [0.5, 0.5, 1, 2, 2.5, 2.5, 2.5, 2.5, 2.5]),
    ({"kind": "table", "times": [0.2, 0.4, 0.7], "factors": [1, 3, 0]}, [1, 1, 1.5, 2.5, 2.5, 1.5, 0.5, 0, 0]),
]


@pytest.mark.parametrize(("history", "factors"), HISTORIES)
def test_factor_is_that_of_the_time_in_the_history_of_a_load_among_others(
    history: dict[str, Any], factors: list[float]
) -> None:
    force = {"kind": "force", "body": "1", "magnitude": 1.0}
    world: World = build_world(Model(scenario_with(force, {**force, "history": history}, force)))
    assert [value_at(world, world.loads[1], 0.1 * k + 0.05) for k in range(9)] == pytest.approx(factors)
    assert [value_at(world, world.loads[n], 0.55) for n in (0, 2)] == [1.0, 1.0]


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.usefixtures("compiler")
def test_loads_on_a_table_that_shakes_give_the_same_bits_on_two_threads(scheme: str) -> None:
    width, height = 16, 14
    wall = {"kind": "wall", "block": "b", "rows": height, "columns": width}
    names = [str(number) for number in (1, 30, 77, width * height)]
    loads: list[dict[str, Any]] = [
        {"kind": "horizontal", "magnitude": 0.3},
        {"kind": "gravity", "to": "5 deg", "rate": "90 deg/s"},
        *({"kind": "force", "body": name, "magnitude": "20 kN", "point": [0.1, 0.2]} for name in names),
    ]
    time = {"end": 0.02 if scheme == "nonsmooth" else 0.004}
    motion = {"kind": "harmonic", "amplitude": 0.001, "frequency": 10.0}
    scenario = scenario_with(*loads, scheme=scheme, bodies=[], structures=[wall], time=time, motion=motion)
    one, two = (simulate(scenario, threads=threads) for threads in (1, 2))
    assert two.summary.threads == 2
    assert one.summary.final_state_sha256 == two.summary.final_state_sha256
    assert one.summary.energy_J.relative_residual < 1e-3
    assert one.summary.energy_J.to_loads < 0.0

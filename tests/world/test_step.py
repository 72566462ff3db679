"""Step and skin of a scene: stable by its eigenvalues, under the load that contacts expect, no contact missed."""

from collections.abc import Mapping
from math import cos, hypot, inf, pi, sin, sqrt
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from blocksim.bench.harness import pushed_wall, three_blocks
from blocksim.errors import BlocksimError
from blocksim.kernels.common.arrays import AT_REST, REACHED, World
from blocksim.kernels.explicit.laws import HERTZ_MINDLIN, tangent_stiffness
from blocksim.scenario import Model, PlacedBody, Scenario
from blocksim.scenario.laws import LAWS
from blocksim.simulation.schemes import measure_row
from blocksim.verification.scene import HEIGHT, WIDTH, SteppedScene, scenario_of
from blocksim.world.bodies import layout_of
from blocksim.world.build import build_world
from blocksim.world.describe import describe
from blocksim.world.nonsmooth import build_nonsmooth
from blocksim.world.step import (
    MOST_STEPS,
    BlockKind,
    ContactLoad,
    ContactStiffness,
    SkinTooSmallError,
    bounds_of,
    expected_load,
    frequency_squared,
    speeds_of,
    stable_step,
)
from tests.golden import Golden

G, HERTZ = 9.81, LAWS["hertz-mindlin"]
RADIUS = hypot(WIDTH, HEIGHT) / 2
FALLING = {"y": 0.2, "angle": 0.4}


def world_of(body: Mapping[str, object], *more: Mapping[str, object], **tables: Any) -> World:
    return build_world(Model(scenario_of([body, *more], **tables)))


def load_of(*bodies: Mapping[str, object], **tables: Any) -> ContactLoad:
    scenario = scenario_of(bodies, **tables)
    layout = layout_of(Model(scenario))
    (bounds,) = bounds_of([layout], build_world(Model(scenario)).bodies[np.newaxis])
    return expected_load(layout, bounds, speeds_of(layout, bounds))


TILTED = {"tilt": "20 deg"}
LOADS = {  # a fall from the highest point, faster by speed and spin times half a diagonal; slopes speed up all the time
    "a fall": load_of(FALLING),
    "onto deeper ground": load_of(FALLING, ground={"profile": [[0.0, 0.0], [1.0, -0.5]]}),
    "a throw": load_of({**FALLING, "velocity": [3.0, 4.0], "spin": -10.0}),
    **{f"on a slope for {end} s": load_of(FALLING, ground=TILTED, time={"end": end}) for end in (0.5, 1.5)},
    "two, and a fixed one": load_of(FALLING, {**FALLING, "x": 0.1}, {**FALLING, "x": 0.2, "fixed": True}),
}


def test_loads_that_are_expected_are_those_that_were_read(golden: Golden) -> None:
    texts = [f"{name}: {load.speed:.9g} m/s, {load.weight:.9g} N" for name, load in LOADS.items()]
    assert LOADS["a fall"].speed == pytest.approx(sqrt(2.0 * G * (0.2 + RADIUS)))
    golden("\n".join(texts))


def test_a_load_makes_a_light_block_no_faster_than_the_way_across_the_scene_lets_it() -> None:
    """A block of 0.1 kg that is pushed by 1 kN: in a second it would be at 9 km/s."""
    loads = [{"kind": "force", "body": "1", "magnitude": 1e3}]
    speeds, blocks = list[float](), list[PlacedBody]()
    for end in (1e-6, 1.0, 10.0):
        scenario = scenario_of([{"y": HEIGHT / 2}], loads=loads, time={"end": end})
        layout = layout_of(Model(scenario))
        (bounds,) = bounds_of([layout], build_world(Model(scenario)).bodies[np.newaxis])
        speeds.append(speeds_of(layout, bounds).greatest - speeds_of(layout, bounds).impact)
        blocks += layout.placed
    block = blocks[0]
    low = min(0.0, block.y - RADIUS)
    across = hypot(2.0 * RADIUS, block.y + RADIUS - low)
    assert speeds[0] == pytest.approx(1e-6 * 1e3 / block.mass, rel=1e-2)
    assert speeds[1] == speeds[2] == pytest.approx(sqrt(2.0 * 1e3 / block.mass * across))


def hertz(body: Mapping[str, object], **contact: object) -> SteppedScene:
    return SteppedScene(world_of(body, contact={"law": "hertz-mindlin", "stiffness_scale": 1e-2, **contact}))


@pytest.mark.parametrize(("body", "restitution"), [(FALLING, 1.0), ({**FALLING, "velocity": [0.0, -3.0]}, 0.2)])
def test_no_contact_becomes_stiffer_than_the_step_expects(body: Mapping[str, object], restitution: float) -> None:
    scene = hertz(body, restitution=restitution, max_overlap=5e-3)
    world, block = scene.world, scene.bodies[0]
    stiffness = float(world.interactions[1, 0].normal_stiffness)
    load = load_of(body, contact={"law": "hertz-mindlin"})
    expected = HERTZ.greatest_slope(stiffness, float(block.inverse_mass), *load)
    deepest = 0.0
    while scene.time < 0.25:
        scene.to_step(scene.steps + 10)
        assert scene.code in {REACHED, AT_REST}
        deepest = max(deepest, float(measure_row(scene.scene)[-1]))
    assert deepest > 0.0
    assert tangent_stiffness(HERTZ_MINDLIN, stiffness, deepest) < 1.01 * expected


def test_contact_under_the_weight_of_everything_is_not_stiffer_than_expected() -> None:
    load = ContactLoad(0.0, 100.0)
    stiffness = 1e9
    slope = HERTZ.greatest_slope(stiffness, 10.0, *load)
    depth = (slope / (1.5 * stiffness)) ** 2
    assert stiffness * depth**1.5 == pytest.approx(100.0)


def test_a_skin_that_a_shaken_support_outruns_is_refused_and_the_least_one_runs_to_the_end() -> None:
    motion = {"kind": "harmonic", "amplitude": "0.2 m", "frequency": "10 Hz", "duration": "0.5 s"}
    high, soft = {"y": 0.2 - hypot(WIDTH, HEIGHT) / 2}, {"stiffness_scale": 1e-4}
    with pytest.raises(SkinTooSmallError) as refusal:
        world_of(high, contact={**soft, "skin": 1e-3 * HEIGHT}, motion=motion)
    run = SteppedScene(world_of(high, contact={**soft, "skin": refusal.value.least}, motion=motion))
    assert run.to_time(0.1).code == REACHED


sizes = st.floats(1e-3, 1.0)
ratios = st.floats(0.0, 6.0)
shears = st.floats(0.05, 1.5)  # of the normal stiffness
K = 9.5e8


def body_of(size_x: float, size_y: float, density: float = 2700.0, depth: float = 0.05) -> BlockKind:
    mass = density * size_x * size_y * depth
    return BlockKind(0.5 * size_x, 0.5 * size_y, 1.0 / mass, 12.0 / (mass * (size_x**2 + size_y**2)), 1)


def stiffness_at(points: list[tuple[float, float, float]], normal: float, shear: float) -> np.ndarray:
    """Return the 3 x 3 stiffness of a body for contact points x, y and the angle of their normal."""
    total = np.zeros((3, 3))
    for x, y, angle in points:
        for stiffness, direction in ((normal, angle), (shear, angle + pi / 2)):
            nx, ny = cos(direction), sin(direction)
            row = np.array([nx, ny, x * ny - y * nx])
            total += stiffness * np.outer(row, row)
    return total


def largest(body: BlockKind, stiffness: np.ndarray) -> float:
    root = np.sqrt([body.inverse_mass, body.inverse_mass, body.inverse_inertia])
    return float(np.linalg.eigvalsh(root[:, None] * stiffness * root).max())


@given(w=sizes, h=sizes, ratio=shears)
def test_bound_is_the_largest_eigenvalue_of_a_face_contact(w: float, h: float, ratio: float) -> None:
    body = body_of(w, h)
    on_base = stiffness_at([(-w / 2, -h / 2, pi / 2), (w / 2, -h / 2, pi / 2)], K, ratio * K)
    on_side = stiffness_at([(w / 2, -h / 2, pi), (w / 2, h / 2, pi)], K, ratio * K)
    expected = max(largest(body, on_base), largest(body, on_side))
    assert frequency_squared(body, K, ratio * K) == pytest.approx(expected, rel=1e-9)


@given(w=sizes, h=sizes, ratio=ratios, safety=st.floats(0.01, 1.0))
def test_safety_is_the_share_of_the_stability_limit(w: float, h: float, ratio: float, safety: float) -> None:
    body, contact = body_of(w, h), ContactStiffness(K, 0.8 * K, ratio)
    whole = stable_step([(body, None, contact)], 1.0)
    assert stable_step([(body, None, contact)], safety) == pytest.approx(safety * whole, rel=1e-12)
    assert whole * sqrt(frequency_squared(body, K, 0.8 * K)) == pytest.approx(2.0 / max(1.0, ratio / 2), rel=1e-12)


def test_stiffest_pair_decides() -> None:
    big, small = body_of(0.1, 0.1), body_of(0.01, 0.01)
    soft, hard = ContactStiffness(K, K, 0.5), ContactStiffness(10 * K, K, 0.5)
    alone = stable_step([(small, None, hard)], 0.05)
    assert stable_step([(big, None, soft), (small, None, hard), (big, big, soft)], 0.05) == alone


def test_scene_in_which_nothing_can_move_has_no_limit() -> None:
    wall = BlockKind(0.5, 0.5, 0.0, 0.0, 1)
    assert (
        stable_step([(wall, None, ContactStiffness(K, K, 0.5)), (wall, wall, ContactStiffness(K, K, 0.5))], 1.0) == inf
    )
    assert stable_step([], 1.0) == inf


RIGID: dict[str, Any] = {"scheme": "nonsmooth"}
REST = {"y": HEIGHT / 2}
LARGE = {"y": 50 * HEIGHT, "width": 100 * WIDTH, "height": 100 * HEIGHT}
SLOPES = {f"a slope of {tilt}": {"ground": {"tilt": f"{tilt} deg"}} for tilt in (20, 40)}
MU = {"block_block": 0.5, "block_ground": 0.5}
SLIPPERY = {"friction": {"block_block": 0.1, "block_ground": 0.5}, **SLOPES["a slope of 20"]}
PLANK = {"x": 1.0, "y": HEIGHT / 2, "width": 1.0, "fixed": True}
HARMONIC = {"kind": "harmonic", "amplitude": "0.1 mm", "frequency": "100 Hz", "ramp": "50 ms"}
PULSE = {"kind": "pulse", "shape": "half-sine", "amplitude": "5 m/s^2", "duration": "5 ms"}
FAST = {**HARMONIC, "amplitude": "20 mm", "ramp": "1 ms"}  # 21.15 m/s
THROWS: dict[str, dict[str, Any]] = {
    "a fall": FALLING,
    "a throw": {**FALLING, "velocity": [0.0, -20.0]},
    "a higher fall": {**FALLING, "y": 5.0},
    "a spin": {**FALLING, "spin": 500.0},
}
MODELS, BOTH_LAWS, DENSE = ("surface", "kernel", "particles"), ("linear", "hertz-mindlin"), {"particle_spacing": 5e-4}
SLIVER = [[0.0, 0.0], [1.0, 1.0], [0.98, 1.02]]
THIN = {"y": 1.0, "x": 1.0, "height": 2e-3, "fixed": True}
HIGH = {"y": 0.2}
SOFT = {"stiffness_scale": 1e-4}


def rigid(*bodies: dict[str, Any], time: dict[str, Any] | None = None, **tables: Any) -> Scenario:
    return scenario_of(bodies or [REST], time={**RIGID, **(time or {})}, **tables)


def shaken(motion: dict[str, Any], gravity: float = 0.0, **time: Any) -> Scenario:
    return rigid(time={"end": 0.1, **time}, motion=motion, gravity=gravity)


def springs(*bodies: dict[str, Any], **tables: Any) -> Scenario:
    return scenario_of(bodies or [HIGH], **tables)


def wall(columns: int, rows: int, **time: Any) -> Scenario:
    return pushed_wall(columns, rows, time={**RIGID, **time})


SCENES: dict[str, Scenario] = {
    "a block": rigid(),
    "a block and fixed ones": rigid(REST, *({"x": 0.1 * i, **REST, "fixed": True} for i in range(1, 20))),
    "a large block": rigid(LARGE),
    "three blocks": three_blocks(time=RIGID),
    "a wall": wall(4, 4),
    "a high wall": wall(10, 100),
    "a short end": rigid(time={"end": 1e-5}),
    "a fast block": rigid({**REST, "velocity": [50.0, 0.0]}),
    "a fast sliver, 28 mm wide": rigid({"outline": SLIVER, "y": 2.0, "velocity": [50.0, 0.0]}),
    "a drop from 50 m": rigid({"y": 50.0}),
    "by hand": rigid(time={"step": 1e-4}),
    **{f"{name}, friction holds or not": rigid(time={"end": 100.0}, friction=MU, **SLOPES[name]) for name in SLOPES},
    "a slope, slippery blocks": rigid(time={"end": 100.0}, **SLIPPERY),
    "a slope, slippery blocks, a plank": rigid(REST, PLANK, time={"end": 10.0}, **SLIPPERY),
    **{
        f"a wall, {step} s, {count} substeps": wall(40, 25, step=step, substeps=count)
        for step, count in ((1e-3, 4), (5e-3, 4), (1.5e-3, 1))
    },
    "a wall, forced": wall(40, 25, step=5e-3, force_step=True),
    **{
        f"a throw, {step} s": rigid({**REST, "velocity": [3.0, 0.0]}, time={"step": step})
        for step in (8e-4, 9e-4, 1e-18)
    },
    "shaken": shaken(HARMONIC),
    "a pulse": shaken(PULSE),
    "shaken, falling": shaken(HARMONIC, 9.81),
    **{
        f"{name}, {step} s": shaken(motion, step=step)
        for name, motion in (("shaken", HARMONIC), ("a pulse", PULSE))
        for step in (4e-4, 6e-4)
    },
    "shaken, forced": shaken(HARMONIC, step=6e-4, force_step=True),
    "shaken from a steep ramp on": shaken({**HARMONIC, "ramp": "1 ms"}),
    "shaken fast": shaken(FAST),
    "shaken fast, by hand": shaken(FAST, step=2e-4),
    **{f"a thin skin, {skin} m": rigid(HIGH, contact={"skin": skin}) for skin in (1e-4, 4e-4)},
    "springs": springs(),
    "half the safety": springs(time={"safety": 0.025}),
    "a hundredth of the stiffness": springs(contact={"stiffness_scale": 0.01}),
    "no rebound": springs(contact={"restitution": 0.0}),
    **{f"springs, {step} s": springs(time={"step": step}) for step in (1e-5, 1e-8, 0.5 / MOST_STEPS)},
    "springs, forced": springs(time={"step": 1e-5, "force_step": True}),
    "springs, a short end": springs(time={"end": 1e-9}),
    **{f"{law}, {name}": springs(body, contact={"law": law}) for law in BOTH_LAWS for name, body in THROWS.items()},
    **{f"{model}, stiff": springs(FALLING, THIN, contact={"model": model, **DENSE}, gravity=0.0) for model in MODELS},
    **{
        f"{model}, 100 m/s at a plate": springs(
            {**FALLING, "velocity": [100.0, 0.0]},
            THIN,
            contact={"model": model, "stiffness_scale": 1e-6, **DENSE},
            gravity=0.0,
        )
        for model in MODELS
    },
    "a long wall is no block": springs(
        walls=[{"from": [2, 0], "to": [2, 0.001]}], ground={"profile": [[0.0, 0.0], [0.01, 0.01], [0.02, 0.0]]}
    ),
    **{f"springs, a skin of {skin} m": springs(contact={**SOFT, "skin": skin}) for skin in (1e-5, 7e-3)},
}


def told(scenario: Scenario) -> str:
    """Return the step and the skin of a scene, and why, or why there is none."""
    is_rigid = scenario.time.scheme == "nonsmooth"
    try:
        world = build_nonsmooth(Model(scenario)).world if is_rigid else build_world(Model(scenario))
    except BlocksimError as error:
        return f"{type(error).__name__} ({int(error.exit_code)}): {error}"
    controls, why = world.controls[0], describe(Model(scenario)).rigid
    return f"{controls.step:.9g} s, skin {controls.skin:.9g} m{f': {why.why}' if why else ''}"


def test_steps_and_skins_are_those_that_were_read(golden: Golden) -> None:
    """Rigid contacts: few blocks take a share of the time of a fall, a whole part of 1 ms; what is fast shortens that.

    Springs: the step goes with the safety and the root of mass over stiffness, with Hertz also with hard impacts.
    """
    golden("\n".join(f"{name}: {told(scenario)}" for name, scenario in SCENES.items()), rules=["digits"])

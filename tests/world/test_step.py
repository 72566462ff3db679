"""The step that a scene takes, and the load that its contacts are expected to bear."""

from __future__ import annotations

from math import hypot, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.kernels.common.arrays import AT_REST, REACHED
from blocksim.kernels.explicit.laws import HERTZ_MINDLIN, tangent_stiffness
from blocksim.scenario.laws import LAWS, LINEAR
from blocksim.verification.scene import HEIGHT, WIDTH, Simulation, scenario_of
from blocksim.world.bodies import layout_of
from blocksim.world.build import build_world
from blocksim.world.step import (
    MOST_STEPS,
    ContactLoad,
    StepError,
    bounds_of,
    expected_load,
    speeds_of,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    from blocksim.kernels.common.arrays import World

G, HERTZ = 9.81, LAWS["hertz-mindlin"]
RADIUS = hypot(WIDTH, HEIGHT) / 2
FALLING = {"y": 0.2, "angle": 0.4}


def world_of(body: Mapping[str, object], *more: Mapping[str, object], **tables: Any) -> World:
    return build_world(scenario_of([body, *more], **tables))


def load_of(*bodies: Mapping[str, object], **tables: Any) -> ContactLoad:
    scenario = scenario_of(bodies, **tables)
    layout = layout_of(scenario)
    (bounds,) = bounds_of([layout], build_world(scenario).bodies[np.newaxis])
    return expected_load(layout, bounds, speeds_of(layout, bounds))


def test_expected_speed_is_that_of_a_fall_from_the_highest_point() -> None:
    load = load_of(FALLING)
    assert load.speed == pytest.approx(sqrt(2.0 * G * (0.2 + RADIUS)))
    deeper = load_of(FALLING, ground={"profile": [[0.0, 0.0], [1.0, -0.5]]})
    assert deeper.speed == pytest.approx(sqrt(2.0 * G * (0.7 + RADIUS)))


def test_speed_and_spin_at_the_start_add_to_the_expected_speed() -> None:
    thrown = load_of({**FALLING, "velocity": [3.0, 4.0], "spin": -10.0})
    assert thrown.speed == pytest.approx(load_of(FALLING).speed + 5.0 + 10.0 * RADIUS)


def test_slope_may_speed_up_a_block_all_the_time() -> None:
    usual, longer = (load_of(FALLING, ground={"tilt": "20 deg"}, time={"end": end}).speed for end in (0.5, 1.5))
    assert longer - usual == pytest.approx(G * 0.3420201433, rel=1e-9)


def test_weight_is_that_of_all_free_blocks() -> None:
    free = {**FALLING, "x": 0.1}
    fixed = {**FALLING, "x": 0.2, "fixed": True}
    one = float(world_of(FALLING).bodies[0].mass) * G
    assert load_of(FALLING, free, fixed).weight == pytest.approx(2.0 * one)


def hertz(body: Mapping[str, object], **contact: object) -> Simulation:
    return Simulation(world_of(body, contact={"law": "hertz-mindlin", "stiffness_scale": 1e-2, **contact}))


@pytest.mark.parametrize(
    "body", [FALLING, {"y": 0.05}, {"y": 0.05, "angle": 0.66}, {**FALLING, "velocity": [0.0, -3.0]}]
)
@pytest.mark.parametrize("restitution", [0.2, 1.0])
def test_no_contact_becomes_stiffer_than_the_step_expects(body: Mapping[str, object], restitution: float) -> None:
    scene = hertz(body, restitution=restitution, max_overlap=5e-3)
    world, block = scene.world, scene.bodies[0]
    stiffness = float(world.interactions[1, 0].normal_stiffness)
    load = load_of(body, contact={"law": "hertz-mindlin"})
    expected = HERTZ.greatest_slope(stiffness, float(block.inverse_mass), *load)
    deepest = 0.0
    while scene.time < 0.25:
        scene.to_step(scene.steps + 5)
        assert scene.status in {REACHED, AT_REST}
        deepest = max(deepest, float(scene.ledger_row()[-1]))
    assert deepest > 0.0
    assert tangent_stiffness(HERTZ_MINDLIN, stiffness, deepest) < 1.01 * expected


def test_contact_under_the_weight_of_everything_is_not_stiffer_than_expected() -> None:
    load = ContactLoad(0.0, 100.0)
    stiffness = 1e9
    slope = HERTZ.greatest_slope(stiffness, 10.0, *load)
    depth = (slope / (1.5 * stiffness)) ** 2
    assert stiffness * depth**1.5 == pytest.approx(100.0)


def test_linear_contacts_and_fixed_pairs_do_not_stiffen() -> None:
    load = ContactLoad(10.0, 1e3)
    assert LINEAR.greatest_slope(7.0, 10.0, *load) == 7.0
    assert HERTZ.greatest_slope(7.0, 0.0, *load) == 7.0


@pytest.mark.parametrize("change", [{"velocity": [0.0, -20.0]}, {"y": 5.0}, {"spin": 500.0}])
def test_harder_impacts_get_a_shorter_step_with_hertz_only(change: Mapping[str, object]) -> None:
    for law, is_shorter in (("linear", False), ("hertz-mindlin", True)):
        usual, hard = (
            float(world_of(body, contact={"law": law}).controls[0].step) for body in (FALLING, {**FALLING, **change})
        )
        assert (hard < 0.95 * usual) is is_shorter
        assert hard <= usual


def test_pieces_of_ground_do_not_shorten_the_step() -> None:
    usual = world_of(FALLING).controls[0].step
    wall = {"from": [1.0, 0.5], "to": [1.0, 0.0]}
    hill = [[0.0, 0.0], [0.01, 0.01], [0.02, 0.0]]
    assert world_of(FALLING, walls=[wall], ground={"profile": hill}).controls[0].step == usual


@pytest.mark.parametrize("model", ["surface", "kernel", "particles"])
def test_step_does_not_depend_on_the_contact_model(model: str) -> None:
    contact = {"model": model, "particle_spacing": 5e-4}
    assert world_of(FALLING, contact=contact).controls[0].step == world_of(FALLING).controls[0].step


def test_step_that_time_cannot_be_divided_by_is_refused() -> None:
    with pytest.raises(StepError, match="cannot be divided"):
        world_of(FALLING, time={"step": 0.5 / MOST_STEPS, "end": 1.0})


@pytest.mark.parametrize("model", ["surface", "kernel", "particles"])
def test_block_moves_by_a_small_share_of_the_smallest_side_in_a_step(model: str) -> None:
    """Otherwise it could pass through a thin one between two examines what touches what."""
    plate = {"y": 1.0, "x": 1.0, "height": 2e-3, "fixed": True}
    soft = {"stiffness_scale": 1e-6, "model": model, "particle_spacing": 5e-4}
    motion = {"kind": "harmonic", "amplitude": 0.1, "frequency": 50.0}
    tables: dict[str, Any] = {"gravity": 0.0, "contact": soft}
    share = 0.05 if model == "surface" else 0.01
    for extra, speed in (({}, 100.0), ({"motion": motion}, 100.0 + 2.0 * np.pi * 50.0 * 0.1)):
        step = float(world_of({**FALLING, "velocity": [100.0, 0.0]}, plate, **tables, **extra).controls[0].step)
        assert step * speed == pytest.approx(share * 2e-3, rel=1e-3)

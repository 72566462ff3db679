"""A scene that comes to rest before time zero: forces, clock, tallies, held bodies, failure, resuming, ensembles."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from blocksim.errors import ExitCode, ScenarioError, StoppedEarlyError
from blocksim.scenario import Scenario, load_scenario, scenario_from_mapping
from blocksim.simulation import simulate, simulate_into
from blocksim.simulation.checkpoint import CheckpointPolicy
from blocksim.simulation.ensemble import run_ensemble
from blocksim.simulation.rest_state import SettleError, initial_scene, settle
from blocksim.simulation.schemes import ALONE, build, scheme_of
from blocksim.study.criterion import DEFAULT, Stability, read_criterion

SCENARIOS = Path(__file__).parents[2] / "scenarios"
SCHEMES = ("explicit", "nonsmooth")
G = 9.81


def stack(scheme: str, *, hold: tuple[str, ...] = (), **changes: Any) -> Scenario:
    """Return three stones on one another, soft ones, that settle."""
    data = {
        "schema": 1,
        "name": "stack",
        "materials": {"stone": {"density": 2000.0, "young_modulus": "1 GPa", "poisson_ratio": 0.2}},
        "blocks": {"b": {"width": 0.4, "height": 0.2, "length": 1.0, "material": "stone"}},
        "bodies": [{"block": "b", "x": 0.05 * k, "y": 0.1 + 0.2 * k} for k in range(3)],
        "contact": {"stiffness_scale": 0.001, "restitution": 0.0},
        "friction": {"block_block": 0.6, "block_ground": 0.6},
        "time": {"scheme": scheme, "end": 0.02, "stop_at_rest": False},
        "output": {"every": 0.005, "contacts": True},
        "start": {"settle": True, "hold": list(hold)},
        **changes,
    }
    return scenario_from_mapping(data)


def support_force(scene: Any, count: int) -> float:
    """Return the size (N) of the force of the ground."""
    rows = scheme_of(scene).contacts(scene, count)
    rows = rows[rows["body_b"] < 0]
    x = rows["normal_force"] * rows["normal_x"] - rows["shear_force"] * rows["normal_y"]
    y = rows["normal_force"] * rows["normal_y"] + rows["shear_force"] * rows["normal_x"]
    return float(np.hypot(x.sum(), y.sum()))


@pytest.mark.parametrize(
    ("scheme", "scale", "tilt"),  # on springs so soft the wall falls soon after, and leans far before it does
    [("explicit", 0.01, 30.0), ("nonsmooth", 1.0, 30.0)],
)
def test_the_tilted_wall_starts_at_rest_and_the_ground_carries_its_weight(
    scheme: str, scale: float, tilt: float
) -> None:
    overrides = {"time.scheme": scheme, "contact.stiffness_scale": scale, "ground.tilt": f"{tilt} deg"}
    settings = {"start.settle": True, **overrides}
    scenario = load_scenario(SCENARIOS / "tilting_wall.toml", settings)
    built = build(scenario)
    scene, settled = settle(built.scene, scenario, built.placed, ALONE)
    scene, _ = ALONE.advance(scene, 0)
    weight = G * sum(body.mass for body in built.placed)
    assert support_force(scene, len(built.placed)) == pytest.approx(weight, rel=1e-6)
    assert int(scene.world.clock[0].steps) == 0
    before = np.stack([scene.world.bodies["x"], scene.world.bodies["y"]])
    scene, _ = ALONE.advance(scene, 100)
    after = np.stack([scene.world.bodies["x"], scene.world.bodies["y"]])
    # what is at rest with rigid contacts may still move by 1e-10 of a side in a step
    assert np.abs(after - before)[:, :-1].max() < (1e-9 if scheme == "explicit" else 1e-8)
    # a block on two halves of others is borne by as much spring as on one whole block, at its own two ends
    assert 0.0 < settled.largest_displacement_mm < 30.0


@pytest.mark.parametrize("restitution", [0.0, 0.8])  # with 0.8 steps may be cut at impacts
def test_rigid_contacts_hold_the_weight_from_the_first_step_on_and_what_is_let_go_falls_freely(
    restitution: float,
) -> None:
    bodies = [{"block": "b", "x": 0.05 * k, "y": 0.1 + 0.2 * k} for k in range(3)]
    held = {"block": "b", "x": 2.0, "y": 3.0, "name": "held"}
    scenario = stack("nonsmooth", bodies=[*bodies, held], hold=("held",), contact={"restitution": restitution})
    built = build(scenario)
    scene, _ = settle(built.scene, scenario, built.placed, ALONE)
    start = np.stack([scene.world.bodies[name][:4] for name in ("x", "y", "angle")])
    step = float(scene.world.controls[0].step)
    for number in (1, 2, 5):
        scene, _ = ALONE.advance(scene, number)
        now = np.stack([scene.world.bodies[name][:4] for name in ("x", "y", "angle")])
        assert support_force(scene, 4) == pytest.approx(3 * 160.0 * G, rel=1e-6)
        assert np.abs(now - start)[:, :3].max() < 1e-9
        assert start[1, 3] - now[1, 3] == pytest.approx(0.5 * G * (number * step) ** 2, rel=1e-9)
        assert float(scene.world.bodies[3].vy) == pytest.approx(-G * number * step, rel=1e-9)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_tilt_at_which_it_falls_ends_with_the_block_that_moves_and_how_fast(scheme: str) -> None:
    scenario = stack(scheme, ground={"tilt": "35 deg"})
    with pytest.raises(SettleError, match=r"block \S+ moves at .* mm/s, block \S+ has come") as caught:
        simulate(scenario)
    assert caught.value.exit_code == ExitCode.NUMERICAL_FAILURE
    row = {"status": "failed", "reason": str(caught.value)}
    assert read_criterion(DEFAULT).verdict(row) is Stability.FALLS


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_held_body_stays_where_it_is_and_falls_from_time_zero_on(scheme: str) -> None:
    bodies = [{"block": "b", "x": 0.0, "y": 0.1}, {"block": "b", "x": 0.3, "y": 0.3, "name": "over"}]
    held = simulate(stack(scheme, bodies=bodies, hold=("over",)))
    assert held.frames.x[0, 1] == 0.3
    assert held.frames.y[0, 1] == 0.3
    assert held.frames.rotation[-1, 1] < 0.0  # it overhangs by more than half of its length
    assert held.summary.settled is not None
    assert held.summary.settled.held == ("over",)
    with pytest.raises(SettleError):
        simulate(stack(scheme, bodies=bodies))


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_driven_body_begins_its_way_at_time_zero(scheme: str) -> None:
    ramp = {"kind": "ramp", "distance": 0.3, "speed": 1.0, "direction": "180 deg"}
    wheel = {"kind": "rotation", "angle": "90 deg", "duration": 0.1}
    driven = [
        {"block": "b", "name": "ram", "x": 0.46, "y": 0.3, "motion": ramp},
        {"block": "b", "name": "wheel", "x": 2.0, "y": 2.0, "motion": wheel},
    ]
    bodies = [{"block": "b", "x": 0.0, "y": 0.1 + 0.2 * k} for k in range(3)]
    run = simulate(stack(scheme, bodies=[*bodies, *driven], friction={"block_block": 0.6, "block_ground": 0.6}))
    assert run.frames.x[0, 3:] == pytest.approx([0.46, 2.0], abs=1e-12)
    assert run.frames.angle[0, 4] == 0.0
    assert np.abs(run.frames.x[0, :3]).max() < 1e-6
    last = run.frames.time[-1]
    assert run.frames.x[-1, 3] == pytest.approx(0.46 - last, abs=1e-9)
    assert run.frames.angle[-1, 4] == pytest.approx(0.5 * np.pi * last / 0.1, rel=1e-9)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_velocities_are_those_of_the_release_and_tallies_begin_at_time_zero(scheme: str) -> None:
    bodies = [{"block": "b", "x": 0.0, "y": 0.1}, {"block": "b", "x": 1.0, "y": 0.1, "velocity": [0.5, 0.0]}]
    result = simulate(stack(scheme, bodies=bodies))
    assert result.frames.vx[0] == pytest.approx([0.0, 0.5])
    ledger = result.summary.energy_J
    assert ledger.relative_residual < 1e-3
    assert ledger.kinetic + ledger.friction + ledger.dashpot + ledger.stored_shear == pytest.approx(20.0, rel=0.02)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_loads_of_time_zero_are_carried_at_time_zero(scheme: str) -> None:
    push = {"kind": "force", "body": "2", "magnitude": "300 N"}
    scenario = stack(scheme, loads=[push])
    built = build(scenario)
    scene, _ = settle(built.scene, scenario, built.placed, ALONE)
    scene, _ = ALONE.advance(scene, 0)
    weight = 3 * 160.0 * G
    assert support_force(scene, 3) == pytest.approx(np.hypot(weight, 300.0), rel=1e-6)
    assert -simulate(scenario).summary.energy_J.to_loads == pytest.approx(0.0, abs=1e-4)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_resumed_run_an_ensemble_and_threads_have_the_bits_of_a_run(scheme: str, tmp_path: Path) -> None:
    scenario = stack(scheme, hold=("3",))
    whole = simulate(scenario, threads=2)
    (one,) = run_ensemble([scenario])
    assert one.final.equals(whole.final)
    first = simulate_into(scenario, tmp_path / "run")
    assert first.summary.final_state_sha256 == whole.summary.final_state_sha256
    assert first.summary.settled == whole.summary.settled


@pytest.mark.parametrize("scheme", SCHEMES)
def test_the_limit_of_wall_time_holds_while_a_scene_settles(scheme: str, tmp_path: Path) -> None:
    with pytest.raises(StoppedEarlyError, match=r"^wall-time limit of 1e-09 s reached while the scene settled"):
        simulate_into(stack(scheme), tmp_path / "out", precautions=CheckpointPolicy(wall_time=1e-9))
    assert not (tmp_path / "out").exists()


JERK = {"kind": "pulse", "shape": "rectangular", "duration": 1.0, "direction": "0 deg"}


def jerked(scheme: str, share: float) -> Scenario:
    """Return two stones on a support that accelerates by a share of gravity at once; rigid ones settle where asked."""
    bodies = [{"block": "b", "x": 0.0, "y": 0.1}, {"block": "b", "x": 0.0, "y": 0.3}]
    contact = {"stiffness_scale": 0.1, "restitution": 0.0}
    friction = {"block_block": 0.4, "block_ground": 0.4}
    motion = {**JERK, "amplitude": share * G}
    start = {"settle": scheme == "nonsmooth"}
    return stack(scheme, start=start, bodies=bodies, contact=contact, friction=friction, motion=motion)


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize(("share", "carried"), [(0.3, 0.3), (0.8, 0.4)])
def test_the_inertial_force_of_a_support_that_jerks_at_time_zero_is_carried_up_to_friction(
    scheme: str, share: float, carried: float
) -> None:
    scenario = jerked(scheme, share)
    built = build(scenario)
    scene, settled = initial_scene(built.scene, scenario, built.placed, ALONE)
    assert settled is not None
    scene, _ = ALONE.advance(scene, 0)
    weight = 2 * 160.0 * G
    pushed = np.sqrt(support_force(scene, 2) ** 2 - weight**2)
    assert pushed == pytest.approx(carried * weight, rel=1e-4 if share == carried else 0.01)


def test_members_of_an_ensemble_begin_as_a_run_does_on_a_support_that_jerks_at_time_zero() -> None:
    scenario = jerked("nonsmooth", 0.3)
    one, two = run_ensemble([scenario, scenario])
    assert one.final.equals(simulate(scenario).final)
    assert two.final.equals(one.final)


def test_what_is_to_drop_or_moves_already_does_not_settle_unasked_under_such_a_support() -> None:
    motion = {**JERK, "amplitude": 1.0}
    for body in ({"y": 0.11}, {"velocity": [0.1, 0.0]}):
        result = simulate(
            stack("explicit", start={}, motion=motion, bodies=[{"block": "b", "x": 0.0, "y": 0.1, **body}])
        )
        assert result.summary.settled is None
        assert result.frames.y[0, 0] == body.get("y", 0.1)
        assert result.summary.warnings == ()


@pytest.mark.parametrize(
    ("start", "message"),
    [
        ({"hold": ["1"]}, "nothing is held without settle = true"),
        ({"settle": True, "hold": ["nobody"]}, 'unknown body "nobody"'),
    ],
)
def test_impossible_starts_are_told_with_their_place(start: dict[str, Any], message: str) -> None:
    with pytest.raises(ScenarioError, match=message):
        stack("explicit", start=start)


def tilted_ring(**changes: Any) -> Scenario:
    """Return a ring of eight stones on springs, which falls from 17.44 degrees on."""
    ring = {"kind": "arch", "block": "b", "radius": 0.2, "thickness": 0.03, "embrace": "162 deg", "count": 8}
    data = {
        "blocks": {"b": {"depth": 0.1, "material": "stone"}},
        "bodies": [],
        "structures": [ring],
        "friction": {"block_block": 1.0, "block_ground": 1.0},
        "contact": {"restitution": 0.0, "stiffness_scale": 10.0},
        **changes,
    }
    return stack("explicit", **data)


def test_a_mechanism_on_springs_is_told_before_it_has_gone_far() -> None:
    with pytest.raises(SettleError, match=r"has come 0\.0\d+ mm, after \d+ steps") as caught:
        simulate(tilted_ring(ground={"tilt": "19 deg"}))
    assert int(str(caught.value).split()[-2]) < 100_000
    assert simulate(tilted_ring(ground={"tilt": "17.3 deg"})).summary.settled is not None


def test_what_closes_a_gap_and_then_rests_is_no_mechanism() -> None:
    gap = 0.004  # 2 % of the smallest side
    fixed = {"block": "b", "x": 0.4 + gap, "y": 0.1, "fixed": True}
    friction = {"block_block": 0.2, "block_ground": 0.2}
    contact = {"restitution": 0.0}
    scenario = stack(
        "explicit",
        bodies=[{"block": "b", "x": 0.0, "y": 0.1}, fixed],
        friction=friction,
        contact=contact,
        ground={"tilt": "-15 deg"},
    )
    settled = simulate(scenario).summary.settled
    assert settled is not None
    assert settled.largest_displacement_mm == pytest.approx(1e3 * gap, rel=0.01)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_what_does_not_come_to_rest_is_recorded_as_it_falls_where_it_is_released(scheme: str) -> None:
    start = {"settle": True, "release": "always"}
    time = {"scheme": scheme, "end": 0.3, "stop_at_rest": False}
    result = simulate(stack(scheme, ground={"tilt": "35 deg"}, start=start, time=time, output={"every": 0.05}))
    assert result.summary.settled is not None
    assert not result.summary.settled.at_rest
    assert result.summary.movement is not None
    assert result.summary.movement.outcome != "stands"
    assert np.abs(result.frames.x[0] - [0.0, 0.05, 0.1]).max() < 0.02 * 0.2 + 1e-9
    assert np.abs(result.frames.vx[0]).max() > 0.0
    (one,) = run_ensemble([result.scenario])
    assert one.final.equals(result.final)

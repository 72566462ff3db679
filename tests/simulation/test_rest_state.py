"""A scene that comes to rest before time zero: forces, clock, tallies, held bodies, failure."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.errors import ExitCode, StoppedEarlyError
from blocksim.scenario import Scenario, load_scenario, scenario_from_mapping
from blocksim.simulation import simulate, simulate_into
from blocksim.simulation.checkpoint import CheckpointPolicy
from blocksim.simulation.rest_state import SettleError, initial_scene, settle
from blocksim.simulation.schemes import ALONE, build, scheme_of
from blocksim.study.criterion import DEFAULT, Stability, read_criterion
from tests.simulation.conftest import SCENARIOS

if TYPE_CHECKING:
    from pathlib import Path

G = 9.81
WEIGHT = 160.0 * G  # N, of a stone
both = pytest.mark.parametrize("scheme", ["explicit", "nonsmooth"])


def stone(x: float = 0.0, y: float = 0.1, **keys: object) -> dict[str, object]:
    return {"block": "b", "x": x, "y": y, **keys}


def stack(scheme: str, *, hold: tuple[str, ...] = (), friction: float = 0.6, **changes: Any) -> Scenario:
    """Return three stones on one another, soft ones, that settle."""
    data = {
        "schema": 1,
        "name": "stack",
        "materials": {"stone": {"density": 2000.0, "young_modulus": "1 GPa", "poisson_ratio": 0.2}},
        "blocks": {"b": {"width": 0.4, "height": 0.2, "length": 1.0, "material": "stone"}},
        "bodies": [stone(0.05 * k, 0.1 + 0.2 * k) for k in range(3)],
        "contact": {"stiffness_scale": 0.001, "restitution": 0.0},
        "friction": {"block_block": friction, "block_ground": friction},
        "time": {"scheme": scheme, "end": 0.02, "stop_at_rest": False},
        "output": {"every": 0.005, "contacts": True},
        "start": {"settle": True, "hold": list(hold)},
        **changes,
    }
    return scenario_from_mapping(data)


def settled_scene(scenario: Scenario) -> tuple[Any, Any]:
    """Return the scene at time zero, and how it has settled."""
    built = build(scenario)
    scene, settled = initial_scene(built.scene, scenario, built.placed, ALONE)
    return ALONE.advance(scene, 0)[0], settled


def support_force(scene: Any) -> float:
    """Return the size (N) of the force of the ground."""
    return force_of(scheme_of(scene).contacts(scene, scene.world.bodies.size - 1))


def force_of(rows: Any) -> float:
    """Return the size (N) of the force of the ground among all contacts."""
    rows = rows[rows["body_b"] < 0]
    x = rows["normal_force"] * rows["normal_x"] - rows["shear_force"] * rows["normal_y"]
    y = rows["normal_force"] * rows["normal_y"] + rows["shear_force"] * rows["normal_x"]
    return float(np.hypot(x.sum(), y.sum()))


def places(scene: Any) -> Any:
    return np.stack([scene.world.bodies[name][:-1].copy() for name in ("x", "y", "angle")])


@pytest.mark.parametrize(("scheme", "scale"), [("explicit", 0.01), ("nonsmooth", 1.0)])
def test_the_tilted_wall_starts_at_rest_and_the_ground_carries_its_weight(scheme: str, scale: float) -> None:
    """On springs as soft as this the wall falls soon after, and leans far before it does."""
    overrides = {"time.scheme": scheme, "contact.stiffness_scale": scale, "ground.tilt": "30 deg"}
    scenario = load_scenario(SCENARIOS / "tilting_wall.toml", {"start.settle": True, **overrides})
    scene, settled = settled_scene(scenario)
    weight = G * float(scene.world.bodies.mass[:-1].sum())
    assert support_force(scene) == pytest.approx(weight, rel=1e-6)
    assert int(scene.world.clock[0].steps) == 0
    before = places(scene)
    scene, _ = ALONE.advance(scene, 100)
    # what is at rest with rigid contacts may still move by 1e-10 of a side in a step
    assert np.abs(places(scene) - before)[:2].max() < (1e-9 if scheme == "explicit" else 1e-8)
    # a block on two halves of others is borne by as much spring as on one whole block, at its own two ends
    assert 0.0 < settled.largest_displacement_mm < 30.0


@pytest.mark.parametrize("restitution", [0.0, 0.8])  # with 0.8 steps may be cut at impacts
def test_rigid_contacts_hold_the_weight_from_the_first_step_on_and_what_is_let_go_falls_freely(
    restitution: float,
) -> None:
    bodies = [*(stone(0.05 * k, 0.1 + 0.2 * k) for k in range(3)), stone(2.0, 3.0, name="held")]
    scenario = stack("nonsmooth", bodies=bodies, hold=("held",), contact={"restitution": restitution})
    built = build(scenario)
    scene, _ = settle(built.scene, scenario, built.placed, ALONE)
    start, step = places(scene), float(scene.world.controls[0].step)
    for number in (1, 2, 5):
        scene, _ = ALONE.advance(scene, number)
        moved = places(scene) - start
        assert support_force(scene) == pytest.approx(3 * WEIGHT, rel=1e-6)
        assert np.abs(moved)[:, :3].max() < 1e-9
        assert -moved[1, 3] == pytest.approx(0.5 * G * (number * step) ** 2, rel=1e-9)
        assert float(scene.world.bodies[3].vy) == pytest.approx(-G * number * step, rel=1e-9)


@both
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


@both
def test_a_held_body_stays_where_it_is_and_falls_from_time_zero_on(scheme: str) -> None:
    bodies = [stone(), stone(0.3, 0.3, name="over")]
    held = simulate(stack(scheme, bodies=bodies, hold=("over",)))
    assert (held.frames.x[0, 1], held.frames.y[0, 1]) == (0.3, 0.3)
    assert held.frames.rotation[-1, 1] < 0.0  # it overhangs by more than half of its length
    assert held.summary.settled is not None
    assert held.summary.settled.held == ("over",)
    with pytest.raises(SettleError):
        simulate(stack(scheme, bodies=bodies))


@both
def test_a_driven_body_begins_its_way_and_loads_and_velocities_theirs_at_time_zero(scheme: str) -> None:
    ramp = {"kind": "ramp", "distance": 0.3, "speed": 1.0, "direction": "180 deg"}
    wheel = {"kind": "rotation", "angle": "90 deg", "duration": 0.1}
    driven = [stone(0.46, 0.3, name="ram", motion=ramp), stone(2.0, 2.0, name="wheel", motion=wheel)]
    slides = stone(4.0, velocity=[0.5, 0.0], name="slides")
    frames = simulate(stack(scheme, bodies=[stone(), *driven, slides])).frames
    assert frames.x[0, 1:3] == pytest.approx([0.46, 2.0], abs=1e-12)
    assert frames.angle[0, 2] == 0.0
    assert abs(frames.x[0, 0]) < 1e-6
    last = frames.time[-1]
    assert frames.x[-1, 1] == pytest.approx(0.46 - last, abs=1e-9)
    assert frames.angle[-1, 2] == pytest.approx(0.5 * np.pi * last / 0.1, rel=1e-9)
    assert frames.vx[0, [0, 3]] == pytest.approx([0.0, 0.5])
    ledger = simulate(stack(scheme, bodies=[stone(), slides])).summary.energy_J
    assert ledger.relative_residual < 1e-3
    assert ledger.kinetic + ledger.friction + ledger.dashpot + ledger.stored_shear == pytest.approx(20.0, rel=0.02)
    load = {"kind": "force", "body": "2", "magnitude": "300 N"}
    pushed = simulate(stack(scheme, bodies=[stone(), stone(0.05, 0.3)], loads=[load]))
    assert pushed.frames.contacts is not None
    assert force_of(pushed.frames.contacts.at(0)) == pytest.approx(np.hypot(2 * WEIGHT, 300.0), rel=1e-6)
    assert -pushed.summary.energy_J.to_loads == pytest.approx(0.0, abs=1e-4)


@both
def test_the_limit_of_wall_time_holds_while_a_scene_settles(scheme: str, tmp_path: Path) -> None:
    with pytest.raises(StoppedEarlyError, match=r"^wall-time limit of 1e-09 s reached while the scene settled"):
        simulate_into(stack(scheme), tmp_path / "out", precautions=CheckpointPolicy(wall_time=1e-9))
    assert not (tmp_path / "out").exists()


JERK = {"kind": "pulse", "shape": "rectangular", "duration": 1.0, "direction": "0 deg"}


@both
@pytest.mark.parametrize(("share", "carried"), [(0.3, 0.3), (0.8, 0.4)])
def test_the_inertial_force_of_a_support_that_jerks_at_time_zero_is_carried_up_to_friction(
    scheme: str, share: float, carried: float
) -> None:
    """Of two stones at a friction of 0.4; rigid ones settle where that is asked for."""
    start, motion = {"settle": scheme == "nonsmooth"}, {**JERK, "amplitude": share * G}
    contact = {"stiffness_scale": 0.1, "restitution": 0.0}
    bodies = [stone(), stone(y=0.3)]
    scenario = stack(scheme, friction=0.4, start=start, bodies=bodies, contact=contact, motion=motion)
    scene, settled = settled_scene(scenario)
    assert settled is not None
    pushed = np.sqrt(support_force(scene) ** 2 - (2 * WEIGHT) ** 2)
    assert pushed == pytest.approx(carried * 2 * WEIGHT, rel=1e-4 if share == carried else 0.01)


def test_what_is_to_drop_or_moves_already_does_not_settle_unasked_under_such_a_support() -> None:
    motion = {**JERK, "amplitude": 1.0}
    for body in (stone(y=0.11), stone(velocity=[0.1, 0.0])):
        result = simulate(stack("explicit", start={}, motion=motion, bodies=[body]))
        assert result.summary.settled is None
        assert result.frames.y[0, 0] == body["y"]
        assert result.summary.warnings == ()


def tilted_ring(tilt: str) -> Scenario:
    """Return a ring of eight stones on springs, which falls from 17.44 degrees on."""
    ring = {"kind": "arch", "block": "b", "radius": 0.2, "thickness": 0.03, "embrace": "162 deg", "count": 8}
    return stack(
        "explicit",
        blocks={"b": {"depth": 0.1, "material": "stone"}},
        bodies=[],
        structures=[ring],
        friction=1.0,
        contact={"restitution": 0.0, "stiffness_scale": 10.0},
        ground={"tilt": tilt},
    )


def test_a_mechanism_on_springs_is_told_before_it_has_gone_far() -> None:
    with pytest.raises(SettleError, match=r"block \S+ moves at .* has come 0\.0\d+ mm, after \d+ steps") as caught:
        simulate(tilted_ring("19 deg"))
    assert caught.value.exit_code == ExitCode.NUMERICAL_FAILURE
    row = {"status": "failed", "reason": str(caught.value)}
    assert read_criterion(DEFAULT).verdict(row) is Stability.FALLS
    assert int(str(caught.value).split()[-2]) < 100_000
    assert simulate(tilted_ring("17.3 deg")).summary.settled is not None


def test_what_closes_a_gap_and_then_rests_is_no_mechanism() -> None:
    gap = 0.004  # 2 % of the smallest side
    bodies = [stone(), stone(0.4 + gap, fixed=True)]
    contact = {"restitution": 0.0}
    settled = simulate(
        stack("explicit", bodies=bodies, friction=0.2, contact=contact, ground={"tilt": "-15 deg"})
    ).summary.settled
    assert settled is not None
    assert settled.largest_displacement_mm == pytest.approx(1e3 * gap, rel=0.01)

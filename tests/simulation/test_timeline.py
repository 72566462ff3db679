"""Scenes that rest before time zero; driven bodies and events do what closed forms say, and the ledger has it all."""

from collections.abc import Mapping, Sequence
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from blocksim.errors import StoppedEarlyError
from blocksim.scenario import Model, Scenario, scenario_from_mapping
from blocksim.scenario.motion import drives_of
from blocksim.simulation import Result, read_result, simulate, simulate_into
from blocksim.simulation.checkpoint import CheckpointPolicy
from blocksim.simulation.interruption import WallTime
from blocksim.simulation.rest_state import SettleError, initial_scene, settle
from blocksim.simulation.schemes import ALONE, build, scheme_of
from blocksim.verification.scene import HEIGHT, PaperBlock, scenario_of

G = 9.81  # m/s2
MASS = PaperBlock().mass  # kg
FRICTION = 0.4
THICK = 0.02  # m
SOFT = {"explicit": 1e-4, "nonsmooth": 1.0}  # of the material's stiffness: milliseconds are some hundred steps
REST = {"stop_at_rest": True, "rest_hold": 0.004, "rest_speed": 0.02}
both = pytest.mark.parametrize("scheme", SOFT)


def plate(motion: Mapping[str, object] | None = None, *, width: float = 0.3, **keys: Any) -> dict[str, Any]:
    """Return a plate with its upper face at y = 0.1 m, driven, or fixed without a motion."""
    moves = {"fixed": True} if motion is None else {"motion": motion}
    return {"y": 0.1 - THICK / 2, "width": width, "height": THICK, "name": "plate", **moves, **keys}


def block(**keys: Any) -> dict[str, Any]:
    return {"y": 0.1 + keys.get("height", HEIGHT) / 2, "name": "block", **keys}


def on_plate(scheme: str, bodies: Sequence[Mapping[str, object]], end: float, **tables: Any) -> Scenario:
    """Return a scenario of bodies, without rebounds unless `restitution` is among the tables."""
    return scenario_of(
        bodies,
        contact={"restitution": tables.pop("restitution", 0.0), "stiffness_scale": SOFT[scheme]},
        friction={"block_block": tables.pop("friction", FRICTION), "block_ground": FRICTION},
        time={"scheme": scheme, "end": end, "stop_at_rest": False, **tables.pop("time", {})},
        **tables,
    )


@both
def test_driven_plate_does_to_a_block_what_a_fixed_one_on_a_moving_support_does(scheme: str) -> None:
    motion = {"kind": "harmonic", "amplitude": "4 mm", "frequency": 8, "direction": "20 deg"}
    time = {"step": 1e-4} if scheme == "nonsmooth" else {}  # the usual one follows from how fast bodies are
    own = simulate(on_plate(scheme, [block(), plate(motion)], 0.1, time=time))
    shared = simulate(on_plate(scheme, [block(), plate()], 0.1, motion=motion, time=time))
    assert own.final.iloc[0, 1:].tolist() == pytest.approx(shared.final.iloc[0, 1:].tolist(), abs=1e-9)
    assert own.summary.energy_J.to_support == pytest.approx(shared.summary.energy_J.to_support, abs=1e-12)


@both
def test_bodies_come_back_to_the_last_bit_and_the_run_rests_only_then(scheme: str) -> None:
    motion = {"kind": "harmonic", "amplitude": "1 mm", "frequency": 50, "duration": 0.06, "ramp": 0.02}
    rest = {"stop_at_rest": True, "rest_hold": 0.002, "rest_speed": 0.01}
    run = simulate(on_plate(scheme, [block(), plate(motion)], 0.2, time=rest))
    assert run.reason == "at rest"
    assert 0.06 < run.summary.simulated_time_s < 0.15
    assert run.frames.y[-1, 1] == run.frames.y[0, 1]
    assert run.frames.x[-1, 1] == pytest.approx(run.frames.x[0, 1], abs=1e-12)


@both
def test_wheel_of_a_far_point_moves_on_its_circle(scheme: str) -> None:
    turn = {"kind": "rotation", "angle": "90 deg", "duration": "50 ms", "about": [0.2, 0.1]}
    frame = simulate(on_plate(scheme, [block(x=1.0, y=HEIGHT / 2), plate(turn, width=0.1)], 0.06)).frames
    radius = np.hypot(frame.x[:, 1] - 0.2, frame.y[:, 1] - 0.1)
    assert radius == pytest.approx(np.hypot(0.2, THICK / 2), abs=1e-12)
    assert (frame.x[-1, 1], frame.y[-1, 1]) == pytest.approx((0.2 + THICK / 2, -0.1), abs=1e-12)
    assert frame.angle[-1, 1] == pytest.approx(pi / 2)


@both
def test_block_struck_by_a_driven_body_leaves_as_restitution_says(scheme: str) -> None:
    """At 1.8 times the speed, with energy that the driven body brings in: no gain that had to be prevented."""
    ramp = {"kind": "ramp", "distance": 0.05, "speed": 1.0}
    pusher = {"x": -0.04, "y": HEIGHT / 2, "width": 0.02, "height": 0.02, "name": "pusher", "motion": ramp}
    scenario = on_plate(scheme, [{"x": 0.0, "y": HEIGHT / 2}, pusher], 0.09, friction=0.0, gravity=0.0, restitution=0.8)
    run = simulate(scenario)
    assert run.final.loc[0, "vx_mm_s"] == pytest.approx(1800.0, rel=0.01)
    assert run.summary.energy_J.relative_residual < 1e-3


def test_speed_of_a_ramp_is_the_greatest_of_its_course() -> None:
    for course, mean in (("constant", 2.0), ("smooth", 2.0 * 8.0 / 15.0)):
        motion = {"kind": "ramp", "distance": 0.3, "speed": 2.0, "course": course}
        (drive,) = drives_of(on_plate("explicit", [block(), plate(motion)], 1.0))
        assert drive.rest_time == pytest.approx(0.3 / mean)


def with_events(scheme: str, events: Sequence[Mapping[str, object]], end: float = 0.08, **tables: Any) -> Scenario:
    """Return a block on a fixed plate to which something happens."""
    bodies = tables.pop("bodies", [block(), plate()])
    return on_plate(scheme, bodies, end, events=events, **{"output": {"every": 0.0005}, **tables})


@both
def test_block_falls_freely_from_the_very_moment_its_plate_goes(scheme: str) -> None:
    run = simulate(with_events(scheme, [{"at": 0.03, "remove": ["plate"]}]))
    (event,) = run.summary.events
    frames = run.frames
    since = frames.time - event.time_s
    start = int(np.argmin(np.abs(since)))
    fall = since[start:-1] - since[start]
    y, vy = frames.y[start, 0], frames.vy[start, 0]
    assert event.time_s == pytest.approx(0.03, abs=0.5 * run.summary.time_step_s)
    assert since[start] >= -1e-12
    assert vy == pytest.approx(0.0, abs=0.01)
    assert frames.y[start:-1, 0] == pytest.approx(y + vy * fall - 0.5 * G * fall**2, abs=1e-9)
    assert frames.contact_count[start] == 0
    assert run.summary.energy_J.relative_residual < 1e-4


FAR_APART = [
    block(y=0.5, x=40.0, name="removed"),
    block(y=1.0, x=10.0, name="held"),
    block(y=1.0, x=20.0, spin=3.0, name="pushed"),
    *(plate({"kind": "ramp", "distance": 1.0, "speed": 1.0}, x=x, y=2.0, name=f"at-{x:g}") for x in (50.0, 60.0)),
    *(block(y=1.0, x=x, velocity=[1.0, 0.0], name=f"at-{x:g}") for x in (0.0, 70.0)),
]
EVENTS: list[dict[str, object]] = [
    {"at": 0.005, "remove": ["wall 1"]},
    {"at": 0.01, "velocity": {"body": "pushed", "vx": 2.0, "spin": "0 rad/s"}},
    {"at": 0.02, "fix": ["held"]},
    {"at": 0.03, "remove": ["removed"]},
    {"at": 0.04, "free": ["at-50"], "fix": ["at-60"]},
    {"at": 0.05, "free": ["held"]},
]


@both
def test_bodies_are_removed_held_freed_and_pushed_at_their_moment_and_the_ledger_has_it(
    scheme: str, tmp_path: Path
) -> None:
    walls = [{"from": [x, 0.5], "to": [x, 1.5]} for x in (0.05, 70.05)]
    run = simulate_into(with_events(scheme, EVENTS, bodies=FAR_APART, walls=walls), tmp_path)
    frames, ledger, end = read_result(tmp_path).frames, run.summary.energy_J, run.summary.simulated_time_s
    times = frames.time
    _, pushed, held, removed, *_, free = run.summary.events
    freed = {event.what: event.energy_J for event in run.summary.events}["held freed"]
    assert ledger.events == pytest.approx(sum(event.energy_J for event in run.summary.events))
    assert ledger.relative_residual < 1e-3
    gone = times > removed.time_s - 1e-9  # stays where it was, without a velocity
    assert np.isnan(frames.vx[gone, 0]).all()
    assert np.isfinite(frames.vx[~gone, 0]).all()
    assert frames.y[gone, 0] == pytest.approx(0.5 - 0.5 * G * removed.time_s**2, abs=1e-6)
    assert (tmp_path / "final.csv").read_text().splitlines()[1].endswith(",,,")
    assert removed.energy_J == pytest.approx(0.5 * G * MASS, rel=1e-6)
    assert run.summary.movement is not None
    assert run.summary.movement.first_mover != "removed"
    y = 1.0 - 0.5 * G * held.time_s**2
    assert frames.y[(times > held.time_s + 1e-3) & (times < free.time_s), 1] == pytest.approx(y, abs=1e-9)
    assert frames.y[-1, 1] == pytest.approx(y - 0.5 * G * (end - free.time_s) ** 2, abs=1e-9)
    assert held.energy_J == pytest.approx(-freed + 0.5 * MASS * (G * held.time_s) ** 2, rel=1e-6)
    expected = [2e4 + 2e3 * (end - pushed.time_s), -1e3 * G * end, 0.0]
    row = [run.final.loc[2, name] for name in ("x_mm", "vy_mm_s", "spin_deg_s")]
    assert row == pytest.approx(expected, rel=1e-9, abs=1e-9)
    assert pushed.energy_J < 0.0
    flown, stopped, passed, barred = run.columns["x_mm"][3:7]
    assert [flown, stopped] == pytest.approx([50_080.0, 60_040.0], abs=0.8)
    assert passed == pytest.approx(1e3 * end, rel=1e-6)
    assert 70_030.0 < barred < 70_035.0


@both
def test_rest_lets_the_next_event_happen_and_the_run_go_on(scheme: str) -> None:
    push: dict[str, object] = {"when": "rest", "velocity": {"body": "block", "vx": 0.3}}
    run = simulate(with_events(scheme, [push, {"when": "rest", "remove": ["plate"]}], end=1.0, time=REST))
    first, second = run.summary.events
    assert first.time_s >= 0.004
    assert second.time_s > first.time_s + (0.3 - REST["rest_speed"]) / (FRICTION * G)
    assert run.reason == "at rest"
    assert run.final.loc[0, "y_mm"] == pytest.approx(500.0 * HEIGHT, abs=0.5)
    slid = 0.5 * 0.3**2 / (FRICTION * G)
    flight = (0.2 / G) ** 0.5
    assert 0.99 * slid < 1e-3 * run.columns["x_mm"][0] < slid + flight * REST["rest_speed"]


@both
def test_load_that_ends_leaves_a_body_as_fast_as_it_has_become(scheme: str) -> None:
    pull = {"kind": "force", "name": "pull", "body": "block", "magnitude": 2.0 * MASS}
    wind = {"kind": "horizontal", "name": "wind", "magnitude": 3.0 / G, "history": {"kind": "ramp", "end": 1e-9}}
    events = [{"at": 0.03, "unload": ["pull"]}, {"at": 0.05, "unload": ["wind"]}]
    run = simulate(with_events(scheme, events, bodies=[block(y=1.0), plate()], loads=[wind, pull]))
    assert [event.what for event in run.summary.events] == ["load pull ended", "load wind ended"]
    first, second = (event.time_s for event in run.summary.events)
    vx = 5.0 * first + 3.0 * (second - first)
    x = 2.5 * first**2 + 5.0 * first * (second - first) + 1.5 * (second - first) ** 2
    x += vx * (run.summary.simulated_time_s - second)
    assert [run.final.loc[0, name] for name in ("vx_mm_s", "x_mm")] == pytest.approx([1e3 * vx, 1e3 * x], rel=1e-3)
    assert run.summary.energy_J.to_loads == pytest.approx(-0.5 * MASS * vx**2, rel=2e-3)
    assert run.summary.energy_J.relative_residual < 1e-4


@both
def test_load_that_has_ended_at_rest_delays_no_later_rest(scheme: str) -> None:
    push = {"kind": "force", "name": "push", "body": "block", "magnitude": 0.5 * FRICTION * MASS * G}
    late = {**push, "name": "late", "magnitude": 1e-9, "history": {"kind": "ramp", "end": 50.0}}
    events: list[dict[str, object]] = [{"at": 0.01, "unload": ["late"]}, {"when": "rest", "unload": ["push"]}]
    run = simulate(with_events(scheme, events, end=1.0, time=REST, loads=[push, late]))
    assert [event.what for event in run.summary.events] == ["load late ended", "load push ended"]
    assert run.reason == "at rest"
    assert run.summary.simulated_time_s < 0.5


@both
def test_rest_before_a_time_does_not_end_the_run_and_what_never_happens_is_told(scheme: str) -> None:
    late = simulate(with_events(scheme, [{"at": 0.06, "remove": ["plate"]}], time=REST))
    assert [one.what for one in late.summary.events] == ["plate removed"]
    removal = [{"when": "rest", "remove": ["plate"]}]
    never = simulate(with_events(scheme, removal, bodies=[block(y=1.0), plate()], time=REST))
    assert never.summary.events == ()
    assert any("events.0 has not happened" in text for text in never.summary.warnings)


JOINT = 0.002  # m, where two seats meet, from the middle of the block
SOON = 3.3  # steps before it lands
LEFT, RIGHT = (plate(width=0.1, x=JOINT + 0.05 * side, name=f"seat{side:g}") for side in (-1.0, 1.0))
FALLING = {"velocity": [0.0, -1.0]}


def landing(
    seats: Sequence[Mapping[str, object]], start: Mapping[str, object], *events: Mapping[str, object]
) -> Result:
    """Return a block 1 mm above its seats that comes down on them at 1 m/s, or does so after an event."""
    bodies = [block(**{"y": 0.1 + 0.5 * HEIGHT + 1e-3, **start}), *seats]
    return simulate(with_events("explicit", events, 0.01, bodies=bodies, gravity=0.0, restitution=0.5))


def test_seat_that_is_removed_bears_no_part_of_a_block_that_lands_steps_later() -> None:
    alone = landing([LEFT], FALLING)
    run = landing([LEFT, RIGHT], FALLING, {"at": 1e-3 - SOON * alone.summary.time_step_s, "remove": [RIGHT["name"]]})
    for name in ("vy_mm_s", "spin_deg_s"):
        assert run.final.loc[0, name] == pytest.approx(alone.final.loc[0, name], rel=1e-9)


def test_block_that_is_freed_steps_before_it_lands_is_borne_by_both_seats() -> None:
    step = landing([LEFT, RIGHT], FALLING).summary.time_step_s
    start = {"fixed": True, "y": 0.1 + 0.5 * HEIGHT + SOON * step}
    freed = {"at": step, "free": ["block"], "velocity": {"body": "block", "vy": -1.0}}
    run = landing([LEFT, RIGHT], start, freed)
    assert run.final.loc[0, "vy_mm_s"] == pytest.approx(500.0, abs=1.0)
    assert run.final.loc[0, "spin_deg_s"] == pytest.approx(0.0, abs=0.1)


def test_block_on_two_others_is_fixed_and_freed_and_they_stay_where_they_are() -> None:
    bodies = [block(y=0.1 + 1.5 * HEIGHT), block(name="left", x=-0.016), block(name="right", x=0.016), plate()]
    events = [{"at": 0.02, "fix": ["block"]}, {"at": 0.03, "free": ["block"]}]
    run = simulate(with_events("explicit", events, bodies=bodies))
    assert run.reason == "end of simulated time"
    assert run.final.loc[0, "y_mm"] == pytest.approx(100.0 + 1500.0 * HEIGHT, abs=0.05)
    assert run.final.loc[1:2, "y_mm"].to_numpy() == pytest.approx(100.0 + 500.0 * HEIGHT, abs=0.05)
    assert run.summary.energy_J.relative_residual < 1e-3


WEIGHT = 160.0 * G  # N, of a stone


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
    model = Model(scenario)
    scene, settled = initial_scene(build(model), model, ALONE)
    return ALONE.advance(scene, 0)[0], settled


def support_force(scene: Any) -> float:
    return force_of(scheme_of(scene).contacts(scene, scene.world.bodies.size - 1))


def force_of(rows: Any) -> float:
    """Return the size (N) of the force of the ground among all contacts."""
    rows = rows[rows["body_b"] < 0]
    x = rows["normal_force"] * rows["normal_x"] - rows["shear_force"] * rows["normal_y"]
    y = rows["normal_force"] * rows["normal_y"] + rows["shear_force"] * rows["normal_x"]
    return float(np.hypot(x.sum(), y.sum()))


def places(scene: Any) -> Any:
    return np.stack([scene.world.bodies[name][:-1].copy() for name in ("x", "y", "angle")])


@pytest.mark.parametrize("restitution", [0.0, 0.8])  # with 0.8 steps may be cut at impacts
def test_rigid_contacts_hold_the_weight_from_the_first_step_on_and_what_is_let_go_falls_freely(
    restitution: float,
) -> None:
    bodies = [*(stone(0.05 * k, 0.1 + 0.2 * k) for k in range(3)), stone(2.0, 3.0, name="held")]
    scenario = stack("nonsmooth", bodies=bodies, hold=("held",), contact={"restitution": restitution})
    model = Model(scenario)
    scene, _ = settle(build(model), model, ALONE)
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


def test_the_limit_of_wall_time_holds_while_a_scene_is_built(tmp_path: Path) -> None:
    over = CheckpointPolicy(wall_time=10.0, time_over=10.0)
    with pytest.raises(StoppedEarlyError, match=r"^wall-time limit of 10 s reached while the scene was built; nothing"):
        simulate_into(stack("explicit"), tmp_path / "out", precautions=over)
    assert not (tmp_path / "out").exists()


@both
def test_the_limit_of_wall_time_holds_while_a_scene_settles(
    scheme: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(WallTime, "check", lambda _: None)  # as if it came right after building
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
        assert not any("settle" in text for text in result.summary.warnings)


def test_what_closes_a_gap_and_then_rests_is_no_mechanism() -> None:
    gap = 0.004  # 2 % of the smallest side
    bodies = [stone(), stone(0.4 + gap, fixed=True)]
    contact = {"restitution": 0.0}
    settled = simulate(
        stack("explicit", bodies=bodies, friction=0.2, contact=contact, ground={"tilt": "-15 deg"})
    ).summary.settled
    assert settled is not None
    assert settled.largest_displacement_mm == pytest.approx(1e3 * gap, rel=0.01)

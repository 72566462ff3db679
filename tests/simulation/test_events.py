"""Events happen at their moment, to the bit the same however a run is interrupted, and the ledger knows of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.errors import ScenarioError
from blocksim.simulation import read_result, run_ensemble, simulate, simulate_into
from blocksim.verification.scene import HEIGHT, PaperBlock
from tests.simulation.driven import FRICTION, SCHEMES, G, block, on_plate, plate
from tests.simulation.sliding import assert_same, interrupted_at

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from blocksim.scenario import Scenario
    from blocksim.simulation import Result

both = pytest.mark.parametrize("scheme", SCHEMES)
MASS = PaperBlock().mass  # kg
REST = {"stop_at_rest": True, "rest_hold": 0.004, "rest_speed": 0.02}


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


@both
def test_removed_body_stays_where_it_was_without_a_velocity_and_takes_its_energy_along(
    tmp_path: Path, scheme: str
) -> None:
    bodies = [block(velocity=[1.0, 0.0]), plate(), block(x=0.1, name="flying", y=0.3)]
    scenario = with_events(scheme, [{"at": 0.03, "remove": ["flying"]}], bodies=bodies)
    run = simulate_into(scenario, tmp_path)
    fall = 0.5 * G * run.summary.events[0].time_s ** 2
    frames = read_result(tmp_path).frames
    gone = frames.time > run.summary.events[0].time_s - 1e-9
    assert np.isnan(frames.vx[gone, 2]).all()
    assert frames.y[gone, 2] == pytest.approx(0.3 - fall, abs=1e-6)
    assert np.isfinite(frames.vx[~gone]).all()
    assert (tmp_path / "final.csv").read_text().splitlines()[-1].endswith(",,,")
    assert run.summary.energy_J.events == pytest.approx(run.summary.events[0].energy_J)
    assert run.summary.events[0].energy_J == pytest.approx(0.3 * G * MASS, rel=1e-6)
    assert run.summary.energy_J.relative_residual < 1e-3
    assert run.summary.movement is not None
    assert run.summary.movement.first_mover == "block"


@both
def test_body_is_held_in_its_flight_and_falls_again_from_rest(scheme: str) -> None:
    events = [{"at": 0.02, "fix": ["block"]}, {"at": 0.05, "free": ["block"]}]
    run = simulate(with_events(scheme, events, bodies=[block(y=1.0), plate()]))
    held, free = (event.time_s for event in run.summary.events)
    y = 1.0 - 0.5 * G * held**2
    still = (run.frames.time > held + 1e-3) & (run.frames.time < free)
    assert run.frames.y[still, 0] == pytest.approx(y, abs=1e-9)
    end = run.summary.simulated_time_s
    assert run.frames.y[-1, 0] == pytest.approx(y - 0.5 * G * (end - free) ** 2, abs=1e-9)
    fixed, freed = (event.energy_J for event in run.summary.events)
    assert fixed == pytest.approx(-freed + 0.5 * MASS * (G * held) ** 2, rel=1e-6)
    assert run.summary.energy_J.relative_residual < 1e-6


@both
def test_new_velocity_is_had_at_once_and_its_energy_is_tallied(scheme: str) -> None:
    event = {"at": 0.01, "velocity": {"body": "block", "vx": 2.0, "spin": "0 rad/s"}}
    run = simulate(with_events(scheme, [event], bodies=[block(y=1.0, spin=3.0), plate()]))
    since = run.summary.simulated_time_s - run.summary.events[0].time_s
    assert run.final.loc[0, "x_mm"] == pytest.approx(2e3 * since, rel=1e-9)
    assert run.final.loc[0, "spin_deg_s"] == pytest.approx(0.0, abs=1e-9)
    assert run.final.loc[0, "vy_mm_s"] == pytest.approx(-1e3 * G * run.summary.simulated_time_s, rel=1e-9)
    assert run.summary.events[0].energy_J < 0.0
    assert run.summary.energy_J.relative_residual < 1e-6


@both
def test_driven_plate_that_is_freed_flies_on_and_one_that_is_fixed_stops(scheme: str) -> None:
    ramp = {"kind": "ramp", "distance": 1.0, "speed": 1.0}
    for action, way in (("free", 0.08), ("fix", 0.04)):
        run = simulate(
            with_events(scheme, [{"at": 0.04, action: ["plate"]}], bodies=[block(x=5.0), plate(ramp, y=2.0)])
        )
        assert run.final.loc[1, "x_mm"] == pytest.approx(1e3 * way, rel=0.01)


@both
def test_wall_that_is_removed_lets_a_block_pass(scheme: str) -> None:
    walls = [{"from": [0.05, 0.5], "to": [0.05, 1.5]}]
    moving = [block(y=1.0, velocity=[1.0, 0.0])]
    stopped, passed = (
        simulate(with_events(scheme, events, bodies=moving, walls=walls))
        for events in ((), [{"at": 0.005, "remove": ["wall 1"]}])
    )
    assert 30.0 < stopped.columns["x_mm"][0] < 35.0
    assert passed.final.loc[0, "x_mm"] == pytest.approx(1e3 * passed.summary.simulated_time_s, rel=1e-6)


@both
def test_rest_lets_the_next_event_happen_and_the_run_go_on(scheme: str) -> None:
    events: list[Mapping[str, object]] = [
        {"when": "rest", "velocity": {"body": "block", "vx": 0.3}},
        {"when": "rest", "remove": ["plate"]},
    ]
    run = simulate(with_events(scheme, events, end=1.0, time=REST))
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
    assert run.final.loc[0, "vx_mm_s"] == pytest.approx(1e3 * vx, rel=1e-3)
    assert run.final.loc[0, "x_mm"] == pytest.approx(1e3 * x, rel=1e-3)
    assert run.summary.energy_J.to_loads == pytest.approx(-0.5 * MASS * vx**2, rel=2e-3)
    assert run.summary.energy_J.relative_residual < 1e-4


@both
def test_load_that_has_ended_at_rest_delays_no_later_rest(scheme: str) -> None:
    push = {"kind": "force", "name": "push", "body": "block", "magnitude": 0.5 * FRICTION * MASS * G}
    late = {**push, "name": "late", "magnitude": 1e-9, "history": {"kind": "ramp", "end": 50.0}}
    events: list[Mapping[str, object]] = [
        {"at": 0.01, "unload": ["late"]},
        {"when": "rest", "unload": ["push"]},
    ]
    run = simulate(with_events(scheme, events, end=1.0, time=REST, loads=[push, late]))
    assert [event.what for event in run.summary.events] == ["load late ended", "load push ended"]
    assert run.reason == "at rest"
    assert run.summary.simulated_time_s < 0.5


@both
def test_rest_before_a_time_does_not_end_the_run_and_what_never_happens_is_told(scheme: str) -> None:
    late = simulate(with_events(scheme, [{"at": 0.06, "remove": ["plate"]}], time=REST))
    assert [one.what for one in late.summary.events] == ["plate removed"]
    never = simulate(
        with_events(scheme, [{"when": "rest", "remove": ["plate"]}], bodies=[block(y=1.0), plate()], time=REST)
    )
    assert never.summary.events == ()
    assert any("events.0 has not happened" in text for text in never.summary.warnings)


@both
def test_interruptions_and_ensembles_change_no_bit_of_a_run_with_events(tmp_path: Path, scheme: str) -> None:
    events = [
        {"at": 0.03, "remove": ["plate"]},
        {"at": 0.02, "velocity": {"body": "block", "vx": 0.5}},
        {"at": 0.04, "fix": ["block"]},
        {"at": 0.025, "unload": ["lift"]},
    ]
    lift = {"kind": "force", "name": "lift", "body": "block", "direction": "90 deg", "magnitude": 0.5 * MASS * G}
    scenario = with_events(scheme, events, output={"every": 0.002, "contacts": True}, loads=[lift])
    whole = simulate_into(scenario, tmp_path / "whole")
    at = [event.step for event in whole.summary.events]
    assert at == sorted(at)
    interrupted_at(scenario, tmp_path / "parts", [at[0] - 1, at[0], at[1], at[3] + 1])
    resumed = simulate_into(scenario, tmp_path / "parts", resume=True)
    assert_same(resumed, whole)
    assert resumed.summary.events == whole.summary.events
    assert resumed.summary.warnings == ()
    assert [str(one.columns) for one in run_ensemble([scenario, scenario])] == [str(whole.columns)] * 2


JOINT = 0.002  # m, where two seats meet, from the middle of the block
SOON = 3.3  # steps before it lands


def seat(name: str, side: float, **keys: Any) -> dict[str, Any]:
    """Return a fixed seat of a block, left (-1) or right (1) of the joint."""
    return plate(width=0.1, x=JOINT + 0.05 * side, name=name, **keys)


def landing(
    seats: Sequence[Mapping[str, object]], start: Mapping[str, object], *events: Mapping[str, object]
) -> Result:
    """Return a block 1 mm above its seats that comes down on them at 1 m/s, or does so after an event."""
    bodies = [block(**{"y": 0.1 + 0.5 * HEIGHT + 1e-3, **start}), *seats]
    return simulate(with_events("explicit", events, 0.01, bodies=bodies, gravity=0.0, restitution=0.5))


def test_seat_that_is_removed_bears_no_part_of_a_block_that_lands_steps_later() -> None:
    left, right = seat("left", -1.0), seat("right", 1.0)
    alone = landing([left], {"velocity": [0.0, -1.0]})
    removal = {"at": 1e-3 - SOON * alone.summary.time_step_s, "remove": ["right"]}
    run = landing([left, right], {"velocity": [0.0, -1.0]}, removal)
    for name in ("vy_mm_s", "spin_deg_s"):
        assert run.final.loc[0, name] == pytest.approx(alone.final.loc[0, name], rel=1e-9)


def test_block_that_is_freed_steps_before_it_lands_is_borne_by_both_seats() -> None:
    seats = [seat("left", -1.0), seat("right", 1.0)]
    step = landing(seats, {"velocity": [0.0, -1.0]}).summary.time_step_s
    start = {"fixed": True, "y": 0.1 + 0.5 * HEIGHT + SOON * step}
    freed = {"at": step, "free": ["block"], "velocity": {"body": "block", "vy": -1.0}}
    run = landing(seats, start, freed)
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


@pytest.mark.parametrize(
    ("events", "told"),
    [
        ([{"at": 0.0, "remove": ["plate"]}], "above 0"),
        ([{"at": 0.5, "remove": ["plate"]}], "after the end"),
        ([{"at": 0.01, "remove": ["plat"]}], "did you mean 'plate'"),
        ([{"at": 0.01, "fix": ["plate"]}], "fixed already"),
        ([{"at": 0.01, "free": ["block"]}], "free already"),
        ([{"at": 0.01, "fix": ["wall 1"]}], "can only be removed"),
        ([{"at": 0.01, "remove": ["block"]}, {"at": 0.02, "fix": ["block"]}], "removed since 0.01 s, by events.0"),
        ([{"at": 0.02, "fix": ["block"]}, {"at": 0.01, "remove": ["block"]}], "removed since 0.01 s, by events.1"),
        ([{"at": 0.01, "fix": ["block"]}, {"at": 0.01, "free": ["block"]}], "at the same moment"),
        ([{"at": 0.01, "fix": ["block"], "velocity": {"body": "block", "vx": 1.0}}], "at the same moment"),
        ([{"at": 0.01, "velocity": {"body": "plate", "vx": 1.0}}], "free it first"),
        ([{"at": 0.01, "unload": ["winf"]}], "did you mean 'wind'"),
        ([{"at": 0.01, "unload": ["table"]}], "is gravity, which does not end"),
        ([{"at": 0.02, "unload": ["wind"]}, {"at": 0.01, "unload": ["wind"]}], "ended already, by events.1"),
        ([{"at": 0.01, "when": "rest", "remove": ["plate"]}], "both given"),
        ([{"remove": ["plate"]}], "give a time"),
        ([{"at": 0.01}], "nothing happens"),
        ([{"when": "rest", "remove": ["plate"]}], "stop_at_rest"),
    ],
)
def test_impossible_events_are_told_with_their_place(events: list[dict[str, object]], told: str) -> None:
    loads = [
        {"kind": "horizontal", "name": "wind", "magnitude": 0.1},
        {"kind": "gravity", "name": "table", "to": "1 deg", "rate": "1 deg/s"},
    ]
    with pytest.raises(ScenarioError, match=r"events\.\d") as caught:
        with_events("explicit", events, loads=loads, walls=[{"from": [0.4, 0.3], "to": [0.4, 0.1]}])
    assert told in str(caught.value)
    assert caught.value.exit_code == 65
